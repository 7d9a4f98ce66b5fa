"""The command line: parses, calls, and turns every foreseen failure into one line and an exit code."""

from __future__ import annotations

import os
import signal
import sys
from importlib import metadata

from cyclopts import App, CycloptsError

from framerunner.commands import camera, doctor, evaluate, film, fly, mission, monitor, replay, scenario, sim

EXIT_BAD_INPUT = 2
EXIT_INTERRUPTED = 130


def build_app() -> App:
    """Return the command with all its parts."""
    app = App(
        name="framerunner",
        help="A simulated drone that speaks MAVLink, and an app that flies the frame challenge with it.",
        version=metadata.version("framerunner"),
        help_format="markdown",
        suppress_keyboard_interrupt=False,
        result_action="return_value",
    )
    app.command(sim.sim)
    app.command(fly.fly)
    app.command(camera.camera)
    app.command(doctor.doctor)
    app.command(evaluate.evaluate)
    app.command(monitor.monitor)
    app.command(replay.replay)
    app.command(film.film)
    app.command(mission.app)
    app.command(scenario.app)
    return app


def main() -> None:
    """Run the command line and exit."""
    signal.signal(signal.SIGTERM, _terminate)
    # Read by libraries when they are first imported: matrices here are too small to share among threads,
    # and a dead camera URL is reported by us, in one line.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    os.environ.setdefault("OPENCV_LOG_LEVEL", "ERROR")
    os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")
    sys.exit(run(sys.argv[1:]))


def run(arguments: list[str]) -> int:
    """Run one command.

    Args:
        arguments: what stands after the program's name.

    Returns:
        The exit code: 0 done, 1 flown but not completed, 2 bad input, 130 Ctrl-C.
    """
    try:
        code = build_app()(arguments or ["--help"], print_error=False, exit_on_error=False)
    except CycloptsError as error:
        return _refuse(" ".join(str(error).split()) + " Try --help.")
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        return EXIT_INTERRUPTED
    except BrokenPipeError:
        # Whoever read our output has gone; Python must not complain about that again at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except Exception as error:
        if not _is_foreseen(error):
            raise
        return _refuse(str(error))
    return code if isinstance(code, int) else 0


def _refuse(reason: str) -> int:
    print(f"error: {reason}", file=sys.stderr)
    return EXIT_BAD_INPUT


def _is_foreseen(error: Exception) -> bool:
    """Whether an error is a room's own, whose message is made for people.

    Compared by name, so that a command does not import rooms it has no use for.
    """
    foreseen = {
        "AirframeError",
        "CameraError",
        "CameraLostError",
        "DroneError",
        "DynamicsError",
        "LinkError",
        "MissionError",
        "MonitorError",
        "ParameterFileError",
        "PictureError",
        "ScenarioError",
        "SettingError",
        "StorageFolderError",
        "VideoError",
    }
    return any(kind.__name__ in foreseen for kind in type(error).__mro__)


def _terminate(_signal: int, _frame: object) -> None:
    """Leave by the same way as Ctrl-C: what was recorded is kept and nothing is left running."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # started in the background by a script
        raise KeyboardInterrupt
    signal.raise_signal(signal.SIGINT)
