"""A contestant's Python file: one subclass of `Pilot` that adds primitives and values.

Reading it executes it, so it is read only if a person names it; a mission file cannot.
"""

from __future__ import annotations

import inspect
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from types import FrameType, ModuleType, TracebackType
from typing import get_type_hints

from framerunner.files.extensions import extension_names, find_extension
from framerunner.files.text_file import TextError, read_text
from framerunner.files.yaml_text import Place
from offboard.chart.problems import MissionError, mission_error
from offboard.pilot import Pilot


@dataclass(frozen=True, slots=True)
class PilotFile:
    """A Python file as text, so that it can be sent to another process."""

    name: str
    text: str

    def pilot_class(self) -> type[Pilot]:
        """Execute the text in a new module and return the subclass of `Pilot` that it defines.

        Each call gives a new class in a new module, so that no flight sees variables of another one.

        Raises:
            MissionError: as `file:line: text`, whatever is wrong with it.
        """
        module = self._execute()
        kinds = dict.fromkeys(each for each in vars(module).values() if isinstance(each, type))
        defined = [k for k in kinds if issubclass(k, Pilot) and k.__module__ == module.__name__]
        defined = [kind for kind in defined if not any(kind in other.__mro__[1:] for other in defined)]
        if not defined:
            raise self._refused("has no subclass of Pilot; write 'class MyPilot(Pilot):' with your methods")
        if len(defined) > 1:
            names = ", ".join(kind.__name__ for kind in defined)
            raise self._refused(f"has several subclasses of Pilot: {names}; leave one")
        self._check(defined[0])
        return defined[0]

    def _execute(self) -> ModuleType:
        """Run the text as a module, named by a hash of its content."""
        try:
            code = compile(self.text, self.name, "exec", dont_inherit=True)
        except (SyntaxError, ValueError) as error:
            line = getattr(error, "lineno", None) or 0
            raise self._refused(f"Python syntax: {getattr(error, 'msg', error)}", line) from None
        digest = sha256(f"{self.name}\n{self.text}".encode()).hexdigest()
        module = ModuleType(f"pilot_file_{digest[:16]}")
        module.__file__ = self.name
        sys.modules[module.__name__] = module  # where typing and dataclasses look up a class's module
        with self._errors_refused(module.__name__, "cannot be imported"):
            exec(code, vars(module))
        return module

    @contextmanager
    def _errors_refused(self, module_name: str, what: str) -> Iterator[None]:
        """Make an exception of any kind, but not the user's Ctrl-C, a `MissionError`."""
        with _interrupts_noted() as interrupts:
            try:
                yield
            except BaseException as error:
                if isinstance(error, KeyboardInterrupt) and interrupts:
                    raise
                line = _last_line_in(error.__traceback__, module_name)
                raise self._refused(f"{what}: {in_words(error)}", line) from None

    def _check(self, kind: type[Pilot]) -> None:
        """Refuse members that would fail only in flight."""
        with self._errors_refused(kind.__module__, f"a type in class {kind.__name__} is unknown"):
            get_type_hints(kind)  # an annotation may be any expression
        for member, reason in _unusable_members(kind):
            raise self._refused(reason, _line_of(member))

    def new_pilot(self, variables: dict[str, object]) -> Pilot:
        """A pilot of a new class, with the mission's variables. Raises `MissionError`."""
        kind = self.pilot_class()
        with self._errors_refused(kind.__module__, f"{kind.__name__} cannot be created"):
            pilot = kind(variables)
        if not hasattr(pilot, "memory"):
            text = f"{kind.__name__}.__init__ must begin with 'super().__init__(variables)'"
            raise self._refused(text, _line_of(kind.__init__))
        return pilot

    def _refused(self, text: str, line: int = 0) -> MissionError:
        return mission_error(Place(self.name, line), text)


PilotSource = PilotFile | type[Pilot]
"""What a mission's pilots are made of."""


def class_of(pilot: PilotSource | None) -> type[Pilot]:
    """The class of a mission's pilots; None: `Pilot` itself. Raises `MissionError`."""
    return pilot.pilot_class() if isinstance(pilot, PilotFile) else pilot or Pilot


def find_pilot(name_or_path: str | Path) -> PilotSource:
    """A pilot by the name under which another package adds it, or a contestant's Python file.

    Args:
        name_or_path: a text is a file if it ends in .py or has a directory.

    Raises:
        MissionError: see `read_pilot`, or no package adds a pilot of this name.
        ExtensionError: a package does, but it cannot be used.
    """
    name = str(name_or_path)
    if _is_path(name_or_path):
        return read_pilot(name_or_path)
    added = find_extension("pilot", name)
    if added is None:
        known = ", ".join(extension_names("pilot")) or "none"
        raise mission_error(Place(name), f"unknown pilot; installed: {known}; a Python file ends in .py")
    kind = added.load()
    if not (isinstance(kind, type) and issubclass(kind, Pilot)):
        raise added.refused("is no subclass of framerunner.Pilot")
    for _, reason in _unusable_members(kind):
        raise added.refused(reason)
    return kind


def pilot_argument(name_or_path: str) -> str:
    """What another process, in any folder, is given for `find_pilot`: an absolute path of a file."""
    return str(Path(name_or_path).absolute()) if _is_path(name_or_path) else name_or_path


def _is_path(name_or_path: str | Path) -> bool:
    return isinstance(name_or_path, Path) or name_or_path.endswith(".py") or "/" in name_or_path


def read_pilot(path: str | Path) -> PilotFile:
    """Read a contestant's Python file and execute it once, to find out whether it can be used.

    Raises:
        MissionError: it cannot be read, or `PilotFile.pilot_class` refuses it; one line.
    """
    path = Path(path)
    try:
        text = read_text(path)
    except TextError as error:
        words = f"cannot be read: {error.reason}" if error.reason else f"{error}; give a pilot's Python file"
        raise mission_error(Place(str(path)), words) from None
    pilot = PilotFile(path.name, text)
    pilot.pilot_class()
    return pilot


def place_in(pilot: PilotFile, module_name: str, error: BaseException) -> str:
    """Where in a contestant's file, executed as a module, an error was raised: "file:line: " or empty."""
    line = _last_line_in(error.__traceback__, module_name)
    return f"{Place(pilot.name, line)}: " if line else ""


def is_interrupt(error: BaseException) -> bool:
    """Whether an exception that came out of a contestant's code is the user's Ctrl-C.

    Within asyncio it is not: there the handler of SIGINT cancels the main task instead.
    """
    handler = signal.getsignal(signal.SIGINT)
    return isinstance(error, KeyboardInterrupt) and handler is signal.default_int_handler


@contextmanager
def _interrupts_noted() -> Iterator[list[int]]:
    """While open, signals that interrupt (Ctrl-C) are added to the list, and handled as before."""
    noted: list[int] = []
    before = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or not callable(before):
        yield noted  # no handler of Python's runs in this thread
        return
    handle = before

    def note(number: int, frame: FrameType | None) -> None:
        noted.append(number)
        handle(number, frame)

    signal.signal(signal.SIGINT, note)
    try:
        yield noted
    finally:
        signal.signal(signal.SIGINT, before)


def in_words(error: BaseException) -> str:
    """An exception of a contestant's code in one line."""
    text = " ".join(str(error).split())
    return f"{type(error).__name__}: {text}" if text else type(error).__name__


def _last_line_in(traceback: TracebackType | None, module_name: str) -> int:
    """Line of the innermost call within a module, 0 if there is none."""
    line = 0
    while traceback is not None:
        if traceback.tb_frame.f_globals.get("__name__") == module_name:
            line = traceback.tb_lineno
        traceback = traceback.tb_next
    return line


def _unusable_members(kind: type[Pilot]) -> Iterator[tuple[object, str]]:
    """The members of a pilot's class that a mission cannot use, each with the reason."""
    for name, member in inspect.getmembers(kind):
        if not name.startswith("_") and getattr(Pilot, name, None) is not member:
            reason = _why_unusable(name, member)
            if reason:
                yield member, reason


def _why_unusable(name: str, member: object) -> str:
    """Why a member of a pilot's class cannot be used by a mission; empty if it can."""
    if isinstance(member, property):
        try:
            get_type_hints(member.fget)
        except Exception as error:  # an annotation may be any expression
            return f"the type of '{name}' is unknown: {in_words(error)}"
        return ""
    if inspect.iscoroutinefunction(member):
        return f"'{name}' is 'async'; a primitive is a plain function that returns at once"
    return ""


def _line_of(member: object) -> int:
    function = member.fget if isinstance(member, property) else member
    code = getattr(function, "__code__", None)
    return code.co_firstlineno if code is not None else 0
