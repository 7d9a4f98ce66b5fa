"""Where the verdict comes from: the simulator, which knows the truth, or a drone's own telemetry."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass
from math import cos, sin
from typing import TYPE_CHECKING, Any, Protocol

from framerunner.errors import SettingError
from framerunner.flying.plan import FlightPlan
from offboard.app import Moment
from scenarios.referee import Referee
from scenarios.truth import TrueState
from wire.simulator_api import SimulatorApi

if TYPE_CHECKING:  # a flight in lockstep asks nobody over HTTP
    import aiohttp

_ANSWER_S = 2.0
_POLL_S = 0.1
# Vehicle time. A heartbeat a second tells each link of the disarming; then the referee needs at most 2 s.
_SETTLE_LIMIT_US = 5_000_000
_CLOCK_STOPPED_S = 3.0  # wall time without progress of vehicle time


@dataclass(frozen=True, slots=True)
class Standing:
    """How a try stands, for the display.

    Attributes:
        try_time_s: since motors on.
        crossed: colours so far.
        contacts: with frames, so far.
        settled: motors off and at rest.
        motors_on: whether the try is being flown.
        began_us: vehicle time of motors on, microseconds; None before.
    """

    try_time_s: float
    crossed: tuple[str, ...]
    contacts: int
    settled: bool
    motors_on: bool
    began_us: int | None


class Judge(Protocol):
    """A referee, wherever it is.

    Attributes:
        source: by what it judges: "truth" or "telemetry".
    """

    source: str

    def see(self, moment: Moment) -> None:
        """Take a tick of the flight."""

    async def standing(self) -> Standing | None:
        """How the try stands now; None if it cannot be had."""

    async def report(self, mission_state: str, ended: str | None) -> dict[str, Any]:
        """The report, when the drone has come to rest."""
        ...


class TruthJudge:
    """Asks the simulator's referee, which sees the true state of every control tick.

    Should the simulator die, the verdict comes from the telemetry seen so far.

    Args:
        api: of the simulator.
        session: for asking.
        plan: of the flight, for the substitute.
        source: by what its referee judges, as it says itself.
    """

    def __init__(
        self, api: SimulatorApi, session: aiohttp.ClientSession, plan: FlightPlan, source: str = "truth"
    ) -> None:
        self.source = source
        self._api = api
        self._session = session
        self._substitute = TelemetryJudge(plan.new_referee())

    def see(self, moment: Moment) -> None:
        """The referee sees for itself; the substitute follows."""
        self._substitute.see(moment)

    async def standing(self) -> Standing | None:
        """Ask for the snapshot."""
        answer = await ask_referee(self._api, self._session)
        if answer is None:
            return None
        now = answer["snapshot"]
        return Standing(
            now["try_time_s"],
            tuple(now["crossed"]),
            now["contacts"],
            now["settled"],
            now["motors_on"],
            now["began_us"],
        )

    async def report(self, mission_state: str, ended: str | None) -> dict[str, Any]:
        """Ask for the report once the drone is at rest.

        A mission that finished has seen the motors stop; the referee's own link may tell it later. A flight
        that was broken off may go on, in hold, with the motors on: that is not waited for.
        """
        await self._settle(motors_stopped=ended is None)
        parameters = {"state": mission_state, **({"ended": ended} if ended else {})}
        answer = await ask_referee(self._api, self._session, parameters)
        if answer is None:
            self.source = self._substitute.source
            return await self._substitute.report(mission_state, ended)
        report: dict[str, Any] = answer["report"]
        return report

    async def _settle(self, *, motors_stopped: bool) -> None:
        """Wait until the referee sees the drone at rest, for 5 s of vehicle time at most.

        Args:
            motors_stopped: the motors are known to be off, whatever the referee has heard yet.
        """
        loop = asyncio.get_running_loop()
        began_us = newest_us = -1
        newest_s = loop.time()
        while (answer := await ask_referee(self._api, self._session)) is not None:
            now, time_us = answer["snapshot"], answer.get("time_us")
            time_us = time_us if isinstance(time_us, int) else 0
            if now["settled"] or now.get("over") or (now["motors_on"] and not motors_stopped):
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
        referee: is shown what telemetry tells.
    """

    source = "telemetry"

    def __init__(self, referee: Referee) -> None:
        self._referee = referee

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

    async def standing(self) -> Standing | None:
        """From the last tick."""
        now = self._referee.snapshot()
        return Standing(now.try_time_s, now.crossed, now.contacts, now.settled, now.motors_on, now.began_us)

    async def report(self, mission_state: str, ended: str | None) -> dict[str, Any]:
        """Judge what was seen."""
        return self._referee.report(mission_state, ended).as_dict()


async def ask_referee(
    api: SimulatorApi, session: aiohttp.ClientSession, parameters: dict[str, str] | None = None
) -> dict[str, Any] | None:
    """Get a simulator's `referee.json`; None if there is none."""
    import aiohttp

    timeout = aiohttp.ClientTimeout(total=_ANSWER_S)
    try:
        async with session.get(api.referee_url, params=parameters, timeout=timeout) as response:
            if response.status != 200:
                return None
            answer = await response.json()
    except (aiohttp.ClientError, TimeoutError, ValueError):
        return None
    return answer if isinstance(answer, dict) and "snapshot" in answer else None


async def choose_judge(
    plan: FlightPlan, api: SimulatorApi | None, session: aiohttp.ClientSession, *, named: bool = False
) -> tuple[Judge, FlightPlan]:
    """Take the referee of the simulator that flies, or judge by telemetry.

    Args:
        plan: of the flight; a simulator with another scenario cannot judge it.
        api: where the simulator may be; None: the drone is none.
        session: for asking.
        named: whether somebody said that a simulator is there; else it is not missed.

    Returns:
        The judge, and the plan with its frames as high as the simulator has them.

    Raises:
        SettingError: the simulator that was named does not judge this scenario.
    """
    answer = None if api is None else await ask_referee(api, session)
    flown = None if answer is None else answer.get("scenario")
    if api is not None and answer is not None and flown == plan.scenario.name:
        # The virtual camera's referee lives on telemetry, and says so.
        lift_m = answer.get("lift_m", 0.0)
        plan = plan.lifted(lift_m if isinstance(lift_m, int | float) else 0.0)
        return TruthJudge(api, session, plan, str(answer.get("source", "truth"))), plan
    if api is not None and named:
        raise SettingError(
            f"--simulator {api.url}: "
            + (
                "nothing there answers as a simulator; check the address, or leave it out"
                if answer is None
                else f"flies the scenario {flown}; start it with --scenario {plan.scenario.name}"
            )
        )
    return TelemetryJudge(plan.new_referee()), plan
