"""The command line: parses, calls, and turns every expected failure into one line and an exit code."""

from __future__ import annotations

import errno
import os
import signal
import sys
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from types import FrameType

    from cyclopts import App
    from cyclopts.argument import ArgumentCollection

EXIT_BAD_INPUT = 2
EXIT_INTERRUPTED = 130
_INTERRUPT_AGAIN_S = 0.02
# Each command: its module, imported only if the command, or help of all, is wanted, and its name there.
_COMMANDS = {
    "sim": "sim:sim",
    "fly": "fly:fly",
    "camera": "camera:app",
    "mocap": "mocap:mocap",
    "vio": "vio:vio",
    "doctor": "doctor:doctor",
    "preflight": "preflight:preflight",
    "evaluate": "evaluate:evaluate",
    "bound": "bound:bound",
    "monitor": "monitor:monitor",
    "px4": "genuine:px4",
    "ardupilot": "genuine:ardupilot",
    "replay": "replay:replay",
    "film": "film:film",
    "mission": "mission:app",
    "edit": "edit:edit",
    "course": "course:app",
    "scenario": "scenario:app",
    "vision": "vision:app",
    "list": "list:list_",
}
_DISK_REFUSES = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS, errno.EIO)


def build_app() -> App:
    """Return the program with all its commands."""
    from cyclopts import App, Parameter

    app = App(
        name="framerunner",
        help="A simulated MAVLink drone, and an app that flies the frame challenge with it.",
        version=_version,
        version_format="plaintext",
        help_format="markdown",
        default_parameter=Parameter(negative=(), show_default=_shown_default),
        suppress_keyboard_interrupt=False,
        result_action="return_value",
        config=_read_settings,
    )
    for name, place in _COMMANDS.items():
        app.command(f"framerunner.commands.{place}", name=name)
    return app


def _read_settings(_app: App, _commands: tuple[str, ...], arguments: ArgumentCollection) -> None:
    """Read the file of a command's option --settings, if it is given."""
    from framerunner.commands.options.flight import SETTINGS

    chosen = next((argument for argument in arguments if argument.name == SETTINGS), None)
    if chosen is not None and chosen.tokens:
        from framerunner.commands.options.settings_file import read_settings

        read_settings(Path(chosen.tokens[-1].value), arguments)


def _shown_default(value: object) -> str | None:
    """What help says of a default; nothing of a flag that is off and of options that need not be given."""
    if value is None or value is False or value in ((), ""):
        return None
    return " ".join(map(str, value)) if isinstance(value, tuple) else str(value)


def _version() -> str:
    from importlib import metadata

    return metadata.version("framerunner")


def main() -> None:
    """Run the command line and exit."""
    _open_closed_streams()
    _handle_signals()
    # Read by libraries when they are first imported: matrices here are too small for several threads,
    # and a camera that cannot be opened is reported by this program in one line.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    os.environ.setdefault("OPENCV_LOG_LEVEL", "ERROR")
    os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")
    code = run(sys.argv[1:])
    try:
        sys.stdout.flush()
    except OSError:
        _discard_output()  # the command's own error is reported already
    for number in (signal.SIGALRM, signal.SIGHUP, signal.SIGINT, signal.SIGTERM):
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, signal.SIG_DFL)  # an exception at shutdown would be a traceback
    sys.exit(code)


def _open_closed_streams() -> None:
    """Replace a standard stream that was closed by the null device; a file would get its number."""
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))  # noqa: SIM115 - until the end


def run(arguments: list[str]) -> int:
    """Run one command.

    Args:
        arguments: without the program's name.

    Returns:
        The exit code: 0 done, 1 flown but not completed, 2 bad input, 130 Ctrl-C.
    """
    try:
        app = build_app()
        if arguments in ([], ["--help"], ["-h"]):
            app.resolved_commands()  # what each says of itself
        code = app(arguments or ["--help"], print_error=False, exit_on_error=False)
        sys.stdout.flush()  # here, where an error is reported in one line
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        return EXIT_INTERRUPTED
    except BrokenPipeError:
        _discard_output()  # its reader has ended
        return 0
    except Exception as error:
        reason = _reason(error)
        if reason is None:
            raise
        print(f"error: {reason}", file=sys.stderr)
        return EXIT_BAD_INPUT
    return code if isinstance(code, int) else 0


def _reason(error: Exception) -> str | None:
    """The message for the user; None for a fault of this program."""
    from cyclopts import CycloptsError, ValidationError

    from framerunner.errors import UserError, is_disk_full
    from framerunner.extras import install_advice

    if isinstance(error, ValidationError) and error.argument is not None:  # of `within`
        return f"{error.argument.name} {error.exception_message}"
    if isinstance(error, CycloptsError):
        return " ".join(str(error).split()) + " Try --help."
    if isinstance(error, UserError):
        return str(error)
    if isinstance(error, ModuleNotFoundError):
        return install_advice(error.name or "")
    if isinstance(error, OSError) and error.errno in _DISK_REFUSES:
        _discard_output()
        what = error.filename or "standard output or a file"
        advice = "free some space" if is_disk_full(error) else "choose another place"
        return f"{what}: cannot be written to ({error.strerror}); {advice}"
    return None


def _discard_output() -> None:
    """Discard what could not be written, so that Python does not report it again at exit."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _handle_signals() -> None:
    """Let SIGTERM and a closed terminal do what Ctrl-C does, also where Ctrl-C is ignored."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        # Started in the background by a script. Ctrl-C keeps having no effect, but asyncio ends its tasks in
        # order only where SIGINT has Python's own handler, which `_terminate` calls.
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        signal.signal(signal.SIGINT, signal.default_int_handler)
    signal.signal(signal.SIGTERM, _terminate)
    if signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:  # as nohup has it
        signal.signal(signal.SIGHUP, _terminate)
    signal.signal(signal.SIGALRM, _terminate)
    report = sys.unraisablehook

    def interrupt_again(unraisable: sys.UnraisableHookArgs) -> None:
        """Repeat an interrupt that was raised where Python drops exceptions, as in a destructor."""
        if issubclass(unraisable.exc_type, KeyboardInterrupt):
            signal.setitimer(signal.ITIMER_REAL, _INTERRUPT_AGAIN_S)  # not within this function
        else:
            report(unraisable)

    sys.unraisablehook = interrupt_again


def _terminate(number: int, frame: FrameType | None) -> None:
    """End as after Ctrl-C: what was recorded is kept and no process is left running."""
    interrupt = signal.getsignal(signal.SIGINT)
    if not callable(interrupt):
        raise KeyboardInterrupt
    interrupt(number, frame)
