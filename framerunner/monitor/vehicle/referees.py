"""A vehicle's referees: its own over HTTP, whose answers are not trusted, and the monitor's on telemetry."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable
from typing import Any

import aiohttp
from pydantic import ValidationError

from framerunner.monitor.ports import Equipment, RefereePort
from framerunner.wire.simulator_api import SimulatorApi
from scenarios.models import Scenario, ScenarioError, TrueState
from scenarios.result import Standing, first_error
from scenarios.task import Task, layout_mark

_PERIOD_S = 0.2
_MAX_PAUSE_S = 5.0
_TIMEOUT = aiohttp.ClientTimeout(total=2.0)
_MAX_BYTES = 1_000_000

Say = Callable[[str, str], None]


class _NotThereError(Exception):
    """No usable answer; the message says what is wrong."""


def scenario_of(task: Task, equipment: Equipment) -> Scenario:
    """The scenario of a task, with its layout, which a simulator tells only for training. Blocks.

    Raises:
        ScenarioError: it is not known here; the message is one line for people.
    """
    if task.scenario is not None:
        return task.scenario
    advice = "give its file to framerunner monitor --scenarios, or start the simulator with --show-layout"
    found = equipment.scenario
    if found is None or found.name != task.name:
        try:
            found = equipment.load_scenario(task.name)
        except ScenarioError:
            raise ScenarioError(f"scenario '{task.name}' is not known here; {advice}") from None
    if layout_mark(found) != task.layout_mark:
        raise ScenarioError(f"scenario '{task.name}' has another layout here; {advice}")
    told = Task.model_fields.keys() & Scenario.model_fields
    return found.model_copy(update={name: getattr(task, name) for name in told})


class RefereeChannel:
    """Requests `/referee.json` five times a second while it is answered, and each scenario once.

    Args:
        api: of the simulator or virtual camera that serves the vehicle's video.
        take: called with each answer.
        say: called with level and one line for people.
        find: the scenario of a task, as `scenario_of`; called in a thread.

    Attributes:
        scenario: what is flown there; None until it is known.
        lift_m: how much higher the gates hang than the scenario says.
    """

    def __init__(
        self,
        api: SimulatorApi,
        take: Callable[[Standing], None],
        say: Say,
        find: Callable[[Task], Scenario],
    ) -> None:
        self._api = api
        self._find = find
        self._take = take
        self._say = say
        self._problem = ""
        self._requested: str | None = None  # name of the scenario
        self.scenario: Scenario | None = None
        self.lift_m = 0.0

    async def run(self) -> None:
        """Request until cancelled."""
        jar = aiohttp.DummyCookieJar()
        async with aiohttp.ClientSession(timeout=_TIMEOUT, cookie_jar=jar, auto_decompress=False) as session:
            pause_s = _PERIOD_S
            while True:
                try:
                    await self._request(session)
                    pause_s = _PERIOD_S
                except _NotThereError:
                    pause_s = min(2 * pause_s, _MAX_PAUSE_S)
                await asyncio.sleep(pause_s)

    async def _request(self, session: aiohttp.ClientSession) -> None:
        content = await _fetch(session, self._api.referee_url)
        try:
            answer = Standing.model_validate(content)
        except ValidationError as error:
            self._warn(f"{self._api.referee_url}: {first_error(error)}")
            raise _NotThereError from None
        self.lift_m = answer.lift_m
        if answer.scenario != self._requested:
            await self._request_scenario(session, answer.scenario)
        self._take(answer)

    async def _request_scenario(self, session: aiohttp.ClientSession, name: str) -> None:
        """Get what is flown there; the referee's answers count even if that fails."""
        self.scenario = None
        try:
            task = Task.model_validate(await _fetch(session, self._api.scenario_url))
            if task.name != name:
                return  # it changed between the two answers: request it again
            self.scenario = await asyncio.to_thread(self._find, task)
        except (_NotThereError, ScenarioError, ValidationError) as error:
            reason = first_error(error) if isinstance(error, ValidationError) else error
            self._warn(f"{self._api.scenario_url}: {reason}; the arena cannot be drawn")
        self._requested = name

    def _warn(self, line: str) -> None:
        if line != self._problem:
            self._problem = line
            self._say("warning", line)


async def _fetch(session: aiohttp.ClientSession, url: str) -> Any:  # noqa: ANN401 - any JSON
    """Get a JSON document of at most 1 MB. Raises `_NotThereError`."""
    headers = {"Accept-Encoding": "identity"}
    try:
        async with session.get(url, allow_redirects=False, headers=headers) as response:
            if response.status != 200:
                raise _NotThereError(f"it answers with status {response.status}")
            data = bytearray()
            async for part in response.content.iter_chunked(1 << 16):
                data += part
                if len(data) > _MAX_BYTES:
                    raise _NotThereError(f"it is longer than {_MAX_BYTES} bytes")
        return json.loads(data)
    except (aiohttp.ClientError, TimeoutError, ValueError, RecursionError, OSError) as error:
        raise _NotThereError(str(error) or type(error).__name__) from None


class TelemetryReferee:
    """The monitor's own referee, for a vehicle without one: follows telemetry and detects no contacts.

    Args:
        scenario: what is flown.
        make_referee: makes a referee for one try.
    """

    def __init__(self, scenario: Scenario, make_referee: Callable[[Scenario], RefereePort]) -> None:
        self._scenario = scenario
        self._make = make_referee
        self._referee = make_referee(scenario)
        self._motors_on = False
        self._has_state = False

    def follow(self, state: TrueState) -> None:
        """Take a state; when the motors come on after a try is over, the next one begins."""
        if state.motors_on and not self._motors_on and self._referee.snapshot().over:
            self._referee = self._make(self._scenario)
        self._motors_on = state.motors_on
        self._has_state = True
        self._referee.update(state)

    def standing(self) -> Standing | None:
        """How the try stands; None before the first state."""
        if not self._has_state:
            return None
        return Standing(
            scenario=self._scenario.name,
            source="telemetry",
            snapshot=self._referee.snapshot(),
            report=self._referee.report(),
        )
