"""The operator's keys in a terminal: hold G to arm, the space bar to land, then K to stop the motors.

A terminal sends no key releases, and a key that is held repeats. So no key means more when it comes again,
and G is held when it comes more often than a person presses it.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import os
import signal
import sys
import termios
import tty
from collections.abc import Callable
from types import TracebackType
from typing import Any

from offboard.safety.operator import Controls, Operator

HINT = "hold G for one to two seconds to arm; SPACE lands, then K stops the motors"
FIRST_REPEAT_S = 0.8
"""From the first character of a held key to the second one, at most."""
MIN_REPEATS = 10
"""Characters of a held key within a second; terminals repeat it 11 to 30 times, a person taps it 7 times."""
_GO, _STOP, _KILL = "gG", " ", "kK"
_STOPS = (signal.SIGTSTP, signal.SIGTTIN, signal.SIGTTOU)
"""By which a terminal stops programs."""
logger = logging.getLogger(__name__)


class KeyReader:
    """Decides from characters and their times what the operator demands. No clock.

    Args:
        operator: is given the go and the stops.
    """

    def __init__(self, operator: Operator) -> None:
        self._controls = Controls(operator, FIRST_REPEAT_S, min_reports=MIN_REPEATS)

    def take(self, key: str, now_s: float) -> None:
        """Take a character at a time, seconds."""
        controls = self._controls
        if key in _GO:
            controls.hold_go(now_s)
        elif key == _STOP:
            controls.stop()
        elif key in _KILL:
            controls.stop_motors()
        else:
            controls.let_go()


class TerminalKeys:
    """Reads the keys of this program's terminal while it is entered, on the running event loop.

    The terminal cannot stop the program meanwhile, as by Ctrl-Z: a drone would be without commands. A program
    that somebody else has stopped takes its keys again when it goes on. Without a terminal it does nothing.

    Args:
        operator: see `KeyReader`.
    """

    def __init__(self, operator: Operator) -> None:
        self._keys = KeyReader(operator)
        self._before: list[Any] | None = None
        self._handlers: dict[int, Any] = {}

    async def __aenter__(self) -> TerminalKeys:
        """Let the terminal give each character at once, without showing it."""
        if has_terminal():
            self._before = termios.tcgetattr(sys.stdin.fileno())
            for number in _STOPS:
                self._handlers[number] = signal.signal(number, signal.SIG_IGN)
            asyncio.get_running_loop().add_signal_handler(signal.SIGCONT, self._go_on)
            self._take_terminal()
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Return the terminal as it was."""
        if self._before is None:
            return
        number, loop = sys.stdin.fileno(), asyncio.get_running_loop()
        loop.remove_reader(number)
        loop.remove_signal_handler(signal.SIGCONT)
        with contextlib.suppress(termios.error):  # the terminal was closed
            if _is_in_foreground(number):
                termios.tcsetattr(number, termios.TCSADRAIN, self._before)
        for stop, handler in self._handlers.items():
            signal.signal(stop, handler)

    def _take_terminal(self) -> bool:
        """Read keys, unless the terminal is another program's, such as the shell's."""
        number, loop = sys.stdin.fileno(), asyncio.get_running_loop()
        if not _is_in_foreground(number):
            return False
        with contextlib.suppress(termios.error):
            tty.setcbreak(number)
            loop.add_reader(number, self._read, number, loop.time)
        return True

    def _go_on(self) -> None:
        """This program was stopped; the shell may have the terminal since."""
        if self._take_terminal():
            logger.warning("the app goes on after a stop; SPACE lands, then K stops the motors")
        else:
            logger.warning("the app goes on after a stop, without its keys: type fg, then SPACE lands")

    def _read(self, number: int, clock: Callable[[], float]) -> None:
        try:
            data = os.read(number, 64)
        except OSError:
            data = b""
        if not data:  # the terminal was closed, or is another program's; the flight goes on
            asyncio.get_running_loop().remove_reader(number)
        for character in data.decode(errors="replace"):
            self._keys.take(character, clock())


def _is_in_foreground(number: int) -> bool:
    """Whether this program has the terminal; one that it does not control is read like a file."""
    try:
        return os.tcgetpgrp(number) == os.getpgrp()
    except OSError:
        return True


def has_terminal() -> bool:
    """Whether keys can be read."""
    return sys.stdin is not None and sys.stdin.isatty()
