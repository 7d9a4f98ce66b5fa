"""A mission in flight: its check, its current and reached items, and the commands in it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import isfinite

from firmware_py.autopilot import Autopilot
from firmware_py.mavlink.missions.item_messages import mission_current
from firmware_py.mavlink.service import AutopilotService, MissionCommandHandler, VehicleCommand
from firmware_py.missions.actions import REGIONS
from firmware_py.missions.flight import IssuedCommand
from firmware_py.status import CommandResult, FlightMode
from framerunner.geometry.vectors import Vec3
from framerunner.vehicle.geodesy import GeodeticPoint
from framerunner.wire.dialect import Message, mavlink
from framerunner.wire.exchange import Exchange

_REPEATS, _REPEAT_US = 10, 1_000_000  # of MISSION_ITEM_REACHED, as PX4
_NO_TOTAL = 0xFFFF
_ACTIVE, _SUSPENDED = 1, 2
_ACTIVE_MODES = frozenset({FlightMode.MISSION, FlightMode.TAKEOFF, FlightMode.LAND})
_GIMBALS = frozenset(  # every mission of MAVSDK contains them; without a gimbal they have no effect
    {
        mavlink.MAV_CMD_DO_MOUNT_CONFIGURE,
        mavlink.MAV_CMD_DO_MOUNT_CONTROL,
        mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW,
        mavlink.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE,
    }
)


class MissionExecution(AutopilotService):
    """Checks missions when they change, starts them, reports their progress and passes on their commands.

    Args:
        device_commands: of what the vehicle carries, by MAV_CMD.
        look_at: points a gimbal, if there is one, at a region of interest.
    """

    def __init__(
        self,
        autopilot: Autopilot,
        exchange: Exchange,
        device_commands: Mapping[int, MissionCommandHandler],
        look_at: Callable[[Vec3 | None], None],
    ) -> None:
        super().__init__(autopilot, exchange)
        self._device_commands = device_commands
        self._look_at = look_at
        self._version = 0  # of the mission
        self._current_sent = 0
        self._reached: int | None = None
        self._repeats_left = 0
        self._repeat_due_us = 0
        self.commands = {
            mavlink.MAV_CMD_MISSION_START: self._start,
            mavlink.MAV_CMD_DO_SET_MISSION_CURRENT: self._set_current,
        }
        self.sources = {mavlink.MAVLINK_MSG_ID_MISSION_CURRENT: self._mission_current}

    def check(self) -> None:
        """Check a changed mission, and forget what was reached of the one before."""
        self._autopilot.check_mission()
        version = self._autopilot.missions.mission.version
        if version != self._version:
            self._version, self._reached = version, None

    def update(self) -> None:
        """Broadcast a new current item, and reached ones eleven times; pass on the mission's commands."""
        store, exchange = self._autopilot.missions, self._exchange
        self.check()
        if store.current != self._current_sent and store.mission.items:
            self.broadcast_current()
        for seq in store.take_reached():
            self._reached, self._repeats_left = seq, _REPEATS
            self._broadcast_reached(seq)
        if self._reached is not None and self._repeats_left and exchange.time_us >= self._repeat_due_us:
            self._repeats_left -= 1
            self._broadcast_reached(self._reached)
        for issued in self._autopilot.take_issued_commands():
            self._pass_on(issued)

    def broadcast_current(self) -> None:
        """Broadcast MISSION_CURRENT."""
        self._current_sent = self._autopilot.missions.current
        self._exchange.broadcast(self._mission_current())

    def _broadcast_reached(self, seq: int) -> None:
        self._repeat_due_us = self._exchange.time_us + _REPEAT_US
        self._exchange.broadcast(mavlink.MAVLink_mission_item_reached_message(seq))

    def _mission_current(self) -> Message:
        """MISSION_CURRENT, with the ids of all three plans."""
        store, mode = self._autopilot.missions, self._autopilot.status.mode
        return mission_current(
            store.current,
            len(store.mission.items) or _NO_TOTAL,
            _mission_state(self._autopilot),
            _ACTIVE if mode in _ACTIVE_MODES else _SUSPENDED,
            (store.mission.opaque_id, store.fence.opaque_id, store.rally.opaque_id),
        )

    def _start(self, command: VehicleCommand) -> CommandResult:
        """MISSION_START: switch to mission mode and arm.

        Param 1 is the first item; -1, or not given: the current one. Param 2, the last item, is ignored, as
        in PX4. TEMPORARILY_REJECTED: the mode or arming is refused.
        """
        autopilot = self._autopilot
        store, first = autopilot.missions, command.params[0]
        first = first if isfinite(first) else -1.0
        if not store.valid:
            autopilot.say(mavlink.MAV_SEVERITY_CRITICAL, "Mission start denied! No valid mission")
            return CommandResult.DENIED
        if not -1 <= first < len(store.mission.items):
            autopilot.say(
                mavlink.MAV_SEVERITY_CRITICAL,
                f"Mission start denied! No item {first:g}, there are {len(store.mission.items)}",
            )
            return CommandResult.DENIED
        if first >= 0:
            store.select(int(first))
        result = autopilot.set_mode(FlightMode.MISSION)
        if result is CommandResult.ACCEPTED and not autopilot.status.armed:
            result = autopilot.arm()
        return result if result is CommandResult.ACCEPTED else CommandResult.TEMPORARILY_REJECTED

    def _set_current(self, command: VehicleCommand) -> CommandResult:
        """DO_SET_MISSION_CURRENT, which PX4 does not have: param 1 is the item to fly next."""
        autopilot, seq = self._autopilot, command.params[0]
        if isfinite(seq) and autopilot.missions.select(int(seq)):
            return CommandResult.ACCEPTED
        count = len(autopilot.missions.mission.items)
        autopilot.say(mavlink.MAV_SEVERITY_CRITICAL, f"No mission item {seq:g}, there are {count}")
        return CommandResult.DENIED

    def _pass_on(self, issued: IssuedCommand) -> None:
        """Execute a command of the mission, and report if that failed."""
        result = self._execute(issued)
        if result is not CommandResult.ACCEPTED:
            text = f"Mission command {issued.command} not done: {result.name.lower().replace('_', ' ')}"
            self._autopilot.say(mavlink.MAV_SEVERITY_WARNING, text)

    def _execute(self, issued: IssuedCommand) -> CommandResult:
        autopilot = self._autopilot
        first, x, y, z = issued.params[0], *issued.params[4:]
        match issued.command:
            case mavlink.MAV_CMD_COMPONENT_ARM_DISARM:
                return autopilot.arm() if first == 1.0 else autopilot.disarm()
            case mavlink.MAV_CMD_DO_SET_HOME:
                if first == 1.0:
                    return autopilot.set_home(None)
                known = isfinite(x) and isfinite(y) and isfinite(z)
                return autopilot.set_home(GeodeticPoint(x, y, z)) if known else CommandResult.DENIED
        return self._command_device(issued)

    def _command_device(self, issued: IssuedCommand) -> CommandResult:
        """Pass a command on to the device that has it."""
        if issued.command in REGIONS:
            self._look_at(issued.place_ned_m)
            return CommandResult.ACCEPTED
        work = self._device_commands.get(issued.command)
        if work is None:
            return CommandResult.ACCEPTED if issued.command in _GIMBALS else CommandResult.UNSUPPORTED
        return work(issued.params)


def _mission_state(autopilot: Autopilot) -> int:
    store = autopilot.missions
    if not store.mission.items or not store.valid:
        state = mavlink.MISSION_STATE_NO_MISSION
    elif store.finished:
        state = mavlink.MISSION_STATE_COMPLETE
    elif autopilot.status.mode is FlightMode.MISSION:
        state = mavlink.MISSION_STATE_ACTIVE
    elif store.started:
        state = mavlink.MISSION_STATE_PAUSED
    else:
        state = mavlink.MISSION_STATE_NOT_STARTED
    return int(state)
