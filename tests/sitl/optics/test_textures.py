"""Textures of floor and walls, compared with where their places are projected and with finer images."""

import cv2
import numpy as np
import pytest

from framerunner.geometry.rotations import quaternion_from_euler
from scenarios.imaging.effects import CameraEffects, Hall
from scenarios.imaging.textures import PATTERNS, Texture
from scenarios.models import Camera, Scenario
from scenarios.random_scenarios import load_level, random_scenario
from sitl.camera import ExposureMotion, SimulatedCamera
from sitl.optics.texture import TextureError

POSES = [
    ((-4.0, 0.0, 1.5), quaternion_from_euler(0.0, 0.0, 0.0)),
    ((-3.0, -3.0, 1.0), quaternion_from_euler(0.05, 0.1, 0.7)),
    ((3.5, -3.5, 0.7), quaternion_from_euler(-0.3, 0.2, 2.2)),
]
ON_THE_FLOOR = ((-0.9, 0.5), (0.0, -2.5), (0.5, 3.0), (-0.9, -2.0))


@pytest.fixture
def dotted(tmp_path):
    """A photograph of the whole arena's floor, with dots; (x, y) is at 100 (5 + x), 100 (5 - y)."""
    photograph = np.full((1000, 1000, 3), 200, np.uint8)
    for x, y in ON_THE_FLOOR:
        cv2.circle(photograph, (round(100 * (5 + x)), round(100 * (5 - y))), 12, (30, 30, 30), -1)
    path = tmp_path / "dots.png"
    cv2.imwrite(str(path), photograph)
    return Texture(photograph=str(path), width_m=10.0)


def darkest(image, near, radius=9):
    """Centre of the dark pixels near a place."""
    column, row = (round(each) for each in near)
    part = image[row - radius : row + radius + 1, column - radius : column + radius + 1].mean(axis=2)
    weight = np.clip(part.max() - part - 20.0, 0.0, None)
    rows, columns = np.mgrid[-radius : radius + 1, -radius : radius + 1]
    return column + (weight * columns).sum() / weight.sum(), row + (weight * rows).sum() / weight.sum()


@pytest.mark.parametrize("rate_rad_s", [0.0, 1.2])
def test_places_of_a_photograph_are_where_they_are_projected(dotted, rate_rad_s):
    readout_s = 0.02
    camera = Camera(position_flu_m=(0.0, 0.0, 0.0), effects=CameraEffects(readout_s=readout_s))
    scenario = Scenario(name="dots", camera=camera, floor_texture=dotted)
    motion = ExposureMotion(0, rate_frd_rad_s=(0.0, 0.0, rate_rad_s))
    image = SimulatedCamera(scenario).render((-4.0, 0.0, 1.5), POSES[0][1], motion=motion)
    for x, y in ON_THE_FLOOR:
        column = 159.5 - camera.focal_px * y / (x + 4.0)
        row = 119.5 + camera.focal_px * 1.5 / (x + 4.0)
        # Turning right by an angle moves what is at the tangent t by (1 + t²) times it, when its row is read.
        late_s = readout_s * (row - 119.5) / 240.0
        tangent = (column - 159.5) / camera.focal_px
        column -= camera.focal_px * rate_rad_s * late_s * (1.0 + tangent**2)
        assert darkest(image, (column, row)) == pytest.approx((column, row), abs=0.7)


@pytest.mark.parametrize("pattern", PATTERNS)
def test_textures_are_anti_aliased(pattern):
    plain = random_scenario(load_level("calm"), 17)
    scenario = plain.model_copy(update={"floor_texture": Texture(pattern=pattern, seed=5)})
    fine = scenario.camera.model_copy(update={"width_px": 1280, "height_px": 960})
    finely = SimulatedCamera(scenario.model_copy(update={"camera": fine}))
    for pose in POSES:
        image = SimulatedCamera(scenario).render(*pose).astype(float)
        exact = cv2.resize(finely.render(*pose), (320, 240), interpolation=cv2.INTER_AREA).astype(float)
        floor = np.abs(image - SimulatedCamera(plain).render(*pose)).sum(axis=2) > 0
        error = (image - exact).mean(axis=2)[floor]
        assert np.sqrt((error**2).mean()) < 0.5 * exact.mean(axis=2)[floor].std()
        assert abs(error.mean()) < 0.5


def test_a_seed_draws_a_pattern_and_draws_it_again():
    def floor(seed):
        scenario = Scenario(name="seeds", floor_texture=Texture(pattern="wood", seed=seed))
        return SimulatedCamera(scenario).render(*POSES[0])

    assert np.array_equal(floor(1), floor(1))
    assert not np.array_equal(floor(1), floor(2))


def test_walls_hide_the_end_of_the_floor(tmp_path):
    def flat(level):
        path = tmp_path / f"{level}.png"
        cv2.imwrite(str(path), np.full((8, 8, 3), level, np.uint8))
        return Texture(photograph=str(path))

    hall = Hall(beyond_m=1.5, wall_texture=flat(250))
    scenario = Scenario(name="walls", hall=hall, floor_texture=flat(60))
    column = SimulatedCamera(scenario).render((0.0, 0.0, 2.0), POSES[0][1])[:, 160].mean(axis=1)
    # The wall ends 6.5 m ahead and 2 m below the camera.
    edge = 119.5 + scenario.camera.focal_px * 2.0 / (6.5 - 0.08)
    last_of_wall, first_of_floor = int(edge - 0.5), int(edge + 1.5)
    assert column[last_of_wall] == pytest.approx(column[100], abs=1.0)
    assert column[first_of_floor] == pytest.approx(column[220], abs=1.0)
    assert column[100] > column[220] + 50.0


def test_a_photograph_that_cannot_be_read_is_named(tmp_path):
    (tmp_path / "no.png").write_text("no image")
    for name, reason in (("no.png", "is no image"), ("missing.png", "cannot be read")):
        texture = Texture(photograph=str(tmp_path / name))
        with pytest.raises(TextureError, match=reason):
            SimulatedCamera(Scenario(name="bad", floor_texture=texture))
