"""Mission items without a place: camera commands, regions of interest (ROI), and commands to others."""

from __future__ import annotations

from math import atan2, dist, hypot, isfinite, nan, radians, remainder, tau

from firmware_py.missions.flight import IssuedCommand, VehicleView
from firmware_py.missions.items import ROI_LOCATION, ROI_WPNEXT, Do, MissionItem
from firmware_py.types import WARNING, StatusText
from framerunner.geometry.vectors import ZERO3, Vec3

_CAMERA = frozenset(
    {
        Do.CONTROL_VIDEO,
        Do.DIGICAM_CONTROL,
        Do.GIMBAL_CONFIGURE,
        Do.GIMBAL_PITCHYAW,
        Do.IMAGE_START_CAPTURE,
        Do.IMAGE_STOP_CAPTURE,
        Do.MOUNT_CONFIGURE,
        Do.MOUNT_CONTROL,
        Do.SET_CAMERA_FOCUS,
        Do.SET_CAMERA_MODE,
        Do.SET_CAMERA_SOURCE,
        Do.TRIGGER_CONTROL,
        Do.VIDEO_START_CAPTURE,
        Do.VIDEO_STOP_CAPTURE,
    }
)
_ABSENT = frozenset({Do.WINCH, Do.SET_ACTUATOR, Do.OBLIQUE_SURVEY, Do.VTOL_TRANSITION})
_NO_PARAMS = (0.0,) * 7
REGIONS = frozenset({Do.NAV_ROI, Do.SET_ROI, Do.SET_ROI_LOCATION, Do.SET_ROI_NONE, Do.SET_ROI_WPNEXT_OFFSET})


class RegionOfInterest:
    """The region to look at, by yawing the whole vehicle; a gimbal looks at places too."""

    def __init__(self) -> None:
        self.release()

    @property
    def place_ned_m(self) -> Vec3 | None:
        """The region if it is a place; None: it is not, or there is none."""
        return self._place_ned_m

    def release(self) -> None:
        """Look along the path."""
        self._place_ned_m: Vec3 | None = None
        self._to_target = False
        self._offset_rad = 0.0

    def change(self, item: MissionItem, view: VehicleView) -> None:
        """Take the region of an item."""
        self.release()
        match item.command:
            case Do.SET_ROI_LOCATION:
                self._look_at(item, view)
            case Do.SET_ROI_WPNEXT_OFFSET:
                self._to_target = True
                self._offset_rad = radians(item.z) if isfinite(item.z) else 0.0
            case Do.SET_ROI | Do.NAV_ROI if item.params[0] == ROI_LOCATION:
                self._look_at(item, view)
            case Do.SET_ROI | Do.NAV_ROI if item.params[0] == ROI_WPNEXT:
                self._to_target = True

    def yaw_rad(self, view: VehicleView, target_ned_m: Vec3, min_distance_m: float) -> float:
        """The yaw towards the region; NaN without one, and nearer to it than the minimum distance."""
        place_ned_m = target_ned_m if self._to_target else self._place_ned_m
        if place_ned_m is None:
            return nan
        north_m = place_ned_m[0] - view.position_ned_m[0]
        east_m = place_ned_m[1] - view.position_ned_m[1]
        if hypot(north_m, east_m) <= min_distance_m:
            return nan
        return remainder(atan2(east_m, north_m) + self._offset_rad, tau)

    def _look_at(self, item: MissionItem, view: VehicleView) -> None:
        place_ned_m = view.place_of(item)
        if isfinite(place_ned_m[0]):
            self._place_ned_m = place_ned_m


class MissionActions:
    """Performs items without a place, and keeps texts and commands to others until they are taken.

    Attributes:
        region: where to look.
    """

    def __init__(self) -> None:
        self.region = RegionOfInterest()
        self._events: list[IssuedCommand | StatusText] = []
        self._distance_m = 0.0  # between pictures; 0: off
        self._last_ned_m = ZERO3  # of the last picture by distance
        self._taken = 0
        self._repeating = False

    def perform(self, item: MissionItem, view: VehicleView) -> None:
        """Perform an item; one that only controls the order of items, such as a jump, does nothing."""
        command = item.command
        if command in REGIONS:
            self.region.change(item, view)
            self._events.append(IssuedCommand(command, _NO_PARAMS, self.region.place_ned_m))
        elif command in _CAMERA:
            self.command_camera(item)
        elif command == Do.SET_CAM_TRIGG_DIST:
            self._start_by_distance(item, view.position_ned_m)
        elif command == Do.SET_CAM_TRIGG_INTERVAL:
            self._start_by_time(item)
        elif command in (Do.SET_HOME, Do.ARM_DISARM, Do.GRIPPER):
            self._pass_on(item)
        elif command in _ABSENT:
            self.say(WARNING, f"Mission item {item.seq + 1} does nothing: no such device here")

    def command_camera(self, item: MissionItem) -> None:
        """Pass a command on to the camera."""
        if item.command == Do.IMAGE_START_CAPTURE:
            self._repeating = item.params[2] != 1.0
        elif item.command == Do.IMAGE_STOP_CAPTURE:
            self._repeating = False
        self._pass_on(item)

    def move(self, position_ned_m: Vec3) -> None:
        """Take the vehicle's position, for pictures by distance."""
        if self._distance_m and dist(position_ned_m, self._last_ned_m) >= self._distance_m:
            self._last_ned_m = position_ned_m
            self._take_one()

    def stop(self) -> None:
        """The mission is left: no more pictures."""
        self._distance_m = 0.0
        if self._repeating:
            self._repeating = False
            self._command_camera(Do.IMAGE_STOP_CAPTURE, (0.0, 0.0, 0.0, 0.0))

    def say(self, severity: int, text: str) -> None:
        """Leave a text for people, with MAV_SEVERITY."""
        self._events.append(StatusText(severity, text))

    def take_events(self) -> list[IssuedCommand | StatusText]:
        """Texts and commands to others since the last call, oldest first."""
        if not self._events:
            return []
        events, self._events = self._events, []
        return events

    def _start_by_distance(self, item: MissionItem, position_ned_m: Vec3) -> None:
        """DO_SET_CAM_TRIGG_DIST: a picture every so many metres; zero or less ends it."""
        distance_m, at_once = item.params[0], item.params[2]
        self._distance_m = distance_m if isfinite(distance_m) and distance_m > 0.0 else 0.0
        self._last_ned_m = position_ned_m
        if self._distance_m and at_once == 1.0:
            self._take_one()

    def _start_by_time(self, item: MissionItem) -> None:
        """DO_SET_CAM_TRIGG_INTERVAL: a picture every so many milliseconds; zero or less ends it."""
        interval_s = item.params[0] / 1e3
        if isfinite(interval_s) and interval_s > 0.0:
            self._command_camera(Do.IMAGE_START_CAPTURE, (0.0, interval_s, 0.0, 0.0))
        else:
            self._command_camera(Do.IMAGE_STOP_CAPTURE, (0.0, 0.0, 0.0, 0.0))
        self._repeating = interval_s > 0.0

    def _take_one(self) -> None:
        self._taken += 1
        self._command_camera(Do.IMAGE_START_CAPTURE, (0.0, 0.0, 1.0, float(self._taken)))

    def _command_camera(self, command: Do, params: tuple[float, float, float, float]) -> None:
        self._events.append(IssuedCommand(command, (*params, 0.0, 0.0, 0.0)))

    def _pass_on(self, item: MissionItem) -> None:
        self._events.append(IssuedCommand(item.command, (*item.params, item.x, item.y, item.z)))
