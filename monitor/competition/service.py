"""The contest while the monitor runs: hears of tries, does what judges ask, and tells who watches."""

from __future__ import annotations

import asyncio
import logging
import re
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from datetime import UTC, datetime
from random import Random, SystemRandom
from typing import TYPE_CHECKING, Any, TypeVar

from sqlalchemy.exc import SQLAlchemyError

from monitor.competition.calls import Entry
from monitor.competition.database import Database, DatabaseError
from monitor.competition.rules import TryScore, read_report
from monitor.competition.store import Store
from monitor.competition.views import Board, RunningView
from monitor.competition.words import Refused, shown
from monitor.vehicle.tries import TryEvent
from scenarios.models import COLOURS

if TYPE_CHECKING:
    from monitor.ports import Equipment

Answer = TypeVar("Answer")
Message = dict[str, Any]

_ANSWER_S = 15.0
_AGAIN_S = 1.0
_MOST_REMEMBERED = 500
_NAME = re.compile(r"[a-z0-9][a-z0-9_-]{0,79}\Z")  # of a scenario; never a path
_log = logging.getLogger(__name__)


class CompetitionService:
    """The one place through which the contest changes. Belongs to the loop on which `run` runs.

    All work on the database is done by one thread, so that a slow one stalls no page.

    Args:
        url: of the database.
        equipment: knows the scenarios.
        now: the wall clock, UTC.
        random: draws the scenarios.
    """

    def __init__(
        self,
        url: str,
        equipment: Equipment,
        now: Callable[[], datetime] = lambda: datetime.now(UTC),
        random: Random | None = None,
    ) -> None:
        self._url = url
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
                await asyncio.wait_for(self._opened.wait(), _ANSWER_S)
        if self._board is None:
            raise DatabaseError("the contest's database is still being opened; try again in a moment")
        return self._board

    @property
    def running(self) -> tuple[RunningView, ...]:
        """The tries that are being flown."""
        if self._board is None:
            return ()
        views = []
        for each in self._board.tries:
            if each.state == "running":
                now = self._flying.get(each.id)
                views.append(
                    RunningView(
                        id=each.id,
                        team=each.team,
                        team_name=each.team_name,
                        scenario=each.scenario,
                        barrier=each.barrier,
                        drone_id=each.drone_id,
                        frames=each.frames,
                        crossed=now.crossed if now is not None else each.referee.crossed,
                        contacts=now.contacts if now is not None else each.referee.contacts,
                        penalty_s=now.penalty_s if now is not None else each.referee.penalty_s,
                        try_time_s=now.try_time_s if now is not None else each.referee.try_time_s,
                    )
                )
        return tuple(views)

    @property
    def listeners(self) -> int:
        """How many listen."""
        return len(self._listeners)

    def subscribe(self, hear: Callable[[Message], None]) -> Callable[[], None]:
        """Hear of changes.

        Args:
            hear: called on the loop with {"kind": "changed", "version", "problem"} or {"kind": "running",
                "tries"}; must not block.

        Returns:
            Ends it.
        """
        self._listeners.add(hear)
        return lambda: self._listeners.discard(hear)

    def news(self) -> list[Message]:
        """What a new listener is told first."""
        version = self._board.version if self._board is not None else 0
        running = [view.model_dump() for view in self.running]
        return [
            {"kind": "changed", "version": version, "problem": self.problem},
            {"kind": "running", "tries": running},
        ]

    def hear(self, event: TryEvent) -> None:
        """Take what the fleet tells of a try; it is written down in its turn."""
        if event.kind == "running":
            self._latest[event.key] = (event, self._now())
        else:
            self._latest.pop(event.key, None)  # older than this
            self._events.append((event, self._now()))
        self._arrived.set()

    async def run(self) -> None:
        """Open the database and write down what is heard, until cancelled.

        Raises:
            DatabaseError: it cannot be opened, in one line.
        """
        loop = asyncio.get_running_loop()
        try:
            database = await loop.run_in_executor(self._worker, Database, self._url)
            self._store = Store(database)
            interrupted = await loop.run_in_executor(self._worker, self._store.interrupt)
            if interrupted:
                _log.warning("tries that ran when the monitor was stopped: %d", interrupted)
            self.scenarios = await self._scenarios_to_draw()
            await self._refresh()
            self._opened.set()
            while True:
                await self._arrived.wait()
                await self._write_next()
        finally:
            if self._store is not None:
                self._worker.submit(self._store.close)
            self._worker.shutdown(wait=False)

    async def change(self, work: Callable[[Store], Answer]) -> Answer:
        """Have the store do something, and tell everybody once it is on the disk.

        Raises:
            Refused: the store refuses it.
            DatabaseError: the database does not answer.
        """
        answer = await self.read(work)
        try:
            await self._refresh()
        except (DatabaseError, SQLAlchemyError) as error:  # what was asked for is kept all the same
            self._tell_problem(error)
        return answer

    async def read(self, work: Callable[[Store], Answer]) -> Answer:
        """Have the store do something that changes nothing. Raises as `change` does."""
        store = self._store
        if store is None:
            await self.board()
            return await self.read(work)
        doing = asyncio.get_running_loop().run_in_executor(self._worker, work, store)
        try:
            return await asyncio.wait_for(asyncio.shield(doing), _ANSWER_S)
        except TimeoutError as error:
            raise DatabaseError(
                f"the database has not answered for {_ANSWER_S:.0f} s; look later whether it was kept"
            ) from error

    async def draw(self, pool: Sequence[str], count: int, who: str) -> int:
        """Draw scenarios at random, for the present round if nobody has flown in it, else for the next.

        Args:
            pool: names to draw from.
            count: how many.
            who: asks for it.

        Returns:
            The round.

        Raises:
            Refused: a name is unknown, its scenario lacks a frame, or the pool holds too few.
        """
        names = list(dict.fromkeys(pool))
        if count > len(names):
            raise Refused(f"count {count} is more than the {len(names)} scenarios of the pool; tick more")
        frames = {name: await self.frames(name) for name in names}
        for name, colours in frames.items():
            if colours != COLOURS:
                raise Refused(
                    f"scenario {shown(name)} cannot be drawn: it has {_listed(colours)}, a try needs a red, "
                    "a green and a blue one; take it out of the pool"
                )
        drawn = {name: frames[name] for name in self._random.sample(names, count)}
        entry = Entry(who, self._now())
        return await self.change(lambda store: store.draw(drawn, names, entry))

    async def frames(self, scenario: str) -> tuple[str, ...]:
        """Colours to cross in a scenario, in order. Raises `Refused` if it is unknown."""
        known = self._frames.get(scenario)
        if known is not None:
            return known
        given = self._equipment.scenario
        if given is None or given.name != scenario:
            if _NAME.match(scenario) is None:
                raise Refused(f"scenario {shown(scenario)} is no name; use small letters, digits, - and _")
            try:
                given = await asyncio.to_thread(self._equipment.load_scenario, scenario)
            except Exception as error:  # the loader is handed in; it has errors of its own
                raise Refused(f"scenario {shown(scenario)} is unknown; choose one of the list") from error
        colours = {frame.colour for frame in given.frames}
        frames = tuple(colour for colour in COLOURS if colour in colours)
        if len(self._frames) < _MOST_REMEMBERED:
            self._frames[scenario] = frames
        return frames

    def shuffled(self, teams: Sequence[int]) -> list[int]:
        """Teams in a random order."""
        return self._random.sample(teams, len(teams))

    async def _scenarios_to_draw(self) -> tuple[str, ...]:
        """Names of the scenarios that have all frames of the challenge."""
        names = []
        for name in await asyncio.to_thread(self._equipment.list_scenarios):
            with suppress(Refused):
                if await self.frames(name) == COLOURS:
                    names.append(name)
        return tuple(names)

    def entry(self, who: str) -> Entry:
        """Somebody, now."""
        return Entry(who, self._now())

    async def _write_next(self) -> None:
        """Write down the oldest thing heard. A beginning or end is tried until the database has it."""
        if self._events:
            event, at = self._events[0]
        elif self._latest:
            event, at = self._latest.pop(next(iter(self._latest)))
        else:
            self._arrived.clear()
            return
        try:
            frames = await self.frames(event.scenario)
        except Refused:
            frames = COLOURS  # of a file of its own; what the rule asks for
        try:
            try_id = await self.read(lambda store: store.take(event, frames, at))
        except (DatabaseError, SQLAlchemyError) as error:
            if event.kind == "running":
                return
            self._tell_problem(error)
            await asyncio.sleep(_AGAIN_S)
            return
        except Exception as error:  # a fault of ours in one try must not end the contest
            _log.exception("a try could not be written down")
            self._drop(event)
            self._tell_problem(error)
            return
        self._drop(event)
        await self._show(event, try_id, frames)

    def _drop(self, event: TryEvent) -> None:
        if event.kind != "running":
            self._events.popleft()

    async def _show(self, event: TryEvent, try_id: int, frames: Sequence[str]) -> None:
        if event.kind == "ended":
            self._flying.pop(try_id, None)
        else:
            self._flying[try_id] = read_report(event.report, frames)
        if event.kind == "running" and any(view.id == try_id for view in self.running):
            self._tell(self.news()[1])
        else:
            try:
                await self._refresh()
            except (DatabaseError, SQLAlchemyError) as error:
                self._tell_problem(error)

    async def _refresh(self) -> None:
        """Read everything anew and tell that it changed."""
        board = await self.read(lambda store: store.board())
        if self._board is None or board.version > self._board.version:
            self._board = board
        self.problem = ""
        for message in self.news():
            self._tell(message)

    def _tell_problem(self, error: Exception) -> None:
        waiting = len(self._events)
        many = f"{waiting} changes of tries wait" if waiting != 1 else "one change of a try waits"
        self.problem = f"{error}; {many} to be written" if waiting else str(error)
        _log.error("%s", self.problem)
        self._tell(self.news()[0])

    def _tell(self, message: Message) -> None:
        for hear in tuple(self._listeners):
            hear(message)


def _listed(colours: Sequence[str]) -> str:
    """Frames of a scenario in words."""
    return "no frames" if not colours else f"only the {' and the '.join(colours)} frame"
