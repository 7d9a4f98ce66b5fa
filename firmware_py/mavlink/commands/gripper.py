"""The gripper: it closes and opens (https://mavlink.io/en/services/gripper.html).

No load is simulated: what it holds has no mass. PX4 acknowledges when its gripper has moved; this one moves
at once.
"""

from __future__ import annotations

from math import isnan

from firmware_py.autopilot import Autopilot
from firmware_py.mavlink.service import Service
from firmware_py.missions.flight import SevenParams
from firmware_py.status import CommandResult
from framerunner.wire.dialect import mavlink

_FIRST = 1.0


class GripperService(Service):
    """Answers DO_GRIPPER: param 1 is the gripper, the first is the only one; param 2 opens or closes it.

    Attributes:
        is_closed: whether it holds, or has closed on nothing.
    """

    def __init__(self, autopilot: Autopilot) -> None:
        self._autopilot = autopilot
        self.is_closed = False
        self.commands = {mavlink.MAV_CMD_DO_GRIPPER: lambda command: self._run(command.all_params)}
        self.mission_commands = {mavlink.MAV_CMD_DO_GRIPPER: self._run}

    def _run(self, params: SevenParams) -> CommandResult:
        """Close or open it, and tell so; DENIED for another gripper or action."""
        number, action = params[:2]
        actions = (mavlink.GRIPPER_ACTION_RELEASE, mavlink.GRIPPER_ACTION_GRAB)
        if not (isnan(number) or number in (0.0, _FIRST)) or action not in actions:
            return CommandResult.DENIED
        closes = action == mavlink.GRIPPER_ACTION_GRAB
        if closes is not self.is_closed:
            self.is_closed = closes
            self._autopilot.say(mavlink.MAV_SEVERITY_INFO, f"Gripper {'closed' if closes else 'opened'}")
        return CommandResult.ACCEPTED
