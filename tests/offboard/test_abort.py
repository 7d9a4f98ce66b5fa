"""An operator's stops while a drone is brought down, with a fake of the drone that is slow to answer."""

import asyncio

from offboard.abort import FlightAbort
from offboard.drone import DroneError, DroneState
from offboard.safety.operator import Operator
from offboard.safety.rules import SafetyRules


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
    """Holds; its link is lost and comes back, then it has states until its motors are stopped."""

    def __init__(self):
        self.calls = []
        self.losses = 2

    async def hold(self):
        self.calls.append("hold")

    async def land_now(self, *, demanded=False):
        self.calls.append("land")

    async def motors_off(self):
        self.calls.append("motors off")

    async def ticks(self):
        self.losses -= 1
        if self.losses >= 0:
            raise DroneError("link lost")
        while True:
            yield DroneState(0, 0.0, 0.0, 1.0, 0.0, armed=True)
            await asyncio.sleep(0.01)


async def stopped_twice(drone, operator):
    abort = FlightAbort(drone, SafetyRules("land", operator), lambda state: None)
    work = asyncio.create_task(abort.bring_down())
    await drone.landing.wait()
    drone.landing.clear()
    operator.press_stop()
    await drone.ends.wait()
    operator.press_stop()
    async with asyncio.timeout(2.0):
        return await work


async def test_a_second_stop_counts_while_the_first_one_takes_effect():
    drone = SlowDrone()
    assert await stopped_twice(drone, Operator(needs_go=False)) == "the operator stopped the motors"
    assert drone.calls[-1] == "motors off"


async def test_a_stop_of_the_motors_that_is_lost_is_repeated():
    drone = SlowDrone(lost=2)
    assert await stopped_twice(drone, Operator(needs_go=False)) == "the operator stopped the motors"
    assert drone.calls.count("motors off") == 3


async def test_motors_that_do_not_stop_are_told():
    drone = SlowDrone(lost=9)
    told = await stopped_twice(drone, Operator(needs_go=False))
    assert told == "stopping the motors: was refused: TIMEOUT"


async def test_stops_act_after_a_link_that_was_lost_has_come_back():
    drone, operator = HoveringDrone(), Operator(needs_go=False)
    seen = asyncio.Event()
    abort = FlightAbort(drone, SafetyRules("hold", operator), lambda state: seen.set())
    work = asyncio.create_task(abort.bring_down())
    async with asyncio.timeout(2.0):
        for _ in range(2):
            await seen.wait()
            seen.clear()
            operator.press_stop()
            await asyncio.sleep(0.05)
        assert await work == "the operator stopped the motors"
    assert drone.calls == ["hold", "land", "motors off"]
