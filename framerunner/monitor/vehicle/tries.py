"""Tries of a vehicle: when one began, how it stands, how it ended, and the figures of the pages."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Literal

from framerunner.monitor.ports import Equipment
from framerunner.monitor.vehicle.referees import RefereeChannel, TelemetryReferee
from framerunner.monitor.vehicle.track import Placement, Source
from framerunner.wire.vehicle_telemetry import VehicleTelemetry
from scenarios.models import Scenario, TrueState
from scenarios.result import FaultFacts, FlightResult, RefereeReport, Standing

_PUBLISH_EVERY_S = 1.0
_GONE_S = 3.0
_ALONE_S = 10.0  # after this time without a referee the app's result alone counts
_SAME_S = 0.1  # difference of two try times of one referee
_SIMILAR_S = 2.5  # between two referees: heartbeats, which show when motors are on, are sent once a second
_KNOWN_RESULTS = 64
_OWN_REFEREE_WAIT_S = 5.0  # within which a vehicle has to show a referee of its own
_FRESH_S = 1.0
_MAX_FAULTS = 20  # shown
_BOOT_TIME_WAIT_S = 3.0  # within which a vehicle has to send its boot time

JsonMessage = dict[str, Any]
EventKind = Literal["began", "running", "ended"]


@dataclass(frozen=True, slots=True)
class TryEvent:
    """A try of a drone began, went on (every second) or ended.

    Attributes:
        kind: what happened. A try may end twice: by the referee, and again, final, by the app's result.
            If a referee that was gone returns, a try that ended with it goes on.
        drone_id: MAVLink system id.
        key: unique to this try, also after a restart of drone or monitor.
        scenario: its name; "" if unknown.
        report: of the referee; the app's `FlightResult` where `final`.
        source: of the referee's data: "truth" or "telemetry".
        final: the report is the app's result; this is the last event with this key.
    """

    kind: EventKind
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
    published_s: float
    ended: bool = False
    result: FlightResult | None = None


@dataclass(slots=True)
class _UnclaimedResult:
    """A RESULT document that no try has claimed yet."""

    crc: int
    result: FlightResult = field(repr=False)
    received_s: float


class TryWatch:
    """Follows the tries of a drone during one boot, which `boot` identifies; `publish` takes the events."""

    def __init__(self, drone_id: int, boot: str, publish: Callable[[TryEvent], None], now_s: float) -> None:
        self._id = drone_id
        self._boot = boot
        self._publish = publish
        self._began_s = now_s
        self._now: _Try | None = None
        self._waiting: _UnclaimedResult | None = None
        self._known: OrderedDict[int, None] = OrderedDict()  # CRCs of results that were dealt with

    @property
    def result(self) -> FlightResult | None:
        """The app's result of the present try; None before it was received."""
        return self._now.result if self._now is not None else None

    def see(self, standing: Standing, now_s: float) -> None:
        """Take a referee's answer."""
        began_us = standing.snapshot.began_us
        if began_us is None:
            return
        now = self._now
        if now is None or now.began_us != began_us:
            self._end_before_next()
            now = _Try(f"{self._id}-{self._boot}-{began_us}", began_us, standing, now_s, now_s)
            self._now = now
            self._report("began", now)
        now.standing, now.heard_s = standing, now_s
        if now.result is not None:
            return
        if standing.ended:
            if not now.ended:
                now.ended = True
                self._report("ended", now)
        elif now_s - now.published_s >= _PUBLISH_EVERY_S or now.ended:
            now.ended = False
            now.published_s = now_s
            self._report("running", now)
        self._match(now_s)

    def take_result(self, crc: int, result: FlightResult, now_s: float) -> None:
        """Take a RESULT document; one with a known CRC changes nothing."""
        waiting = self._waiting
        if crc in self._known or (waiting is not None and waiting.crc == crc):
            return
        self._waiting = _UnclaimedResult(crc, result, now_s)
        self._match(now_s)

    def tick(self, now_s: float) -> None:
        """End a try whose referee is gone; take the app's result where there is no referee."""
        now = self._now
        if now is not None and not now.ended and now.result is None and now_s - now.heard_s > _GONE_S:
            now.ended = True
            self._report("ended", now, f"nothing was heard of it for {_GONE_S:g} s")
            self._match(now_s)
        alone = now is None or now.began_us is None
        if alone and self._waiting is not None and now_s - self._began_s > _ALONE_S:
            self._take_alone(self._waiting, now_s)

    def close(self) -> None:
        """End the present try with what is known: the drone has restarted."""
        now = self._now
        if now is not None and not now.ended and now.result is None:
            now.ended = True
            self._report("ended", now, "the drone restarted")

    def _end_before_next(self) -> None:
        """End the present try, and drop a result that waits: it belongs to an earlier try."""
        now = self._now
        if now is None:
            return
        if not now.ended and now.result is None:
            self._report("ended", now, "the next try began")
        if self._waiting is not None:
            self._settle(self._waiting)

    def _match(self, now_s: float) -> None:
        """Give a waiting result to the present try, if it belongs to it.

        A result contains no key of a try. So its time must be that of this try, and an app that sends its
        last result again must not end the next try.
        """
        now, waiting = self._now, self._waiting
        if now is None or waiting is None or now.result is not None or now.standing is None:
            return
        result, standing = waiting.result, now.standing
        is_other = bool(result.scenario and standing.scenario) and result.scenario != standing.scenario
        if result.try_time_s <= 0.0 or is_other:
            return
        tolerance_s = _SAME_S if result.judged_by == standing.source else _SIMILAR_S
        if now.ended and not standing.ended:  # the referee was gone before it saw the end
            tolerance_s = _SIMILAR_S
        elif not standing.ended:  # the app has ended, and the drone still flies
            fresh = now_s - waiting.received_s < _PUBLISH_EVERY_S
            tolerance_s = _SIMILAR_S if fresh and result.ended != "finished" else -1.0
        if abs(standing.snapshot.try_time_s - result.try_time_s) <= tolerance_s:
            self._finish(now, waiting)

    def _finish(self, now: _Try, waiting: _UnclaimedResult) -> None:
        now.result, now.ended = waiting.result, True
        self._settle(waiting)
        self._report("ended", now)

    def _take_alone(self, waiting: _UnclaimedResult, now_s: float) -> None:
        """Make a try of the app's result, because there is no referee."""
        if waiting.result.try_time_s <= 0.0:
            self._settle(waiting)
            return
        now = _Try(f"{self._id}-{self._boot}-result-{waiting.crc:08x}", None, None, now_s, now_s)
        self._now = now
        self._report("began", now, result=waiting.result)
        self._finish(now, waiting)

    def _settle(self, waiting: _UnclaimedResult) -> None:
        self._known[waiting.crc] = None
        if len(self._known) > _KNOWN_RESULTS:
            self._known.popitem(last=False)
        if self._waiting is waiting:
            self._waiting = None

    def _report(
        self, kind: EventKind, now: _Try, remark: str = "", result: FlightResult | None = None
    ) -> None:
        standing, final = now.standing, now.result is not None
        result = now.result or result
        if result is not None:
            report: RefereeReport = result
            scenario, source = result.scenario, result.judged_by
        else:
            assert standing is not None
            report, scenario, source = standing.report, standing.scenario, standing.source
        if remark:
            reason = f"{report.reason}; {remark}".removeprefix("; ")
            report = report.model_copy(update={"reason": reason})
        self._publish(TryEvent(kind, self._id, now.key, scenario, report, source, final))


class Judging:
    """Follows the tries of one boot of a vehicle, by its own referee or by the monitor's.

    Args:
        equipment: with the scenario, if there is one, and a referee for it.
        publish: called with each event of a try.

    Attributes:
        standing: how the try stands; None without a referee.
    """

    def __init__(
        self, drone_id: int, equipment: Equipment, publish: Callable[[TryEvent], None], now_s: float
    ) -> None:
        self._id = drone_id
        self._equipment = equipment
        self._publish = publish
        self._began_s = now_s
        self._on_telemetry: TelemetryReferee | None = None
        self._tries: TryWatch | None = None
        self._answered_s = -1e9
        self._result: tuple[int, FlightResult] | None = None
        self.standing: Standing | None = None

    def take_standing(self, standing: Standing, now_s: float) -> None:
        """Take an answer of the vehicle's referee; from now on only this referee counts."""
        self._on_telemetry = None
        self._answered_s = now_s
        self.standing = standing
        if self._tries is not None:
            self._tries.see(standing, now_s)

    def follow(self, telemetry: VehicleTelemetry, placement: Placement) -> None:
        """Pass the newest telemetry to the monitor's referee, unless the vehicle's has answered."""
        position, attitude = telemetry.position, telemetry.attitude
        if self._answered_s > 0 or placement.source < Source.START or position is None or attitude is None:
            return
        if self._on_telemetry is None:
            scenario = self._equipment.scenario
            if scenario is None:
                return
            self._on_telemetry = TelemetryReferee(scenario, self._equipment.make_referee)
        alignment = placement.alignment
        state = TrueState(
            position.time_us,
            alignment.position(position.position_ned_m),
            alignment.vector(position.velocity_ned_m_s),
            alignment.attitude(attitude.attitude_ned),
            telemetry.armed,
        )
        self._on_telemetry.follow(state)

    def tick(self, boot_unix_us: int | None, now_s: float, wall_boot_us: int) -> None:
        """Update the try; to be called several times a second.

        Args:
            boot_unix_us: when the vehicle was switched on, as it reports; None: not yet.
            now_s: time of the loop.
            wall_boot_us: the same by this machine's clock, used if the vehicle never reports it.
        """
        if self._tries is None:
            if boot_unix_us is None and now_s - self._began_s <= _BOOT_TIME_WAIT_S:
                return
            boot_us = wall_boot_us if boot_unix_us is None else boot_unix_us
            # Clocks that are set by satellites report a slightly different time in each answer.
            self._tries = TryWatch(self._id, f"{boot_us // 10_000_000}", self._publish, now_s)
            if self._result is not None:
                self._tries.take_result(*self._result, now_s)
        if self._on_telemetry is not None:
            self.standing = self._on_telemetry.standing()
            if self.standing is not None and now_s - self._began_s > _OWN_REFEREE_WAIT_S:
                self._tries.see(self.standing, now_s)
        self._tries.tick(now_s)

    def take_result(self, crc: int, result: FlightResult, now_s: float) -> None:
        """Take the app's RESULT document."""
        self._result = (crc, result)
        if self._tries is not None:
            self._tries.take_result(crc, result, now_s)

    def close(self) -> None:
        """End the present try: the vehicle has restarted."""
        if self._tries is not None:
            self._tries.close()

    def motors_on(self, telemetry: VehicleTelemetry, now_s: float) -> bool:
        """Whether the motors run: a referee reports it sooner than a heartbeat."""
        if self.standing is not None and now_s - self._answered_s < _FRESH_S:
            return self.standing.snapshot.motors_on
        return telemetry.armed

    def figures(self, channel: RefereeChannel | None) -> JsonMessage | None:
        """The figures of the present try; None if nothing is known."""
        scenario = self.scenario(channel)
        limit_s = scenario.try_limit_s if scenario is not None else None
        result = self._tries.result if self._tries is not None else None
        return figures(self.standing, result, limit_s)

    def scenario(self, channel: RefereeChannel | None) -> Scenario | None:
        """What is flown: by the vehicle's referee, otherwise by the monitor's equipment."""
        own = channel.scenario if channel is not None else None
        return own if own is not None else self._equipment.scenario


def figures(
    standing: Standing | None, result: FlightResult | None, limit_s: float | None
) -> JsonMessage | None:
    """The figures of a try, as in `docs/monitor-channels.md`; None if nothing is known.

    Args:
        standing: how the try stands; None without a referee.
        result: the app's result of this try, which replaces the referee's numbers; None before.
        limit_s: longest try; None: not known.
    """
    if standing is None and result is None:
        return None
    shown: JsonMessage = {"next_colour": None, "inside": True, "motors_on": False}
    if standing is not None:
        shown = _of_standing(standing)
    if result is not None:
        shown |= _of_result(result)
    late = limit_s is not None and shown["try_time_s"] >= limit_s
    return {**shown, "limit_s": limit_s, "time_over": late, "final": result is not None}


def _of_standing(standing: Standing) -> JsonMessage:
    now, report = standing.snapshot, standing.report
    return {
        "try_time_s": now.try_time_s,
        "penalty_s": now.penalty_s,
        "total_time_s": now.try_time_s + now.penalty_s,
        "crossed": list(now.crossed),
        "crossing_times_s": list(report.crossing_times_s),
        "next_colour": now.next_colour,
        "contacts": now.contacts,
        "inside": now.inside,
        "motors_on": now.motors_on,
        "over": now.over,
        # During a try a verdict would only say that it is not over.
        "verdict": report.verdict if standing.ended else "",
        "reason": report.reason if standing.ended else "",
        "source": standing.source,
        **_of_faults(standing.faults),
    }


def _of_faults(facts: FaultFacts) -> JsonMessage:
    """What has failed, newest last, and the last failsafe; empty if nothing has."""
    if not facts.begun:
        return {}
    return {
        "faults": [
            {"fault": each.fault, "active": each.ended_us is None} for each in facts.begun[-_MAX_FAULTS:]
        ],
        "failsafe": facts.failsafes[-1].text if facts.failsafes else "",
    }


def _of_result(result: FlightResult) -> JsonMessage:
    return {
        "try_time_s": result.try_time_s,
        "penalty_s": result.penalty_s,
        "total_time_s": result.total_time_s,
        "crossed": list(result.frames_crossed),
        "crossing_times_s": list(result.crossing_times_s),
        "contacts": result.contacts,
        "over": True,
        "verdict": result.verdict,
        "reason": result.reason,
        "source": result.judged_by,
    }
