"""The service on an event loop, with its database behind a thread."""

import asyncio
import threading
from contextlib import asynccontextmanager
from dataclasses import asdict
from random import Random

import pytest

from framerunner.monitor.competition.database import DatabaseError
from framerunner.monitor.competition.rules import Rule
from framerunner.monitor.competition.service import CompetitionService
from framerunner.monitor.competition.store import Store
from framerunner.monitor.competition.validation import RefusedError
from framerunner.monitor.competition.views import RuleView
from tests.framerunner.monitor.competition.harness import COLOURS, EQUIPMENT, event


async def until(holds, seconds=10.0):
    async with asyncio.timeout(seconds):
        while not holds():  # noqa: ASYNC110 - what it waits for has no event of its own
            await asyncio.sleep(0.005)


@asynccontextmanager
async def serving(url, **options):
    service = CompetitionService(url, EQUIPMENT, **options)
    task = asyncio.create_task(service.run())
    try:
        await until(lambda: service._board is not None or task.done())
        if task.done():
            task.result()
        yield service
    finally:
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)


@pytest.fixture
def url(tmp_path):
    return f"sqlite:///{tmp_path}/contest.db"


async def test_a_bad_database_ends_the_service_with_one_line():
    with pytest.raises(DatabaseError, match="not the URL of a database"):
        async with serving("no url"):
            pass


async def test_a_second_monitor_on_a_database_is_refused_and_interrupts_no_try(url):
    async with serving(url, user="the first") as first:
        first.on_try_event(event("began", "flying", time_s=0.0))
        await until(lambda: first.running)
        with pytest.raises(DatabaseError, match=r"the first \(process \d+\) uses it"):
            async with serving(url):
                pass
        assert [each.state for each in (await first.board()).tries] == ["running"]


async def test_requests_wait_until_the_database_is_open_but_not_for_ever(url, monkeypatch):
    service = CompetitionService(url, EQUIPMENT)
    early = asyncio.create_task(service.change(lambda store: store.board().rule))
    board = asyncio.create_task(service.board())
    work = asyncio.create_task(service.run())
    assert await early == RuleView(**asdict(Rule()), who="", at=None) and (await board).version > 0
    work.cancel()
    await asyncio.gather(work, return_exceptions=True)

    monkeypatch.setattr("framerunner.monitor.competition.service._ANSWER_S", 0.01)
    service = CompetitionService(url, EQUIPMENT)
    with pytest.raises(DatabaseError, match="being opened"):
        await service.board()
    with pytest.raises(DatabaseError, match="being opened"):
        await service.change(lambda store: store.board().rule)
    assert service.running == () and service.messages()[0].version == 0


@pytest.mark.parametrize("steps", range(6))
async def test_a_cancellation_is_kept_also_when_an_answer_comes_at_the_same_time(url, steps):
    async with serving(url) as service:
        may_answer, answered = threading.Event(), threading.Event()
        reading = asyncio.create_task(service.read(lambda _: may_answer.wait(10.0)))
        await asyncio.sleep(0.05)
        service._worker.submit(answered.set)
        may_answer.set()
        answered.wait(10.0)  # the event loop has the answer now, and has not begun to handle it
        for _ in range(steps):
            await asyncio.sleep(0.0)
        if reading.cancel():
            with pytest.raises(asyncio.CancelledError):
                await reading
        else:
            assert await reading


async def test_listeners_get_only_what_is_committed(url):
    async with serving(url) as service:
        seen = []

        def hear(message):
            if message.kind == "changed":
                other = Store(service._store._database)  # what another reader of the file finds now
                seen.append((message.version, [each.state for each in other.board().tries]))

        service.subscribe(hear)
        service.on_try_event(event("began", "k", time_s=0.0))
        await until(lambda: seen)
        service.on_try_event(event("ended", "k"))
        await until(lambda: len(seen) >= 2)
        assert [states for _, states in seen] == [["running"], ["ended"]]
        assert seen[0][0] < seen[1][0]


async def test_events_of_a_running_try_are_sent_without_reading_everything(url):
    async with serving(url) as service:
        heard = []
        service.subscribe(heard.append)
        service.on_try_event(event("began", "k", time_s=0.0))
        await until(lambda: service.running)
        version = service._board.version
        for time_s in (1.0, 2.0, 3.0):
            service.on_try_event(event("running", "k", time_s=time_s, crossed=("red",)))
            await until(lambda now=time_s: service.running[0].try_time_s == now)
        assert service._board.version == version
        assert [m.tries[0].try_time_s for m in heard if m.kind == "running"][-3:] == [1.0, 2.0, 3.0]
        assert service.running[0].crossed == ("red",)
        service.on_try_event(event("ended", "k"))
        await until(lambda: not service.running)


async def test_a_removed_listener_gets_no_messages(url):
    async with serving(url) as service:
        heard = []
        service.subscribe(heard.append)()
        service.on_try_event(event("ended", "k"))
        await until(lambda: service._board.tries)
        assert heard == []


async def test_a_slow_database_delays_no_page(url):
    async with serving(url) as service:
        free = threading.Event()
        blocked = asyncio.create_task(service.read(lambda _: free.wait(20)))
        await asyncio.sleep(0)
        started = asyncio.get_running_loop().time()
        for _ in range(100):
            assert service._board.tries == ()  # pages are answered from what was read before
            await asyncio.sleep(0)
        assert asyncio.get_running_loop().time() - started < 5.0 and not blocked.done()
        service.on_try_event(event("ended", "k"))
        free.set()
        await blocked
        await until(lambda: service._board.tries)


async def test_results_wait_for_a_database_that_is_unreachable(url, monkeypatch):
    monkeypatch.setattr("framerunner.monitor.competition.service._RETRY_S", 0.01)
    away = True
    take = Store.take

    def fail(self, *arguments):
        if away:
            raise DatabaseError("database x: connection refused")
        return take(self, *arguments)

    monkeypatch.setattr(Store, "take", fail)
    async with serving(url) as service:
        problems = []
        service.subscribe(lambda message: problems.append(getattr(message, "problem", None)))
        service.on_try_event(event("began", "k", time_s=0.0))
        service.on_try_event(event("running", "k", time_s=1.0))
        service.on_try_event(event("ended", "k"))
        await until(lambda: problems)
        assert "connection refused; 2 changes of tries wait" in service.problem
        away = False
        await until(lambda: service._board.tries and service._board.tries[0].judged)
        assert service.problem == ""


async def test_one_bad_try_does_not_end_the_contest(url, monkeypatch):
    take = Store.take
    monkeypatch.setattr(
        Store, "take", lambda self, told, *rest: 1 / 0 if told.key == "bad" else take(self, told, *rest)
    )
    async with serving(url) as service:
        service.on_try_event(event("ended", "bad"))
        service.on_try_event(event("ended", "good"))
        await until(lambda: service._board.tries)
        assert service._board.tries[0].judged


async def test_a_draw_takes_from_the_pool_and_each_can_be_first(url):
    async with serving(url, random=Random(1)) as service:
        pool = ["case-1", "case-2", "case-3", "calm-17"]
        first = set()
        for _ in range(15):
            await service.draw([*pool, "case-1"], 3, service.entry("Ada"))
            draw = service._board.draws[0]
            assert len(set(draw.scenarios)) == 3 and set(draw.scenarios) <= set(pool)
            assert draw.pool == tuple(pool) and draw.who == "Ada"
            first.add(draw.scenarios[0])
        assert first == set(pool)
        assert service._board.round == 1


@pytest.mark.parametrize(
    ("pool", "count", "words"),
    [
        (["case-1"], 2, "count 2 is more than the 1"),
        (["../secrets"], 1, "is no name"),
        (["nowhere"], 1, "unknown"),
        (["case-1", "no-frames"], 1, '"no-frames" cannot be drawn: it has no frames, .* take it out'),
        (["two-1", "case-1"], 1, '"two-1" cannot be drawn: it has only the red and the green frame'),
    ],
)
async def test_a_bad_draw_is_refused(url, pool, count, words):
    async with serving(url) as service:
        with pytest.raises(RefusedError, match=words):
            await service.draw(pool, count, service.entry("Ada"))
        assert service._board.draws == ()


async def test_scenarios_with_all_gates_can_be_drawn(url):
    async with serving(url) as service:
        assert service.scenarios == ("case-1", "case-2", "case-3", "case-4")


async def test_shuffling_can_give_every_order(url):
    async with serving(url, random=Random(1)) as service:
        orders = {tuple(service.shuffled([1, 2, 3])) for _ in range(100)}
        assert len(orders) == 6 and all(sorted(order) == [1, 2, 3] for order in orders)


async def test_gates_are_those_of_the_scenario_or_all(url):
    async with serving(url) as service:
        for key, name in (("a", "two-1"), ("b", "unknown"), ("c", "../x"), ("d", "")):
            service.on_try_event(event("ended", key, name))
        await until(lambda: len(service._board.tries) == 4)
        frames = {each.scenario: each.frames for each in service._board.tries}
        assert frames == {"two-1": COLOURS[:2], "unknown": COLOURS, "../x": COLOURS, "": COLOURS}
