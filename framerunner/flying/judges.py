"""The source of the verdict: the simulator, which has the true states, or a drone's own telemetry."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from dataclasses import replace
from math import cos, sin
from typing import TYPE_CHECKING

from pydantic import ValidationError

from framerunner.errors import SettingError
from framerunner.flying.plan import FlightPlan
from framerunner.terminal import warn
from framerunner.wire.simulator_api import SimulatorApi
from offboard.app import Moment
from scenarios.models import Scenario, TrueState
from scenarios.referee import Referee
from scenarios.result import (
    FaultFacts,
    RefereeReport,
    RefereeSnapshot,
    Standing,
    StandingPlace,
    TimedPosition,
    first_error,
)

if TYPE_CHECKING:  # a flight in lockstep needs no HTTP
    import aiohttp

_ANSWER_S = 2.0
_POLL_S = 0.1
# Vehicle time. Heartbeats, one a second, show the disarming; the referee then needs at most 2 s.
_SETTLE_LIMIT_US = 5_000_000
_CLOCK_STOPPED_S = 3.0  # wall time without progress of vehicle time


class Judge:
    """A referee in this process or elsewhere; as it is here, one that is shown the states by others.

    Attributes:
        source: the states that it judges by: "truth" or "telemetry".
        referee: that judges.
    """

    source = "truth"

    def __init__(self, referee: Referee) -> None:
        self.referee = referee

    def see(self, moment: Moment) -> None:
        """Take a tick of the flight."""

    async def standing(self) -> RefereeSnapshot | None:
        """How the try stands now; None if that is unknown."""
        return self.referee.snapshot()

    def so_far(self, mission_state: str, ended: str) -> RefereeReport:
        """Judge the ticks seen so far, at once."""
        return self.referee.report(mission_state, ended)

    async def report(self, mission_state: str, ended: str | None) -> RefereeReport:
        """Return the report, when the drone has come to rest."""
        return self.referee.report(mission_state, ended)

    async def faults(self) -> FaultFacts:
        """What failed in the flight; nothing if that is unknown."""
        return FaultFacts()

    def flown_path(self) -> Sequence[TimedPosition]:
        """Where the drone truly was, after `report`: seconds since motors on, arena metres; () if unknown."""
        return self.referee.flown_path


class TelemetryJudge(Judge):
    """A referee that sees the drone's telemetry, and so no contacts with gates."""

    source = "telemetry"

    def flown_path(self) -> Sequence[TimedPosition]:
        """Unknown."""
        return ()

    def see(self, moment: Moment) -> None:
        """Show the drone's state to the referee."""
        state = moment.state
        half = state.yaw / 2
        self.referee.update(
            TrueState(
                state.time_us,
                (state.x, state.y, state.z),
                state.velocity_arena_m_s,
                (cos(half), 0.0, 0.0, sin(half)),
                state.armed,
            )
        )


class TruthJudge(TelemetryJudge):
    """The simulator's referee, which sees the true state of every control tick, over HTTP.

    If the simulator ends, the verdict is made from the telemetry seen so far; likewise if the referee still
    has the try of an earlier flight, because in this one the motors were never on.

    Args:
        api: of the simulator.
        session: for the requests.
        plan: of the flight.
        source: the states that it judges by.
        earlier_us: vehicle time at which the try of an earlier flight began; None: there is none.
    """

    def __init__(
        self,
        api: SimulatorApi,
        session: aiohttp.ClientSession,
        plan: FlightPlan,
        source: str = "truth",
        earlier_us: int | None = None,
    ) -> None:
        super().__init__(plan.new_referee())
        self.source = source
        self._earlier_us = earlier_us
        self._api = api
        self._session = session
        self._latest: Standing | None = None
        self._flown_path: Sequence[TimedPosition] = ()

    async def standing(self) -> RefereeSnapshot | None:
        """As of now, or None without a valid answer."""
        answer = await ask_referee(self._api, self._session)
        self._latest = answer or self._latest
        return None if answer is None or self._is_earlier(answer) else answer.snapshot

    async def report(self, mission_state: str, ended: str | None) -> RefereeReport:
        """Request the report once the drone is at rest.

        A mission that finished has seen the motors stop; the referee may learn of it later, over another
        link. After a flight that was aborted the drone may stay in hold with its motors on; this does not
        wait for their end.
        """
        await self._settle(motors_stopped=ended is None)
        parameters = {"state": mission_state, **({"ended": ended} if ended else {})}
        answer = await ask_referee(self._api, self._session, parameters)
        if answer is None or self._is_earlier(answer):
            self.source = TelemetryJudge.source
            return await super().report(mission_state, ended)
        self._flown_path = answer.flown_path
        return answer.report

    def flown_path(self) -> Sequence[TimedPosition]:
        """As the simulator has told with its report."""
        return self._flown_path

    async def faults(self) -> FaultFacts:
        """As the simulator tells, or has told last; nothing without a valid answer."""
        answer = await ask_referee(self._api, self._session) or self._latest
        return FaultFacts() if answer is None else answer.faults

    def _is_earlier(self, answer: Standing) -> bool:
        """Whether an answer is about the try of an earlier flight."""
        return self._earlier_us is not None and answer.snapshot.began_us == self._earlier_us

    async def _settle(self, *, motors_stopped: bool) -> None:
        """Wait until the referee sees the drone at rest, for 5 s of vehicle time at most.

        If `motors_stopped`, the motors are known to be off, even if the referee has not seen it yet.
        """
        loop = asyncio.get_running_loop()
        began_us = newest_us = -1
        newest_s = loop.time()
        while (answer := await ask_referee(self._api, self._session)) is not None:
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


def _started_at(plan: FlightPlan, place: StandingPlace | None, api: SimulatorApi) -> FlightPlan:
    """The plan of a drone that starts from where it stands; as it was, with a warning, if it cannot."""
    problem = "does not stand upright with its motors off"
    if place is not None:
        (x_m, y_m, _), scenario = place.position_arena_m, plan.scenario
        start = {"x_m": x_m, "y_m": y_m, "yaw_rad": place.yaw_rad}
        try:
            return replace(plan, scenario=Scenario.model_validate({**scenario.model_dump(), "start": start}))
        except ValidationError as error:
            problem = f"stands where no flight can start, {first_error(error)}"
    warn(f"the drone at {api.url} has flown before and {problem}; start the simulator again")
    return plan


async def ask_referee(
    api: SimulatorApi, session: aiohttp.ClientSession, parameters: dict[str, str] | None = None
) -> Standing | None:
    """Request a simulator's `referee.json`; None if there is no valid answer."""
    import aiohttp

    timeout = aiohttp.ClientTimeout(total=_ANSWER_S)
    try:
        async with session.get(api.referee_url, params=parameters, timeout=timeout) as response:
            if response.status != 200:
                return None
            return Standing.model_validate_json(await response.read())
    except (aiohttp.ClientError, TimeoutError, ValidationError):
        return None


async def choose_judge(
    plan: FlightPlan, api: SimulatorApi | None, session: aiohttp.ClientSession, *, named: bool = False
) -> tuple[Judge, FlightPlan]:
    """Choose the referee of the simulator that flies or, without one, telemetry.

    A simulated drone that has flown before starts from where it stands now. On standard error it is told if
    it cannot, and if the simulator was not named and has another scenario.

    Args:
        plan: of the flight; a simulator with another scenario cannot judge it.
        api: where a simulator may be; None: nowhere.
        session: for the requests.
        named: whether the user named the simulator, which must then answer.

    Returns:
        The judge, and the plan with its start and its gates' heights as the simulator has them.

    Raises:
        SettingError: the named simulator does not judge this scenario.
    """
    answer = None if api is None else await ask_referee(api, session)
    if api is not None and answer is not None and answer.scenario == plan.scenario.name:
        plan = plan.lifted(answer.lift_m)
        now = answer.snapshot
        # A virtual camera places the arena anew; a drone that flies is refused later.
        if now.began_us is not None and not now.motors_on and answer.source == "truth":
            plan = _started_at(plan, answer.stands_at, api)
        return TruthJudge(api, session, plan, answer.source, now.began_us), plan
    if api is not None and named:
        raise SettingError(
            f"--simulator {api.url}: "
            + (
                "nothing there answers as a simulator; check the address, or leave it out"
                if answer is None
                else f"flies the scenario {answer.scenario}; start it with --scenario {plan.scenario.name}"
            )
        )
    if api is not None and answer is not None:
        warn(
            f"{api.url} shows the scenario {answer.scenario}, and {plan.scenario.name} is flown; "
            f"start it with --scenario {plan.scenario.name}"
        )
    return TelemetryJudge(plan.new_referee()), plan
