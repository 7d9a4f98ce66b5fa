"""The mounting of a camera: found in a recorded flight, told to people, written into the calibration file."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import date
from math import degrees, hypot
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console

from framerunner.camera_calibration.calibration_file import load_calibration, save_calibration
from framerunner.camera_calibration.camera_delay import CAMERA_DELAY_S
from framerunner.errors import SettingError
from framerunner.flying.detector import true_calibration
from framerunner.geometry.gate_shape import GateShapes
from framerunner.geometry.rotations import MAX_MOUNTING_RAD
from framerunner.geometry.vectors import Vec3
from framerunner.recording.events import RecordedImage
from framerunner.recording.open_recording import recorded_flight
from framerunner.recording.tlog_reader import TlogRecording
from framerunner.runs.run_files import RunFiles
from offboard.app import Moment
from vision.calibration.model import Calibration, CalibrationError, Mounting
from vision.calibration.mounting import (
    MAX_DELAY_STD_S,
    MAX_POSITION_STD_M,
    MountingFit,
    Movement,
    fit_mounting,
    missing_for,
    movement_of,
)
from vision.calibration.sightings import MotionReport, PoseSpline, Values, sightings_of
from vision.detectors import new_detector
from vision.types import Detections

if TYPE_CHECKING:
    from offboard.drone import DroneState
    from scenarios.models import Scenario

_ANGLES = (
    ("roll", "to the right", "to the left"),
    ("pitch", "upwards", "downwards"),
    ("yaw", "to the right", "to the left"),
)
_HEADING_STD_DEG = 0.34
"""Of a constant error of the reported heading, such as that of misaligned markers of a motion capture.

No survey can tell it from the camera's yaw: only their sum is seen.
"""
_MAX_RMS_PX = 3.0
_MAX_DELAY_S = 0.5


@dataclass(frozen=True, slots=True)
class MountingSearch:
    """What is known of the mounting after some movement.

    Attributes:
        fit: None if no gate was seen often enough.
        movement: of the drone while gates were seen.
        missing: what must still be done, in words; empty if the angles are known.
    """

    fit: MountingFit | None
    movement: Movement
    missing: tuple[str, ...]


def search_mounting(
    images: Sequence[Detections],
    reports: Sequence[MotionReport],
    calibration: Calibration,
    position_flu_m: Vec3,
    *,
    stamped: bool,
    shapes: GateShapes | None = None,
) -> MountingSearch:
    """Find the mounting from images and states of a flight.

    Args:
        images: what was seen in them, as an ideal camera with this calibration's focal length would see it.
        reports: the drone's states.
        calibration: of the camera.
        position_flu_m: of the camera from the drone's centre, as measured by hand.
        stamped: whether images have the time of their exposure; else it is that of their arrival.
        shapes: of the gates of each colour; None: all have that of the frame challenge.
    """
    motion, delay_s = PoseSpline(reports), 0.0 if stamped else CAMERA_DELAY_S
    half_height_px = calibration.height_px / 2
    seen = sightings_of(images, motion, half_height_px, calibration.readout_s, delay_s, shapes=shapes)
    known = Values((0.0, 0.0, 0.0), position_flu_m, delay_s)
    fit = fit_mounting(seen, motion, calibration.fx_px, known)
    movement = movement_of(seen, motion, fit)
    return MountingSearch(fit, movement, missing_for(movement, fit))


def _accepted_fit(search: MountingSearch) -> MountingFit:
    """The mounting if it is known.

    Raises:
        CalibrationError: it is not; the message says what movement is missing.
    """
    fit = search.fit
    if fit is None or search.missing:
        raise CalibrationError(f"extrinsics: not known: {'; '.join(search.missing)}")
    if fit.rms_px > _MAX_RMS_PX:
        raise CalibrationError(
            f"extrinsics: the frames' corners are {fit.rms_px:.1f} pixels from where they should be; is the "
            "calibration that of this camera, and is the drone's position that of its centre?"
        )
    largest_rad = max(map(abs, fit.values.angles_frd_rad))
    if largest_rad > MAX_MOUNTING_RAD:
        raise CalibrationError(
            f"extrinsics: an angle of {degrees(largest_rad):.0f} degrees was found; a camera that looks "
            f"ahead has {degrees(MAX_MOUNTING_RAD):.0f} at most"
        )
    return fit


def _tell(search: MountingSearch, fit: MountingFit, say: Callable[[str], None]) -> None:
    """Say what was found and how exactly it is known."""
    movement, found, std = search.movement, fit.values, fit.std
    say(
        f"{movement.sightings} sightings of {_counted(movement.gates, 'frame')}; turned by "
        f"{movement.turn_deg:.0f} degrees, {movement.approach_m:.1f} m nearer and farther; corners fit "
        f"within {fit.rms_px:.2f} px RMS"
    )
    angles = zip(_ANGLES, found.angles_frd_rad, std.angles_frd_rad, strict=True)
    for (name, positive, negative), angle, one in angles:
        way = positive if angle >= 0.0 else negative
        say(f"{name:8s}{degrees(abs(angle)):6.2f} degrees {way} (1 sigma {degrees(one):.2f})")
    body_deg = hypot(degrees(std.angles_frd_rad[2]), _HEADING_STD_DEG)
    say(
        "        yaw is from the heading that telemetry reports, as a flight needs it; from the drone's body "
        f"its 1 sigma is {body_deg:.2f}, if that heading is wrong by {_HEADING_STD_DEG:g} (1 sigma)"
    )
    for name, place, one in zip(
        ("forward", "left", "up"), found.position_flu_m, std.position_flu_m, strict=True
    ):
        hint = "" if one <= MAX_POSITION_STD_M else "; hardly observable: measure it, and give --position"
        say(f"{name:8s}{place:6.3f} m (1 sigma {one:.3f}){hint}")
    if std.delay_s <= MAX_DELAY_STD_S:
        say(f"{'delay':8s}{1000 * found.delay_s:6.1f} ms (1 sigma {1000 * std.delay_s:.1f})")
    else:
        say("delay   not observable: yaw faster, at 30 degrees a second or more")


def _with_mounting(calibration: Calibration, fit: MountingFit, *, stamped: bool) -> Calibration:
    """The calibration with what was found; the delay is of images without time stamps."""
    found, std = fit.values, fit.std
    mounting = Mounting(
        angles_frd_rad=found.angles_frd_rad,
        angles_std_rad=std.angles_frd_rad,
        position_flu_m=found.position_flu_m,
        position_std_m=std.position_flu_m,
        measured_on=date.today().isoformat(),
    )
    update: dict[str, object] = {"mounting": mounting}
    if not stamped and std.delay_s <= MAX_DELAY_STD_S and 0.0 <= found.delay_s <= _MAX_DELAY_S:
        update["delay_s"] = found.delay_s
    return calibration.model_copy(update=update)


def finish(
    search: MountingSearch,
    calibration: Calibration,
    path: Path,
    say: Callable[[str], None],
    *,
    stamped: bool,
) -> None:
    """Tell what was found and write it.

    Raises:
        CalibrationError: the mounting is not known.
        SettingError: the file cannot be written.
    """
    fit = _accepted_fit(search)
    _tell(search, fit, say)
    measured = _with_mounting(calibration, fit, stamped=stamped)
    save_calibration(measured, path)
    if measured.delay_s is not None and not stamped:
        say(f"without --camera-delay, `fly` takes {measured.delay_s:.3f} s from the file")
    say(f"written to {path}; use it with `framerunner fly --calibration {path}`")


def _counted(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"


def measure_recorded(
    flight: Path, calibration: Path, position_flu_m: Vec3 | None
) -> tuple[MountingSearch, Calibration, bool]:
    """Find the mounting from a recorded flight.

    Args:
        flight: a run folder, or the MCAP file in it.
        calibration: file of the camera; for a flight of the simulated drone it need not exist.
        position_flu_m: of the camera from the drone's centre; None: what the file or the scenario says.

    Returns:
        What was found, the calibration as it is, and whether the images have time stamps.

    Raises:
        RecordingError: there is no recorded flight, or it is damaged.
        CalibrationError: the calibration is not valid, or of another size of images.
        SettingError: the recording's images have no times.
    """
    folder = flight if flight.is_dir() else flight.parent
    with recorded_flight(flight) as recorded:
        if isinstance(recorded, TlogRecording):
            raise SettingError(
                f"{flight}: has a log and a video, whose images have no times; fly again with --record"
            )
        result = recorded.result
        simulated = result is not None and result.judged_by == "truth"
        scenario = RunFiles(folder).load_scenario()
        known = _calibration(calibration, scenario if simulated else None)
        shapes = None if scenario is None else GateShapes(scenario.gate_shapes)
        detect = new_detector("frames", calibration=known, shapes=shapes)
        images: list[Detections] = []
        reports: list[MotionReport] = []
        with Console(stderr=True).status("looking for frames in the recorded images"):
            for event in recorded.events():
                if isinstance(event, RecordedImage):
                    images.append(detect(event.image, event.time_us))
                elif isinstance(event, Moment):
                    reports += [_report_of(state) for state in (*event.state.missed, event.state)]
    place_m = place_of(known, position_flu_m, scenario)
    with Console(stderr=True).status("fitting"):
        search = search_mounting(images, reports, known, place_m, stamped=simulated, shapes=shapes)
    return search, known, simulated


def place_of(calibration: Calibration, given_m: Vec3 | None, scenario: Scenario | None) -> Vec3:
    """The camera's place on the drone as it is known: given, of an earlier measurement, or the scenario's."""
    if given_m is not None:
        return given_m
    mounting = calibration.mounting
    if mounting is not None and mounting.position_flu_m is not None:
        return mounting.position_flu_m
    if scenario is not None:
        return scenario.camera.position_flu_m
    from scenarios.models import Camera

    return Camera().position_flu_m


def _report_of(state: DroneState) -> MotionReport:
    """A tick's state."""
    position_us = state.time_us - round(state.position_age_s * 1e6)
    place_m = (state.x, state.y, state.z)
    return MotionReport(state.time_us, position_us, place_m, state.velocity_arena_m_s, state.attitude_arena)


def _calibration(path: Path, simulated: Scenario | None) -> Calibration:
    if simulated is not None and not path.exists():
        return true_calibration(simulated.camera)
    return load_calibration(path, to_write=True)
