"""The gate finder on painted images of known geometry."""

from dataclasses import asdict
from math import atan2, cos, degrees, hypot, radians, sin

import cv2
import numpy as np
import pytest

from framerunner.geometry.gate_shape import GateShape, GateShapes
from framerunner.geometry.rotations import quaternion_from_euler
from framerunner.geometry.vectors import Quaternion, Vec3
from scenarios.imaging.effects import CameraEffects, Hall, LensDistortion, Patch
from scenarios.models import Base, Decoy, Gate, Pole, Scenario
from scenarios.models import Camera as ScenarioCamera
from sitl.camera import SimulatedCamera
from vision.bar_edges import find_edges
from vision.calibration.model import Calibration, CalibrationError
from vision.detectors import new_detector
from vision.patch import ImagePatch
from vision.types import Detections, GateSighting

GATE = Gate(colour="green", x_m=0, y_m=0, z_m=1.5, yaw_rad=0.4)
SCENARIO = Scenario(name="one", frames=(GATE,), base=Base(x_m=4.5, y_m=4.5))
CAMERA = SimulatedCamera(SCENARIO)
FIND = new_detector("frames", focal_px=CAMERA.focal_px)


def look(
    distance: float, turn: float = 0.0, roll: float = 0.0, pitch: float = 0.0, aside: float = 0.0
) -> tuple[Vec3, Quaternion]:
    """Pose with the camera `distance` from the gate's centre, `turn` round it, looking at it."""
    yaw = GATE.yaw_rad + turn
    reach = distance + 0.08
    position = (-reach * cos(yaw), -reach * sin(yaw), GATE.z_m)
    return position, quaternion_from_euler(roll, pitch, yaw + aside)


def see(position: Vec3, attitude: Quaternion) -> Detections:
    return FIND(CAMERA.render(position, attitude), 7)


def only(found: Detections) -> GateSighting:
    (sighting,) = found.frames
    assert sighting.colour == "green"
    return sighting


@pytest.mark.parametrize("distance", [0.7, 1.0, 2.0, 4.0, 6.0])
@pytest.mark.parametrize("turn", [-1.1, -0.5, 0.05, 0.8])
def test_one_of_the_poses_is_right(distance: float, turn: float) -> None:
    sighting = only(see(*look(distance, turn, roll=0.1, pitch=-0.02)))
    assert sighting.whole
    best = min(sighting.poses, key=lambda pose: abs(atan2(-pose.normal_flu[1], -pose.normal_flu[0]) + turn))
    assert hypot(*best.position_flu_m) == pytest.approx(distance, rel=0.01 + 0.006 * distance)
    normal = atan2(-best.normal_flu[1], -best.normal_flu[0])
    # Seen from the front, a small turn hardly changes the image.
    assert abs(degrees(normal + turn)) < (1.0 + 2.0 * distance if abs(turn) > 0.3 else 4.0 + 4.0 * distance)


@pytest.mark.parametrize("turn", [-1.0, 1.0])  # mirror images: the solver answers NaN to one of them
def test_the_signed_angle_says_where_to_fly(turn: float) -> None:
    found = see(*look(0.8, turn))
    # Turned counter-clockwise round the gate, the camera is on the right of its axis: left is the way.
    assert found.green.signed_a == pytest.approx(degrees(turn), abs=4.0)
    assert found.green.seen
    assert found.time_us == 7
    assert not found.red.seen


@pytest.mark.parametrize(
    ("shape", "distance"),
    [
        (GateShape(0.5, 0.5, 0.02, 0.02), 2.5),
        (GateShape(1.5, 0.8, 0.06, 0.06), 4.0),
        (GateShape(0.6, 1.1, 0.05, 0.01), 3.0),
        (GateShape(0.35, 0.2, 0.01, 0.03), 1.2),
    ],
)
def test_gates_of_other_shapes_have_their_corners_and_poses(shape: GateShape, distance: float) -> None:
    gate = GATE.model_copy(update=asdict(shape))
    decoy = Decoy(colour="cyan", x_m=-3.0, y_m=4.0, z_m=1.5, outer_width_m=0.8)
    scenario = SCENARIO.model_copy(update={"frames": (gate,), "decoys": (decoy,)})
    shapes = GateShapes(scenario.gate_shapes)
    find = new_detector("frames", focal_px=CAMERA.focal_px, shapes=shapes)
    image = SimulatedCamera(scenario).render(*look(distance, 0.5))
    sighting = only(find(image, 7))
    assert sighting.whole
    places = [pose.position_flu_m for pose in sighting.poses]
    assert min(abs(hypot(*place) / distance - 1.0) for place in places) < 0.015
    box = new_detector("boxes", focal_px=CAMERA.focal_px, shapes=shapes)(image, 7).green
    assert box.d == pytest.approx(distance, rel=0.12)  # the paper's formula: it takes the nearer upright bar


def test_a_gate_behind_is_not_seen() -> None:
    position, _ = look(1.0)
    assert see(position, quaternion_from_euler(0.0, 0.0, GATE.yaw_rad + radians(180))).frames == ()


def test_a_gate_that_the_border_cuts_has_its_sure_corners() -> None:
    sighting = only(see(*look(0.6, 0.3, aside=-0.75)))
    assert not sighting.whole
    upper_left, upper_right, lower_right, lower_left = sighting.corners
    assert upper_left is lower_left is None
    assert upper_right is not None
    assert lower_right is not None
    assert upper_right.down_px < lower_right.down_px


def test_a_gate_behind_another_is_seen_through_it() -> None:
    blue = Gate(colour="blue", x_m=2, y_m=-0.4, z_m=1.5, yaw_rad=0.3)
    red = Gate(colour="red", x_m=0.8, y_m=0, z_m=1.5, yaw_rad=0)
    scenario = Scenario(name="two", frames=(red, blue), base=Base(x_m=4.5, y_m=4.5))
    image = SimulatedCamera(scenario).render((-0.08, 0.0, 1.5), (1.0, 0.0, 0.0, 0.0))
    found = {sighting.colour: sighting for sighting in FIND(image, None).frames}
    assert found["red"].whole
    assert not found["blue"].whole
    corners = found["blue"].corners
    assert sum(corner is not None for corner in corners) >= 2
    for corner, (left, up) in zip(corners, ((1, 1), (-1, 1), (-1, -1), (1, -1)), strict=True):
        ahead, aside = 2.0 - left * 0.21 * sin(0.3), -0.4 + left * 0.21 * cos(0.3)
        if corner is not None:
            assert corner.right_px == pytest.approx(-CAMERA.focal_px * aside / ahead, abs=1.0)
            assert corner.down_px == pytest.approx(-CAMERA.focal_px * 0.11 * up / ahead, abs=1.0)


def test_what_looks_like_a_gate_but_is_none_is_refused() -> None:
    image = np.full((240, 320, 3), 200, np.uint8)
    cv2.rectangle(image, (60, 60), (140, 102), (0, 0, 255), -1)  # filled
    cv2.rectangle(image, (200, 60), (240, 180), (0, 255, 0), 6)  # upright
    cv2.circle(image, (280, 200), 25, (255, 0, 0), 4)
    cv2.line(image, (20, 200), (90, 220), (0, 0, 255), 3)
    assert FIND(image, None).frames == ()


def test_obstacles_end_where_they_stand() -> None:
    pole = Pole(x_m=2.0, y_m=0.0, edge_m=0.3)
    scenario = Scenario(name="pole", frames=(GATE,), base=Base(x_m=4.5, y_m=4.5), poles=(pole,))
    image = SimulatedCamera(scenario).render((-0.08, 0.0, 1.0), (1.0, 0.0, 0.0, 0.0))
    edges = [edge for edge in FIND(image, None).obstacle_edges if not edge.cut]
    assert edges
    for edge in edges:
        assert abs(edge.right_px) < 160 * 0.15 / 1.85 + 1
        assert edge.down_px == pytest.approx(160.1 * 1.0 / 1.85, abs=1.0)


def test_any_image_gets_an_answer() -> None:
    stream = np.random.Generator(np.random.PCG64(3))
    colours = [
        (0, 0, 255),
        (0, 255, 0),
        (255, 0, 0),
        (255, 255, 0),
        (255, 0, 255),
        (180, 70, 120),
        (0, 0, 90),
    ]
    for number in range(120):
        image = np.full((240, 320, 3), stream.integers(0, 256, 3), np.uint8)
        for _ in range(int(stream.integers(1, 9))):
            points = stream.integers(-40, 360, (int(stream.integers(2, 7)), 2)).astype(np.int32)
            colour, width = colours[int(stream.integers(len(colours)))], int(stream.integers(1, 14))
            if number % 2:
                cv2.polylines(image, [points], True, colour, width)
            else:
                cv2.fillPoly(image, [points], colour)
        for sighting in FIND(image, None).frames:
            assert any(sighting.corners)


BARREL = LensDistortion(k1=-0.25, k2=0.07, p1=0.001, p2=-0.001)


@pytest.mark.parametrize(
    ("distance_m", "aside_deg", "angle_deg"), [(0.5, 0, 10), (0.8, 25, 30), (2.0, 35, 20)]
)
def test_a_calibrated_camera_gives_corners_and_poses_of_an_ideal_one(distance_m, aside_deg, angle_deg):
    aside, angle = np.radians((aside_deg, angle_deg))
    x, y = distance_m * np.cos(aside), distance_m * np.sin(aside)
    gate = Gate(colour="red", x_m=x, y_m=y, z_m=1.2, yaw_rad=float(aside + angle))
    camera = ScenarioCamera(position_flu_m=(0.0, 0.0, 0.0), effects=CameraEffects(lens=BARREL))
    image = SimulatedCamera(Scenario(name="lens", frames=[gate], camera=camera)).render(
        (0.0, 0.0, 1.2), (1.0, 0.0, 0.0, 0.0)
    )
    calibration = Calibration.ideal(320, 240, camera.focal_px, BARREL.coefficients)
    find = new_detector("frames", calibration=calibration)
    (sighting,) = find(image, None).frames
    assert sighting.poses[0].position_flu_m == pytest.approx((x, y, 0.0), abs=0.015 * distance_m)
    ideal = new_detector("frames", focal_px=camera.focal_px)
    blind = ideal(image, None).frames
    if distance_m < 1.0:  # without the calibration it is no gate, or elsewhere
        assert (
            not blind
            or not blind[0].poses
            or blind[0].poses[0].position_flu_m != pytest.approx((x, y, 0.0), abs=0.015 * distance_m)
        )


def test_images_of_another_size_than_calibrated_are_refused():
    calibration = Calibration.ideal(640, 480, 300.0, BARREL.coefficients)
    with pytest.raises(CalibrationError, match="images have 320 x 240 pixels, but the calibration is of 640"):
        new_detector("frames", calibration=calibration)(np.zeros((240, 320, 3), np.uint8), None)


@pytest.mark.parametrize("border_m", [None, 0.14, 0.012])
def test_sheets_and_drawn_rectangles_are_no_gates(border_m):
    poster = Patch(
        surface="front", colour="red", across_m=0.0, up_m=1.2, width_m=1.2, height_m=0.6, border_m=border_m
    )
    scenario = Scenario(name="poster", hall=Hall(), patches=[poster])
    image = SimulatedCamera(scenario).render((3.5, 0.0, 1.2), (1.0, 0.0, 0.0, 0.0))
    assert not [sighting for sighting in FIND(image, None).frames if sighting.poses]


@pytest.mark.parametrize("up_m", [1.3, 1.05])
def test_a_gate_before_a_poster_of_its_colour_is_found(up_m):
    gate = Gate(colour="red", x_m=2.0, y_m=0.0, z_m=1.2, yaw_rad=0.2)
    poster = Patch(surface="front", colour="red", across_m=0.3, up_m=up_m, width_m=0.3, height_m=1.2)
    camera = ScenarioCamera(position_flu_m=(0.0, 0.0, 0.0))
    scenario = Scenario(name="poster", frames=[gate], camera=camera, hall=Hall(), patches=[poster])
    image = SimulatedCamera(scenario).render((0.9, 0.0, 1.2), (1.0, 0.0, 0.0, 0.0))
    whole = [sighting for sighting in FIND(image, None).frames if sighting.whole and sighting.poses]
    assert whole[0].poses[0].position_flu_m == pytest.approx((1.1, 0.0, 0.0), abs=0.03)


def test_a_bar_that_is_expected_wider_than_the_image_is_looked_for_in_the_image_only():
    patch = ImagePatch(
        np.zeros((40, 60), np.uint8), np.zeros((40, 60), np.int16), (30.0, 20.0), (160.0, 120.0)
    )
    a, b, c, d = (-10.0, -5.0), (10.0, -5.0), (10.0, 5.0), (-10.0, 5.0)
    edges = find_edges(patch, ((a, b), (b, c), (c, d), (d, a)), [(1e9, 1e9)] * 4)
    assert not edges.outer_ok.any()
