"""PREFLIGHT_CALIBRATION: ideal sensors need none, so each is done at once, in the words stations follow."""

from __future__ import annotations

from firmware_py.autopilot import Autopilot
from firmware_py.mavlink.service import Command, Service
from firmware_py.status import CommandResult
from wire.dialect import mavlink

_INFO = mavlink.MAV_SEVERITY_INFO
_ACCELEROMETER, _LEVEL = 1.0, 2.0  # param 5


class CalibrationService(Service):
    """Says that it is done."""

    def __init__(self, autopilot: Autopilot) -> None:
        self._autopilot = autopilot
        self.commands = {mavlink.MAV_CMD_PREFLIGHT_CALIBRATION: self._calibrate}

    def _calibrate(self, command: Command) -> CommandResult:
        """Calibrate what the parameters name: 1 gyroscope, 2 magnetometer, 5 accelerometer (1) or level (2).

        Returns:
            TEMPORARILY_REJECTED while armed, UNSUPPORTED for what there is not.
        """
        autopilot = self._autopilot
        if autopilot.status.armed:
            return CommandResult.TEMPORARILY_REJECTED
        if not any(value != 0.0 for value in (*command.params, *command.params_567)):
            return CommandResult.ACCEPTED  # all zeros: give up a calibration, as in PX4
        name = _name(command)
        if name is None:
            return CommandResult.UNSUPPORTED
        autopilot.say(_INFO, f"[cal] calibration started: 2 {name}")
        for percent in (0, 50, 100):
            autopilot.say(_INFO, f"[cal] progress <{percent}>")
        autopilot.say(_INFO, f"[cal] calibration done: {name}")
        return CommandResult.ACCEPTED


def _name(command: Command) -> str | None:
    if command.params[0] == 1.0:
        return "gyro"
    if command.params[1] == 1.0:
        return "mag"
    accelerometer = command.params_567[0]
    if accelerometer == _ACCELEROMETER:
        return "accel"
    return "level" if accelerometer == _LEVEL else None
