"""The files in the folder of a flight: their names, and how those that describe the flight are read."""

from __future__ import annotations

from pathlib import Path

from scenarios.loader import load_scenario
from scenarios.models import Scenario
from scenarios.result import MAX_RESULT_BYTES, FlightResult
from vision.calibration.model import Calibration

RESULT, RECORDING, LOG, VIDEO = "result.json", "flight.mcap", "flight.tlog", "video.avi"
SCENARIO, MISSION, PILOT = "scenario.yaml", "mission.yaml", "pilot.py"


class RunFiles:
    """The files in a flight's folder; each of them may be missing.

    Attributes:
        path: of the folder.
        result: how the flight ended.
        track: a plot of its path.
        tlog: the MAVLink traffic, of a flight in real time.
        recording: the whole flight, if it was recorded.
        video: the camera's images.
        scenario: what was flown.
        mission: that flew it.
        pilot: a contestant's file, if the mission uses one.
        calibration: of the camera, if one was given.
        unfinished: what the result is to be if the program is ended in flight.
        hang_report: where the program hung.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.result = path / RESULT
        self.track = path / "track.png"
        self.tlog = path / LOG
        self.recording = path / RECORDING
        self.video = path / VIDEO
        self.scenario = path / SCENARIO
        self.mission = path / MISSION
        self.pilot = path / PILOT
        self.calibration = path / "calibration.yaml"
        self.unfinished = path / "unfinished.json"
        self.hang_report = path / "hang.txt"

    def load_scenario(self) -> Scenario | None:
        """What was flown; None without a file. Raises `ScenarioError`."""
        return load_scenario(self.scenario) if self.scenario.is_file() else None

    def load_result(self) -> FlightResult | None:
        """The result as this program wrote it; None without a file.

        Raises:
            OSError: it cannot be read.
            ResultError: it is damaged.
        """
        if not self.result.is_file():
            return None
        with self.result.open("rb") as file:
            return FlightResult.parse(file.read(MAX_RESULT_BYTES + 1))

    def load_calibration(self) -> Calibration | None:
        """Of the camera; None without a file. Raises `CalibrationError`."""
        from framerunner.camera_calibration.calibration_file import load_calibration

        return load_calibration(self.calibration) if self.calibration.is_file() else None
