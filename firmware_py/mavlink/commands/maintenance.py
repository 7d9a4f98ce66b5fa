"""Commands about the vehicle itself: reboot, calibration, actuators, and injected failures.

INJECT_FAILURE is DENIED while SYS_FAILURE_EN does not allow it, as in PX4. What cannot be broken is
UNSUPPORTED; PX4 does not answer then. Ideal sensors need no calibration, so each is done at once, with the
texts that ground stations follow.
"""

from __future__ import annotations

from math import floor, isfinite
from typing import Protocol

from firmware_py.autopilot import Autopilot
from firmware_py.mavlink.service import Service, VehicleCommand
from firmware_py.status import CommandResult
from framerunner.wire.dialect import mavlink

_MAX_NUMBER = 0xFFFF
_INFO, _WARNING = mavlink.MAV_SEVERITY_INFO, mavlink.MAV_SEVERITY_WARNING


class FailureSink(Protocol):
    """What can break parts of the vehicle: its simulation."""

    def inject(self, unit: int, kind: int, instance: int) -> str | None:
        """Break a part, or repair it.

        Args:
            unit: FAILURE_UNIT.
            kind: FAILURE_TYPE; 0 repairs.
            instance: counts from 1; 0: all of that unit.

        Returns:
            What is done, in words; None if it cannot be done, and nothing has changed.
        """


class MaintenanceCommands(Service):
    """Executes these commands; `failures` None: nothing can be broken."""

    def __init__(self, autopilot: Autopilot, failures: FailureSink | None) -> None:
        self._autopilot = autopilot
        self._failures = failures
        self.commands = {
            # As PX4 to which no such actuator is connected.
            mavlink.MAV_CMD_DO_SET_ACTUATOR: lambda _command: CommandResult.ACCEPTED,
            mavlink.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN: self._reboot,
            mavlink.MAV_CMD_PREFLIGHT_CALIBRATION: self._calibrate,
            mavlink.MAV_CMD_INJECT_FAILURE: self._inject_failure,
            mavlink.MAV_CMD_ACTUATOR_TEST: self._test_actuator,
        }

    def _test_actuator(self, _command: VehicleCommand) -> CommandResult:
        return CommandResult.DENIED if self._autopilot.status.armed else CommandResult.UNSUPPORTED

    def _reboot(self, command: VehicleCommand) -> CommandResult:
        """Refuse: a simulator is restarted from outside; PX4's SITL ends."""
        if self._autopilot.status.armed:
            return CommandResult.DENIED
        if command.params[0] > 0:
            self._autopilot.say(_WARNING, "No reboot here: start the simulator again")
        return CommandResult.UNSUPPORTED

    def _calibrate(self, command: VehicleCommand) -> CommandResult:
        """Calibrate the sensor of the params: 1 gyroscope, 2 magnetometer, 5 accelerometer (1) or level (2).

        Returns:
            TEMPORARILY_REJECTED while armed, UNSUPPORTED for other sensors.
        """
        autopilot = self._autopilot
        if autopilot.status.armed:
            return CommandResult.TEMPORARILY_REJECTED
        if all(value == 0.0 for value in command.all_params):
            return CommandResult.ACCEPTED  # all zeros cancel a calibration, as in PX4
        match command.all_params:
            case (1.0, *_):
                name = "gyro"
            case (_, 1.0, *_):
                name = "mag"
            case (_, _, _, _, 1.0, *_):
                name = "accel"
            case (_, _, _, _, 2.0, *_):
                name = "level"
            case _:
                return CommandResult.UNSUPPORTED
        autopilot.say(_INFO, f"[cal] calibration started: 2 {name}")
        for percent in (0, 50, 100):
            autopilot.say(_INFO, f"[cal] progress <{percent}>")
        autopilot.say(_INFO, f"[cal] calibration done: {name}")
        return CommandResult.ACCEPTED

    def _inject_failure(self, command: VehicleCommand) -> CommandResult:
        """Params: unit, type, instance (NaN: all)."""
        autopilot = self._autopilot
        if not autopilot.parameters.value("SYS_FAILURE_EN"):
            return CommandResult.DENIED
        unit, kind, instance = command.params[:3]
        numbers = [_rounded(unit), _rounded(kind), _rounded(instance) if isfinite(instance) else 0]
        if min(numbers) < 0 or self._failures is None:
            return CommandResult.UNSUPPORTED
        done = self._failures.inject(*numbers)
        if done is None:
            return CommandResult.UNSUPPORTED
        autopilot.say(_WARNING, f"Injected failure: {done}")
        return CommandResult.ACCEPTED


def _rounded(number: float) -> int:
    """A number as PX4 rounds it; -1 if it is out of range."""
    return floor(number + 0.5) if isfinite(number) and -0.5 <= number <= _MAX_NUMBER else -1
