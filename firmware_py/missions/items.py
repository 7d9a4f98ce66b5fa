"""Mission, fence and rally items, with MAVLink's numbers (MAV_FRAME, MAV_CMD)."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import IntEnum
from struct import Struct
from zlib import crc32


class PlanType(IntEnum):
    """MAV_MISSION_TYPE."""

    MISSION = 0
    FENCE = 1
    RALLY = 2


class MavFrame(IntEnum):
    """The frames that an item may have."""

    GLOBAL = 0
    MISSION = 2  # no place: x and y are plain numbers
    GLOBAL_RELATIVE_ALT = 3
    GLOBAL_INT = 5
    GLOBAL_RELATIVE_ALT_INT = 6


GLOBAL_FRAMES = frozenset(MavFrame) - {MavFrame.MISSION}
RELATIVE_FRAMES = frozenset({MavFrame.GLOBAL_RELATIVE_ALT, MavFrame.GLOBAL_RELATIVE_ALT_INT})


class Do(IntEnum):
    """MAV_CMD of mission, fence and rally items."""

    WAYPOINT = 16
    LOITER_UNLIM = 17
    LOITER_TIME = 19
    RETURN_TO_LAUNCH = 20
    LAND = 21
    TAKEOFF = 22
    LOITER_TO_ALT = 31
    NAV_ROI = 80
    VTOL_TAKEOFF = 84
    VTOL_LAND = 85
    DELAY = 93
    CONDITION_DELAY = 112
    CONDITION_DISTANCE = 114
    JUMP = 177
    CHANGE_SPEED = 178
    SET_HOME = 179
    SET_ACTUATOR = 187
    LAND_START = 189
    SET_ROI_LOCATION = 195
    SET_ROI_WPNEXT_OFFSET = 196
    SET_ROI_NONE = 197
    CONTROL_VIDEO = 200
    SET_ROI = 201
    DIGICAM_CONTROL = 203
    MOUNT_CONFIGURE = 204
    MOUNT_CONTROL = 205
    SET_CAM_TRIGG_DIST = 206
    GRIPPER = 211
    SET_CAM_TRIGG_INTERVAL = 214
    OBLIQUE_SURVEY = 260
    ARM_DISARM = 400
    SET_CAMERA_MODE = 530
    SET_CAMERA_FOCUS = 532
    SET_CAMERA_SOURCE = 534
    GIMBAL_PITCHYAW = 1000
    GIMBAL_CONFIGURE = 1001
    IMAGE_START_CAPTURE = 2000
    IMAGE_STOP_CAPTURE = 2001
    TRIGGER_CONTROL = 2003
    VIDEO_START_CAPTURE = 2500
    VIDEO_STOP_CAPTURE = 2501
    VTOL_TRANSITION = 3000
    CONDITION_GATE = 4501
    FENCE_RETURN_POINT = 5000
    POLYGON_INCLUSION = 5001
    POLYGON_EXCLUSION = 5002
    CIRCLE_INCLUSION = 5003
    CIRCLE_EXCLUSION = 5004
    RALLY_POINT = 5100
    WINCH = 42600


PLACES = frozenset(
    {
        Do.WAYPOINT,
        Do.LOITER_UNLIM,
        Do.LOITER_TIME,
        Do.LAND,
        Do.TAKEOFF,
        Do.LOITER_TO_ALT,
        Do.VTOL_TAKEOFF,
        Do.VTOL_LAND,
    }
)
"""Commands that fly to the item's place."""

POLYGONS = frozenset({Do.POLYGON_INCLUSION, Do.POLYGON_EXCLUSION})
CIRCLES = frozenset({Do.CIRCLE_INCLUSION, Do.CIRCLE_EXCLUSION})
ROI_NONE, ROI_WPNEXT, ROI_WPINDEX, ROI_LOCATION = 0, 1, 2, 3  # MAV_ROI
_HOLDING = frozenset({Do.WAYPOINT, Do.LOITER_TIME, Do.DELAY})
_MAX_HOLD_S = 1e9

Params = tuple[float, float, float, float]


@dataclass(frozen=True, slots=True)
class MissionItem:
    """One item as it was uploaded.

    Attributes:
        seq: its index in the plan, from 0.
        frame: `MavFrame`.
        command: `Do`.
        params: params 1 to 4.
        x: latitude in degrees in a global frame, else param 5; NaN: not given.
        y: longitude in degrees in a global frame, else param 6; NaN: not given.
        z: altitude in metres above sea level or home in a global frame, else param 7; NaN: not given.
        autocontinue: go on to the next item when this one is done.
    """

    seq: int
    frame: int
    command: int
    params: Params = (0.0, 0.0, 0.0, 0.0)
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    autocontinue: bool = True

    @property
    def has_place(self) -> bool:
        """Whether its command flies to its place."""
        return self.command in PLACES

    @property
    def is_relative(self) -> bool:
        """Whether its altitude is relative to home."""
        return self.frame in RELATIVE_FRAMES

    @property
    def hold_us(self) -> int:
        """How long to wait at it, microseconds."""
        hold_s = self.params[0] if self.command in _HOLDING else 0.0
        return round(min(hold_s, _MAX_HOLD_S) * 1e6) if hold_s > 0.0 else 0


_PACKED = Struct("<BHB7d")


def opaque_id(items: Iterable[MissionItem]) -> int:
    """MAVLink's opaque id of a plan: the same for the same items, 0 for none.

    A CRC-32 over each item's frame, command, autocontinue and seven parameters, as in PX4; clients may
    compare it but not compute it.
    """
    crc, count = 0, 0
    for item in items:
        count += 1
        packed = _PACKED.pack(
            item.frame, item.command, item.autocontinue, *item.params, item.x, item.y, item.z
        )
        crc = crc32(packed, crc)
    return crc or min(count, 1)
