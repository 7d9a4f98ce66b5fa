"""The lockstep adapter of the drone port, without a mission."""

import asyncio
from dataclasses import replace
from math import nan

import pytest

from firmware_py.status import CommandResult, FlightMode
from framerunner.flying.lockstep import LockstepPerception
from framerunner.flying.lockstep_drone import TICK_US, LockstepDrone
from offboard.drone import DroneError, VelocityFluCommand
from offboard.perception import CameraLostError
from scenarios.loader import load_scenario
from sitl.camera import SimulatedCamera
from sitl.simulation import Simulation

START = (1.0, 2.0, 0.5, 0.3)  # not the simulation's own start: the axes must be aligned to this


@pytest.fixture
def simulation():
    return Simulation(load_scenario("empty"))


@pytest.fixture
def drone(simulation):
    return LockstepDrone(simulation, START)


async def fly(drone, command, ticks):
    states = []
    async for state in drone.ticks():
        states.append(state)
        drone.command(command)
        if len(states) == ticks:
            return states
    return states


async def in_the_air(drone):
    await drone.connect()
    await drone.ready()
    await drone.motors_on()
    return await fly(drone, VelocityFluCommand(up_m_s=0.5), 60)


async def test_ticks_are_on_the_50_ms_grid_in_the_arenas_axes(drone):
    await drone.ready()
    states = await fly(drone, VelocityFluCommand(), 6)
    assert [state.time_us // TICK_US - states[0].time_us // TICK_US for state in states] == list(range(6))
    assert all(state.time_us % TICK_US < 4_000 for state in states)
    last = states[-1]
    assert (last.x, last.y, last.z, last.yaw) == pytest.approx(START, abs=1e-4)
    assert (last.armed, last.offboard, last.landed) == (False, False, True)


async def test_motors_run_only_in_offboard_and_a_velocity_holds_until_changed(drone, simulation):
    await drone.ready()
    await drone.motors_on()
    assert simulation.autopilot.status.mode is FlightMode.OFFBOARD
    drone.command(VelocityFluCommand(forward_m_s=0.4, up_m_s=0.4))
    ticks = drone.ticks()
    states = [await anext(ticks) for _ in range(80)]  # 4 s without another command
    assert all(state.armed and state.offboard for state in states)
    vx, vy, vz = states[-1].velocity_arena_m_s
    assert (vx, vy) == pytest.approx((0.4 * 0.955, 0.4 * 0.296), abs=0.02)  # forward is along START's yaw
    assert vz == pytest.approx(0.4, abs=0.02)


async def first_tick_after_arming(drone, simulation, *, confirmed=False):
    """The first state after motors on, and for how long the motors had run then, seconds."""
    began_us = []
    tick = simulation.tick

    def noted():
        tick()
        if not began_us and simulation.autopilot.status.armed:
            began_us.append(simulation.time_us)

    simulation.tick = noted
    await drone.ready()
    await drone.motors_on(confirmed=confirmed)
    drone.command(VelocityFluCommand(up_m_s=1.0))
    state = await anext(drone.ticks())
    return state, (state.time_us - began_us[0]) / 1e6


@pytest.mark.parametrize(("confirmed", "least_s", "most_s"), [(False, 0.0, 0.06), (True, 0.9, 1.06)])
async def test_it_flies_with_the_acknowledgement_or_when_a_heartbeat_has_confirmed_it(
    drone, simulation, confirmed, least_s, most_s
):
    state, since_s = await first_tick_after_arming(drone, simulation, confirmed=confirmed)
    assert least_s <= since_s <= most_s
    assert state.armed and state.offboard
    heights_m = [state.z for state in await fly(drone, VelocityFluCommand(up_m_s=1.0), 15)]
    assert heights_m[-1] > START[2] + 0.3


async def test_until_a_heartbeat_has_shown_it_the_drone_is_armed_and_no_pilot_has_it(drone, simulation):
    await first_tick_after_arming(drone, simulation)
    states = await fly(drone, VelocityFluCommand(up_m_s=0.5), 50)
    assert all(state.armed and state.offboard for state in states)
    simulation.autopilot.disarm(force=True)
    with pytest.raises(DroneError, match="the vehicle was disarmed by others"):
        await fly(drone, VelocityFluCommand(), 25)


async def test_a_heartbeat_after_the_acknowledgement_that_shows_it_disarmed_ends_the_flight(
    drone, simulation
):
    await first_tick_after_arming(drone, simulation)
    simulation.autopilot.disarm(force=True)
    with pytest.raises(DroneError, match=r"the vehicle was disarmed by others; .*Disarmed by external"):
        await fly(drone, VelocityFluCommand(), 25)


async def test_an_arming_that_no_heartbeat_shows_ends_the_flight_after_the_limit(drone, simulation):
    see = drone._arming.see_heartbeat
    drone._arming.see_heartbeat = lambda _: see(False)
    first, _ = await first_tick_after_arming(drone, simulation)
    states = await fly(drone, VelocityFluCommand(), 118)
    assert all(state.armed and state.offboard for state in states)
    assert (states[-1].time_us - first.time_us) / 1e6 == pytest.approx(5.9, abs=0.01)
    told = "arming was acknowledged, but telemetry still shows mode OFFBOARD, disarmed after 6 s; .*Armed"
    with pytest.raises(DroneError, match=told):
        await fly(drone, VelocityFluCommand(), 4)


async def test_before_a_heartbeat_has_shown_the_motors_on_they_can_be_stopped(drone, simulation):
    await first_tick_after_arming(drone, simulation)
    before_us = simulation.time_us
    await drone.motors_off()
    assert not simulation.autopilot.status.armed
    assert (simulation.time_us - before_us) / 1e6 > 0.5  # a heartbeat has shown it
    assert not (await anext(drone.ticks())).armed


async def test_before_a_heartbeat_has_shown_the_motors_on_the_drone_can_land(drone, simulation):
    await first_tick_after_arming(drone, simulation)
    await fly(drone, VelocityFluCommand(up_m_s=1.0), 14)
    assert drone._arming.shown is False
    await drone.land()
    assert not simulation.autopilot.status.armed
    drone.settle()
    assert simulation.referee.settled


async def test_motors_off_land_and_hold(drone, simulation):
    assert (await in_the_air(drone))[-1].z > START[2] + 0.5
    await drone.hold()
    assert simulation.autopilot.status.mode is FlightMode.HOLD
    await drone.land()
    assert not simulation.autopilot.status.armed
    drone.settle()
    assert simulation.referee.settled
    await drone.motors_on()
    await drone.motors_off()
    assert not simulation.autopilot.status.armed


async def test_reports_that_another_mode_took_over(drone, simulation):
    await in_the_air(drone)
    simulation.autopilot.set_mode(FlightMode.HOLD)
    with pytest.raises(DroneError, match="the pilot or a failsafe took over: mode HOLD"):
        await fly(drone, VelocityFluCommand(), 25)


async def test_reports_that_it_was_disarmed(drone, simulation):
    await in_the_air(drone)
    simulation.autopilot.disarm(force=True)
    with pytest.raises(DroneError, match=r"disarmed by others; the vehicle says: .*Disarmed by external"):
        await fly(drone, VelocityFluCommand(), 25)


async def test_a_command_with_a_nan_brakes_as_a_packet_with_it_does(drone):
    await in_the_air(drone)
    states = await fly(drone, VelocityFluCommand(up_m_s=nan), 40)
    assert states[-1].velocity_arena_m_s[2] == pytest.approx(0.0, abs=0.02)


async def test_refuses_an_armed_vehicle_and_ticks_before_ready(drone, simulation):
    with pytest.raises(DroneError, match=r"call ready\(\) first"):
        await anext(drone.ticks())
    await drone.ready()
    simulation.autopilot.arm()
    for _ in range(2):
        simulation.tick()
    with pytest.raises(DroneError, match="armed already"):
        await drone.ready()


async def test_reports_what_the_vehicle_refuses(drone, simulation, monkeypatch):
    await drone.ready()
    monkeypatch.setattr(simulation.autopilot, "arm", lambda: CommandResult.TEMPORARILY_REJECTED)
    with pytest.raises(DroneError, match=r"arming was refused: TEMPORARILY_REJECTED; .*Ready for takeoff"):
        await drone.motors_on()


async def test_reports_that_the_vehicles_clock_stands_still(drone, simulation, monkeypatch):
    await drone.ready()
    sample = replace(simulation.world.sensors(), position_ned_m=(nan, nan, nan))
    monkeypatch.setattr(simulation.world, "sensors", lambda: sample)
    with pytest.raises(DroneError, match="link lost: the vehicle's clock stands still"):
        await fly(drone, VelocityFluCommand(), 25)
    with pytest.raises(
        DroneError, match="offboard mode was acknowledged, but telemetry still shows mode HOLD"
    ):
        await drone.motors_on()


async def test_ctrl_c_reaches_a_flight_that_never_waits(drone):
    await drone.ready()
    task = asyncio.current_task()

    async def interrupted():
        async for _ in drone.ticks():
            asyncio.current_task().cancel()

    flight = asyncio.create_task(interrupted())
    with pytest.raises(asyncio.CancelledError):
        await flight
    assert task.cancelling() == 0


@pytest.mark.parametrize("delay_us", [-1, 50_000])
def test_refuses_a_delay_that_does_not_fit_between_ticks(simulation, delay_us):
    with pytest.raises(ValueError, match=f"telemetry_delay_us {delay_us}"):
        LockstepDrone(simulation, START, telemetry_delay_us=delay_us)


def test_images_are_spaced_by_their_times_and_only_those_used_are_painted(simulation, monkeypatch):
    painted = []
    render = SimulatedCamera.render
    monkeypatch.setattr(
        SimulatedCamera, "render", lambda *args, **named: painted.append(1) or render(*args, **named)
    )
    perception = LockstepPerception(simulation.scenario)

    def after(seconds):
        for _ in range(round(seconds * 250)):
            simulation.tick()
            perception.follow(simulation.truth)
        perception.latest(simulation.time_us)
        return [round(seen.time_us, -5) // 100_000 for seen in perception.take()]

    perception.space_images(0.15)
    assert after(0.7) == [0, 2, 4, 6]
    perception.space_images(0.0)
    assert after(0.3) == [7, 8, 9]
    assert len(painted) == 7
    perception.space_images(2.0)
    assert after(1.5) == []  # and the camera is not taken for dead
    assert perception.image is not None
    assert len(painted) == 8


def test_a_camera_without_fresh_images_is_lost(simulation):
    perception = LockstepPerception(simulation.scenario)
    assert not perception.latest(900_000).red.seen
    for _ in range(50):
        simulation.tick()
        perception.follow(simulation.truth)
    newest = perception.latest(simulation.time_us)
    assert newest.time_us == 136_000
    assert [seen.time_us for seen in perception.take()] == [36_000, 136_000]
    assert perception.take() == ()
    with pytest.raises(CameraLostError, match=r"no image for 1\.1 s"):
        perception.latest(1_250_000)
