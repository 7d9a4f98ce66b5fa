"""The control: who has the sticks, and what is done when the pilot falls silent."""

import asyncio
from contextlib import suppress

import pytest

from framerunner.monitor.manual_channel import ManualControls
from framerunner.monitor.manual_control import NEUTRAL, Browser, Clock, Control, ControlMessage, Order
from framerunner.monitor.vehicle.commands import Sticks
from tests.framerunner.monitor.manual_fakes import MISSION, FakeFleet

FORWARD = Sticks(0.5, 0.0, 0.0, 0.0)


class FakeTime:
    """Time that passes only when the test says so."""

    def __init__(self):
        self.now_s = 100.0
        self.sleepers = []

    def clock(self):
        return Clock(lambda: self.now_s, self.wait)

    async def wait(self, seconds):
        woken = asyncio.Event()
        self.sleepers.append((self.now_s + seconds, woken))
        await woken.wait()


class Game:
    """A controls with its drones, people and time."""

    def __init__(self):
        self.time = FakeTime()
        self.fleet = FakeFleet()
        self.controls = ManualControls(self.fleet, self.time.clock())
        self.told = {}

    def browser(self, name, may_judge=False):
        told = []
        browser = Browser(name, may_judge, told.append)
        self.told[name] = told
        self.controls._browsers.append(browser)  # without the watch: the test ticks
        return browser

    def control(self, number=1):
        return self.controls._controls[number]

    async def settle(self):
        for _ in range(10):
            await asyncio.sleep(0)

    async def pass_time(self, seconds, streaming=None, sticks=NEUTRAL):
        """Let time pass in steps of a twentieth of a second; a browser may stream meanwhile."""
        for _ in range(round(seconds / 0.05)):
            self.time.now_s += 0.05
            if streaming is not None:
                self.controls.sticks(streaming, sticks)
            for due in [each for each in self.time.sleepers if each[0] <= self.time.now_s + 1e-9]:
                self.time.sleepers.remove(due)
                due[1].set()
            await self.settle()
            self.controls.tick()
            await self.settle()

    async def order(self, browser, what, number=1, confirmed=False, streaming=True):
        task = asyncio.create_task(
            self.controls.do(browser, Order(id=number, what=what, confirmed=confirmed))
        )
        for _ in range(40):
            await self.settle()
            if task.done():
                break
            await self.pass_time(0.05, browser if streaming else None)
        return await task

    async def take(self, browser, **how):
        answer = await self.order(browser, "take", **how)
        assert answer.ok, answer.text

    def last_sticks(self, number=1):
        return [sticks for drone_id, sticks in self.fleet.sent if drone_id == number][-1]


@pytest.fixture
async def game():
    yield Game()
    for task in asyncio.all_tasks():
        if task is not asyncio.current_task():
            task.cancel()
            with suppress(asyncio.CancelledError):
                await task


async def test_taking_sends_neutral_sticks_before_it_requests_position_mode(game):
    ana = game.browser("Ana")
    task = asyncio.create_task(game.controls.do(ana, Order(id=1, what="take")))
    await game.pass_time(0.3, ana, FORWARD)
    assert game.fleet.orders == []
    assert game.fleet.sent and all(sticks == NEUTRAL for _, sticks in game.fleet.sent)
    await game.pass_time(0.2, ana)
    answer = await task
    assert answer.ok and "drone 1" in answer.text
    assert game.fleet.orders == ["position"]
    assert game.control().control is Control.ACTIVE
    assert game.fleet.pilots[1] == "Ana"


async def test_only_the_holder_s_sticks_reach_the_drone(game):
    ana, ben = game.browser("Ana"), game.browser("Ben")
    await game.take(ana)
    game.controls.sticks(ana, FORWARD)
    assert game.last_sticks() == FORWARD
    game.controls.sticks(ben, Sticks(-1.0, 0.0, 0.0, 0.0))
    assert game.last_sticks() == FORWARD


async def test_every_browser_is_told_who_has_the_sticks(game):
    ana, _ben = game.browser("Ana"), game.browser("Ben")
    await game.take(ana)
    mine, theirs = game.told["Ana"][-1], game.told["Ben"][-1]
    assert mine == ControlMessage(id=1, holder="Ana", yours=True, flying=True)
    assert theirs == ControlMessage(id=1, holder="Ana", yours=False, flying=True)


async def test_a_refusal_has_the_vehicle_s_reason_and_frees_the_seat(game):
    ana = game.browser("Ana")
    game.fleet.refuse["position"] = "Switching to Position is currently not available: no position"
    answer = await game.order(ana, "take")
    assert not answer.ok and answer.text == game.fleet.refuse["position"]
    assert game.control().holder is None and game.control().control is Control.NONE


async def test_silence_for_half_a_second_centres_the_sticks_and_requests_hold(game):
    ana = game.browser("Ana")
    await game.take(ana)
    await game.pass_time(1.0, ana, FORWARD)
    assert game.fleet.orders == ["position"]
    await game.pass_time(0.45)
    assert game.fleet.orders == ["position"] and game.last_sticks() == FORWARD
    await game.pass_time(0.1)
    assert game.fleet.orders == ["position", "hold"] and game.last_sticks() == NEUTRAL
    assert game.fleet.notices[0] == (
        1,
        "warning",
        "the pilot's page fell silent; drone 1 is told to hold",
    )
    assert game.fleet.notices[-1] == (1, "info", "drone 1 holds")


async def test_sticks_after_silence_are_not_sent(game):
    ana = game.browser("Ana")
    await game.take(ana)
    await game.pass_time(0.6)
    await game.pass_time(0.2, ana, FORWARD)
    assert game.last_sticks() == NEUTRAL
    assert game.told["Ana"][-1].yours and not game.told["Ana"][-1].flying
    await game.take(ana)
    game.controls.sticks(ana, FORWARD)
    assert game.last_sticks() == FORWARD


async def test_the_drone_holds_at_once_when_the_page_is_closed(game):
    ana = game.browser("Ana")
    await game.take(ana)
    game.controls.sticks(ana, FORWARD)
    game.controls.remove(ana)
    assert game.last_sticks() == NEUTRAL
    await game.settle()
    assert game.fleet.orders[-1] == "hold"
    assert game.fleet.pilots[1] == ""


async def test_hold_is_requested_until_the_drone_holds(game):
    ana = game.browser("Ana")
    await game.take(ana)
    game.fleet.refuse["hold"] = "drone 1 does not answer"
    await game.pass_time(2.7)
    assert game.fleet.orders.count("hold") == 3
    assert (1, "error", "drone 1 does not hold: drone 1 does not answer") in game.fleet.notices
    del game.fleet.refuse["hold"]
    await game.pass_time(1.1)
    assert game.control().control is Control.NONE and game.fleet.orders.count("hold") == 4


async def test_silence_does_not_interrupt_a_failsafe(game):
    ana = game.browser("Ana")
    await game.take(ana)
    game.fleet.status[1]["mode"] = "Return"
    await game.pass_time(1.0)
    assert "hold" not in game.fleet.orders and game.last_sticks() == NEUTRAL
    assert game.fleet.notices == [(1, "warning", "the pilot's page fell silent; drone 1 goes on by itself")]


async def test_the_drone_holds_when_the_page_is_closed_while_it_takes_the_sticks(game):
    ana = game.browser("Ana")
    game.fleet.gates["position"] = asyncio.Event()
    task = asyncio.create_task(game.controls.do(ana, Order(id=1, what="take")))
    await game.pass_time(0.5, ana)
    assert game.fleet.orders == ["position"]
    game.controls.remove(ana)
    await game.settle()
    assert game.fleet.orders == ["position", "hold"] and game.control().holder is None
    assert not (await task).ok


async def test_giving_back_resumes_the_waiting_mission(game):
    ana = game.browser("Ana")
    await game.take(ana)
    game.fleet.status[1]["mission"] = MISSION
    answer = await game.order(ana, "give")
    assert answer.ok and answer.text == "the mission frame_challenge goes on"
    assert game.fleet.orders == ["position", "offboard"] and game.control().holder is None


@pytest.mark.parametrize("mission", [None, MISSION | {"paused": False}, MISSION | {"alive": False}])
async def test_the_drone_holds_after_giving_back_without_a_waiting_mission(game, mission):
    ana = game.browser("Ana")
    await game.take(ana)
    game.fleet.status[1]["mission"] = mission
    answer = await game.order(ana, "give")
    assert answer.ok and answer.text == "no mission waits; drone 1 holds"
    assert game.fleet.orders == ["position", "hold"]


async def test_the_drone_holds_if_the_mission_cannot_go_on_and_the_answer_has_the_reason(game):
    ana = game.browser("Ana")
    await game.take(ana)
    game.fleet.status[1]["mission"] = MISSION
    game.fleet.refuse["offboard"] = "no setpoints"
    answer = await game.order(ana, "give")
    assert answer.text == "the mission frame_challenge cannot go on (no setpoints); drone 1 holds"


async def test_the_pilot_keeps_a_drone_that_does_not_hold(game):
    ana = game.browser("Ana")
    await game.take(ana)
    game.fleet.refuse["hold"] = "no answer"
    answer = await game.order(ana, "give")
    assert not answer.ok and "you still have the sticks" in answer.text
    game.controls.sticks(ana, FORWARD)
    assert game.last_sticks() == FORWARD


async def test_closing_the_page_does_not_interrupt_giving_back(game):
    ana = game.browser("Ana")
    await game.take(ana)
    game.fleet.status[1]["mission"] = MISSION
    game.fleet.gates["offboard"] = asyncio.Event()
    task = asyncio.create_task(game.controls.do(ana, Order(id=1, what="give")))
    await game.settle()
    game.controls.remove(ana)
    game.fleet.gates["offboard"].set()
    assert (await task).ok
    await game.pass_time(1.0)
    assert game.fleet.orders == ["position", "offboard"] and game.control().control is Control.NONE


async def test_neutral_sticks_go_on_until_the_drone_is_disarmed(game):
    ana = game.browser("Ana")
    await game.take(ana)
    assert (await game.order(ana, "give")).ok
    await game.pass_time(3.0)
    assert game.last_sticks() == NEUTRAL
    game.fleet.status[1]["armed"] = False
    game.fleet.status[1]["link"]["state"] = "lost"  # so its old status does not count
    await game.pass_time(0.2)
    assert game.last_sticks() == NEUTRAL
    game.fleet.status[1]["link"]["state"] = "live"
    await game.pass_time(0.1)
    assert game.last_sticks() is None and game.control().idle


async def test_a_taken_seat_is_refused_until_its_holder_was_silent_for_five_seconds(game):
    ana, ben = game.browser("Ana"), game.browser("Ben")
    await game.take(ana)
    answer = await game.order(ben, "take")
    assert not answer.ok and answer.text.startswith("Ana has the sticks")
    await game.pass_time(4.8)
    assert not (await game.order(ben, "take")).ok
    await game.pass_time(0.3)
    await game.take(ben)
    assert game.control().holder is ben
    game.controls.sticks(ana, FORWARD)
    assert game.last_sticks() == NEUTRAL


async def test_a_judge_takes_the_sticks_at_any_time_and_the_pilot_is_told(game):
    ana, judge = game.browser("Ana"), game.browser("Judge", may_judge=True)
    await game.take(ana)
    await game.pass_time(0.1, ana, FORWARD)
    await game.take(judge)
    assert game.control().holder is judge and game.last_sticks() == NEUTRAL
    assert not game.told["Ana"][-1].yours
    assert (1, "warning", "Judge took the sticks of drone 1 from Ana") in game.fleet.notices


async def test_orders_of_others_are_refused_while_somebody_flies(game):
    ana, ben = game.browser("Ana"), game.browser("Ben")
    await game.take(ana)
    for what in ("arm", "disarm", "take_off", "land", "hold", "give"):
        answer = await game.order(ben, what, streaming=False)
        assert not answer.ok and answer.text == "Ana has the sticks of drone 1"
        game.controls.sticks(ana, NEUTRAL)
    assert not (await game.order(ben, "stop_motors", confirmed=True)).ok
    assert game.fleet.orders == ["position"]


async def test_stopping_the_motors_needs_confirmation_and_does_not_wait(game):
    ana = game.browser("Ana")
    answer = await game.order(ana, "stop_motors")
    assert not answer.ok and "confirmed" in answer.text and game.fleet.orders == []
    game.fleet.gates["arm"] = asyncio.Event()
    waiting = asyncio.create_task(game.controls.do(ana, Order(id=1, what="arm")))
    await game.settle()
    assert (await game.order(ana, "stop_motors", confirmed=True)).ok
    assert game.fleet.orders == ["arm", "stop_motors"]
    assert (await waiting).text == "arm: another order came before the answer"


async def test_hold_replaces_the_present_order_and_others_wait(game):
    ana = game.browser("Ana")
    game.fleet.gates["position"] = asyncio.Event()
    taking = asyncio.create_task(game.controls.do(ana, Order(id=1, what="take")))
    await game.pass_time(0.5, ana)
    answer = await game.order(ana, "arm")
    assert not answer.ok and answer.text == "drone 1 has not answered to take yet"
    assert (await game.order(ana, "hold")).ok
    assert not (await taking).ok
    assert game.control().control is Control.NONE and game.control().holder is ana


async def test_after_hold_the_sticks_must_be_taken_again(game):
    ana = game.browser("Ana")
    await game.take(ana)
    assert (await game.order(ana, "hold")).ok
    await game.pass_time(0.1, ana, FORWARD)
    assert game.last_sticks() == NEUTRAL and game.control().holder is ana


async def test_after_a_take_off_the_sticks_control_the_drone_again(game):
    ana = game.browser("Ana")
    await game.take(ana)
    assert (await game.order(ana, "take_off")).ok
    await game.pass_time(2.0, ana, FORWARD)
    assert game.last_sticks() == NEUTRAL and game.fleet.orders == ["position", "take_off"]
    game.fleet.status[1]["mode"] = "Hold"
    await game.pass_time(0.6, ana, NEUTRAL)
    assert game.fleet.orders == ["position", "take_off", "position"]
    game.controls.sticks(ana, FORWARD)
    assert game.last_sticks() == FORWARD


async def test_silence_during_take_off_does_not_interrupt_it(game):
    ana = game.browser("Ana")
    await game.take(ana)
    assert (await game.order(ana, "take_off")).ok
    await game.pass_time(1.0)
    game.fleet.status[1]["mode"] = "Hold"
    await game.pass_time(1.0)
    assert game.fleet.orders == ["position", "take_off"]


async def test_one_browser_flies_one_drone(game):
    ana = game.browser("Ana")
    await game.take(ana)
    answer = await game.order(ana, "take", number=2)
    assert not answer.ok and answer.text == "you have the sticks of drone 1; give them back first"
    assert (await game.order(ana, "take", number=7)).text == "no drone 7 is heard"


async def test_the_seats_of_two_drones_are_independent(game):
    ana, ben = game.browser("Ana"), game.browser("Ben")
    await game.take(ana)
    await game.take(ben, number=2, streaming=True)
    assert game.last_sticks(2) == NEUTRAL
    game.controls.sticks(ben, FORWARD)
    assert game.last_sticks(2) == FORWARD and game.last_sticks(1) == NEUTRAL


async def test_a_fault_in_one_seat_does_not_affect_another(game, caplog):
    ana, ben = game.browser("Ana"), game.browser("Ben")
    await game.take(ana)
    await game.take(ben, number=2)
    game.control(1).tick = lambda: 1 / 0
    await game.pass_time(0.6)
    assert game.control(2).control is Control.NONE and game.fleet.orders[-1] == "hold"
    assert "the update of its manual control failed" in caplog.text


async def test_the_watch_runs_by_itself_while_a_browser_is_there():
    fleet, told = FakeFleet(), []
    controls = ManualControls(fleet)
    ana = Browser("Ana", False, told.append)
    controls.add(ana)
    loop = asyncio.get_running_loop()
    task = asyncio.create_task(controls.do(ana, Order(id=1, what="take")))
    while not task.done():
        controls.sticks(ana, NEUTRAL)
        await asyncio.sleep(0.02)
    silent_since_s = loop.time()
    async with asyncio.timeout(5.0):
        await fleet.held.wait()
    assert loop.time() - silent_since_s > 0.4
    controls.remove(ana)


def test_two_browsers_with_one_name_are_different():
    assert Browser("Ana") != Browser("Ana")
