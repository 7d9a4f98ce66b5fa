"""The MAVSDK adapter against a vehicle on a real UDP socket."""

from __future__ import annotations

import asyncio
import math
import socket
import struct
import time
from contextlib import asynccontextmanager
from itertools import pairwise

import pytest
from pymavlink import mavutil

from offboard.drone import DroneError, VelocityFluCommand
from offboard.link.watchdog import HangLimits
from offboard.mavsdk_drone import MavsdkDrone
from tests.free_ports import free_port
from tests.offboard.udp_vehicle import POSCTL, UdpVehicle

pytestmark = pytest.mark.realtime

START = (-3.0, -3.0, 0.53, 1.0)


@asynccontextmanager
async def connected(vehicle, **options):
    drone = MavsdkDrone(f"udpin://127.0.0.1:{vehicle.port}", start_arena=START, **options)
    try:
        await drone.connect()
        await drone.ready()
        yield drone
    finally:
        await drone.close()


async def take(ticks, count):
    return [await anext(ticks) for _ in range(count)]


async def test_flies_as_commanded_in_arena_axes_and_stops_its_motors(vehicle):
    vehicle.position, vehicle.yaw = [7.0, 8.0, -0.1], 0.4
    async with connected(vehicle) as drone:
        ticks = drone.ticks()
        state = await anext(ticks)
        assert (state.x, state.y, state.z, state.yaw) == pytest.approx(START, abs=1e-5)
        assert not state.armed
        await drone.motors_on()
        assert vehicle.armed
        modes = [command[0] for command in vehicle.commands if command[0] in (176, 400)]
        assert modes[:2] == [176, 400]  # offboard first, then arming
        drone.command(VelocityFluCommand(0.8, 0.4, 0.2, 0.0))
        states = await take(ticks, 21)
        assert states[-1].armed
        assert states[-1].offboard
        assert vehicle.setpoints[-1][1:] == pytest.approx((0.8, -0.4, -0.2, 0.0), abs=1e-6)
        flown_s = (states[-1].time_us - states[5].time_us) / 1e6
        expected = (0.8 * math.cos(1) - 0.4 * math.sin(1), 0.8 * math.sin(1) + 0.4 * math.cos(1), 0.2)
        moved = [getattr(states[-1], axis) - getattr(states[5], axis) for axis in "xyz"]
        assert moved == pytest.approx([v * flown_s for v in expected], abs=0.05)
        drone.command(VelocityFluCommand(yaw_rate_rad_s=0.5))
        states = await take(ticks, 15)
        assert states[-1].yaw > states[0].yaw  # to the left
        assert vehicle.setpoints[-1][4] == pytest.approx(-0.5, abs=1e-6)
        await drone.motors_off()
        assert not vehicle.armed
        assert vehicle.commands[-2][:2] == (400, 0.0) or (400, 0.0, 21196.0) in vehicle.commands


@pytest.mark.parametrize("speed", [0.5, 3.0])
async def test_ticks_keep_to_vehicle_time_at_any_speed(speed):
    vehicle = UdpVehicle(free_port(), speed=speed)
    vehicle.start()
    try:
        async with connected(vehicle) as drone:
            states = await take(drone.ticks(), 21)
    finally:
        vehicle.stop()
    # Attitude comes every 10 ms here; of a packet that a busy machine loses, the next one makes the tick.
    assert sum(state.time_us % 50_000 == 0 for state in states) >= 16
    assert all(later.time_us // 50_000 > earlier.time_us // 50_000 for earlier, later in pairwise(states))


async def test_landing_waits_until_disarmed(vehicle):
    async with connected(vehicle) as drone:
        ticks = drone.ticks()
        await drone.motors_on()
        drone.command(VelocityFluCommand(up_m_s=1.0))
        await take(ticks, 20)
        await drone.land()
        assert not vehicle.armed
        assert vehicle.position[2] == 0.0


async def until_error(ticks):
    try:
        async with asyncio.timeout(8):
            async for _ in ticks:
                pass
    except DroneError as error:
        return str(error)
    raise AssertionError("the ticks ended without a reason")


async def until(ticks, condition, limit_s=8.0):
    """The first state for which a condition holds."""
    async with asyncio.timeout(limit_s):
        async for state in ticks:
            if condition(state):
                return state
    raise AssertionError("the ticks ended")


@asynccontextmanager
async def taken_by_a_pilot(vehicle):
    """A drone and its ticks, and how many commands the vehicle had had when an operator took it."""
    async with connected(vehicle) as drone:
        ticks = drone.ticks()
        await drone.motors_on()
        drone.command(VelocityFluCommand(up_m_s=0.5))
        await take(ticks, 5)
        before = len(vehicle.commands)
        vehicle.mode = (POSCTL, 0)
        state = await until(ticks, lambda state: not state.offboard)
        assert state.mode == "POSCTL"
        yield drone, ticks, before


def modes_asked_for(vehicle, before):
    return [command for command in vehicle.commands[before:] if command[0] == 176]


def fresh_setpoints(vehicle, seconds):
    return [setpoint[1:] for setpoint in vehicle.setpoints if setpoint[0] > time.monotonic() - seconds]


async def test_a_pilot_who_takes_over_keeps_the_vehicle_and_can_give_it_back(vehicle):
    async with taken_by_a_pilot(vehicle) as (drone, ticks, before):
        for _ in range(100):  # five seconds: MAVSDK has ended its own stream meanwhile
            drone.command(VelocityFluCommand(forward_m_s=0.9))
            assert not (await anext(ticks)).offboard
        fresh = fresh_setpoints(vehicle, 1.0)
        assert len(fresh) >= 15
        assert set(fresh) == {(0.0, 0.0, 0.0, 0.0)}  # nothing of the mission
        assert not modes_asked_for(vehicle, before)
        assert vehicle.mode == (POSCTL, 0)
        vehicle.mode = (6, 0)
        await until(ticks, lambda state: state.offboard)
        await take(ticks, 5)
        assert set(fresh_setpoints(vehicle, 0.2)) == {(0.0, 0.0, 0.0, 0.0)}  # it stands until taken back
        for _ in range(10):
            drone.command(VelocityFluCommand(forward_m_s=0.4))
            await anext(ticks)
        assert vehicle.setpoints[-1][1] == pytest.approx(0.4)
        vehicle.mode = (POSCTL, 0)  # and again
        await until(ticks, lambda state: not state.offboard)


async def test_after_a_pilot_the_vehicle_is_followed_from_where_he_left_it(vehicle):
    async with taken_by_a_pilot(vehicle) as (drone, ticks, _):
        vehicle.position[0] += 3.0  # off any model of what was commanded
        vehicle.mode = (6, 0)
        await until(ticks, lambda state: state.offboard)
        for _ in range(10):
            drone.command(VelocityFluCommand())
            await anext(ticks)
        assert set(fresh_setpoints(vehicle, 0.3)) == {(0.0, 0.0, 0.0, 0.0)}  # no way back is flown


async def test_no_mode_is_asked_of_a_vehicle_that_a_pilot_has(vehicle):
    async with taken_by_a_pilot(vehicle) as (drone, _, before):
        await drone.hold()
        await asyncio.sleep(0.3)
        count = len(vehicle.setpoints)
        await asyncio.sleep(0.5)
        assert len(vehicle.setpoints) == count  # silent
        assert not modes_asked_for(vehicle, before)
        assert vehicle.mode == (POSCTL, 0)


async def test_a_vehicle_not_taken_back_holds_and_can_be_given_another_time(vehicle):
    async with taken_by_a_pilot(vehicle) as (drone, ticks, before):
        vehicle.mode = (6, 0)
        await until(ticks, lambda state: state.offboard)
        await drone.refuse()
        assert vehicle.mode == (4, 3)
        assert len(modes_asked_for(vehicle, before)) == 1
        state = await anext(ticks)
        assert (state.mode, state.offboard) == ("HOLD", False)
        await take(ticks, 20)
        assert set(fresh_setpoints(vehicle, 0.5)) == {(0.0, 0.0, 0.0, 0.0)}
        vehicle.mode = (6, 0)
        await until(ticks, lambda state: state.offboard)


async def test_while_a_pilot_has_it_modes_and_arming_are_his(vehicle):
    async with taken_by_a_pilot(vehicle) as (_, ticks, _):
        vehicle.mode = (4, 3)
        await until(ticks, lambda state: state.mode == "HOLD")
        vehicle.armed = False
        await until(ticks, lambda state: not state.armed)


async def test_a_link_lost_while_a_pilot_has_it_is_noticed(vehicle):
    async with taken_by_a_pilot(vehicle) as (_, ticks, _):
        vehicle.mute = True
        assert (await until_error(ticks)).startswith("link lost: no telemetry for 1.")


async def test_an_app_that_hangs_while_a_pilot_has_it_leaves_no_stream_and_asks_for_nothing(vehicle):
    async with taken_by_a_pilot(vehicle) as (drone, ticks, before):
        drone._watchdog.limits = HangLimits(stand_s=0.5, hang_s=1.0, locked_s=10.0)
        await take(ticks, 5)
        time.sleep(1.5)  # noqa: ASYNC251 - this is what hanging is
        assert not fresh_setpoints(vehicle, 0.2)
        error = await until_error(ticks)
        assert error.startswith("this app hung") and error.endswith("its watchdog stopped sending")
        vehicle.mode = (6, 0)  # somebody gives it back to an app that has given up
        await drone._requester.until(lambda: drone._feed.mode == "OFFBOARD", 3.0)
        await drone.hold()
        assert vehicle.mode == (4, 3)
        assert not fresh_setpoints(vehicle, 0.2)
        assert len(modes_asked_for(vehicle, before)) == 1


async def test_a_mode_that_is_no_pilot_s_ends_commanding(vehicle):
    async with connected(vehicle) as drone:
        ticks = drone.ticks()
        await drone.motors_on()
        await take(ticks, 5)
        vehicle.mode = (4, 5)
        expected = "the pilot or a failsafe took over: mode RETURN_TO_LAUNCH"
        assert (await until_error(ticks)).startswith(expected)


async def test_a_lost_link_is_noticed_within_a_second_or_so(vehicle):
    async with connected(vehicle) as drone:
        ticks = drone.ticks()
        await drone.motors_on()
        await take(ticks, 5)
        vehicle.mute = True
        assert (await until_error(ticks)).startswith("link lost: no telemetry for 1.")


async def test_swapped_telemetry_is_no_clock_that_runs_back(vehicle):
    vehicle.swap = True
    async with connected(vehicle) as drone:
        states = await take(drone.ticks(), 60)
    assert all(later.time_us > earlier.time_us for earlier, later in pairwise(states))
    assert all(0.0 <= state.position_age_s < 0.05 for state in states)


async def test_some_heartbeats_may_be_lost_while_telemetry_comes(vehicle):
    async with connected(vehicle) as drone:
        ticks = drone.ticks()
        await drone.motors_on()
        vehicle.heartbeats = False
        for _ in range(90):  # 4.5 s; after 3 MAVSDK holds the vehicle for gone and ends its stream once
            drone.command(VelocityFluCommand(forward_m_s=0.4))
            await anext(ticks)
        assert fresh_setpoints(vehicle, 0.2)[-1][0] == pytest.approx(0.4)
        assert (await until_error(ticks)).startswith("link lost: no heartbeat for 6.")


async def test_a_silent_link_stands_still_before_it_is_lost(vehicle):
    async with connected(vehicle) as drone:
        ticks = drone.ticks()
        await drone.motors_on()
        drone.command(VelocityFluCommand(forward_m_s=0.8))
        await take(ticks, 5)
        vehicle.mute = True
        assert (await until_error(ticks)).startswith("link lost")
        assert set(fresh_setpoints(vehicle, 0.3)) == {(0.0, 0.0, 0.0, 0.0)}


async def test_hold_is_asked_for_again_when_the_request_is_lost(vehicle, monkeypatch):
    monkeypatch.setattr("offboard.mavsdk_drone.SHOWN_S", 0.7)
    async with connected(vehicle) as drone:
        await drone.motors_on()
        vehicle.setpoint_loss_s = math.inf
        vehicle.deaf_s = vehicle.time_s + 3.0  # longer than MAVSDK asks
        await drone.hold()
        assert vehicle.mode == (4, 3)


async def test_disarming_by_others_is_noticed(vehicle):
    async with connected(vehicle) as drone:
        ticks = drone.ticks()
        await drone.motors_on()
        await take(ticks, 5)
        vehicle.armed = False
        assert "disarmed by others" in await until_error(ticks)


@asynccontextmanager
async def armed_by_acknowledgement(vehicle):
    """A drone whose heartbeats say that it is disarmed, while it flies, and its ticks."""
    vehicle.tells_disarmed = True
    async with connected(vehicle) as drone:
        ticks = drone.ticks()
        await drone.motors_on(confirmed=False)
        assert vehicle.armed
        assert drone._feed.mode == "OFFBOARD"  # this is confirmed in any case, before arming
        drone.command(VelocityFluCommand(up_m_s=1.0))
        yield drone, ticks


async def test_it_flies_with_the_acknowledgement_of_arming_whatever_older_heartbeats_say(vehicle):
    async with armed_by_acknowledgement(vehicle) as (drone, ticks):
        states = await take(ticks, 30)  # 1.5 s with three heartbeats
        assert not drone._feed.armed
        assert all(state.armed and state.offboard for state in states)
        assert states[-1].z > START[2] + 1.0
        vehicle.tells_disarmed = False
        await until(ticks, lambda _: drone._feed.armed)
        await take(ticks, 5)
        vehicle.armed = False
        assert "disarmed by others" in await until_error(ticks)


async def test_an_arming_that_no_heartbeat_shows_ends_the_flight_after_the_limit(vehicle, monkeypatch):
    monkeypatch.setattr("offboard.mavsdk_drone.CONFIRM_S", 1.2)
    async with armed_by_acknowledgement(vehicle) as (_, ticks):
        before_s = vehicle.time_s
        assert all(state.armed for state in await take(ticks, 10))
        error = await until_error(ticks)
        assert error.startswith("arming was acknowledged, but telemetry still shows mode OFFBOARD, disarmed")
        assert vehicle.time_s - before_s == pytest.approx(1.2, abs=0.3)


async def test_a_heartbeat_after_the_acknowledgement_that_shows_it_disarmed_ends_the_flight(vehicle):
    async with armed_by_acknowledgement(vehicle) as (_, ticks):
        vehicle.armed, vehicle.mode = False, (4, 3)
        assert "disarmed by others" in await until_error(ticks)


async def test_a_pilot_who_takes_over_before_a_heartbeat_has_shown_the_arming_has_an_armed_vehicle(vehicle):
    async with armed_by_acknowledgement(vehicle) as (_, ticks):
        vehicle.mode = (POSCTL, 0)
        state = await until(ticks, lambda state: not state.offboard)
        assert (state.mode, state.armed) == ("POSCTL", True)


async def test_before_a_heartbeat_has_shown_the_arming_the_vehicle_lands_until_one_shows_it_disarmed(vehicle):
    async with armed_by_acknowledgement(vehicle) as (drone, ticks):
        await take(ticks, 16)
        landing = asyncio.create_task(drone.land())
        await drone._requester.until(lambda: drone._feed.mode == "LAND", 3.0)
        assert not landing.done()
        vehicle.tells_disarmed = False
        await landing
        assert not vehicle.armed
        assert vehicle.position[2] == 0.0


async def test_before_a_heartbeat_has_shown_the_arming_the_motors_can_be_stopped(vehicle):
    async with armed_by_acknowledgement(vehicle) as (drone, ticks):
        await take(ticks, 3)
        await drone.motors_off()
        assert not vehicle.armed
        assert not (await anext(ticks)).armed


async def test_positions_that_are_not_finite_are_refused(vehicle):
    async with connected(vehicle) as drone:
        ticks = drone.ticks()
        await take(ticks, 2)
        vehicle.position = [math.nan, 0.0, 0.0]
        assert "not finite" in await until_error(ticks)


async def test_hold_stops_the_setpoints_and_is_confirmed(vehicle):
    async with connected(vehicle) as drone:
        await drone.motors_on()
        await drone.hold()
        assert vehicle.mode == (4, 3)
        count = len(vehicle.setpoints)
        drone.command(VelocityFluCommand(forward_m_s=1.0))
        await asyncio.sleep(0.3)
        assert len(vehicle.setpoints) == count


async def test_a_refused_arming_gives_the_vehicle_s_reason(vehicle):
    vehicle.refuse_arming = "Arming denied: high throttle"
    async with connected(vehicle) as drone:
        with pytest.raises(DroneError, match=r"arming was refused: COMMAND_DENIED.*high throttle"):
            await drone.motors_on()
        assert not vehicle.armed


async def test_an_acknowledged_mode_that_does_not_come_is_no_success(vehicle, monkeypatch):
    monkeypatch.setattr("offboard.link.ticks.CONFIRM_S", 0.7)
    vehicle.ignore_modes = True
    async with connected(vehicle) as drone:
        with pytest.raises(
            DroneError, match="offboard mode was acknowledged, but telemetry still shows mode HOLD"
        ):
            await drone.motors_on()
        assert 400 not in [command[0] for command in vehicle.commands]


async def test_not_ready_says_what_is_missing(vehicle):
    vehicle.armable = False
    drone = MavsdkDrone(f"udpin://127.0.0.1:{vehicle.port}", ready_limit_s=0.8)
    try:
        await drone.connect()
        told = r"not ready within 0\.8 s: pre-arm checks not passed.*framerunner doctor --drone udpin"
        with pytest.raises(DroneError, match=told):
            await drone.ready()
    finally:
        await drone.close()


async def test_a_vehicle_that_can_only_be_armed_in_offboard_is_taken_there(vehicle):
    """PX4 checks for the mode it is in; hold wants a global position, which there is none of in a hall."""
    vehicle.armable_modes = {6}
    drone = MavsdkDrone(f"udpin://127.0.0.1:{vehicle.port}", ready_limit_s=6.0)
    try:
        await drone.connect()
        await drone.ready()
        assert vehicle.mode[0] == 6
        await drone.motors_on()
        assert vehicle.armed
    finally:
        await drone.close()


async def test_a_vehicle_that_drifts_is_brought_back(vehicle):
    async with connected(vehicle) as drone:
        await drone.motors_on()
        vehicle.drift_m_s = -0.1  # up, as PX4's height does under velocity setpoints
        heights = []
        async for state in drone.ticks():
            drone.command(VelocityFluCommand())
            heights.append(state.z)
            if len(heights) == 80:
                break
        assert heights[-1] - heights[0] < 0.2
        assert vehicle.setpoints[-1][3] > 0.05  # told to go down


async def test_an_armed_vehicle_is_not_taken(vehicle):
    vehicle.armed = True
    with pytest.raises(DroneError, match="armed already"):
        async with connected(vehicle):
            pass


async def test_an_armed_vehicle_that_is_not_ready_is_left_alone(vehicle):
    """It may be flown by another app, which a request for hold would stop."""
    vehicle.armed, vehicle.armable = True, False
    drone = MavsdkDrone(f"udpin://127.0.0.1:{vehicle.port}", ready_limit_s=0.8)
    try:
        await drone.connect()
        with pytest.raises(DroneError, match="armed already"):
            await drone.ready()
    finally:
        await drone.close()
    assert 176 not in [command[0] for command in vehicle.commands]


async def test_a_vehicle_that_others_have_armed_meanwhile_is_not_taken(vehicle):
    async with connected(vehicle) as drone:
        vehicle.armed = True
        await asyncio.sleep(1.2)  # until a heartbeat shows it
        mode = vehicle.mode
        with pytest.raises(DroneError, match="armed by others before the flight"):
            await drone.motors_on()
        assert vehicle.mode == mode


async def test_another_vehicle_than_the_checked_one_is_not_flown(vehicle):
    with pytest.raises(DroneError, match=r"another vehicle \(system 1\) sends to .*; stop it"):
        async with connected(vehicle, system_id=7):
            pass


async def test_no_vehicle_is_one_clear_line():
    drone = MavsdkDrone(f"udpin://127.0.0.1:{free_port()}", connect_limit_s=0.3)
    with pytest.raises(DroneError, match=r"no vehicle was found on udpin://127.*within 0\.3 s"):
        await drone.connect()
    await drone.close()


async def test_a_busy_port_is_told():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", free_port()))
        port = other.getsockname()[1]
        drone = MavsdkDrone(f"udpin://127.0.0.1:{port}")
        with pytest.raises(DroneError, match=f"UDP port {port}"):
            await drone.connect()
        await drone.close()


async def test_the_recording_holds_both_directions(vehicle, tmp_path):
    drone = MavsdkDrone(f"udpin://127.0.0.1:{vehicle.port}", start_arena=START)
    drone.record_to(tmp_path / "flight.tlog")
    await drone.connect()
    await drone.ready()
    await drone.motors_on()
    ticks = drone.ticks()
    drone.command(VelocityFluCommand(forward_m_s=0.7))
    await take(ticks, 20)
    await drone.motors_off()
    await drone.close()
    log = mavutil.mavlink_connection(str(tmp_path / "flight.tlog"))
    kinds: dict[str, int] = {}
    speeds = set()
    while (message := log.recv_match()) is not None:
        kinds[message.get_type()] = kinds.get(message.get_type(), 0) + 1
        if message.get_type() == "SET_POSITION_TARGET_LOCAL_NED":
            speeds.add(round(message.vx, 3))
    assert kinds["ATTITUDE"] > 100
    assert kinds["SET_POSITION_TARGET_LOCAL_NED"] > 15
    assert kinds["COMMAND_LONG"] >= 3
    assert 0.7 in speeds
    assert "BAD_DATA" not in kinds
    stamps = struct.unpack(">Q", (tmp_path / "flight.tlog").read_bytes()[:8])[0]
    assert stamps > 1_500_000_000_000_000


async def test_recording_to_an_impossible_place_is_told(vehicle, tmp_path):
    drone = MavsdkDrone(f"udpin://127.0.0.1:{vehicle.port}")
    drone.record_to(tmp_path / "missing" / "flight.tlog")
    with pytest.raises(DroneError, match="cannot record to"):
        await drone.connect()
    await drone.close()
