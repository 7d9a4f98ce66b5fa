"""PX4's failsafes in words: the warnings that it prints, and the mode that it changes to."""

from __future__ import annotations

import re

_WARNING = re.compile(r"(?:WARN|ERROR)\s+\[\w+\]\s+(.*)")
_COLOUR = re.compile(r"\x1b\[[0-9;]*m")
_RECENT_US = 3_000_000  # before a failsafe is seen, its reasons are printed; heartbeats come once a second
_MAX_TEXTS = 4


class FailsafeWords:
    """What PX4 does about a failure, for results and displays.

    PX4's heartbeat shows a failsafe and its mode; what it has printed shortly before says why. Without the
    output of PX4, if the user has started it, the reasons are missing.

    Attributes:
        failsafes: of the present or last try: vehicle time in microseconds and text; oldest first.
    """

    def __init__(self) -> None:
        self.failsafes: list[tuple[int, str]] = []
        self._recent: list[tuple[int, str]] = []
        self._mode = ""  # of the failsafe that acts now; empty: none does
        self._armed = False

    def set_armed(self, armed: bool) -> None:
        """PX4 is armed or not; with arming a try begins."""
        if armed and not self._armed:
            self.failsafes = []
            self._recent, self._mode = [], ""
        self._armed = armed

    def printed(self, time_us: int, line: str) -> None:
        """Take a line of PX4's output."""
        found = _WARNING.match(_COLOUR.sub("", line))
        if found is not None and self._armed:
            self._recent.append((time_us, found[1].strip()))

    def heartbeat(self, time_us: int, mode: str, *, critical: bool) -> None:
        """Take a heartbeat: the mode's name, and whether a failsafe acts."""
        if not critical or not self._armed:
            self._mode = ""
            return
        if mode == self._mode:
            return
        self._mode = mode
        recent = [each for each in self._recent if each[0] >= time_us - _RECENT_US]
        self._recent = []
        texts = list(dict.fromkeys(text for _, text in recent))[-_MAX_TEXTS:]
        began_us = next((each[0] for each in recent if "ailsafe" in each[1]), time_us)
        self.failsafes.append((began_us, f"{'; '.join(texts) or 'failsafe'}: {mode}"))
