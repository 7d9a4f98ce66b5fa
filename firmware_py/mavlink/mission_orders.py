"""What a mission commands others: pictures to the camera, arming and home to the autopilot itself."""

from __future__ import annotations

from math import isfinite

from firmware_py.mavlink.exchange import Exchange
from firmware_py.missions.flight import IssuedCommand
from firmware_py.status import CommandResult
from firmware_py.types import GeodeticPoint
from wire.dialect import mavlink

_TO_NOBODY = frozenset(  # every mission of MAVSDK has them, and there is no gimbal
    {
        mavlink.MAV_CMD_DO_MOUNT_CONFIGURE,
        mavlink.MAV_CMD_DO_MOUNT_CONTROL,
        mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW,
        mavlink.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE,
    }
)


class MissionOrders:
    """Passes on what the mission has commanded, and says what could not be done."""

    __slots__ = ("_exchange",)

    def __init__(self, exchange: Exchange) -> None:
        self._exchange = exchange

    def update(self) -> None:
        """Pass on what has come since the last time."""
        autopilot = self._exchange.autopilot
        for order in autopilot.take_issued_commands():
            result = self._pass_on(order)
            if result is not CommandResult.ACCEPTED:
                text = f"Mission command {order.command} not done: {result.name.lower().replace('_', ' ')}"
                autopilot.say(mavlink.MAV_SEVERITY_WARNING, text)

    def _pass_on(self, order: IssuedCommand) -> CommandResult:
        autopilot, camera = self._exchange.autopilot, self._exchange.camera
        if order.command in _TO_NOBODY:
            return CommandResult.ACCEPTED
        first, x, y, z = order.params[0], *order.params[4:]
        match order.command:
            case mavlink.MAV_CMD_COMPONENT_ARM_DISARM:
                return autopilot.arm() if first == 1.0 else autopilot.disarm()
            case mavlink.MAV_CMD_DO_SET_HOME:
                if first == 1.0:
                    return autopilot.set_home(None)
                known = isfinite(x) and isfinite(y) and isfinite(z)
                return autopilot.set_home(GeodeticPoint(x, y, z)) if known else CommandResult.DENIED
        if camera is None:
            return CommandResult.UNSUPPORTED
        return camera.run(order.command, order.params)
