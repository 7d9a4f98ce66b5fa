"""The mounting of a camera from a recorded flight: its images, and the states that telemetry reported."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console

from framerunner.camera_calibration.calibration_file import load_calibration
from framerunner.camera_calibration.mounting_report import MountingSearch, search_mounting
from framerunner.errors import SettingError
from framerunner.flying.detector import true_calibration
from framerunner.recording.events import RecordedImage
from framerunner.recording.open_recording import recorded_flight
from framerunner.recording.tlog_reader import TlogRecording
from framerunner.runs.run_files import RunFiles
from offboard.app import Moment
from vision.calibration.motion import MotionReport
from vision.detectors import new_detector

if TYPE_CHECKING:
    from framerunner.geometry.vectors import Vec3
    from offboard.drone import DroneState
    from scenarios.models import Scenario
    from vision.calibration.model import Calibration
    from vision.types import Detections


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
        smooth = scenario is not None and scenario.camera.effects is not None
        detect = new_detector("frames", calibration=known, rendered=simulated, smooth=smooth)
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
        search = search_mounting(images, reports, known, place_m, stamped=simulated)
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
