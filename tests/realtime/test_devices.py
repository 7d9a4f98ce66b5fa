"""Camera and gimbal as MAVSDK's clients use them: on the payload link, synchronously, and by the manager."""

import asyncio
from functools import partial

import pytest
from mavsdk import ComponentType, Configuration, Mavsdk
from mavsdk.asyncio.plugins.gimbal import ControlMode, GimbalAsync, GimbalMode, SendMode
from mavsdk.plugins.camera import Camera, Mode

from tests.processes import wait_until
from tests.realtime.conftest import mavsdk_system

pytestmark = pytest.mark.realtime


@pytest.mark.parametrize("url", ["udpout://127.0.0.1:{}", "udpin://0.0.0.0:{}"])
def test_the_camera_is_found_on_the_payload_link_and_does_all_a_client_asks(sim, instance, url):
    mavsdk = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
    mavsdk.add_any_connection(url.format(14030 + instance))
    assert wait_until(mavsdk.get_systems, 10.0)
    camera = Camera(mavsdk.get_systems()[0])
    assert wait_until(lambda: camera.camera_list().cameras, 10.0)
    number = camera.camera_list().cameras[0].component_id
    assert number == 100
    for operation in (  # each raises an error if it is refused
        partial(camera.set_mode, number, Mode.PHOTO),
        partial(camera.take_photo, number),
        partial(camera.set_mode, number, Mode.VIDEO),
        partial(camera.start_video, number),
        partial(camera.stop_video, number),
        partial(camera.start_video_streaming, number, 0),
        partial(camera.stop_video_streaming, number, 0),
        partial(camera.format_storage, number, 0),
        partial(camera.reset_settings, number),
    ):
        operation()


async def test_the_gimbal_is_found_and_turned_by_angles_rates_and_a_place(sim, instance):
    async with mavsdk_system(sim.process, instance) as system:
        gimbal = GimbalAsync(system)
        async with asyncio.timeout(10.0):
            found = await anext(each.gimbals async for each in gimbal.subscribe_gimbal_list() if each.gimbals)
        assert [(each.gimbal_device_id, each.model_name) for each in found] == [(154, "simulated gimbal")]

        async def angles(pitch_deg, yaw_deg):
            async with asyncio.timeout(10.0):
                async for update in gimbal.subscribe_attitude():
                    seen = update.euler_angle_forward
                    is_turned = yaw_deg is None or seen.yaw_deg == pytest.approx(yaw_deg, abs=1.0)
                    if seen.pitch_deg == pytest.approx(pitch_deg, abs=1.0) and is_turned:
                        return

        await gimbal.take_control(1, ControlMode.PRIMARY)
        await gimbal.set_angles(1, 0.0, -60.0, 45.0, GimbalMode.YAW_FOLLOW, SendMode.ONCE)
        await angles(-60.0, 45.0)
        await gimbal.set_angular_rates(1, 0.0, -30.0, 0.0, GimbalMode.YAW_FOLLOW, SendMode.STREAM)
        await angles(-90.0, None)  # straight down, where MAVSDK's yaw and roll are not defined
        await gimbal.set_roi_location(1, 47.397742, 8.555594, 489.0)  # 750 m east of the drone
        await angles(0.0, 90.0)
        await gimbal.release_control(1)
