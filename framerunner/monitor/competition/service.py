"""The contest while the monitor runs: records tries, does what judges request, and notifies listeners."""

from __future__ import annotations

import asyncio
import logging
import os
import re
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from datetime import UTC, datetime
from random import Random, SystemRandom
from typing import TYPE_CHECKING, TypeVar

from sqlalchemy.exc import SQLAlchemyError

from framerunner.monitor.competition.calls import Entry
from framerunner.monitor.competition.database import Database, DatabaseError
from framerunner.monitor.competition.rules import TryScore, read_report
from framerunner.monitor.competition.store import Store
from framerunner.monitor.competition.validation import RefusedError, shown
from framerunner.monitor.competition.views import (
    Board,
    ChangedMessage,
    Message,
    RunningMessage,
    RunningView,
)
from framerunner.monitor.vehicle.tries import TryEvent
from scenarios.models import COLOURS

if TYPE_CHECKING:
    from framerunner.monitor.ports import Equipment

Answer = TypeVar("Answer")

_ANSWER_S = 15.0
_RETRY_S = 1.0
_MAX_REMEMBERED = 500
_NAME = re.compile(r"[a-z0-9][a-z0-9_-]{0,79}\Z")  # of a scenario; never a path
_log = logging.getLogger(__name__)


class CompetitionService:
    """Everything that changes the contest calls this. Used on the event loop on which `run` runs.

    All work on the database is done by one thread, so that a slow database delays no page.

    Args:
        url: of the database.
        equipment: with the scenarios.
        user: who this is, for the people of another monitor on the same database.
        now: the wall clock, UTC.
        random: draws the scenarios.

    Attributes:
        problem: what is wrong with the database, in one line; "" while it works.
        scenarios: names of those that can be drawn: they have all gates of the challenge.
    """

    def __init__(
        self,
        url: str,
        equipment: Equipment,
        user: str = "another monitor",
        now: Callable[[], datetime] = lambda: datetime.now(UTC),
        random: Random | None = None,
    ) -> None:
        self._url, self._user = url, f"{user} (process {os.getpid()})"
        self._equipment = equipment
        self._now = now
        self._random = random or SystemRandom()
        self._worker = ThreadPoolExecutor(1, thread_name_prefix="competition")
        self._store: Store | None = None
        self._board: Board | None = None
        self._events: deque[tuple[TryEvent, datetime]] = deque()
        self._latest: dict[str, tuple[TryEvent, datetime]] = {}
        self._arrived = asyncio.Event()
        self._opened = asyncio.Event()
        self._flying: dict[int, TryScore] = {}
        self._frames: dict[str, tuple[str, ...]] = {}
        self._listeners: set[Callable[[Message], None]] = set()
        self.problem = ""
        self.scenarios: tuple[str, ...] = ()

    async def board(self) -> Board:
        """The contest as last read; waits for the database to be opened. Raises `DatabaseError`."""
        if self._board is None:
            with suppress(TimeoutError):
                async with asyncio.timeout(_ANSWER_S):
                    await self._opened.wait()
        if self._board is None:
            raise DatabaseError("the contest's database is still being opened; try again in a moment")
        return self._board

    @property
    def running(self) -> tuple[RunningView, ...]:
        """The tries that are being flown."""
        tries = self._board.tries if self._board is not None else ()
        return tuple(
            RunningView.of(each, self._flying.get(each.id, each.referee))
            for each in tries
            if each.state == "running"
        )

    def subscribe(self, listener: Callable[[Message], None]) -> Callable[[], None]:
        """Notify a listener of changes.

        Args:
            listener: called on the loop with each message; must not block.

        Returns:
            Ends it.
        """
        self._listeners.add(listener)
        return lambda: self._listeners.discard(listener)

    def messages(self) -> list[Message]:
        """The present state as messages: "changed", then "running"."""
        version = self._board.version if self._board is not None else 0
        return [
            ChangedMessage(version=version, problem=self.problem),
            RunningMessage(tries=self.running),
        ]

    def on_try_event(self, event: TryEvent) -> None:
        """Queue an event of the fleet; `run` records it."""
        if event.kind == "running":
            self._latest[event.key] = (event, self._now())
        else:
            self._latest.pop(event.key, None)  # older than this
            self._events.append((event, self._now()))
        self._arrived.set()

    async def run(self) -> None:
        """Open the database and record the fleet's events, until cancelled.

        Raises:
            DatabaseError: it cannot be opened, in one line.
        """
        loop = asyncio.get_running_loop()
        try:
            database = await loop.run_in_executor(self._worker, Database, self._url, self._user)
            self._store = Store(database)
            interrupted = await loop.run_in_executor(self._worker, self._store.interrupt)
            if interrupted:
                _log.warning("tries that ran when the monitor was stopped: %d", interrupted)
            self.scenarios = await self._scenarios_to_draw()
            await self._refresh()
            self._opened.set()
            while True:
                await self._arrived.wait()
                await self._record_next()
        finally:
            if self._store is not None:
                self._worker.submit(self._store.close)
            self._worker.shutdown(wait=False)

    async def change(self, work: Callable[[Store], Answer]) -> Answer:
        """Let the store change something, and notify listeners once it is on the disk.

        Raises:
            RefusedError: the store refuses it.
            DatabaseError: the database does not answer.
        """
        answer = await self.read(work)
        try:
            await self._refresh()
        except (DatabaseError, SQLAlchemyError) as error:  # the change is on the disk all the same
            self._report_problem(error)
        return answer

    async def read(self, work: Callable[[Store], Answer]) -> Answer:
        """Let the store do something that changes nothing. Raises as `change` does."""
        store = self._store
        if store is None:
            await self.board()
            return await self.read(work)
        doing = asyncio.get_running_loop().run_in_executor(self._worker, work, store)
        try:
            async with asyncio.timeout(_ANSWER_S):
                return await asyncio.shield(doing)
        except TimeoutError as error:
            message = f"the database has not answered for {_ANSWER_S:.0f} s; check later what was kept"
            raise DatabaseError(message) from error

    async def draw(self, pool: Sequence[str], count: int, entry: Entry) -> int:
        """Draw scenarios at random, for the present round if it has no tries yet, else for the next.

        Returns:
            The round.

        Raises:
            RefusedError: a name is unknown, its scenario lacks a gate, or the pool holds too few.
        """
        names = list(dict.fromkeys(pool))
        if count > len(names):
            raise RefusedError(
                f"count {count} is more than the {len(names)} scenarios of the pool; tick more"
            )
        for name in names:
            await self.check_drawable(name)
        drawn = dict.fromkeys(self._random.sample(names, count), COLOURS)
        return await self.change(lambda store: store.draw(drawn, names, entry))

    async def check_drawable(self, scenario: str) -> None:
        """Raise `RefusedError` if a scenario is unknown or lacks a gate."""
        colours = await self.frames(scenario)
        if colours != COLOURS:
            has = f"only the {' and the '.join(colours)} frame" if colours else "no frames"
            raise RefusedError(
                f"scenario {shown(scenario)} cannot be drawn: it has {has}, a try needs a red, "
                "a green and a blue one; take it out of the pool"
            )

    async def frames(self, scenario: str) -> tuple[str, ...]:
        """Colours to cross in a scenario, in order. Raises `RefusedError` if it is unknown."""
        known = self._frames.get(scenario)
        if known is not None:
            return known
        given = self._equipment.scenario
        if given is None or given.name != scenario:
            if _NAME.match(scenario) is None:
                raise RefusedError(
                    f"scenario {shown(scenario)} is no name; use small letters, digits, - and _"
                )
            try:
                given = await asyncio.to_thread(self._equipment.load_scenario, scenario)
            except Exception as error:  # the loader is passed in, and its errors are not known here
                raise RefusedError(
                    f"scenario {shown(scenario)} is unknown; choose one of the list, LEVEL-SEED such as "
                    "calm-17, or put its file into the folder of --scenarios"
                ) from error
        colours = {frame.colour for frame in given.frames}
        frames = tuple(colour for colour in COLOURS if colour in colours)
        if len(self._frames) < _MAX_REMEMBERED:
            self._frames[scenario] = frames
        return frames

    def shuffled(self, teams: Sequence[int]) -> list[int]:
        """Teams in a random order."""
        return self._random.sample(teams, len(teams))

    def entry(self, who: str) -> Entry:
        """An entry by a judge, now."""
        return Entry(who, self._now())

    async def _scenarios_to_draw(self) -> tuple[str, ...]:
        names = []
        for name in await asyncio.to_thread(self._equipment.list_scenarios):
            with suppress(RefusedError):
                if await self.frames(name) == COLOURS:
                    names.append(name)
        return tuple(names)

    async def _record_next(self) -> None:
        """Record the oldest event. A beginning or end is tried until the database has it."""
        if self._events:
            event, at = self._events[0]
        elif self._latest:
            event, at = self._latest.pop(next(iter(self._latest)))
        else:
            self._arrived.clear()
            return
        try:
            frames = await self.frames(event.scenario)
        except RefusedError:
            frames = COLOURS  # the scenario's file is not known here; a try needs all gates
        fault: Exception | None = None
        try:
            try_id = await self.read(lambda store: store.take(event, frames, at))
        except (DatabaseError, SQLAlchemyError) as error:
            if event.kind != "running":
                self._report_problem(error)
                await asyncio.sleep(_RETRY_S)
            return
        except Exception as error:  # one faulty try must not end the contest
            _log.exception("a try could not be recorded")
            fault = error
        if event.kind != "running":
            self._events.popleft()
        if fault is None:
            await self._show(event, try_id, frames)
        else:
            self._report_problem(fault)

    async def _show(self, event: TryEvent, try_id: int, frames: Sequence[str]) -> None:
        if event.kind == "ended":
            self._flying.pop(try_id, None)
        else:
            self._flying[try_id] = read_report(event.report, frames)
        if event.kind == "running" and any(view.id == try_id for view in self.running):
            self._send(self.messages()[1])
        else:
            try:
                await self._refresh()
            except (DatabaseError, SQLAlchemyError) as error:
                self._report_problem(error)

    async def _refresh(self) -> None:
        """Read everything again and send that it changed."""
        board = await self.read(lambda store: store.board(self._equipment.scenario_argument))
        if self._board is None or board.version > self._board.version:
            self._board = board
        self.problem = ""
        for message in self.messages():
            self._send(message)

    def _report_problem(self, error: Exception) -> None:
        waiting = len(self._events)
        many = f"{waiting} changes of tries wait" if waiting != 1 else "one change of a try waits"
        self.problem = f"{error}; {many} to be written" if waiting else str(error)
        _log.error("%s", self.problem)
        self._send(self.messages()[0])

    def _send(self, message: Message) -> None:
        for listener in tuple(self._listeners):
            listener(message)
