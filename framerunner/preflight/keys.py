"""The operator's keys in a terminal: hold G to arm, the space bar to land, then K to stop the motors.

A terminal sends no key releases, and a key that is held repeats. So no key means more when it comes again,
and G is held when it comes more often than a person presses it.
"""

from __future__ import annotations

import asyncio
import contextlib
import os
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

    Without a terminal it does nothing.

    Args:
        operator: see `KeyReader`.
    """

    def __init__(self, operator: Operator) -> None:
        self._keys = KeyReader(operator)
        self._before: list[Any] | None = None

    async def __aenter__(self) -> TerminalKeys:
        """Let the terminal give each character at once, without showing it."""
        if has_terminal():
            number = sys.stdin.fileno()
            self._before = termios.tcgetattr(number)
            tty.setcbreak(number)
            loop = asyncio.get_running_loop()
            loop.add_reader(number, self._read, number, loop.time)
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Return the terminal as it was."""
        if self._before is None:
            return
        number = sys.stdin.fileno()
        asyncio.get_running_loop().remove_reader(number)
        with contextlib.suppress(termios.error):  # the terminal was closed
            termios.tcsetattr(number, termios.TCSADRAIN, self._before)

    def _read(self, number: int, clock: Callable[[], float]) -> None:
        try:
            data = os.read(number, 64)
        except OSError:
            data = b""
        if not data:  # the terminal was closed; the flight goes on
            asyncio.get_running_loop().remove_reader(number)
        for character in data.decode(errors="replace"):
            self._keys.take(character, clock())


def has_terminal() -> bool:
    """Whether keys can be read."""
    return sys.stdin is not None and sys.stdin.isatty()
