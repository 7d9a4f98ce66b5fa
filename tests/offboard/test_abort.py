"""An operator's stops while a drone is brought down, with a fake of the drone that is slow to answer."""

import asyncio

from offboard.abort import FlightAbort
from offboard.drone import DroneError, DroneState
from offboard.safety.operator import Operator
from offboard.safety.rules import SafetyRules
from tests.waiting import until


class SlowDrone:
    """Lands for ever; `lost` requests to stop its motors have no effect."""

    def __init__(self, lost=0):
        self.calls = []
        self.landing = asyncio.Event()
        self.ends = asyncio.Event()
        self.lost = lost

    async def land_now(self, *, demanded=False):
        self.calls.append("land")
        self.landing.set()
        try:
            await asyncio.Event().wait()
        finally:
            self.ends.set()
            await asyncio.sleep(0.05)  # what the adapter may wait for when it is cancelled

    async def motors_off(self):
        self.calls.append("motors off")
        self.lost -= 1
        if self.lost >= 0:
            raise DroneError("was refused: TIMEOUT")


class HoveringDrone:
    """Holds; its link is lost and comes back, then it has states; `lost` as above."""

    def __init__(self, lost=0):
        self.calls = []
        self.losses = 2
        self.lost = lost
        self.armed = True

    async def hold(self):
        self.calls.append("hold")

    async def land_now(self, *, demanded=False):
        self.calls.append("land")

    async def motors_off(self):
        self.calls.append("motors off")
        self.lost -= 1
        if self.lost >= 0:
            raise DroneError("was refused: TIMEOUT")

    async def ticks(self):
        self.losses -= 1
        if self.losses >= 0:
            raise DroneError("link lost")
        while True:
            yield DroneState(0, 0.0, 0.0, 1.0, 0.0, armed=self.armed)
            await asyncio.sleep(0.01)


def bringing_down(drone, rules):
    """The task that brings a drone down, and what is set when it has seen a state."""
    seen = asyncio.Event()
    return asyncio.create_task(FlightAbort(drone, rules, lambda state: seen.set()).bring_down()), seen


async def stopped_twice(drone, operator, again=0):
    work, _ = bringing_down(drone, SafetyRules("land", operator))
    await drone.landing.wait()
    drone.landing.clear()
    operator.demand_landing()
    await drone.ends.wait()
    operator.demand_motors_off()
    async with asyncio.timeout(2.0):
        for number in range(again):
            await until(lambda: drone.calls == ["land"] + (number + 1) * [*3 * ["motors off"], "land"])  # noqa: B023 - awaited here
            operator.demand_motors_off()
        return await work


async def test_a_second_stop_counts_while_the_first_one_takes_effect():
    drone = SlowDrone()
    assert await stopped_twice(drone, Operator(needs_go=False)) == "the operator stopped the motors"
    assert drone.calls[-1] == "motors off"


async def test_a_stop_of_the_motors_that_is_lost_is_repeated():
    drone = SlowDrone(lost=2)
    assert await stopped_twice(drone, Operator(needs_go=False)) == "the operator stopped the motors"
    assert drone.calls.count("motors off") == 3


async def test_a_stop_of_the_motors_that_has_failed_is_requested_again_when_it_is_demanded_again(caplog):
    drone, operator = SlowDrone(lost=7), Operator(needs_go=False)
    assert await stopped_twice(drone, operator, again=2) == "the operator stopped the motors"
    assert drone.calls.count("motors off") == 8
    assert caplog.messages.count("stopping the motors: was refused: TIMEOUT; K requests it again") == 2
    assert operator.phase == "motors stopped"


async def test_motors_that_do_not_stop_are_told_when_the_drone_has_landed():
    drone, operator = HoveringDrone(lost=3), Operator(needs_go=False)
    work, seen = bringing_down(drone, SafetyRules("land", operator))
    async with asyncio.timeout(2.0):
        await seen.wait()
        operator.demand_landing()
        operator.demand_motors_off()
        await until(lambda: drone.calls[-1] == "land" and "motors off" in drone.calls)
        drone.armed = False
        assert await work == "stopping the motors: was refused: TIMEOUT"


async def test_a_landing_is_requested_again_when_it_is_demanded_again():
    drone, operator = HoveringDrone(), Operator(needs_go=False)
    work, seen = bringing_down(drone, SafetyRules("hold", operator))
    async with asyncio.timeout(2.0):
        for _ in range(3):
            await seen.wait()
            seen.clear()
            operator.demand_landing()
            await asyncio.sleep(0.05)
        drone.armed = False
        assert await work == ""
    assert drone.calls == ["hold", "land", "land", "land"]


async def test_a_landing_that_is_under_way_is_not_interrupted_by_the_same_demand():
    drone, operator = SlowDrone(), Operator(needs_go=False)
    work, _ = bringing_down(drone, SafetyRules("hold", operator))
    operator.demand_landing()
    await drone.landing.wait()
    for _ in range(3):
        operator.demand_landing()
        await asyncio.sleep(0.01)
    assert drone.calls == ["land"]
    work.cancel()  # Ctrl-C still ends it
    async with asyncio.timeout(2.0):
        assert await asyncio.gather(work, return_exceptions=True) != [""]
    assert work.cancelled()


async def test_stops_act_after_a_link_that_was_lost_has_come_back():
    drone, operator = HoveringDrone(), Operator(needs_go=False)
    work, seen = bringing_down(drone, SafetyRules("hold", operator))
    async with asyncio.timeout(2.0):
        for demand in (operator.demand_landing, operator.demand_motors_off):
            await seen.wait()
            seen.clear()
            demand()
            await asyncio.sleep(0.05)
        assert await work == "the operator stopped the motors"
    assert drone.calls == ["hold", "land", "motors off"]
