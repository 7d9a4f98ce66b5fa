"""PX4's failsafes in words: the warnings that it prints, and the mode that it changes to."""

from __future__ import annotations

import re

_WARNING = re.compile(r"(?:WARN|ERROR)\s+\[(\w+)\]\s+(.*)")
_FAILSAFE = "failsafe"  # PX4's module
_OF_LINKS = frozenset({"dataman", "lockstep_scheduler", "logger", "mavlink", "param", "simulator_mavlink"})
_COLOUR = re.compile(r"\x1b\[[0-9;]*m")
_RECENT_US = 3_000_000  # before a failsafe, its reasons are printed
_MAX_TEXTS = 4


class FailsafeWords:
    """What PX4 does about a failure, for results and displays.

    PX4 prints that a failsafe begins, and before it why; its heartbeat shows the mode that it changes to, up
    to a second later. Of a PX4 that the user has started only the heartbeat is known.

    Attributes:
        failsafes: of the present or last try: vehicle time in microseconds and text; oldest first.
    """

    def __init__(self) -> None:
        self.failsafes: list[tuple[int, str]] = []
        self._recent: list[tuple[int, str]] = []
        self._mode = ""  # of the failsafe that acts now; empty: none does
        self._lacks_mode = False  # the last failsafe has not shown its mode yet
        self._armed = False

    def set_armed(self, armed: bool) -> None:
        """PX4 is armed or not; with arming a try begins."""
        if armed and not self._armed:
            self.failsafes = []
            self._recent, self._mode, self._lacks_mode = [], "", False
        self._armed = armed

    def printed(self, time_us: int, line: str) -> None:
        """Take a line of PX4's output."""
        found = _WARNING.match(_COLOUR.sub("", line))
        if found is None or not self._armed or found[1] in _OF_LINKS:
            return
        self._recent.append((time_us, found[2].strip()))
        if found[1] == _FAILSAFE:
            self.failsafes.append((time_us, self._reasons(time_us)))
            self._mode, self._lacks_mode = "", True

    def heartbeat(self, time_us: int, mode: str, *, critical: bool) -> None:
        """Take a heartbeat: the mode's name, and whether a failsafe acts."""
        if not critical or not self._armed:
            self._mode = ""
            return
        if mode == self._mode:
            return
        self._mode = mode
        if self._lacks_mode:
            began_us, text = self.failsafes.pop()
        else:
            began_us, text = time_us, self._reasons(time_us) or "failsafe"
        self._lacks_mode = False
        self.failsafes.append((began_us, f"{text}: {mode}"))

    def _reasons(self, time_us: int) -> str:
        """What PX4 has printed shortly before; once."""
        recent = [text for printed_us, text in self._recent if printed_us >= time_us - _RECENT_US]
        self._recent = []
        return "; ".join(list(dict.fromkeys(recent))[-_MAX_TEXTS:])
