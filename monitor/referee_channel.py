"""A drone's referee and scenario over HTTP, beside its video; what comes from there is not trusted."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable
from typing import Annotated, Any
from urllib.parse import urlsplit, urlunsplit

import aiohttp
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from monitor.standing import Standing
from monitor.vehicle.mission import first_error
from scenarios.models import Scenario
from scenarios.report import RefereeSnapshot

_PERIOD_S = 0.2
_LONGEST_PAUSE_S = 5.0
_TIMEOUT = aiohttp.ClientTimeout(total=2.0)
_MOST_BYTES = 1_000_000

Finite = Annotated[float, Field(allow_inf_nan=False, ge=-1e9, le=1e9)]
Word = Annotated[str, Field(max_length=200)]
Say = Callable[[str, str], None]


class _Told(BaseModel):
    model_config = ConfigDict(extra="ignore", frozen=True, allow_inf_nan=False)


class _Snapshot(_Told):
    began_us: int | None
    try_time_s: Finite
    penalty_s: Finite
    crossed: list[Word] = Field(max_length=10)
    next_colour: Word | None
    contacts: int
    inside: bool
    motors_on: bool
    settled: bool
    over: bool


class _Report(_Told):
    model_config = ConfigDict(extra="allow", frozen=True, allow_inf_nan=False)

    verdict: Word
    reason: str = Field("", max_length=2000)
    frames_crossed: list[Word] = Field([], max_length=10)
    crossing_times_s: list[Finite] = Field([], max_length=10)
    contacts: int = 0
    try_time_s: Finite = 0.0
    penalty_s: Finite = 0.0
    total_time_s: Finite = 0.0


class LocalFrame(_Told):
    """Where in the arena the vehicle's local frame lies."""

    origin_arena_m: tuple[Finite, Finite, Finite]
    yaw_rad: Finite = 0.0


class RefereeAnswer(_Told):
    """What `/referee.json` says."""

    scenario: str = Field(max_length=80)
    source: str = Field("truth", max_length=40)
    lift_m: Finite = 0.0
    time_us: int | None = None
    snapshot: _Snapshot
    report: _Report
    local_frame: LocalFrame | None = None

    def standing(self) -> Standing:
        """How the try stands."""
        told = self.snapshot.model_dump()
        told["crossed"] = tuple(told["crossed"])
        return Standing(self.scenario, self.source, RefereeSnapshot(**told), self.report.model_dump())


class _NotThereError(Exception):
    """Nothing usable was answered; the message says what."""


class RefereeChannel:
    """Asks one drone's referee, five times a second while it answers.

    Args:
        video_url: of the drone's video; the referee is at the same host and port.
        hear: called with each answer.
        say: called with level and one line for people.

    Attributes:
        scenario: what is flown there; None until it is known.
        lift_m: how much higher the frames hang than the scenario says.
        source: what the referee sees by; "" before its first answer.
    """

    def __init__(self, video_url: str, hear: Callable[[RefereeAnswer], None], say: Say) -> None:
        parts = urlsplit(video_url)
        self._referee_url = urlunsplit((parts.scheme, parts.netloc, "/referee.json", "", ""))
        self._scenario_url = urlunsplit((parts.scheme, parts.netloc, "/scenario.json", "", ""))
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
        content = await _fetch(session, self._referee_url)
        try:
            answer = RefereeAnswer.model_validate(content)
        except ValidationError as error:
            self._complain(f"{self._referee_url}: {first_error(error)}")
            raise _NotThereError from None
        self.lift_m, self.source = answer.lift_m, answer.source
        if answer.scenario != self._asked_for:
            await self._ask_scenario(session, answer.scenario)
        self._hear(answer)

    async def _ask_scenario(self, session: aiohttp.ClientSession, name: str) -> None:
        """Get what is flown there, once for each name; a referee without it is still a referee."""
        self.scenario = None
        try:
            content = await _fetch(session, self._scenario_url)
            scenario = Scenario.model_validate(content)
        except _NotThereError as error:
            self._complain(f"{self._scenario_url}: {error}; the arena cannot be drawn")
            self._asked_for = name
            return
        except ValidationError as error:
            self._complain(f"{self._scenario_url}: {first_error(error)}; the arena cannot be drawn")
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
