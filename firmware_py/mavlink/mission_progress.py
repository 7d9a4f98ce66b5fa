"""What people are told of a mission: whether it can be flown, where it is, what it has reached."""

from __future__ import annotations

from firmware_py.geodesy import LocalProjection
from firmware_py.mavlink.exchange import Exchange
from firmware_py.mavlink.mission_messages import MissionCurrent
from firmware_py.mavlink.port import AutopilotPort
from firmware_py.missions.checks import mission_faults
from firmware_py.missions.flight import View
from firmware_py.missions.geofence import Geofence
from firmware_py.status import FlightMode, LandedState
from firmware_py.types import GeodeticPoint
from wire.dialect import Message, mavlink

_REPEATS, _REPEAT_US = 10, 1_000_000  # of MISSION_ITEM_REACHED, as PX4
_NO_TOTAL = 0xFFFF
_ACTIVE, _SUSPENDED = 1, 2
_ACTIVE_MODES = frozenset({FlightMode.MISSION, FlightMode.TAKEOFF, FlightMode.LAND})


def mission_current(autopilot: AutopilotPort, _time_us: int) -> Message:
    """MISSION_CURRENT, with the ids of all three plans."""
    store, mode = autopilot.missions, autopilot.status.mode
    return MissionCurrent(
        store.current,
        len(store.mission.items) or _NO_TOTAL,
        _mission_state(autopilot),
        _ACTIVE if mode in _ACTIVE_MODES else _SUSPENDED,
        (store.mission.opaque_id, store.fence.opaque_id, store.rally.opaque_id),
    )


def _mission_state(autopilot: AutopilotPort) -> int:
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


class MissionProgress:
    """Checks missions when they change, and broadcasts where the mission is."""

    def __init__(self, exchange: Exchange) -> None:
        self._exchange = exchange
        self._fence = Geofence(exchange.autopilot.missions, exchange.autopilot.parameters)
        self._view = View()
        self._origin: GeodeticPoint | None = None
        self._checked: tuple[int, int, bool] = (0, 0, False)
        self._current_sent = 0
        self._reached: int | None = None
        self._repeats_left = 0
        self._repeat_due_us = 0

    def check(self, *, again: bool = False) -> None:
        """Find out whether the mission can be flown, if it, the fence or the knowledge of home has changed.

        Args:
            again: also if nothing has changed, before a start.
        """
        autopilot = self._exchange.autopilot
        store, home_known = autopilot.missions, autopilot.status.home is not None
        state = (store.mission.version, store.fence.version, home_known)
        before = self._checked
        if state == before and not again:
            return
        self._checked = state
        self._look(autopilot)
        if state[1:] != before[1:]:
            self._fence.breach_at(self._view.position_ned_m, self._view)
        store.valid, texts = mission_faults(
            store.mission.items, self._view, autopilot.parameters, self._fence
        )
        for text in (*self._fence.take_texts(), *texts):
            autopilot.say(text.severity, text.text)
        if state[0] != before[0]:
            self._reached = None

    def update(self) -> None:
        """Broadcast what is new, and what was reached ten times more."""
        store, exchange = self._exchange.autopilot.missions, self._exchange
        self.check()
        if store.current != self._current_sent and store.mission.items:
            self.tell_current()
        for seq in store.take_reached():
            self._reached, self._repeats_left = seq, _REPEATS
            self._tell_reached(seq)
        if self._reached is not None and self._repeats_left and exchange.time_us >= self._repeat_due_us:
            self._repeats_left -= 1
            self._tell_reached(self._reached)

    def tell_current(self) -> None:
        """Broadcast MISSION_CURRENT."""
        self._current_sent = self._exchange.autopilot.missions.current
        self._exchange.broadcast(mission_current(self._exchange.autopilot, self._exchange.time_us))

    def _tell_reached(self, seq: int) -> None:
        self._repeat_due_us = self._exchange.time_us + _REPEAT_US
        self._exchange.broadcast(mavlink.MAVLink_mission_item_reached_message(seq))

    def _look(self, autopilot: AutopilotPort) -> None:
        """Bring the view of the vehicle up to date."""
        view, status = self._view, autopilot.status
        if status.origin is not self._origin:
            self._origin = status.origin
            view.projection = None if status.origin is None else LocalProjection(status.origin)
        view.position_ned_m = autopilot.state.position_ned_m
        view.landed = status.landed_state is LandedState.ON_GROUND
        view.home_ned_m = None if status.home is None else status.home_ned_m
