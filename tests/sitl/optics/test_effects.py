"""What effects do to an image, measured in the image."""

from math import cos, radians, sin, sqrt

import cv2
import numpy as np
import pytest

from framerunner.geometry.rotations import quaternion_from_euler
from scenarios.imaging.effects import CameraEffects, Hall, LensDistortion, Patch
from scenarios.models import Camera, Light, Pole, Scenario
from scenarios.random_scenarios import load_level, random_scenario
from sitl.camera import ExposureMotion
from sitl.camera import SimulatedCamera as PaintedCamera
from sitl.optics.sensor import SensorChain

AHEAD = quaternion_from_euler(0.0, 0.0, 0.0)
BARREL = LensDistortion(k1=-0.28, k2=0.07, p1=0.001, p2=-0.0005)


def scene(effects, **parts):
    camera = Camera(position_flu_m=(0.0, 0.0, 0.0), effects=effects)
    return Scenario(name="effects", camera=camera, **parts)


def middle_of_red(image):
    blue, green, red = (image[..., channel].astype(float) for channel in range(3))
    weight = np.clip(red - 2.0 * np.maximum(blue, green), 0.0, None)
    rows, columns = np.mgrid[0 : image.shape[0], 0 : image.shape[1]]
    return (weight * columns).sum() / weight.sum(), (weight * rows).sum() / weight.sum()


def poster(y_m, z_m, size_m=0.3):
    return Patch(surface="front", colour="red", across_m=-y_m, up_m=z_m, width_m=size_m, height_m=size_m)


@pytest.mark.parametrize(("y_m", "z_m"), [(0.0, 2.0), (5.5, 4.6), (-5.5, 0.5), (5.5, 2.0)])
def test_a_lens_moves_what_is_seen_to_where_opencv_projects_it(y_m, z_m):
    scenario = scene(CameraEffects(lens=BARREL), hall=Hall(beyond_m=1.5), patches=[poster(y_m, z_m)])
    column, row = middle_of_red(PaintedCamera(scenario).render((0.0, 0.0, 2.0), AHEAD))
    focal = scenario.camera.focal_px
    matrix = np.array([[focal, 0.0, 159.5], [0.0, focal, 119.5], [0.0, 0.0, 1.0]])
    front = np.array([[-y_m, -(z_m - 2.0), 6.498]])
    expected, _ = cv2.projectPoints(front, np.zeros(3), np.zeros(3), matrix, np.array(BARREL.coefficients))
    assert (column, row) == pytest.approx(tuple(expected.ravel()), abs=0.4)


def test_effects_that_do_nothing_leave_the_image_as_it_is():
    turned = quaternion_from_euler(0.2, 0.0, 0.0)
    hung = {"hall": Hall(beyond_m=1.5), "patches": [poster(0.5, 2.2)]}
    plain = PaintedCamera(scene(None, **hung)).render((0.0, 0.0, 2.0), turned)
    same = PaintedCamera(scene(CameraEffects(), **hung)).render((0.0, 0.0, 2.0), turned)
    assert same.shape == plain.shape
    assert np.abs(same.astype(int) - plain).mean() < 0.2
    assert middle_of_red(same) == pytest.approx(middle_of_red(plain), abs=0.1)


@pytest.mark.parametrize("level", [10, 60, 200])
def test_noise_is_that_of_reading_and_of_electrons(level):
    effects = CameraEffects(read_noise=2.0, shot_noise=4.0)
    chain = SensorChain(Camera(effects=effects), seed=5)
    image = chain.develop(np.full((240, 320, 3), level, np.uint8), 1_000_000).astype(float)
    assert image.mean() == pytest.approx(level, abs=0.7)
    assert image.std() == pytest.approx(sqrt(2.0**2 + level * 4.0**2 / 255.0), rel=0.06)
    assert abs(np.corrcoef(image[:, 1:, 0].ravel(), image[:, :-1, 0].ravel())[0, 1]) < 0.02


def test_noise_follows_from_seed_and_time():
    def image(seed, time_us):
        camera = PaintedCamera(scene(CameraEffects(read_noise=2.0)), seed)
        return camera.render((0.0, 0.0, 2.0), AHEAD, motion=ExposureMotion(time_us))

    assert np.array_equal(image(1, 36_000), image(1, 36_000))
    assert not np.array_equal(image(1, 36_000), image(2, 36_000))
    assert not np.array_equal(image(1, 36_000), image(1, 136_000))


def test_gain_and_white_balance_are_regulated():
    grey = np.full((240, 320, 3), 128, np.uint8)
    effects = CameraEffects(illumination=0.3, light_rgb=(1.0, 0.8, 0.5), gain="auto", auto_mean=110.0)
    warm = SensorChain(Camera(effects=effects), 0).develop(grey.copy(), 0).mean(axis=(0, 1))
    assert warm.mean() == pytest.approx(110.0, abs=5.0)
    assert warm[2] / warm[0] == pytest.approx(2.0, rel=0.05)
    balanced = effects.model_copy(update={"white_balance": "auto", "auto_balance": 1.0})
    means = SensorChain(Camera(effects=balanced), 0).develop(grey.copy(), 0).mean(axis=(0, 1))
    assert np.ptp(means) < 4.0


def test_vignetting_darkens_the_corners():
    grey = np.full((240, 320, 3), 200, np.uint8)
    image = SensorChain(Camera(effects=CameraEffects(vignetting=0.4)), 0).develop(grey, 0)
    assert image[120, 160, 0] == pytest.approx(200, abs=1)
    assert image[0, 0, 0] == pytest.approx(120, abs=2)


def pole_columns(effects, motion):
    """Column of the middle of a pole 3 m ahead, in each row."""
    pole = Pole(x_m=3.0, y_m=0.0, edge_m=0.3)
    image = PaintedCamera(scene(effects, poles=[pole])).render((0.0, 0.0, 2.0), AHEAD, motion=motion)
    excess = np.clip(image[..., 0].astype(float) - 1.6 * image[..., 1], 0.0, None)
    return (excess * np.arange(320)).sum(axis=1)[40:200] / excess.sum(axis=1)[40:200]


def test_a_rolling_shutter_shears_what_a_turning_camera_sees():
    rate, readout_s = 1.2, 0.02
    columns = pole_columns(
        CameraEffects(readout_s=readout_s), ExposureMotion(0, rate_frd_rad_s=(0.0, 0.0, rate))
    )
    slope = np.polyfit(np.arange(len(columns)), columns, 1)[0]
    # Turning right moves it left, the more the later a row is read.
    assert slope * 240 == pytest.approx(-160.1 * rate * readout_s, rel=0.1)


def test_a_rolling_shutter_shears_what_a_flying_camera_passes():
    columns = pole_columns(
        CameraEffects(readout_s=0.02), ExposureMotion(0, velocity_arena_m_s=(0.0, 2.0, 0.0))
    )
    slope = np.polyfit(np.arange(len(columns)), columns, 1)[0]
    assert slope * 240 == pytest.approx(160.1 * 2.0 * 0.02 / 2.85, rel=0.1)


def test_motion_during_the_exposure_blurs():
    def edge_px(rate):
        pole = Pole(x_m=3.0, y_m=0.0, edge_m=0.6)
        camera = PaintedCamera(scene(CameraEffects(exposure_s=0.02), poles=[pole]))
        motion = ExposureMotion(0, rate_frd_rad_s=(0.0, 0.0, rate))
        row = camera.render((0.0, 0.0, 2.0), AHEAD, motion=motion)[100].astype(float)[:, 1]
        share = (row[:160] - row[160]) / (row[120] - row[160])
        return np.count_nonzero((share > 0.05) & (share < 0.95))

    assert edge_px(0.0) <= 1
    assert edge_px(1.0) == pytest.approx(160.1 * 1.0 * 0.02, abs=1.3)


def test_the_light_turns():
    scenario = random_scenario(load_level("calm"), 3)
    gate = scenario.frames[0]
    turning = scenario.model_copy(update={"light": Light(turn_rad_s=0.2)})
    camera = PaintedCamera(turning)
    x, y = gate.x_m - 1.5 * cos(gate.yaw_rad), gate.y_m - 1.5 * sin(gate.yaw_rad)
    pose = ((x, y, gate.z_m), quaternion_from_euler(0.0, radians(20.0), gate.yaw_rad))
    early, late = (camera.render(*pose, motion=ExposureMotion(time_us)) for time_us in (0, 8_000_000))
    assert not np.array_equal(early, late)
    assert np.array_equal(early, camera.render(*pose, motion=ExposureMotion(0)))
    assert np.array_equal(early, PaintedCamera(scenario).render(*pose))


def test_things_hang_on_the_halls_walls():
    scenario = scene(None, hall=Hall(beyond_m=1.5), patches=[poster(1.0, 2.5)])
    column, row = middle_of_red(PaintedCamera(scenario).render((0.0, 0.0, 2.0), AHEAD))
    assert column == pytest.approx(159.5 - 160.1 * 1.0 / 6.5, abs=0.5)
    assert row == pytest.approx(119.5 - 160.1 * 0.5 / 6.5, abs=0.5)


def test_unused_parts_are_not_written():
    written = random_scenario(load_level("calm"), 1).model_dump(mode="json")
    assert "hall" not in written
    assert "patches" not in written
    assert "effects" not in written["camera"]
    assert "turn_rad_s" not in written["light"]


def test_bad_effects_are_refused():
    with pytest.raises(ValueError, match="folds the image's corners"):
        Camera(effects=CameraEffects(lens=LensDistortion(k1=-0.9)))
    with pytest.raises(ValueError, match="is a wall of the hall, and there is none"):
        scene(None, patches=[Patch(surface="back", colour="red", across_m=0, up_m=1, width_m=1, height_m=1)])
