"""Tries: when a drone began one, how it goes, how it ended, each told under a key of its own."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal

from scenarios.result import FlightResult, RefereeReport, Standing

_TELL_EVERY_S = 1.0
_GONE_S = 3.0
_ALONE_S = 10.0  # so long nobody but the app may have judged before its word stands alone
_SAME_S = 0.1  # between two numbers of one referee
_ALIKE_S = 2.5  # between two referees: heartbeats that tell of the motors come once a second
_KNOWN_RESULTS = 64


@dataclass(frozen=True, slots=True)
class TryEvent:
    """A try of a drone began, went on (every second) or ended.

    Attributes:
        kind: what happened. A try may end twice: by the referee, and again, final, by the app's result.
            Should a referee that had vanished come back, a try that ended with it goes on.
        drone_id: MAVLink system id.
        key: names this try and no other, also after a restart of drone or monitor.
        scenario: its name; "" if unknown.
        report: of the referee; the app's `FlightResult` where `final`.
        source: what the referee saw by: "truth" or "telemetry".
        final: the report is the app's result; nothing else will come for this key.
    """

    kind: Literal["began", "running", "ended"]
    drone_id: int
    key: str
    scenario: str
    report: RefereeReport
    source: str
    final: bool


@dataclass(slots=True)
class _Try:
    key: str
    began_us: int | None
    standing: Standing | None
    heard_s: float
    told_s: float
    ended: bool = False
    result: FlightResult | None = None


@dataclass(slots=True)
class _UnclaimedResult:
    """A RESULT document that no try has claimed yet."""

    crc: int
    result: FlightResult = field(repr=False)
    came_s: float


class TryWatch:
    """Follows the tries of one drone, from one boot to the next.

    Args:
        drone_id: MAVLink system id.
        boot: names this boot of the drone and no other.
        tell: called with each event.
        now_s: loop time.

    Attributes:
        result: the app's result of the present try; None before it came.
    """

    def __init__(self, drone_id: int, boot: str, tell: Callable[[TryEvent], None], now_s: float) -> None:
        self._id = drone_id
        self._boot = boot
        self._tell = tell
        self._began_s = now_s
        self._now: _Try | None = None
        self._waiting: _UnclaimedResult | None = None
        self._known: OrderedDict[int, None] = OrderedDict()  # CRCs of results that were dealt with

    @property
    def result(self) -> FlightResult | None:
        """See the class."""
        return self._now.result if self._now is not None else None

    def see(self, standing: Standing, now_s: float) -> None:
        """Take what the referee says."""
        began_us = standing.snapshot.began_us
        if began_us is None:
            return
        now = self._now
        if now is None or now.began_us != began_us:
            self._end_by_the_next(now)
            now = _Try(f"{self._id}-{self._boot}-{began_us}", began_us, standing, now_s, now_s)
            self._now = now
            self._say("began", now)
        now.standing, now.heard_s = standing, now_s
        if now.result is not None:
            return
        if standing.ended:
            if not now.ended:
                now.ended = True
                self._say("ended", now)
        elif now_s - now.told_s >= _TELL_EVERY_S or now.ended:
            now.ended = False
            now.told_s = now_s
            self._say("running", now)
        self._match(now_s)

    def take_result(self, crc: int, result: FlightResult, now_s: float) -> None:
        """Take a RESULT document; one that is merely said again changes nothing.

        Args:
            crc: names this version of it.
            result: what it says.
            now_s: loop time.
        """
        waiting = self._waiting
        if crc in self._known or (waiting is not None and waiting.crc == crc):
            return
        self._waiting = _UnclaimedResult(crc, result, now_s)
        self._match(now_s)

    def tick(self, now_s: float) -> None:
        """Look at the clock: whoever judged may be gone, or there never was anybody."""
        now = self._now
        if now is not None and not now.ended and now.result is None and now_s - now.heard_s > _GONE_S:
            now.ended = True
            self._say("ended", now, f"nothing was heard of it for {_GONE_S:g} s")
            self._match(now_s)
        alone = now is None or now.began_us is None
        if alone and self._waiting is not None and now_s - self._began_s > _ALONE_S:
            self._take_alone(self._waiting, now_s)

    def close(self) -> None:
        """The drone begins anew: a try that is flown ends with what is known."""
        now = self._now
        if now is not None and not now.ended and now.result is None:
            now.ended = True
            self._say("ended", now, "the drone started anew")

    def _end_by_the_next(self, now: _Try | None) -> None:
        if now is None:
            return
        if not now.ended and now.result is None:
            self._say("ended", now, "the next try began")
        if self._waiting is not None:  # it was of an earlier try, whichever
            self._settle(self._waiting)

    def _match(self, now_s: float) -> None:
        """Give a waiting result to the present try, if it is about that one.

        A result names no try. So its time must be that of this try, and an app that lives on and says its
        last result again must not end the next one.
        """
        now, waiting = self._now, self._waiting
        if now is None or waiting is None or now.result is not None or now.standing is None:
            return
        result, standing = waiting.result, now.standing
        is_other = bool(result.scenario and standing.scenario) and result.scenario != standing.scenario
        if result.try_time_s <= 0.0 or is_other:
            return
        alike_s = _SAME_S if result.judged_by == standing.source else _ALIKE_S
        if now.ended and not standing.ended:  # the referee was gone before it saw the end
            alike_s = _ALIKE_S
        elif not standing.ended:  # the app broke off, and the drone still flies
            fresh = now_s - waiting.came_s < _TELL_EVERY_S
            alike_s = _ALIKE_S if fresh and result.ended != "finished" else -1.0
        if abs(standing.snapshot.try_time_s - result.try_time_s) <= alike_s:
            self._finish(now, waiting)

    def _finish(self, now: _Try, waiting: _UnclaimedResult) -> None:
        now.result, now.ended = waiting.result, True
        self._settle(waiting)
        self._say("ended", now)

    def _take_alone(self, waiting: _UnclaimedResult, now_s: float) -> None:
        """Nobody but the app judged: its result is the try."""
        if waiting.result.try_time_s <= 0.0:
            self._settle(waiting)
            return
        now = _Try(f"{self._id}-{self._boot}-result-{waiting.crc:08x}", None, None, now_s, now_s)
        self._now = now
        self._say("began", now, result=waiting.result)
        self._finish(now, waiting)

    def _settle(self, waiting: _UnclaimedResult) -> None:
        self._known[waiting.crc] = None
        if len(self._known) > _KNOWN_RESULTS:
            self._known.popitem(last=False)
        if self._waiting is waiting:
            self._waiting = None

    def _say(
        self,
        kind: Literal["began", "running", "ended"],
        now: _Try,
        remark: str = "",
        result: FlightResult | None = None,
    ) -> None:
        standing, final = now.standing, now.result is not None
        report: RefereeReport
        result = now.result or result
        if result is not None:
            report, scenario, source = result, result.scenario, result.judged_by
        else:
            assert standing is not None
            report, scenario, source = standing.report, standing.scenario, standing.source
        if remark:
            reason = f"{report.reason}; {remark}".removeprefix("; ")
            report = report.model_copy(update={"reason": reason})
        self._tell(TryEvent(kind, self._id, now.key, scenario, report, source, final))
