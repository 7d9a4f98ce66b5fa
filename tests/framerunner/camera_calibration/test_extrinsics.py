"""`framerunner camera extrinsics` as its user calls it, and what a flight does with its file."""

from math import degrees
from pathlib import Path

import numpy as np
import pytest

from framerunner.camera_calibration.calibration_file import load_calibration, save_calibration
from framerunner.camera_calibration.live_mounting import Watched
from framerunner.camera_calibration.mounting_report import MountingSearch, finish
from framerunner.cli import run as command_line
from framerunner.commands.camera import extrinsics
from framerunner.errors import UserError
from framerunner.flying.plan import FlightPlan
from framerunner.geometry.rotations import quaternion_from_euler
from framerunner.wire.dialect import AUTOPILOT_COMPONENT_ID, mavlink
from offboard.drone import DroneError, DroneState
from offboard.navigation.camera_model import CameraModel
from offboard.navigation.pose_history import PoseHistory
from scenarios.loader import dump_yaml, load_scenario
from scenarios.models import Camera as CameraSettings
from scenarios.models import Scenario
from sitl.camera import SimulatedCamera
from tests.vision.calibration.seen_gates import FOCAL_PX
from vision.calibration.model import Calibration, CalibrationError
from vision.calibration.mounting import MountingFit, Movement
from vision.calibration.sightings import Sightings, Values
from vision.detectors import new_detector

ANGLES = (0.035, 0.087, -0.052)
TURNS = """\
name: turns
vision: frames
initial: rise
variables: {x0: 0, y0: 0, z0: 0}
states:
  rise:
    enter: [hover, memory.x0 = imu.x, memory.y0 = imu.y, memory.z0 = imu.z,
      "goal_m = (imu.x, imu.y, imu.z + 1)"]
    during: [fly_to_goal]
    transitions: [{when: distance_to_goal_m < 0.15, to: here}]
  here:
    enter: [cmd.rot_z = 0.7]
    during: [fly_to_goal]
    transitions: [{when: seconds_in_state > 9.3, to: there}]
  there:
    enter: [cmd.rot_z = 0.7, "goal_m = (memory.x0 + 1.4, memory.y0 + 1.2, memory.z0 + 1)"]
    during: [fly_to_goal]
    transitions: [{when: seconds_in_state > 10, to: down}]
  down:
    enter: [land]
    final: true
"""


def tilted() -> Scenario:
    scenario = load_scenario("test-case-1")
    camera = scenario.camera.model_copy(update={"mounting_frd_rad": ANGLES})
    return scenario.model_copy(update={"name": "tilted", "camera": camera})


def test_a_recorded_flight_gives_the_mounting(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scenario = tilted()
    (tmp_path / "tilted.yaml").write_text(dump_yaml(scenario))
    (tmp_path / "turns.yaml").write_text(TURNS)
    camera = scenario.camera
    file = tmp_path / "camera.yaml"
    save_calibration(Calibration.ideal(camera.width_px, camera.height_px, camera.focal_px), file)
    files = ("--mission", tmp_path / "turns.yaml", "--out", tmp_path / "runs", "--calibration", file)
    command_line(
        ["fly", str(tmp_path / "tilted.yaml"), "--lockstep", *map(str, files)]
    )  # flown again when it is read
    (run,) = (tmp_path / "runs").iterdir()
    assert extrinsics(run, calibration=file) == 0
    assert "written to" in capsys.readouterr().err
    mounting = load_calibration(file).mounting
    assert mounting is not None
    for found, angle in zip(mounting.angles_frd_rad, ANGLES, strict=True):
        assert abs(degrees(found - angle)) < 0.2
    plan = FlightPlan(scenario, calibration=load_calibration(file))
    assert plan.camera.mounting_frd_rad == mounting.angles_frd_rad


def search(*, missing: tuple[str, ...] = (), pitch_rad: float = 0.1, rms_px: float = 0.4) -> MountingSearch:
    """A mounting that was found, its images 0.093 s late."""
    nothing = np.empty(0)
    seen = Sightings(nothing.astype(str), nothing, nothing, nothing, nothing, nothing, nothing)
    found = Values((0.03, pitch_rad, -0.05), (0.08, 0.0, 0.0), 0.093)
    std = Values((0.001, 0.001, 0.002), (0.002, 0.003, 0.02), 0.001)
    fit = MountingFit(found, std, seen, nothing.astype(int), nothing.reshape(0, 3), rms_px)
    return MountingSearch(fit, Movement(300, 3, 150.0, 2.0), missing)


@pytest.mark.parametrize("stamped", [False, True])
def test_the_delay_is_written_for_images_without_time_stamps(tmp_path: Path, stamped: bool) -> None:
    file, lines = tmp_path / "camera.yaml", []
    finish(search(), Calibration.ideal(320, 240, FOCAL_PX), file, lines.append, stamped=stamped)
    written = load_calibration(file)
    assert written.delay_s == (None if stamped else 0.093)
    assert written.mounting is not None
    assert written.mounting.angles_frd_rad == (0.03, 0.1, -0.05)
    assert any("pitch     5.73 degrees upwards (1 sigma 0.06)" in line for line in lines)
    assert any("from the drone's body its 1 sigma is 0.36" in line for line in lines)
    assert written.mounting.measured_on is not None


@pytest.mark.parametrize(
    ("what", "words"),
    [
        ({"missing": ("yaw the drone further",)}, "not known: yaw the drone further"),
        ({"pitch_rad": 0.9}, "an angle of 52 degrees was found"),
        ({"rms_px": 4.0}, "corners are 4.0 pixels from where they should be"),
    ],
)
def test_what_is_not_known_or_cannot_be_is_not_written(tmp_path: Path, what: dict, words: str) -> None:
    file = tmp_path / "camera.yaml"
    with pytest.raises(CalibrationError, match=words):
        finish(search(**what), Calibration.ideal(320, 240, FOCAL_PX), file, print, stamped=True)
    assert not file.exists()


def test_the_navigator_sees_gates_where_they_are_with_a_turned_camera() -> None:
    scenario = tilted()
    gate = scenario.frames[0]
    at, attitude = (gate.x_m - 2.0, gate.y_m + 0.3, gate.z_m + 0.2), quaternion_from_euler(0.1, -0.05, 0.1)
    image = SimulatedCamera(scenario).render(at, attitude)
    detect = new_detector("frames", focal_px=scenario.camera.focal_px)
    (sighting,) = [each for each in detect(image, 0).frames if each.colour == gate.colour]
    model = CameraModel.of(scenario.camera)
    history = PoseHistory(model)
    history.add(DroneState(0, *at, 0.1, attitude_arena=attitude))
    history.add(DroneState(50_000, *at, 0.1, attitude_arena=attitude))
    pose = history.at(25_000)
    assert pose is not None
    seen = model.project(model.pose(pose.position_m, pose.attitude_arena), gate.position_arena_m)
    assert seen is not None
    corners = [each for each in sighting.corners if each is not None]
    assert len(corners) == 4
    assert sum(each.right_px for each in corners) / 4 == pytest.approx(seen[0], abs=1.0)
    assert sum(each.down_px for each in corners) / 4 == pytest.approx(seen[1], abs=1.0)


@pytest.mark.parametrize(
    ("what", "words"),
    [
        ({}, "--drone: is missing; name a run folder, or both --drone and --camera"),
        ({"drone": "udpin://127.0.0.1:1"}, "--camera: is missing"),
        ({"flight": Path("runs/x"), "camera": "0"}, "is a recorded flight; leave out --drone and --camera"),
        ({"flight": Path("runs/x"), "position": "forwards=1"}, "--position forwards=1: unknown name"),
        ({"flight": Path("runs/x")}, "does not exist; name a run folder"),
    ],
)
def test_wrong_options_are_one_line(what: dict, words: str) -> None:
    flight = what.pop("flight", None)
    with pytest.raises(UserError, match=words.replace("(", r"\(")) as caught:
        extrinsics(flight, **what)
    assert "\n" not in str(caught.value)


def test_a_camera_that_looks_back_or_has_a_gimbal_is_refused() -> None:
    with pytest.raises(ValueError, match=r"mounting_frd_rad.1\n  Input should be less than or equal to 0.8"):
        CameraSettings(mounting_frd_rad=(0.0, 1.5, 0.0))
    with pytest.raises(ValueError, match="does not go with a gimbal"):
        CameraSettings(mounting_frd_rad=(0.0, 0.1, 0.0), gimbal={})


def test_a_live_drone_is_only_watched() -> None:
    """Its telemetry has axes north, east, down; images without times get those of their arrival."""
    calibration = Calibration.ideal(320, 240, FOCAL_PX)
    watched = Watched(calibration)
    codec = mavlink.MAVLink(None, srcSystem=7, srcComponent=AUTOPILOT_COMPONENT_ID)

    def received(message: object) -> object:
        return codec.parse_buffer(message.pack(codec))[0]

    heartbeat = mavlink.MAVLink_heartbeat_message(
        mavlink.MAV_TYPE_QUADROTOR, mavlink.MAV_AUTOPILOT_PX4, 0, 0, mavlink.MAV_STATE_ACTIVE, 3
    )
    half = 0.3  # heading 0.6 rad east of north
    attitude = mavlink.MAVLink_attitude_quaternion_message(1000, 0.955336, 0.0, 0.0, 0.295520, 0.0, 0.0, 0.0)
    position = mavlink.MAVLink_local_position_ned_message(1010, 1.0, 2.0, -3.0, 0.1, 0.2, -0.3)
    for each in (heartbeat, attitude, position):
        watched.take(received(each), 5.0)
    assert watched.system_id == 7
    last = watched.reports[-1]
    assert (last.time_us, last.position_time_us) == (1_000_000, 1_010_000)
    assert last.position_m == pytest.approx((1.0, -2.0, 3.0))
    assert last.velocity_m_s == pytest.approx((0.1, -0.2, 0.3), abs=1e-6)
    assert last.attitude == pytest.approx(quaternion_from_euler(0.0, 0.0, -2 * half), abs=1e-5)
    early = mavlink.MAVLink_attitude_quaternion_message(50_000, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    late = mavlink.MAVLink_attitude_quaternion_message(10, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    watched.take(received(early), 60.0)
    with pytest.raises(DroneError, match="restarted"):
        watched.take(received(late), 60.0)
