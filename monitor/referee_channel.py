"""A drone's referee and scenario over HTTP, beside its video; what comes from there is not trusted."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable
from typing import Any

import aiohttp
from pydantic import ValidationError

from scenarios.models import Scenario
from scenarios.result import Standing, first_error
from wire.simulator_api import SimulatorApi

_PERIOD_S = 0.2
_LONGEST_PAUSE_S = 5.0
_TIMEOUT = aiohttp.ClientTimeout(total=2.0)
_MOST_BYTES = 1_000_000

Say = Callable[[str, str], None]


class _NotThereError(Exception):
    """Nothing usable was answered; the message says what."""


class RefereeChannel:
    """Asks one drone's referee, five times a second while it answers.

    Args:
        api: of the simulator or virtual camera whose video the drone tells of.
        hear: called with each answer.
        say: called with level and one line for people.

    Attributes:
        scenario: what is flown there; None until it is known.
        lift_m: how much higher the frames hang than the scenario says.
        source: what the referee sees by; "" before its first answer.
    """

    def __init__(self, api: SimulatorApi, hear: Callable[[Standing], None], say: Say) -> None:
        self._api = api
        self._hear = hear
        self._say = say
        self._complaint = ""
        self.scenario: Scenario | None = None
        self._asked_for: str | None = None
        self.lift_m = 0.0
        self.source = ""

    async def run(self) -> None:
        """Ask until cancelled."""
        jar = aiohttp.DummyCookieJar()
        async with aiohttp.ClientSession(timeout=_TIMEOUT, cookie_jar=jar, auto_decompress=False) as session:
            pause_s = _PERIOD_S
            while True:
                try:
                    await self._ask(session)
                    pause_s = _PERIOD_S
                except _NotThereError:
                    pause_s = min(2 * pause_s, _LONGEST_PAUSE_S)
                await asyncio.sleep(pause_s)

    async def _ask(self, session: aiohttp.ClientSession) -> None:
        content = await _fetch(session, self._api.referee_url)
        try:
            answer = Standing.model_validate(content)
        except ValidationError as error:
            self._complain(f"{self._api.referee_url}: {first_error(error)}")
            raise _NotThereError from None
        self.lift_m, self.source = answer.lift_m, answer.source
        if answer.scenario != self._asked_for:
            await self._ask_scenario(session, answer.scenario)
        self._hear(answer)

    async def _ask_scenario(self, session: aiohttp.ClientSession, name: str) -> None:
        """Get what is flown there, once for each name; a referee without it is still a referee."""
        self.scenario = None
        try:
            content = await _fetch(session, self._api.scenario_url)
            scenario = Scenario.model_validate(content)
        except _NotThereError as error:
            self._complain(f"{self._api.scenario_url}: {error}; the arena cannot be drawn")
            self._asked_for = name
            return
        except ValidationError as error:
            self._complain(f"{self._api.scenario_url}: {first_error(error)}; the arena cannot be drawn")
            self._asked_for = name
            return
        if scenario.name == name:  # else it changed in between: ask again
            self.scenario, self._asked_for = scenario, name

    def _complain(self, line: str) -> None:
        if line != self._complaint:
            self._complaint = line
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
                if len(data) > _MOST_BYTES:
                    raise _NotThereError(f"it is longer than {_MOST_BYTES} bytes")
        return json.loads(data)
    except (aiohttp.ClientError, TimeoutError, ValueError, RecursionError, OSError) as error:
        raise _NotThereError(str(error) or type(error).__name__) from None
