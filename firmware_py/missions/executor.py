"""Flies the store's mission, item by item, as PX4's navigator does for a multicopter."""

from __future__ import annotations

from dataclasses import replace
from enum import Enum
from math import hypot, isfinite, isnan, nan, radians, remainder, tau

from firmware_py.missions import route
from firmware_py.missions.actions import MissionActions
from firmware_py.missions.flight import IssuedCommand, LegKind, MissionLeg, VehicleView
from firmware_py.missions.items import Do, MissionItem
from firmware_py.missions.store import MissionStore
from firmware_py.parameters import Parameters
from firmware_py.types import CRITICAL, INFO, StatusText
from framerunner.geometry.vectors import ZERO3, Vec3


class Arrival:
    """Acceptance limits by the parameters, and since when the present item's place is reached.

    Attributes:
        radius_m: horizontal distance within which a place counts as reached, if the item gives none.
        height_m: height difference within which it does.
        takeoff_m: climb of a take-off, if the item gives none.
    """

    def __init__(self, parameters: Parameters) -> None:
        self._version = -1
        self.configure(parameters)
        self.begin()

    def configure(self, parameters: Parameters) -> None:
        """Apply the parameters if one has changed."""
        if parameters.version == self._version:
            return
        self._version = parameters.version
        value = parameters.value
        self.radius_m = value("NAV_ACC_RAD")
        self.height_m = value("NAV_MC_ALT_RAD")
        self.takeoff_m = value("MIS_TAKEOFF_ALT")
        self._circle_m = abs(value("NAV_LOITER_RAD"))
        self._yaw_error_rad = radians(value("MIS_YAW_ERR"))
        self._yaw_ignored = value("MIS_YAW_TMT") > 0.0  # as in PX4: with a time limit there is no wait

    def begin(self) -> None:
        """Begin a new item."""
        self._since_us = -1
        self._heading_reached = False

    def radius_of(self, item: MissionItem) -> float:
        """The horizontal distance within which the item's place is reached, m."""
        if item.command == Do.LOITER_TO_ALT:
            circle_m = abs(item.params[1])
            return self.radius_m + (circle_m if isfinite(circle_m) and circle_m > 0.0 else self._circle_m)
        own_m = item.params[1] if item.command == Do.WAYPOINT else nan
        return own_m if isfinite(own_m) and own_m > 0.0 else self.radius_m

    def has_climbed(self, leg: MissionLeg, view: VehicleView) -> bool:
        """Whether the vehicle is high enough; for a very low climb, half of it must be done."""
        if view.landed:
            return False
        tolerance_m = self.height_m
        if view.home_ned_m is not None:
            above_home_m = view.home_ned_m[2] - leg.target_ned_m[2]
            if 0.0 < above_home_m < tolerance_m:
                tolerance_m = above_home_m / 2.0
        return view.position_ned_m[2] < leg.target_ned_m[2] + tolerance_m

    def is_there(self, leg: MissionLeg, view: VehicleView) -> bool:
        """Whether the vehicle is at the leg's target."""
        north_m, east_m, down_m = leg.target_ned_m
        here_ned_m = view.position_ned_m
        return (
            abs(down_m - here_ned_m[2]) <= self.height_m
            and hypot(north_m - here_ned_m[0], east_m - here_ned_m[1]) <= leg.radius_m
        )

    def has_arrived(self, leg: MissionLeg, view: VehicleView) -> bool:
        """Whether the vehicle was in the air at the target and has reached its heading."""
        if self._since_us < 0:
            if view.landed or not self.is_there(leg, view):
                return False
            self._since_us = view.time_us
        if not self._heading_reached:
            yaw_rad = leg.yaw_rad
            self._heading_reached = (
                isnan(yaw_rad)
                or self._yaw_ignored
                or abs(remainder(yaw_rad - view.yaw_rad, tau)) < self._yaw_error_rad
            )
        return self._heading_reached

    def has_waited(self, item: MissionItem, view: VehicleView) -> bool:
        """Whether the item's waiting time is over, since the arrival or else since the first call."""
        if self._since_us < 0:
            self._since_us = view.time_us
        return view.time_us - self._since_us >= item.hold_us


def is_behind(gate_ned_m: Vec3, leg: MissionLeg, view: VehicleView) -> bool:
    """Whether the vehicle has passed a gate on its path to the leg's target."""
    along_north_m, along_east_m = leg.target_ned_m[0] - gate_ned_m[0], leg.target_ned_m[1] - gate_ned_m[1]
    north_m = view.position_ned_m[0] - gate_ned_m[0]
    east_m = view.position_ned_m[1] - gate_ned_m[1]
    return not view.landed and north_m * along_north_m + east_m * along_east_m >= 0.0


_MIN_CLIMB_M = 0.5  # a first place no higher than this gives no climb: it is MIS_TAKEOFF_ALT
_SAME_YAW_RAD = 0.01
_YAWING = frozenset({Do.WAYPOINT, Do.LOITER_UNLIM, Do.LOITER_TIME})


class _Phase(Enum):
    CLIMB = "climb"  # vertically, before the item
    APPROACH = "approach"  # to above the landing place, or to a loiter at the present height
    ITEM = "item"
    WAIT = "wait"  # the item is done, without autocontinue
    OVER = "over"


class MissionExecutor:
    """Decides what to fly next. `enter` at mode entry, `step` each tick, `leave` at mode exit.

    A step in which nothing changes makes a few comparisons and returns the same `MissionLeg` again. One item
    is begun or ended per step.
    """

    def __init__(self, store: MissionStore, parameters: Parameters) -> None:
        self._store = store
        self._parameters = parameters
        self._arrival = Arrival(parameters)
        self._actions = MissionActions()
        self._jumps: dict[int, int] = {}
        self._leg = MissionLeg(LegKind.DONE, ZERO3)
        self._item: MissionItem | None = None
        self._phase = _Phase.OVER
        self._seen = (-1, -1)
        self._home_ned_m: Vec3 | None = None
        self._speed_m_s = nan
        self._gate_ned_m: Vec3 | None = None
        self._climb_first = False
        self._restart = False
        self._left_at = 0
        self._replay: tuple[int, MissionItem] | None = None  # an item, and the trigger to repeat behind it

    def enter(self, view: VehicleView) -> None:
        """Begin, or continue at the current item; from below its place, climb to its height first."""
        store = self._store
        self._arrival.configure(self._parameters)
        if store.mission.version != self._seen[0]:
            self._jumps.clear()
            self._left_at = 0
        items = store.mission.items
        if self._restart and items and store.current == len(items) - 1:
            store.current = 0
            self._left_at = 0
            self._jumps.clear()
        self._restart = False
        self._climb_first = True
        self._leg = MissionLeg(LegKind.HOLD, view.position_ned_m)
        if self._begin_mission(view):
            self._resume()
            self._begin_item(view)

    def step(self, view: VehicleView) -> MissionLeg:
        """The leg to fly now."""
        store = self._store
        if self._seen != (store.mission.version, store.selections):
            self._change(view)
        elif view.home_ned_m is not self._home_ned_m:
            self._move_home(view)
        if self._phase is _Phase.OVER or self._phase is _Phase.WAIT or self._item is None:
            return self._leg
        self._arrival.configure(self._parameters)
        self._actions.move(view.position_ned_m)
        self._look(view)
        if self._is_done(self._item, view):
            self._go_on(self._item, view)
        return self._leg

    def leave(self) -> None:
        """The mode has ended: no more pictures; `enter` begins the current item again."""
        self._actions.stop()
        self._left_at = self._store.current
        self._item = None
        self._phase = _Phase.OVER

    def disarmed(self) -> None:
        """The motors have stopped: a mission at its last item begins again at its first."""
        self._restart = self._store.started

    def take_events(self) -> list[IssuedCommand | StatusText]:
        """Texts and commands to others since the last call."""
        return self._actions.take_events()

    # Beginning and changing the mission

    def _begin_mission(self, view: VehicleView) -> bool:
        """Whether there is a mission to fly; if not, the vehicle stays where it is."""
        store = self._store
        self._seen = (store.mission.version, store.selections)
        self._home_ned_m = view.home_ned_m
        self._actions.region.release()
        self._item = None
        if not store.valid or view.projection is None:
            reaction = "refusing takeoff" if view.landed else "loitering"
            self._actions.say(CRITICAL, f"No valid mission available, {reaction}")
            self._end(view, finished=False)
            return False
        found = route.behind_jumps(store.mission.items, store.current, self._jumps, follow=True)
        if found is None:
            self._end(view, finished=True)
            return False
        store.current = found
        store.started, store.finished = True, False
        return True

    def _resume(self) -> None:
        """Restore the settings of earlier items; an interrupted series of pictures misses none."""
        store, items = self._store, self._store.mission.items
        self._actions.say(INFO, "Executing Mission")
        self._speed_m_s = route.speed_before(items, store.current)
        for item in route.settings_before(items, store.current):
            self._actions.command_camera(item)
        trigger = route.trigger_before(items, store.current)
        self._replay = None
        if trigger is not None:
            if self._left_at > 0:
                before = route.place_before(items, store.current)
                store.current = store.current if before is None else before
            self._replay = (store.current, trigger)
        self._left_at = 0

    def _change(self, view: VehicleView) -> None:
        """Begin another mission, or another item, while this one is flown."""
        if self._store.mission.version != self._seen[0]:
            self._jumps.clear()
            self._replay = None
        self._left_at = 0
        if self._begin_mission(view):
            self._begin_item(view)

    def _move_home(self, view: VehicleView) -> None:
        """Adapt a height above home to a new home."""
        before, self._home_ned_m = self._home_ned_m, view.home_ned_m
        if before is None or view.home_ned_m is None or self._item is None or not self._item.is_relative:
            return
        north_m, east_m, down_m = self._leg.target_ned_m
        target_ned_m = (north_m, east_m, down_m + view.home_ned_m[2] - before[2])
        self._leg = replace(self._leg, target_ned_m=target_ned_m)

    # Beginning an item

    def _begin_item(self, view: VehicleView) -> None:
        item = self._item = self._store.mission.items[self._store.current]
        self._arrival.begin()
        self._phase = _Phase.ITEM
        if self._replay is not None and self._store.current > self._replay[0]:
            self._actions.perform(self._replay[1], view)
            self._replay = None
        if item.has_place:
            self._begin_place(item, view)
        elif item.command == Do.CONDITION_GATE:  # fly on; with no place behind it the gate is passed already
            onward = route.next_place(self._store.mission.items, item.seq + 1, self._jumps)
            self._gate_ned_m = None if onward is None else self._target_of(item, view)
            if onward is not None:
                target_ned_m = self._target_of(onward, view)
                self._leg = MissionLeg(
                    LegKind.FLY, target_ned_m, nan, self._speed_m_s, self._arrival.radius_m
                )
        elif item.command == Do.CHANGE_SPEED:
            self._speed_m_s = route.commanded_speed(item)
            self._leg = replace(self._leg, speed_m_s=self._speed_m_s)
        else:
            self._actions.perform(item, view)

    def _begin_place(self, item: MissionItem, view: VehicleView) -> None:
        """Climb first if necessary, else fly to the item's place."""
        climb_first, self._climb_first = self._climb_first, False
        here_ned_m, target_ned_m = view.position_ned_m, self._target_of(item, view)
        if item.command == Do.LAND:
            if not view.landed:
                self._begin_landing(target_ned_m, view)
            return
        climb_m = here_ned_m[2] - target_ned_m[2]
        if view.landed or (climb_first and climb_m > self._arrival.height_m):
            if climb_m < _MIN_CLIMB_M:
                climb_m = self._arrival.takeoff_m
            down_m = here_ned_m[2] - climb_m
            above_home_m = -down_m if view.home_ned_m is None else view.home_ned_m[2] - down_m
            self._actions.say(INFO, f"Climb to {above_home_m:.1f} meters above home")
            kind = LegKind.TAKEOFF if view.landed else LegKind.FLY
            self._phase = _Phase.CLIMB
            self._leg = MissionLeg(
                kind, (here_ned_m[0], here_ned_m[1], down_m), nan, self._speed_m_s, self._arrival.radius_m
            )
            return
        self._fly_to(item, target_ned_m, view)

    def _fly_to(self, item: MissionItem, target_ned_m: Vec3, view: VehicleView) -> None:
        yaw_deg = item.params[3] if item.command in _YAWING else nan
        if item.command == Do.LOITER_TO_ALT and view.position_ned_m[2] != target_ned_m[2]:
            self._phase = _Phase.APPROACH  # the height is changed only at the place
            target_ned_m = (target_ned_m[0], target_ned_m[1], view.position_ned_m[2])
        next_ned_m = onward = None
        if self._phase is _Phase.ITEM:
            onward = route.next_without_stop(self._store.mission.items, item, self._jumps)
        if onward is not None:
            north_m, east_m, down_m = view.place_of(onward)
            next_ned_m = (
                target_ned_m[0] if isnan(north_m) else north_m,
                target_ned_m[1] if isnan(east_m) else east_m,
                down_m if isfinite(down_m) else target_ned_m[2],
            )
        self._leg = MissionLeg(
            LegKind.FLY,
            target_ned_m,
            remainder(radians(yaw_deg), tau) if isfinite(yaw_deg) else nan,
            self._speed_m_s,
            self._arrival.radius_of(item),
            next_ned_m,
        )

    def _begin_landing(self, target_ned_m: Vec3, view: VehicleView) -> None:
        """Land at the target; from farther away, fly there first at the present height."""
        here_ned_m = view.position_ned_m
        north_m, east_m, _ = target_ned_m
        if hypot(north_m - here_ned_m[0], east_m - here_ned_m[1]) > self._arrival.radius_m:
            down_m = self._leg.target_ned_m[2] if self._leg.kind is LegKind.FLY else here_ned_m[2]
            self._phase = _Phase.APPROACH
            place_ned_m = (north_m, east_m, down_m)
            self._leg = MissionLeg(LegKind.FLY, place_ned_m, nan, self._speed_m_s, self._arrival.radius_m)
        else:
            self._phase = _Phase.ITEM
            self._leg = MissionLeg(LegKind.LAND, (north_m, east_m, here_ned_m[2]))

    # Ending an item

    def _is_done(self, item: MissionItem, view: VehicleView) -> bool:
        """Whether the present phase of the item is over."""
        if self._phase is _Phase.CLIMB:
            return self._arrival.has_climbed(self._leg, view)
        if self._phase is _Phase.APPROACH:
            return self._arrival.is_there(self._leg, view)
        match item.command:
            case Do.LAND:
                done = view.landed
            case Do.DELAY:
                done = self._arrival.has_waited(item, view)
            case Do.CONDITION_GATE:
                done = self._gate_ned_m is None or is_behind(self._gate_ned_m, self._leg, view)
            case Do.LOITER_UNLIM:
                done = False
            case _ if item.has_place:
                done = self._arrival.has_arrived(self._leg, view) and self._arrival.has_waited(item, view)
            case _:
                done = True
        return done

    def _go_on(self, item: MissionItem, view: VehicleView) -> None:
        """Begin the next phase of the item, or the next item."""
        if self._phase is _Phase.CLIMB:
            self._phase = _Phase.ITEM
            self._fly_to(item, self._target_of(item, view), view)
            return
        if self._phase is _Phase.APPROACH:
            self._phase = _Phase.ITEM
            target_ned_m = self._target_of(item, view)
            if item.command == Do.LAND:
                self._leg = MissionLeg(
                    LegKind.LAND, (target_ned_m[0], target_ned_m[1], view.position_ned_m[2])
                )
            else:
                self._leg = replace(self._leg, target_ned_m=target_ned_m)
            return
        self._store.report_reached(item.seq)
        if not item.autocontinue:
            self._phase = _Phase.WAIT
            return
        self._begin_next(item, view)

    def _begin_next(self, item: MissionItem, view: VehicleView) -> None:
        store = self._store
        found = None
        if store.current + 1 < len(store.mission.items):
            found = route.behind_jumps(store.mission.items, store.current + 1, self._jumps, follow=True)
        if item.command == Do.RETURN_TO_LAUNCH:
            store.finished = found is None
            store.current = store.current if found is None else found
            self._item, self._phase = None, _Phase.OVER
            self._leg = MissionLeg(LegKind.RETURN, view.position_ned_m)
        elif found is None:
            self._end(view, finished=True)
        else:
            store.current = found
            self._begin_item(view)

    def _end(self, view: VehicleView, *, finished: bool) -> None:
        """Stay: at the target flown to, else here."""
        if finished:
            self._actions.say(INFO, f"Mission finished, {'landed' if view.landed else 'loitering'}")
            self._jumps.clear()
            self._store.finished = True
        flown_to = self._leg.kind is LegKind.FLY and not view.landed
        target_ned_m = self._leg.target_ned_m if flown_to else view.position_ned_m
        self._item, self._phase = None, _Phase.OVER
        self._leg = MissionLeg(LegKind.DONE, target_ned_m, self._leg.yaw_rad, self._speed_m_s)

    def _look(self, view: VehicleView) -> None:
        """Yaw towards the region of interest; not while climbing, taking off or landing."""
        if self._phase is not _Phase.ITEM or self._leg.kind is not LegKind.FLY:
            return
        yaw_rad = self._actions.region.yaw_rad(view, self._leg.target_ned_m, self._arrival.radius_m)
        if isnan(yaw_rad):
            return
        if not abs(remainder(yaw_rad - self._leg.yaw_rad, tau)) <= _SAME_YAW_RAD:  # also if it was NaN
            self._leg = replace(self._leg, yaw_rad=yaw_rad)

    def _target_of(self, item: MissionItem, view: VehicleView) -> Vec3:
        """The item's place; what it does not give is the vehicle's position, or the height of its leg."""
        north_m, east_m, down_m = view.place_of(item)
        if isnan(north_m):
            north_m, east_m, _ = view.position_ned_m
        if not isfinite(down_m):
            down_m = self._leg.target_ned_m[2] if self._leg.kind is LegKind.FLY else view.position_ned_m[2]
        return (north_m, east_m, down_m)
