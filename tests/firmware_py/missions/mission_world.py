"""A simple world that flies missions, and helpers to write them."""

from math import atan2, hypot, isnan, nan, remainder, tau

from firmware_py.missions.executor import MissionExecutor
from firmware_py.missions.flight import IssuedCommand, LegKind, VehicleView
from firmware_py.missions.items import Do, MavFrame, MissionItem, PlanType
from firmware_py.missions.store import MissionStore
from firmware_py.parameters import Parameters
from firmware_py.types import StatusText
from framerunner.vehicle.geodesy import GeodeticPoint, LocalProjection

ORIGIN = GeodeticPoint(47.397742, 8.545594, 489.0)
PROJECTION = LocalProjection(ORIGIN)
TICK_US = 20_000
CRUISE_M_S = 5.0
TURN_RAD_S = 1.0


def at(seq, command, north=0.0, east=0.0, up=0.0, *, params=(0.0, 0.0, 0.0, nan), autocontinue=True):
    """An item at a place, height above home."""
    point = PROJECTION.to_geodetic((north, east, 0.0))
    frame = MavFrame.GLOBAL_RELATIVE_ALT_INT
    return MissionItem(seq, frame, command, params, point.latitude_deg, point.longitude_deg, up, autocontinue)


def do(seq, command, *params, autocontinue=True):
    """An item without a place."""
    values = (*params, *[0.0] * (7 - len(params)))
    return MissionItem(seq, MavFrame.MISSION, command, values[:4], *values[4:], autocontinue)


def plan(*makers):
    """Number items: each maker takes its seq."""
    return [maker(seq) for seq, maker in enumerate(makers)]


def placed(command, *place, **options):
    return lambda seq: at(seq, command, *place, **options)


def waypoint(north, east, up, **options):
    return placed(Do.WAYPOINT, north, east, up, **options)


def doing(command, *params, **options):
    return lambda seq: do(seq, command, *params, **options)


class World:
    """A point mass without inertia that flies legs, with a speed limit."""

    def __init__(self, items, *, parameters=None, current=None):
        self.parameters = parameters or Parameters()
        self.store = MissionStore()
        self.store.replace(PlanType.MISSION, items, current=current)
        self.store.valid = bool(items)
        self.view = VehicleView(projection=PROJECTION, home_ned_m=(0.0, 0.0, 0.0))
        self.executor = MissionExecutor(self.store, self.parameters)
        self.reached, self.texts, self.commands, self.legs, self.track = [], [], [], [], []
        self.executor.enter(self.view)

    @property
    def kinds(self):
        """Kinds of the legs flown."""
        return [
            leg.kind for index, leg in enumerate(self.legs) if not index or self.legs[index - 1] is not leg
        ]

    def run(self, seconds=600.0, *, until=lambda world: False):
        """Fly until done, or for a time; the last leg."""
        end_us = self.view.time_us + round(seconds * 1e6)
        while self.view.time_us < end_us:
            leg = self.tick()
            if leg.kind in (LegKind.DONE, LegKind.RETURN) or until(self):
                break
        return leg

    def tick(self):
        self.view.time_us += TICK_US
        leg = self.executor.step(self.view)
        self.collect()
        if not self.legs or self.legs[-1] is not leg:
            self.legs.append(leg)
        self._move(leg)
        self.track.append(self.view.position_ned_m)
        return leg

    def collect(self):
        self.reached += self.store.take_reached()
        for event in self.executor.take_events():
            if isinstance(event, StatusText):
                self.texts.append(event.text)
            elif isinstance(event, IssuedCommand):
                self.commands.append((event.command, event.params))

    def _move(self, leg):
        view, step_s = self.view, TICK_US / 1e6
        north, east, down = view.position_ned_m
        to_north, to_east, to_down = leg.target_ned_m
        if leg.kind is LegKind.LAND:
            to_down = 0.0
        if leg.kind is LegKind.TAKEOFF:
            to_north, to_east = north, east
        speed = CRUISE_M_S if isnan(leg.speed_m_s) else leg.speed_m_s
        distance = hypot(to_north - north, to_east - east)
        share = min(1.0, speed * step_s / distance) if distance else 0.0
        climb = max(-2.0 * step_s, min(2.0 * step_s, to_down - down))
        view.position_ned_m = (
            north + share * (to_north - north),
            east + share * (to_east - east),
            min(0.0, down + climb),
        )
        view.landed = view.position_ned_m[2] > -0.05
        ahead = atan2(to_east - east, to_north - north) if distance > 1.0 else view.yaw_rad
        yaw = ahead if isnan(leg.yaw_rad) else leg.yaw_rad
        turn = remainder(yaw - view.yaw_rad, tau)
        view.yaw_rad += max(-TURN_RAD_S * step_s, min(TURN_RAD_S * step_s, turn))
