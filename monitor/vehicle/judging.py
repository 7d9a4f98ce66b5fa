"""Who judges a vehicle's tries: its own referee over HTTP, or the monitor's, which follows telemetry."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from geometry.vectors import Quaternion, Vec3
from monitor.ports import Equipment, Referee
from monitor.referee_channel import RefereeChannel
from monitor.tries import TryEvent, TryWatch
from monitor.vehicle.placement import Placement, Source
from scenarios.models import Scenario, TrueState
from scenarios.result import FlightResult, Standing
from wire.vehicle_telemetry import VehicleTelemetry

JsonMessage = dict[str, Any]
_PATIENCE_S = 5.0  # within which a drone has to show its own referee
_FRESH_S = 1.0
_NAMED_S = 3.0  # within which the drone has to say when it was switched on


class OwnReferee:
    """The monitor's own, for a drone that brings none: follows telemetry and sees no contacts.

    Args:
        scenario: what is flown.
        make_referee: a referee for one try.
    """

    def __init__(self, scenario: Scenario, make_referee: Callable[[Scenario], Referee]) -> None:
        self.scenario = scenario
        self._make = make_referee
        self._referee = make_referee(scenario)
        self._armed = False
        self._followed = False

    def follow(
        self,
        time_us: int,
        position_arena_m: Vec3,
        velocity_arena_m_s: Vec3,
        attitude: Quaternion,
        armed: bool,
    ) -> None:
        """Take a state as telemetry tells it.

        Args:
            time_us: vehicle time.
            position_arena_m: shape (3,).
            velocity_arena_m_s: shape (3,).
            attitude: unit quaternion (w, x, y, z), body FLU to arena.
            armed: motors on.
        """
        if armed and not self._armed and self._referee.snapshot().over:
            self._referee = self._make(self.scenario)
        self._armed = armed
        self._followed = True
        self._referee.update(TrueState(time_us, position_arena_m, velocity_arena_m_s, attitude, armed))

    def standing(self) -> Standing | None:
        """How the try stands; None if nothing was followed yet."""
        if not self._followed:
            return None
        referee = self._referee
        return Standing(
            scenario=self.scenario.name,
            source="telemetry",
            snapshot=referee.snapshot(),
            report=referee.report(),
        )


class Judging:
    """Follows the tries of one boot of a vehicle.

    Args:
        drone_id: system id.
        equipment: with the scenario, if there is one, and a referee for it.
        tell: called with each event of a try.
        now_s: loop time.

    Attributes:
        standing: how the try stands; None: nobody says.
    """

    def __init__(
        self, drone_id: int, equipment: Equipment, tell: Callable[[TryEvent], None], now_s: float
    ) -> None:
        self._id = drone_id
        self._equipment = equipment
        self._tell = tell
        self._began_s = now_s
        self._own: OwnReferee | None = None
        self._tries: TryWatch | None = None
        self._answered_s = -1e9
        self._result: tuple[int, FlightResult] | None = None
        self.standing: Standing | None = None

    def hear(self, standing: Standing, now_s: float) -> None:
        """Take what the vehicle's referee says; from now on it alone counts."""
        self._own = None
        self._answered_s = now_s
        self.standing = standing
        if self._tries is not None:
            self._tries.see(standing, now_s)

    def follow(self, telemetry: VehicleTelemetry, placement: Placement) -> None:
        """Show the monitor's own referee the latest telemetry, if it is the one who judges."""
        position, attitude = telemetry.position, telemetry.attitude
        if self._answered_s > 0 or placement.source < Source.START or position is None or attitude is None:
            return
        if self._own is None:
            scenario = self._equipment.scenario
            if scenario is None:
                return
            self._own = OwnReferee(scenario, self._equipment.make_referee)
        alignment = placement.alignment
        self._own.follow(
            position.time_us,
            alignment.position(position.position_ned_m),
            alignment.vector(position.velocity_ned_m_s),
            alignment.attitude(attitude.attitude_ned),
            armed=telemetry.armed,
        )

    def tick(self, boot_unix_us: int | None, now_s: float, wall_boot_us: int) -> None:
        """Look at the clock, some times a second.

        Args:
            boot_unix_us: when the vehicle was switched on; None: it has not said so.
            now_s: loop time.
            wall_boot_us: the same by this machine's clock, in case it never does.
        """
        if self._tries is None:
            late = now_s - self._began_s > _NAMED_S
            if boot_unix_us is None and not late:
                return
            boot_us = wall_boot_us if boot_unix_us is None else boot_unix_us
            # Clocks that are set by satellites differ a little each time they are asked.
            self._tries = TryWatch(self._id, f"{boot_us // 10_000_000}", self._tell, now_s)
            if self._result is not None:
                self._tries.take_result(*self._result, now_s)
        if self._own is not None:
            self.standing = self._own.standing()
            if self.standing is not None and now_s - self._began_s > _PATIENCE_S:
                self._tries.see(self.standing, now_s)
        self._tries.tick(now_s)

    def take_result(self, crc: int, result: FlightResult, now_s: float) -> None:
        """Take the app's RESULT document."""
        self._result = (crc, result)
        if self._tries is not None:
            self._tries.take_result(crc, result, now_s)

    def close(self) -> None:
        """The vehicle has restarted."""
        if self._tries is not None:
            self._tries.close()

    def motors_on(self, telemetry: VehicleTelemetry, now_s: float) -> bool:
        """Whether the motors run: a referee knows it sooner than a heartbeat tells."""
        if self.standing is not None and now_s - self._answered_s < _FRESH_S:
            return self.standing.snapshot.motors_on
        return telemetry.armed

    def figures(self, channel: RefereeChannel | None) -> JsonMessage | None:
        """The Game Monitor's figures; None if nothing is known."""
        scenario = self.scenario(channel)
        limit_s = scenario.try_limit_s if scenario is not None else None
        result = self._tries.result if self._tries is not None else None
        return figures(self.standing, result, limit_s)

    def scenario(self, channel: RefereeChannel | None) -> Scenario | None:
        """What is flown: as the vehicle's referee says, else as the monitor was told."""
        told = channel.scenario if channel is not None else None
        return told if told is not None else self._equipment.scenario


def figures(
    standing: Standing | None, result: FlightResult | None, limit_s: float | None
) -> JsonMessage | None:
    """The Game Monitor's figures.

    Args:
        standing: how the try stands; None: nobody says.
        result: the app's result of this very try; then its numbers count.
        limit_s: longest try; None: not known.

    Returns:
        As `docs/monitor-channels.md` says; None if nothing is known.
    """
    if standing is None and result is None:
        return None
    told = _of_standing(standing) if standing is not None else _NOTHING
    if result is not None:
        told = {**told, **_of_result(result)}
    late = limit_s is not None and told["try_time_s"] >= limit_s
    return {**told, "limit_s": limit_s, "time_over": late, "final": result is not None}


_NOTHING: JsonMessage = {
    "try_time_s": None,
    "penalty_s": None,
    "total_time_s": None,
    "crossed": [],
    "crossing_times_s": [],
    "next_colour": None,
    "contacts": None,
    "inside": True,
    "motors_on": False,
    "over": True,
    "verdict": "",
    "reason": "",
    "source": "",
}


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
        # While the try is flown a verdict would only say that it is not over.
        "verdict": report.verdict if standing.ended else "",
        "reason": report.reason if standing.ended else "",
        "source": standing.source,
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
