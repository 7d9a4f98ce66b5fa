"""Where the verdict comes from: the simulator, which knows the truth, or a drone's own telemetry."""

from __future__ import annotations

import asyncio
from math import cos, sin
from typing import Protocol
from urllib.parse import urlsplit, urlunsplit

import aiohttp
from pydantic import ValidationError

from firmware_py.airframe import load_airframe
from framerunner.virtual_camera.lift import lifted
from offboard.app import Moment
from scenarios.models import Scenario
from scenarios.referee import Referee
from scenarios.result import RefereeReport, RefereeSnapshot, Standing
from scenarios.truth import TrueState

_ANSWER_S = 2.0
_POLL_S = 0.1
# Vehicle time. A heartbeat a second tells each link of the disarming; then the referee needs at most 2 s.
_SETTLE_LIMIT_US = 5_000_000
_CLOCK_STOPPED_S = 3.0  # wall time without progress of vehicle time


class Judge(Protocol):
    """A referee, wherever it is."""

    source: str
    lift_m: float

    def see(self, moment: Moment) -> None:
        """Take a tick of the flight."""

    async def standing(self) -> RefereeSnapshot | None:
        """How the try stands now; None if it cannot be had."""

    async def report(self, mission_state: str, ended: str | None) -> RefereeReport:
        """The report, when the drone has come to rest."""
        ...


class TruthJudge:
    """Asks the simulator's referee, which sees the true state of every control tick.

    Should the simulator die, the verdict comes from the telemetry seen so far.

    Args:
        url: of its `referee.json`.
        session: for asking.
        scenario: what is flown.
        source: what its referee sees by, as it says itself.
        lift_m: how much higher its frames hang than the scenario says, for want of a base.
    """

    def __init__(
        self,
        url: str,
        session: aiohttp.ClientSession,
        scenario: Scenario,
        source: str = "truth",
        lift_m: float = 0.0,
    ) -> None:
        self.source = source
        self.lift_m = lift_m
        self._url = url
        self._session = session
        self._substitute = TelemetryJudge(scenario, lift_m)

    def see(self, moment: Moment) -> None:
        """The referee sees for itself; the substitute follows."""
        self._substitute.see(moment)

    async def standing(self) -> RefereeSnapshot | None:
        """Ask for the snapshot."""
        answer = await ask_referee(self._url, self._session)
        return None if answer is None else answer.snapshot

    async def report(self, mission_state: str, ended: str | None) -> RefereeReport:
        """Ask for the report once the drone is at rest.

        A mission that finished has seen the motors stop; the referee's own link may tell it later. A flight
        that was broken off may go on, in hold, with the motors on: that is not waited for.
        """
        await self._settle(motors_stopped=ended is None)
        parameters = {"state": mission_state, **({"ended": ended} if ended else {})}
        answer = await ask_referee(self._url, self._session, parameters)
        if answer is None:
            self.source = self._substitute.source
            return await self._substitute.report(mission_state, ended)
        return answer.report

    async def _settle(self, *, motors_stopped: bool) -> None:
        """Wait until the referee sees the drone at rest, for 5 s of vehicle time at most.

        Args:
            motors_stopped: the motors are known to be off, whatever the referee has heard yet.
        """
        loop = asyncio.get_running_loop()
        began_us = newest_us = -1
        newest_s = loop.time()
        while (answer := await ask_referee(self._url, self._session)) is not None:
            now, time_us = answer.snapshot, answer.time_us or 0
            if now.settled or now.over or (now.motors_on and not motors_stopped):
                return
            if began_us < 0:
                began_us = time_us
            if time_us > newest_us:
                newest_us, newest_s = time_us, loop.time()
            if time_us - began_us > _SETTLE_LIMIT_US or loop.time() - newest_s > _CLOCK_STOPPED_S:
                return
            await asyncio.sleep(_POLL_S)


class TelemetryJudge:
    """Judges by what the drone says of itself; contacts with frames remain unseen.

    Args:
        scenario: what is flown.
        lift_m: how much higher its frames hang than the scenario says, for want of a base.
    """

    source = "telemetry"

    def __init__(self, scenario: Scenario, lift_m: float = 0.0) -> None:
        self.lift_m = lift_m
        envelope_m = load_airframe(scenario.airframe).envelope_m
        self._referee = Referee(lifted(scenario, lift_m), envelope_m, lift_m)

    def see(self, moment: Moment) -> None:
        """Follow the drone's state."""
        state = moment.state
        half = state.yaw / 2
        self._referee.update(
            TrueState(
                state.time_us,
                (state.x, state.y, state.z),
                state.velocity_arena_m_s,
                (cos(half), 0.0, 0.0, sin(half)),
                state.armed,
            )
        )

    async def standing(self) -> RefereeSnapshot | None:
        """From the last tick."""
        return self._referee.snapshot()

    async def report(self, mission_state: str, ended: str | None) -> RefereeReport:
        """Judge what was seen."""
        return self._referee.report(mission_state, ended)


async def ask_referee(
    url: str, session: aiohttp.ClientSession, parameters: dict[str, str] | None = None
) -> Standing | None:
    """Get a simulator's `referee.json`; None if there is none."""
    timeout = aiohttp.ClientTimeout(total=_ANSWER_S)
    try:
        async with session.get(url, params=parameters, timeout=timeout) as response:
            if response.status != 200:
                return None
            return Standing.model_validate_json(await response.read())
    except (aiohttp.ClientError, TimeoutError, ValidationError):
        return None


async def choose_judge(
    scenario: Scenario, camera_url: str, session: aiohttp.ClientSession
) -> TruthJudge | TelemetryJudge:
    """Take the referee of the simulator that the camera belongs to, or judge by telemetry.

    Args:
        scenario: what is flown; a simulator with another one cannot judge it.
        camera_url: whatever was given as the camera.
        session: for asking.
    """
    parts = urlsplit(camera_url)
    if parts.scheme == "http":
        url = urlunsplit((parts.scheme, parts.netloc, "/referee.json", "", ""))
        answer = await ask_referee(url, session)
        if answer is not None and answer.scenario == scenario.name:
            # The virtual camera's referee lives on telemetry, and says so.
            return TruthJudge(url, session, scenario, answer.source, answer.lift_m)
    return TelemetryJudge(scenario)
