"""Commands about the vehicle itself: reboot, actuators, and failures that are injected for tests.

INJECT_FAILURE is DENIED while SYS_FAILURE_EN does not allow it, as in PX4. What cannot be broken is
UNSUPPORTED; PX4 says nothing to that.
"""

from __future__ import annotations

from math import floor, isfinite
from typing import Protocol

from firmware_py.autopilot import Autopilot
from firmware_py.mavlink.service import Command, Service
from firmware_py.status import CommandResult
from wire.dialect import mavlink

_MAX_NUMBER = 0xFFFF


class FailureSink(Protocol):
    """Who can break parts of the vehicle: its simulation."""

    def inject(self, unit: int, kind: int, instance: int) -> bool:
        """Break a part, or repair it.

        Args:
            unit: FAILURE_UNIT.
            kind: FAILURE_TYPE; 0 repairs.
            instance: counts from 1; 0: all of that unit.

        Returns:
            False if it cannot be done; nothing has changed then.
        """


class MaintenanceCommands(Service):
    """Does them.

    Args:
        failures: breaks parts; None: nothing can be broken.
    """

    def __init__(self, autopilot: Autopilot, failures: FailureSink | None) -> None:
        self._autopilot = autopilot
        self._failures = failures
        self.commands = {
            mavlink.MAV_CMD_DO_SET_ACTUATOR: self._set_actuator,
            mavlink.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN: self._reboot,
            mavlink.MAV_CMD_INJECT_FAILURE: self._inject_failure,
            mavlink.MAV_CMD_ACTUATOR_TEST: self._test_actuator,
        }

    def _set_actuator(self, _command: Command) -> CommandResult:
        return CommandResult.ACCEPTED  # as PX4 to which no such actuator is connected

    def _test_actuator(self, _command: Command) -> CommandResult:
        return CommandResult.DENIED if self._autopilot.status.armed else CommandResult.UNSUPPORTED

    def _reboot(self, command: Command) -> CommandResult:
        """A simulator is started again by whoever started it; PX4's SITL ends."""
        if self._autopilot.status.armed:
            return CommandResult.DENIED
        if command.params[0] > 0:
            self._autopilot.say(mavlink.MAV_SEVERITY_WARNING, "No reboot here: start the simulator again")
        return CommandResult.UNSUPPORTED

    def _inject_failure(self, command: Command) -> CommandResult:
        """Params: unit, type, instance (NaN: all)."""
        autopilot = self._autopilot
        if not autopilot.parameters.value("SYS_FAILURE_EN"):
            return CommandResult.DENIED
        unit, kind, instance = command.params[:3]
        numbers = [_whole(unit), _whole(kind), _whole(instance) if isfinite(instance) else 0]
        if min(numbers) < 0 or self._failures is None or not self._failures.inject(*numbers):
            return CommandResult.UNSUPPORTED
        what = "repaired" if numbers[1] == mavlink.FAILURE_TYPE_OK else f"failure {numbers[1]}"
        autopilot.say(mavlink.MAV_SEVERITY_WARNING, f"Injected: unit {numbers[0]}.{numbers[2]} {what}")
        return CommandResult.ACCEPTED


def _whole(number: float) -> int:
    """A number as PX4 rounds it; -1 for what cannot be one."""
    return floor(number + 0.5) if isfinite(number) and -0.5 <= number <= _MAX_NUMBER else -1
