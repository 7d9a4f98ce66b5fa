"""The camera, the streams and the vehicle's own description, as MAVSDK 4 sees them in a running simulator."""

import asyncio
import time
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
from mavsdk.asyncio.plugins.camera import CameraAsync, CameraError, Mode, PhotosRange
from mavsdk.asyncio.plugins.ftp import FtpAsync
from mavsdk.asyncio.plugins.info import InfoAsync
from mavsdk.asyncio.plugins.telemetry import TelemetryAsync

from tests.realtime.conftest import mavsdk_system

pytestmark = pytest.mark.realtime

CAMERA = 100
STREAMED = (
    "position",
    "attitude_quaternion",
    "velocity_ned",
    "gps_info",
    "battery",
    "odometry",
    "distance_sensor",
    "altitude",
    "imu",
    "scaled_imu",
    "ground_truth",
    "actuator_output_status",
)


async def first(updates, wanted=lambda update: True, limit_s=15.0):
    async with asyncio.timeout(limit_s):
        async for update in updates:
            if wanted(update):
                return update
    raise AssertionError("the stream has ended")


@pytest.fixture
async def drone(sim, instance):
    async with mavsdk_system(sim.process, instance) as system:
        yield SimpleNamespace(
            camera=CameraAsync(system),
            ftp=FtpAsync(system),
            info=InfoAsync(system),
            telemetry=TelemetryAsync(system),
            http_port=8100 + instance,
        )


async def test_a_camera_is_listed_described_and_takes_pictures_that_can_be_fetched(drone, tmp_path):
    camera = drone.camera
    (listed,) = (await first(camera.subscribe_camera_list(), lambda update: update.cameras)).cameras
    assert (listed.component_id, listed.vendor_name) == (CAMERA, "framerunner")
    assert (listed.horizontal_resolution_px, listed.vertical_resolution_px) == (320, 240)
    await camera.set_mode(CAMERA, Mode.PHOTO)

    capture = asyncio.create_task(first(camera.subscribe_capture_info()))
    await asyncio.sleep(0.3)
    await camera.take_photo(CAMERA)
    taken = await capture
    assert taken.is_success
    assert taken.index == 0
    assert taken.position.latitude_deg == pytest.approx(47.3977, abs=1e-3)

    await camera.start_photo_interval(CAMERA, 0.2)
    await asyncio.sleep(1.0)
    await camera.stop_photo_interval(CAMERA)
    await first(
        camera.subscribe_storage(), lambda update: update.storage.storage_id
    )  # now the status is known
    assert len(await camera.list_photos(CAMERA, PhotosRange.ALL)) >= 4

    path = taken.file_url.removeprefix("mftp://[;comp=1]")
    async with asyncio.timeout(10.0):
        async for _ in drone.ftp.download(path, str(tmp_path), False):
            pass
    picture = cv2.imread(str(tmp_path / path.rpartition("/")[2]))
    assert picture.shape == (240, 320, 3)
    assert np.ptp(picture) > 50


async def test_video_is_recorded_and_storage_formatted_and_what_is_not_there_is_refused(drone):
    camera = drone.camera
    await first(camera.subscribe_camera_list(), lambda update: update.cameras)
    await camera.set_mode(CAMERA, Mode.VIDEO)
    await camera.start_video(CAMERA)
    await asyncio.sleep(1.0)
    await camera.stop_video(CAMERA)
    listed = await drone.ftp.list_directory("DCIM")
    assert [entry.name for entry in listed.entries] != []
    await camera.stop_video_streaming(CAMERA, 0)
    await camera.start_video_streaming(CAMERA, 0)
    await camera.format_storage(CAMERA, 0)
    await camera.reset_settings(CAMERA)
    assert "DCIM" not in [entry.name for entry in (await drone.ftp.list_directory("/")).entries]
    with pytest.raises(CameraError):
        await camera.zoom_in_start(CAMERA)
    stream = (await first(camera.subscribe_video_stream_info(), lambda update: update)).video_stream_info
    assert stream.settings.horizontal_resolution_pix == 320
    assert stream.settings.uri  # the preferred one's
    storage = (await first(camera.subscribe_storage(), lambda update: update.storage.storage_id)).storage
    assert storage.total_storage_mib >= storage.available_storage_mib > 0.0


@pytest.mark.alone
async def test_every_rate_that_px4_lets_one_set_is_set_and_streamed(drone):
    telemetry = drone.telemetry
    for name in STREAMED:
        await getattr(telemetry, f"set_rate_{name}")(20.0)
    counts = dict.fromkeys(STREAMED, 0)

    async def count(name):
        async for _ in getattr(telemetry, f"subscribe_{name}")():
            counts[name] += 1

    tasks = [asyncio.create_task(count(name)) for name in STREAMED]
    began_s = time.monotonic()
    await asyncio.sleep(3.0)
    rates_hz = {name: number / (time.monotonic() - began_s) for name, number in counts.items()}
    for task in tasks:
        task.cancel()
    assert {name: rate for name, rate in rates_hz.items() if not 14.0 < rate < 24.0} == {}


async def test_it_says_which_version_it_follows_and_who_it_is(drone):
    version = await drone.info.get_version()
    assert (version.flight_sw_major, version.flight_sw_minor) == (1, 17)
    assert (await drone.info.get_identification()).legacy_uid > 0
