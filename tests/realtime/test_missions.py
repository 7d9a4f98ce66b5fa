"""A mission, a fence and rally points by MAVSDK over UDP: up, down, flown, paused, finished."""

import asyncio
from math import cos, nan, radians

import pytest
from mavsdk.asyncio.plugins.action import ActionAsync
from mavsdk.asyncio.plugins.geofence import Circle, FenceType, GeofenceAsync, GeofenceData, Point
from mavsdk.asyncio.plugins.mission import MissionAsync, MissionItem, MissionPlan
from mavsdk.asyncio.plugins.mission_raw import MissionItem as RawItem
from mavsdk.asyncio.plugins.mission_raw import MissionRawAsync
from mavsdk.asyncio.plugins.telemetry import TelemetryAsync

from tests.realtime.conftest import mavsdk_system

pytestmark = pytest.mark.realtime

SIM_OPTIONS = ("--speed", "4")
METRES_PER_DEGREE = 111_194.93


@pytest.fixture
async def system(sim, instance):
    async with mavsdk_system(sim.process, instance) as found:
        yield found


@pytest.fixture
async def home(system):
    telemetry = TelemetryAsync(system)
    async with asyncio.timeout(20.0):
        async for health in telemetry.subscribe_health():
            if health.is_armable and health.is_home_position_ok:
                break
        return await anext(telemetry.subscribe_home())


def beside(home, north_m, east_m):
    latitude = home.latitude_deg + north_m / METRES_PER_DEGREE
    return latitude, home.longitude_deg + east_m / METRES_PER_DEGREE / cos(radians(home.latitude_deg))


def waypoint(home, north_m, east_m, **options):
    latitude, longitude = beside(home, north_m, east_m)
    return MissionItem(latitude, longitude, 4.0, is_fly_through=True, yaw_deg=nan, **options)


async def test_a_mission_is_flown_paused_and_finished(system, home):
    mission, action, telemetry = MissionAsync(system), ActionAsync(system), TelemetryAsync(system)
    plan = MissionPlan(
        [
            waypoint(home, 8, 0, speed_m_s=4.0, camera_action=MissionItem.CameraAction.TAKE_PHOTO),
            waypoint(home, 8, 8, loiter_time_s=1.0),
            waypoint(home, 0, 4, gimbal_pitch_deg=-30.0, gimbal_yaw_deg=0.0),
        ]
    )
    await mission.set_return_to_launch_after_mission(True)
    await mission.upload_mission(plan)
    read = await mission.download_mission()
    assert [item.latitude_deg for item in read.mission_items] == pytest.approx(
        [item.latitude_deg for item in plan.mission_items], abs=1e-7
    )
    progress = []
    await action.arm()
    await mission.start_mission()
    async with asyncio.timeout(60.0):
        async for seen in mission.subscribe_mission_progress():
            progress.append((seen.current, seen.total))
            if seen.current == 1:
                await mission.pause_mission()
                await asyncio.sleep(1.0)
                assert not await mission.is_mission_finished()
                await mission.start_mission()
            if seen.current == seen.total:
                break
        async for armed in telemetry.subscribe_armed():
            if not armed:
                break
    assert progress == sorted(progress)
    assert await mission.is_mission_finished()


async def test_fence_and_rally_points_come_back_as_sent(system, home):
    raw, geofence = MissionRawAsync(system), GeofenceAsync(system)
    latitude, longitude = beside(home, 0, 0)
    circle = Circle(Point(latitude, longitude), 60.0, FenceType.INCLUSION)
    await geofence.upload_geofence(GeofenceData([], [circle]))
    (kept,) = await raw.download_geofence()
    assert (kept.command, kept.param1, kept.x) == (5003, 60.0, round(latitude * 1e7))
    rally = [
        RawItem(0, 3, 5100, 0, 1, x=round(latitude * 1e7), y=round(longitude * 1e7), z=20.0, mission_type=2)
    ]
    await raw.upload_rally_points(rally)
    (point,) = await raw.download_rallypoints()
    assert (point.command, point.x, point.z) == (5100, rally[0].x, 20.0)
    await geofence.clear_geofence()
    assert await raw.download_geofence() == []
