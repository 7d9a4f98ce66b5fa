"""What MAVSDK 4 offers an app, plugin by plugin: actions, offboard of every kind, sticks, following.

Missions, files, the camera and telemetry rates have tests of their own beside this one. Four times real time
is as fast as MAVSDK's own timers allow with some to spare.
"""

import asyncio
import json
import time
from math import cos, hypot, radians, sin

import pytest
from mavsdk.asyncio.plugins.action import ActionAsync, ActionError, OrbitYawBehavior
from mavsdk.asyncio.plugins.calibration import CalibrationAsync, CalibrationResult
from mavsdk.asyncio.plugins.component_metadata import ComponentMetadataAsync, MetadataType
from mavsdk.asyncio.plugins.events import EventsAsync
from mavsdk.asyncio.plugins.failure import FailureAsync, FailureError, FailureType, FailureUnit
from mavsdk.asyncio.plugins.follow_me import (
    Config,
    FollowMeAsync,
    FollowMeError,
    FollowMeResult,
    TargetLocation,
)
from mavsdk.asyncio.plugins.info import InfoAsync
from mavsdk.asyncio.plugins.manual_control import ManualControlAsync
from mavsdk.asyncio.plugins.mavlink_direct import MavlinkDirectAsync
from mavsdk.asyncio.plugins.offboard import (
    AccelerationNed,
    Attitude,
    AttitudeRate,
    OffboardAsync,
    OffboardError,
    OffboardResult,
    PositionGlobalYaw,
    PositionNedYaw,
    VelocityBodyYawspeed,
    VelocityNedYaw,
)
from mavsdk.asyncio.plugins.param import ParamAsync, ParamError, ParamResult
from mavsdk.asyncio.plugins.shell import ShellAsync
from mavsdk.asyncio.plugins.telemetry import FlightMode, TelemetryAsync

from tests.realtime.conftest import mavsdk_system

pytestmark = pytest.mark.realtime

SIM_OPTIONS = ("--speed", "4", "--shell")
METRES_PER_DEGREE = 111_194.93
PLUGINS = {
    "action": ActionAsync,
    "calibration": CalibrationAsync,
    "component_metadata": ComponentMetadataAsync,
    "direct": MavlinkDirectAsync,
    "events": EventsAsync,
    "failure": FailureAsync,
    "follow_me": FollowMeAsync,
    "info": InfoAsync,
    "manual_control": ManualControlAsync,
    "offboard": OffboardAsync,
    "param": ParamAsync,
    "shell": ShellAsync,
    "telemetry": TelemetryAsync,
}


class Drone:
    """A system's plugins by name, made when first asked for, and what flights of tests need."""

    def __init__(self, system):
        self._system = system

    def __getattr__(self, name):
        setattr(self, name, self.another(name))
        return self.__dict__[name]

    def another(self, name):
        """A plugin that knows nothing yet."""
        return PLUGINS[name](self._system)

    async def seen(self, stream, wanted, limit_s=40.0):
        """The first of a telemetry stream that is as wanted."""
        latest = None
        try:
            async with asyncio.timeout(limit_s):
                async for latest in getattr(self.telemetry, f"subscribe_{stream}")():
                    if wanted(latest):
                        return latest
        except TimeoutError:
            pass
        raise AssertionError(f"{stream} not as wanted within {limit_s:g} s; the latest is {latest}")

    async def vehicle_s(self):
        """The vehicle's time."""
        message = await anext(self.direct.subscribe_message("ATTITUDE"))
        return json.loads(message.fields_json)["time_boot_ms"] / 1000

    async def place(self):
        """Position and velocity now."""
        return await self.seen("position_velocity_ned", lambda _: True)

    async def near(self, north_m, east_m, down_m, limit_s=40.0):
        await self.seen(
            "position_velocity_ned",
            lambda now: (
                abs(now.position.north_m - north_m) < 0.5
                and abs(now.position.east_m - east_m) < 0.5
                and abs(now.position.down_m - down_m) < 0.5
            ),
            limit_s,
        )

    async def moves(self, north_m_s, east_m_s, down_m_s):
        await self.seen(
            "velocity_ned",
            lambda now: (
                abs(now.north_m_s - north_m_s) < 0.2
                and abs(now.east_m_s - east_m_s) < 0.2
                and abs(now.down_m_s - down_m_s) < 0.2
            ),
        )

    async def take_off(self, height_m):
        await self.action.set_takeoff_altitude(height_m)
        await self.action.arm()
        await self.action.takeoff()
        await self.seen("flight_mode", lambda mode: mode == FlightMode.HOLD)

    async def come_down(self):
        await self.action.land()
        await self.seen("armed", lambda armed: not armed)


@pytest.fixture
async def drone(sim, instance):
    async with mavsdk_system(sim.process, instance) as system:
        drone = Drone(system)
        if await drone.seen("armed", lambda _: True):  # the test before has failed
            await drone.come_down()
        await drone.seen("health", lambda health: health.is_armable and health.is_home_position_ok)
        yield drone


def at(home, north_m, east_m):
    """Latitude and longitude beside home."""
    return (
        home.latitude_deg + north_m / METRES_PER_DEGREE,
        home.longitude_deg + east_m / METRES_PER_DEGREE / cos(radians(home.latitude_deg)),
    )


async def test_actions(drone):
    action = drone.action
    await action.set_takeoff_altitude(4.0)
    assert await action.get_takeoff_altitude() == 4.0
    await action.set_return_to_launch_altitude(6.0)
    assert await action.get_return_to_launch_altitude() == 6.0
    home = await drone.seen("home", lambda _: True)
    ground = await drone.place()
    await drone.take_off(4.0)
    assert (await drone.place()).position.down_m == pytest.approx(ground.position.down_m - 4.0, abs=0.5)
    with pytest.raises(ActionError):
        await action.disarm()  # it flies

    north_m, east_m = ground.position.north_m + 10.0, ground.position.east_m
    down_m = ground.position.down_m - 6.0
    await action.goto_location(*at(home, 10.0, 0.0), home.absolute_altitude_m + 6.0, 90.0)
    await drone.near(north_m, east_m, down_m)
    await drone.seen("heading", lambda heading: abs(heading.heading_deg - 90.0) < 3.0)
    await action.set_current_speed(3.0)

    await action.do_orbit(
        4.0,
        2.0,
        OrbitYawBehavior.HOLD_FRONT_TO_CIRCLE_CENTER,
        *at(home, 10.0, 0.0),
        home.absolute_altitude_m + 6.0,
    )
    for side_m in (3.0, -3.0):  # of the circle, east and west
        await drone.seen(
            "position_velocity_ned", lambda now, s=side_m: (now.position.east_m - east_m) / s > 1.0
        )
        now = await drone.place()
        radius_m = hypot(now.position.north_m - north_m, now.position.east_m - east_m)
        assert radius_m == pytest.approx(4.0, abs=1.0)
        assert now.position.down_m == pytest.approx(down_m, abs=0.5)
    await action.hold()
    await drone.seen("flight_mode", lambda mode: mode == FlightMode.HOLD)

    await action.return_to_launch()
    await drone.seen("flight_mode", lambda mode: mode == FlightMode.RETURN_TO_LAUNCH)
    await drone.seen("armed", lambda armed: not armed)
    landed = (await drone.place()).position
    assert hypot(landed.north_m - ground.position.north_m, landed.east_m - ground.position.east_m) < 0.5


async def test_offboard_by_position_velocity_and_acceleration(drone):
    offboard = drone.offboard
    with pytest.raises(OffboardError) as refused:
        await offboard.start()
    assert refused.value.result == OffboardResult.NO_SETPOINT_SET
    home = await drone.seen("home", lambda _: True)
    ground = (await drone.place()).position
    north_m, east_m, down_m = home.local_north_m, home.local_east_m, ground.down_m - 4.0
    await drone.take_off(4.0)

    await offboard.set_position_ned(PositionNedYaw(north_m + 3.0, east_m, down_m, 0.0))
    await offboard.start()
    await drone.near(north_m + 3.0, east_m, down_m)
    await drone.seen("flight_mode", lambda mode: mode == FlightMode.OFFBOARD)
    assert await offboard.is_active()

    await offboard.set_velocity_body(VelocityBodyYawspeed(0.0, 0.0, 0.0, 45.0))
    await drone.seen("attitude_angular_velocity_body", lambda rate: abs(rate.yaw_rad_s - radians(45)) < 0.05)
    await offboard.set_position_global(
        PositionGlobalYaw(*at(home, 3.0, 3.0), 4.0, 90.0, PositionGlobalYaw.AltitudeType.REL_HOME)
    )
    await drone.near(north_m + 3.0, east_m + 3.0, down_m)
    await drone.seen("heading", lambda heading: abs(heading.heading_deg - 90.0) < 2.0)

    await offboard.set_velocity_body(VelocityBodyYawspeed(2.0, -1.0, 0.0, 0.0))
    await drone.moves(1.0, 2.0, 0.0)  # it looks east
    await offboard.set_velocity_ned(VelocityNedYaw(-1.0, 0.0, -0.7, 0.0))
    await drone.moves(-1.0, 0.0, -0.7)
    await offboard.set_position_velocity_ned(
        PositionNedYaw(north_m, east_m, down_m, 0.0), VelocityNedYaw(0.0, 0.0, 0.0, 0.0)
    )
    await drone.near(north_m, east_m, down_m)
    await offboard.set_position_velocity_acceleration_ned(
        PositionNedYaw(north_m, east_m + 2.0, down_m, 0.0),
        VelocityNedYaw(0.0, 0.0, 0.0, 0.0),
        AccelerationNed(0.0, 0.0, 0.0),
    )
    await drone.near(north_m, east_m + 2.0, down_m)
    await offboard.set_acceleration_ned(AccelerationNed(1.0, 0.0, 0.0))
    await drone.seen("velocity_ned", lambda now: now.north_m_s > 1.5)

    await offboard.stop()
    await drone.seen("flight_mode", lambda mode: mode == FlightMode.HOLD)
    assert not await offboard.is_active()
    await drone.come_down()


async def test_offboard_by_attitude_and_rates(drone):
    offboard = drone.offboard
    await drone.take_off(8.0)
    hover = 0.5
    await offboard.set_attitude(Attitude(0.0, 0.0, 0.0, hover))
    await offboard.start()
    await offboard.set_attitude(Attitude(0.0, -10.0, 0.0, hover))
    await drone.seen("attitude_euler", lambda now: abs(now.pitch_deg + 10.0) < 2.0)
    await drone.seen("velocity_ned", lambda now: now.north_m_s > 0.5)
    await offboard.set_attitude(Attitude(8.0, 0.0, 0.0, hover))
    await drone.seen("attitude_euler", lambda now: abs(now.roll_deg - 8.0) < 2.0)
    await offboard.set_attitude_rate(AttitudeRate(0.0, 0.0, 60.0, hover))
    await drone.seen("attitude_angular_velocity_body", lambda rate: abs(rate.yaw_rad_s - radians(60)) < 0.1)
    await offboard.stop()
    await drone.come_down()


async def test_sticks_fly(drone):
    async def steer(pitch, roll, throttle, yaw):
        while True:
            await drone.manual_control.set_manual_control_input(pitch, roll, throttle, yaw)
            await asyncio.sleep(0.02)

    await drone.take_off(4.0)
    for start, mode in (
        (drone.manual_control.start_position_control, FlightMode.POSCTL),
        (drone.manual_control.start_altitude_control, FlightMode.ALTCTL),
    ):
        sticks = asyncio.create_task(steer(0.0, 0.0, 0.5, 0.0))
        await asyncio.sleep(0.2)
        await start()
        await drone.seen("flight_mode", lambda now, wanted=mode: now == wanted)
        sticks.cancel()
        sticks = asyncio.create_task(steer(0.6, 0.0, 0.5, 0.0))
        heading = radians((await drone.seen("heading", lambda _: True)).heading_deg)
        await drone.seen(
            "velocity_ned",
            lambda now, h=heading: (
                now.north_m_s * cos(h) + now.east_m_s * sin(h) > 1.5 and abs(now.down_m_s) < 0.6
            ),
        )
        sticks.cancel()
    await drone.action.hold()
    await drone.come_down()


async def test_it_follows(drone):
    follow_me = drone.follow_me

    async def keep_telling(target):
        while True:
            try:
                await follow_me.set_target_location(target)
            except FollowMeError as error:  # telemetry may know of the mode before its plugin does
                if error.result != FollowMeResult.NOT_ACTIVE:
                    raise
            await asyncio.sleep(0.1)

    home = await drone.seen("home", lambda _: True)
    await follow_me.set_config(Config(8.0, 5.0, 0.1, Config.FollowAltitudeMode.CONSTANT, 8.0, 180.0))
    assert (await follow_me.get_config()).follow_distance_m == pytest.approx(5.0)
    await drone.take_off(5.0)
    await follow_me.start()
    await drone.seen("flight_mode", lambda mode: mode == FlightMode.FOLLOW_ME)
    for away_m in (15.0, 25.0):
        target = TargetLocation(*at(home, away_m, 0.0), home.absolute_altitude_m, 0.0, 0.0, 0.0)
        reporting = asyncio.create_task(keep_telling(target))
        await drone.seen(
            "position_velocity_ned",
            lambda now, m=home.local_north_m + away_m: (
                3.0 < hypot(now.position.north_m - m, now.position.east_m - home.local_east_m) < 7.0
            ),
        )
        reporting.cancel()
    await follow_me.stop()
    await drone.come_down()


async def test_parameters(drone):
    param = drone.param
    everything = await param.get_all_params()
    floats = {each.name: each.value for each in everything.float_params}
    whole = {each.name: each.value for each in everything.int_params}
    assert floats["MPC_XY_VEL_MAX"] == 12.0
    assert len(floats) > 50 and len(whole) > 50
    assert await param.get_param_int("COM_OBL_RC_ACT") == whole["COM_OBL_RC_ACT"]
    await param.set_param_int("COM_OBL_RC_ACT", 5)
    assert await param.get_param_int("COM_OBL_RC_ACT") == 5
    await param.set_param_float("MPC_XY_CRUISE", 4.5)
    assert await param.get_param_float("MPC_XY_CRUISE") == 4.5
    with pytest.raises(ParamError) as wrong:
        await param.get_param_int("MPC_XY_CRUISE")
    assert wrong.value.result == ParamResult.WRONG_TYPE


async def test_information_health_and_metadata(drone):
    assert (await drone.info.get_version()).flight_sw_major == 1
    assert (await drone.info.get_product()).vendor_id == 0
    await anext(drone.info.subscribe_flight_information())
    began_s, vehicle_s = time.monotonic(), await drone.vehicle_s()
    await asyncio.sleep(1.0)
    told = await drone.info.get_speed_factor()
    assert told == pytest.approx(
        (await drone.vehicle_s() - vehicle_s) / (time.monotonic() - began_s), rel=0.4
    )
    async with asyncio.timeout(15.0):
        report = await anext(drone.events.subscribe_health_and_arming_checks())
        assert report.current_mode_intention.can_arm_or_run
        await drone.component_metadata.request_autopilot_component()
        # To the end: MAVSDK 4.1 crashes when it is destroyed while it still has metadata to tell.
        texts, updates = {}, drone.component_metadata.subscribe_metadata_available()
        async for update in updates:
            texts[update.type] = update.json_metadata
            if update.type == MetadataType.ALL_COMPLETED:
                break
        await updates.aclose()
        assert "MPC_XY_VEL_MAX" in texts[MetadataType.PARAMETER]


async def test_calibration_failures_shell_and_messages_of_ones_own(drone):
    async with asyncio.timeout(15.0):
        steps = [result async for result, _ in drone.calibration.calibrate_gyro()]
    assert steps[-1] == CalibrationResult.SUCCESS

    # Kept until the end: MAVSDK loses later requests for parameters if a plugin ends that waits for one.
    first = drone.another("failure")
    with pytest.raises(FailureError):
        await first.inject(FailureUnit.SENSOR_GPS, FailureType.OFF, 0)
    await drone.param.set_param_int("SYS_FAILURE_EN", 1)
    assert drone.failure  # it reads the parameter once, when it is made
    await asyncio.sleep(0.5)
    for kind in (FailureType.OFF, FailureType.OK):
        await drone.failure.inject(FailureUnit.SENSOR_GPS, kind, 0)
    await drone.param.set_param_int("SYS_FAILURE_EN", 0)
    del first

    answers = drone.shell.subscribe_receive()
    told = asyncio.create_task(anext(answers))
    await asyncio.sleep(0.1)
    await drone.shell.send("help\n", 10)
    assert (await asyncio.wait_for(told, 10.0)) is not None

    async with asyncio.timeout(10.0):
        message = await anext(drone.direct.subscribe_message("ATTITUDE"))
    assert '"yaw"' in message.fields_json
