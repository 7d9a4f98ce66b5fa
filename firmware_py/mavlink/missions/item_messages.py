"""Mission messages: items to and from MISSION_ITEM and MISSION_ITEM_INT, and a plan's opaque id.

The items that can be uploaded are PX4's. The opaque ids are extensions that pymavlink's dialects lack;
receivers that lack them too ignore them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import isfinite, isinf, isnan, nan
from struct import pack

from firmware_py.missions.geofence import MIN_VERTICES, vertex_count
from firmware_py.missions.items import (
    CIRCLES,
    GLOBAL_FRAMES,
    PLACES,
    POLYGONS,
    ROI_LOCATION,
    ROI_NONE,
    ROI_WPINDEX,
    ROI_WPNEXT,
    Do,
    MavFrame,
    MissionItem,
    PlanType,
)
from framerunner.wire.dialect import Message, mavlink, whole

_NOT_GIVEN = 0x7FFF_FFFF  # x or y of MISSION_ITEM_INT
_REGIONS = frozenset({Do.NAV_ROI, Do.SET_ROI})
_REGION_PLACES = (ROI_NONE, ROI_LOCATION)
_REGION_WAYPOINTS = (ROI_NONE, ROI_WPNEXT, ROI_WPINDEX)
_FENCE = POLYGONS | CIRCLES | {Do.FENCE_RETURN_POINT}
_WITH_PLACE: dict[PlanType, frozenset[int]] = {
    PlanType.MISSION: frozenset(PLACES | _REGIONS | {Do.SET_ROI_LOCATION, Do.CONDITION_GATE, Do.ARM_DISARM}),
    PlanType.FENCE: frozenset(_FENCE),
    PlanType.RALLY: frozenset({Do.RALLY_POINT, Do.LOITER_TO_ALT}),
}
_WITHOUT_PLACE = (
    frozenset(Do) - _WITH_PLACE[PlanType.MISSION] - _FENCE - {Do.RALLY_POINT} | {Do.ARM_DISARM} | _REGIONS
)
_OF_OTHER_PLANS = frozenset(_FENCE | {Do.RALLY_POINT})
_SHORT_FRAMES: dict[int, int] = {
    MavFrame.GLOBAL_INT: MavFrame.GLOBAL,
    MavFrame.GLOBAL_RELATIVE_ALT_INT: MavFrame.GLOBAL_RELATIVE_ALT,
}
_INT_FRAMES = {short: long for long, short in _SHORT_FRAMES.items()}


@dataclass(frozen=True, slots=True)
class ItemRefusal:
    """An item that cannot be taken."""

    result: int  # MAV_MISSION_RESULT
    reason: str


def read_item(message: Message, plan_type: PlanType) -> MissionItem | ItemRefusal:
    """The item in a MISSION_ITEM or MISSION_ITEM_INT, if a plan of that type may have it."""
    is_int = message.get_msgId() == mavlink.MAVLINK_MSG_ID_MISSION_ITEM_INT
    frame, command = message.frame, message.command
    if frame in GLOBAL_FRAMES and (is_int or frame not in _SHORT_FRAMES):
        accepted = command in _WITH_PLACE[plan_type]
    elif frame == MavFrame.MISSION:
        accepted = plan_type is PlanType.MISSION and command in _WITHOUT_PLACE
    else:
        return ItemRefusal(mavlink.MAV_MISSION_UNSUPPORTED_FRAME, f"frame {frame} is not supported")
    if not accepted:
        misplaced = plan_type is PlanType.MISSION and command in _OF_OTHER_PLANS
        result = mavlink.MAV_MISSION_ERROR if misplaced else mavlink.MAV_MISSION_UNSUPPORTED
        return ItemRefusal(result, f"command {command} is not supported in frame {frame}")
    x, y = float(message.x), float(message.y)
    if is_int and frame != MavFrame.MISSION:
        x = nan if message.x == _NOT_GIVEN else message.x * 1e-7
        y = nan if message.y == _NOT_GIVEN else message.y * 1e-7
    params = (message.param1, message.param2, message.param3, message.param4)
    item = MissionItem(message.seq, frame, command, params, x, y, message.z, bool(message.autocontinue))
    return next(_faults(item), item)


def _faults(item: MissionItem) -> Iterator[ItemRefusal]:
    """The faults in the numbers of an item."""
    first, second = item.params[0], item.params[1]
    with_place = item.frame in GLOBAL_FRAMES
    if with_place and not _is_angle(item.x, 90.0, optional=item.has_place):
        yield ItemRefusal(mavlink.MAV_MISSION_INVALID_PARAM5_X, f"latitude {item.x:g} is no place")
    if with_place and not _is_angle(item.y, 180.0, optional=item.has_place):
        yield ItemRefusal(mavlink.MAV_MISSION_INVALID_PARAM6_Y, f"longitude {item.y:g} is no place")
    if with_place and isinf(item.z):
        yield ItemRefusal(mavlink.MAV_MISSION_INVALID_PARAM7, f"altitude {item.z:g} cannot be flown")
    if item.command in _REGIONS and first not in (_REGION_PLACES if with_place else _REGION_WAYPOINTS):
        yield ItemRefusal(mavlink.MAV_MISSION_INVALID_PARAM1, f"region mode {first:g} is not supported")
    if item.command == Do.JUMP and not isfinite(first):
        yield ItemRefusal(mavlink.MAV_MISSION_INVALID_PARAM1, f"index {first:g} to jump to is none")
    if item.command == Do.JUMP and not isfinite(second):
        yield ItemRefusal(mavlink.MAV_MISSION_INVALID_PARAM2, f"count {second:g} of jumps is none")
    if item.command in CIRCLES and not (isfinite(first) and first >= 0.0):
        yield ItemRefusal(mavlink.MAV_MISSION_INVALID_PARAM1, f"radius {first:g} is none")
    if item.command in POLYGONS and vertex_count(item) < MIN_VERTICES:
        yield ItemRefusal(mavlink.MAV_MISSION_ERROR, f"a polygon needs {MIN_VERTICES} vertices")


def _is_angle(angle_deg: float, max_deg: float, *, optional: bool) -> bool:
    return optional if isnan(angle_deg) else abs(angle_deg) <= max_deg


def item_message(
    item: MissionItem, target: tuple[int, int], plan_type: PlanType, *, current: bool, as_int: bool
) -> Message:
    """The item as MISSION_ITEM_INT or MISSION_ITEM, in that message's own frame, as PX4 sends it."""
    build = mavlink.MAVLink_mission_item_int_message if as_int else mavlink.MAVLink_mission_item_message
    frames = _INT_FRAMES if as_int else _SHORT_FRAMES
    frame = frames.get(item.frame, item.frame)
    x: float = item.x
    y: float = item.y
    if as_int:
        scale = 1.0 if item.frame == MavFrame.MISSION else 1e7
        x, y = _as_int(item.x, scale), _as_int(item.y, scale)
    return build(
        *target,
        item.seq,
        int(frame),
        item.command,
        int(current),
        int(item.autocontinue),
        *item.params,
        x,
        y,
        item.z,
        int(plan_type),
    )


def _as_int(value: float, scale: float) -> int:
    return _NOT_GIVEN if isnan(value) else whole(value * scale, 32)


class ExtendedMessage(mavlink.MAVLink_message):  # type: ignore[misc]  # pymavlink has no types
    """A message with an extension field that the dialect lacks; its fields are in the order of the wire."""

    def __init__(self, known: Message, layout: str, *fields: int) -> None:
        mavlink.MAVLink_message.__init__(self, known.id, known.msgname)
        self.crc_extra = known.crc_extra
        self._payload = pack(layout, *fields)

    def pack(self, mav: Message, force_mavlink1: bool = False) -> bytes:
        """The packet."""
        return bytes(self._pack(mav, self.crc_extra, self._payload, force_mavlink1=force_mavlink1))


def mission_count(target: tuple[int, int], count: int, mission_type: int, opaque_id: int) -> Message:
    """MISSION_COUNT with the opaque id of the plan, or 0."""
    known = mavlink.MAVLink_mission_count_message
    return ExtendedMessage(known, "<HBBBI", count, *target, mission_type, opaque_id)


def mission_ack(target: tuple[int, int], result: int, mission_type: int, opaque_id: int) -> Message:
    """MISSION_ACK with the opaque id of the new plan, or 0."""
    known = mavlink.MAVLink_mission_ack_message
    return ExtendedMessage(known, "<BBBBI", *target, result, mission_type, opaque_id)


def mission_current(seq: int, total: int, state: int, mode: int, opaque_ids: tuple[int, int, int]) -> Message:
    """MISSION_CURRENT: item, number of items, MISSION_STATE, 1 active or 2 not, opaque ids of three plans."""
    known = mavlink.MAVLink_mission_current_message
    return ExtendedMessage(known, "<HHBBIII", seq, total, state, mode, *opaque_ids)
