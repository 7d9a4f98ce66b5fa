"""The MAVSDK adapter against a protocol fake of ArduCopter, on a real UDP socket."""

from __future__ import annotations

import asyncio
import math
from contextlib import asynccontextmanager

import pytest
from pymavlink.dialects.v20 import common as mavlink

from offboard.drone import DroneError, VelocityFluCommand
from offboard.limits import Box, VelocityLimits
from offboard.mavsdk_drone import MavsdkDrone
from tests.free_ports import free_port
from tests.offboard.udp_arducopter import BRAKE, GUIDED, LOITER, UdpArduCopter

pytestmark = pytest.mark.realtime

START = (-3.0, -3.0, 0.5, 1.0)
UP = VelocityFluCommand(up_m_s=1.0)


@pytest.fixture
def copter():
    vehicle = UdpArduCopter(free_port())
    vehicle.start()
    yield vehicle
    vehicle.stop()


@asynccontextmanager
async def connected(vehicle, **options):
    drone = MavsdkDrone(f"udpin://127.0.0.1:{vehicle.port}", start_arena=START, corrects=False, **options)
    try:
        await drone.connect()
        await drone.ready()
        yield drone
    finally:
        await drone.close()
        await drone.disconnect()


async def fly(drone, ticks, command, condition, limit_s=15.0):
    """Command at each tick until a state fulfils a condition; returns it."""
    async with asyncio.timeout(limit_s):
        async for state in ticks:
            if condition(state):
                return state
            drone.command(command)
    raise AssertionError("the ticks ended")


async def test_a_climb_on_the_ground_is_a_take_off_and_velocities_follow_in_the_air(copter):
    copter.yaw = 0.4
    async with connected(copter) as drone:
        ticks = drone.ticks()
        await drone.motors_on()
        assert (copter.mode[0], copter.armed) == (GUIDED, True)
        drone.command(VelocityFluCommand(forward_m_s=1.0))  # no climb: it stays on the ground
        assert copter.takeoffs == []
        await fly(drone, ticks, UP, lambda state: state.z > 1.0)
        assert copter.takeoffs == [1.0]
        assert copter.early == 0
        before = await anext(ticks)
        command = VelocityFluCommand(forward_m_s=1.0, left_m_s=0.5)
        after = await fly(drone, ticks, command, lambda s: s.time_us > before.time_us + 1_500_000)
        expected = (math.cos(1) - 0.5 * math.sin(1), math.sin(1) + 0.5 * math.cos(1))
        assert after.velocity_arena_m_s[:2] == pytest.approx(expected, abs=0.02)
        assert math.hypot(after.x - before.x, after.y - before.y) == pytest.approx(1.5 * 1.118, rel=0.2)
        turn = VelocityFluCommand(yaw_rate_rad_s=0.5)
        turned = await fly(drone, ticks, turn, lambda s: s.time_us > after.time_us + 1_000_000)
        assert turned.yaw > after.yaw + 0.3  # to the left
        await drone.land()
        assert not copter.armed


async def test_a_take_off_stays_below_the_ceiling(copter):
    low = Box((-5.0, -5.0, 0.0), (5.0, 5.0, START[2] + 0.6), START[:2])
    async with connected(copter, limits=VelocityLimits(box=low)) as drone:
        await drone.motors_on()
        await fly(drone, drone.ticks(), UP, lambda state: not state.landed)
        assert copter.takeoffs == [pytest.approx(0.42)]
        await drone.motors_off()


async def test_a_drone_that_was_ready_and_not_armed_does_not_stay_in_guided(copter):
    async with connected(copter):
        assert copter.mode[0] == GUIDED  # its checks are those of this mode
    assert (copter.mode[0], copter.armed) == (BRAKE, False)


async def test_a_take_off_that_had_no_effect_is_requested_again(copter):
    copter.ignores_takeoff = True
    async with connected(copter) as drone:
        ticks = drone.ticks()
        await drone.motors_on()
        with pytest.raises(TimeoutError):
            await fly(drone, ticks, UP, lambda state: not state.landed, limit_s=1.5)
        assert len(copter.takeoffs) == 1
        copter.ignores_takeoff = False
        await fly(drone, drone.ticks(), UP, lambda state: not state.landed)
        assert len(copter.takeoffs) == 2
        await drone.motors_off()


async def test_hold_is_brake_because_loiter_descends_without_sticks(copter):
    async with connected(copter) as drone:
        ticks = drone.ticks()
        await drone.motors_on()
        await fly(drone, ticks, UP, lambda state: state.z > 1.0)
        await drone.hold()
        assert copter.mode[0] == BRAKE
        count = len(copter.setpoints)
        await asyncio.sleep(0.3)
        assert len(copter.setpoints) == count


async def test_a_pilot_takes_it_in_loiter_and_gives_it_back_in_guided(copter):
    async with connected(copter) as drone:
        ticks = drone.ticks()
        await drone.motors_on()
        await fly(drone, ticks, UP, lambda state: state.z > 1.0)
        copter.mode = (LOITER, 0)
        state = await fly(drone, ticks, UP, lambda state: not state.offboard)
        assert state.mode == "LOITER"
        copter.mode = (GUIDED, 0)
        await fly(drone, ticks, VelocityFluCommand(), lambda state: state.offboard)
        await drone.hold()


async def test_another_mode_is_a_failsafe(copter):
    async with connected(copter) as drone:
        ticks = drone.ticks()
        await drone.motors_on()
        await fly(drone, ticks, UP, lambda state: state.z > 1.0)
        copter.mode = (6, 0)
        with pytest.raises(DroneError, match="took over: mode RTL"):
            await fly(drone, ticks, UP, lambda state: False)


async def test_without_a_position_it_is_not_ready(copter):
    copter.has_position = False
    with pytest.raises(DroneError, match="not ready within"):
        async with connected(copter, ready_limit_s=2.0):
            pass


async def test_without_its_landed_state_it_is_not_ready(copter):
    copter.refused = {mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE}
    with pytest.raises(DroneError, match="no landed state"):
        async with connected(copter, ready_limit_s=2.0):
            pass


async def test_a_rover_is_not_flown(copter):
    copter.type = mavlink.MAV_TYPE_GROUND_ROVER
    with pytest.raises(DroneError, match="the vehicle is a rover; use a multicopter"):
        async with connected(copter):
            pass


async def test_a_refusal_is_said_in_words(copter):
    async with connected(copter) as drone:
        copter.refuse_arming = "Arm: Battery 1 low voltage failsafe"
        with pytest.raises(DroneError, match=r"arming was refused.*Battery 1 low"):
            await drone.motors_on()
