"""The frame finder on painted images of known geometry."""

from math import atan2, cos, degrees, hypot, radians, sin

import pytest

from geometry.rotations import quaternion_from_euler
from geometry.vectors import Quaternion, Vec3
from scenarios.models import Base, Frame, Scenario
from sitl.camera import Camera
from vision.detectors import new_detector
from vision.types import Detections, FrameSighting

FRAME = Frame(colour="green", x_m=0, y_m=0, z_m=1.5, yaw_rad=0.4)
SCENARIO = Scenario(name="one", frames=(FRAME,), base=Base(x_m=4.5, y_m=4.5))
CAMERA = Camera(SCENARIO)
FIND = new_detector("frames", focal_px=CAMERA.focal_px, rendered=True)


def look(
    distance: float, turn: float = 0.0, roll: float = 0.0, pitch: float = 0.0, aside: float = 0.0
) -> tuple[Vec3, Quaternion]:
    """Pose with the camera `distance` from the frame's centre, `turn` round it, looking at it."""
    yaw = FRAME.yaw_rad + turn
    reach = distance + 0.08
    position = (-reach * cos(yaw), -reach * sin(yaw), FRAME.z_m)
    return position, quaternion_from_euler(roll, pitch, yaw + aside)


def see(position: Vec3, attitude: Quaternion) -> Detections:
    return FIND(CAMERA.render(position, attitude), 7)


def only(found: Detections) -> FrameSighting:
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
    # Turned counter-clockwise round the frame, the camera is on the right of its axis: left is the way.
    assert found.green.signed_a == pytest.approx(degrees(turn), abs=4.0)
    assert found.green.seen
    assert found.time_us == 7
    assert not found.red.seen


def test_a_frame_behind_is_not_seen() -> None:
    position, _ = look(1.0)
    assert see(position, quaternion_from_euler(0.0, 0.0, FRAME.yaw_rad + radians(180))).frames == ()
