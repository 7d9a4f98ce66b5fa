"""Uploads a fence to a vehicle and downloads the one it has, by the mission protocol.

https://mavlink.io/en/services/mission.html; a fence is a plan of the type MAV_MISSION_TYPE_FENCE.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

from framerunner.preflight.session import VehicleSession
from framerunner.wire.dialect import AUTOPILOT_COMPONENT_ID, Message, mavlink
from offboard.drone import DroneError

FENCE = mavlink.MAV_MISSION_TYPE_FENCE
_INCLUSION = mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION
_UPLOAD_S = 5.0
_REQUESTS = ("MISSION_REQUEST_INT", "MISSION_REQUEST")
MAX_ITEMS = 1000

Vertex = tuple[int, int]
"""Latitude and longitude, 1e-7 degrees."""


@dataclass(frozen=True, slots=True)
class FenceItem:
    """One item of a fence, with the fields of MISSION_ITEM_INT.

    Attributes:
        command: MAV_CMD.
        frame: MAV_FRAME.
        params: param1 to param4.
        x: latitude, 1e-7 degrees.
        y: longitude, 1e-7 degrees.
        z: metres.
    """

    command: int
    frame: int
    params: tuple[float, float, float, float]
    x: int
    y: int
    z: float = 0.0


def polygon_fence(vertices: Sequence[Vertex]) -> tuple[FenceItem, ...]:
    """The items of a fence of one polygon in which the vehicle must stay."""
    params = (float(len(vertices)), 0.0, 0.0, 0.0)
    return tuple(FenceItem(_INCLUSION, mavlink.MAV_FRAME_GLOBAL, params, x, y) for x, y in vertices)


def upload_fence(session: VehicleSession, items: Sequence[FenceItem]) -> None:
    """Replace the vehicle's fence; without items it has none afterwards.

    Raises:
        DroneError: the vehicle refuses it or does not answer.
    """
    count = mavlink.MAVLink_mission_count_message(
        session.system_id, AUTOPILOT_COMPONENT_ID, len(items), FENCE
    )

    def step(message: Message) -> int | None:
        """Answer a request for an item; the result once the vehicle acknowledges."""
        if getattr(message, "mission_type", None) != FENCE:
            return None
        if message.get_type() in _REQUESTS and message.seq < len(items):
            session.send(_message(session.system_id, message.seq, items[message.seq]))
        return int(message.type) if message.get_type() == "MISSION_ACK" else None

    def first(message: Message) -> bool | None:
        answered = message.get_type() in (*_REQUESTS, "MISSION_ACK")
        if not answered or getattr(message, "mission_type", None) != FENCE:
            return None
        results.append(step(message))
        return True

    results: list[int | None] = []
    if session.request(count, first) is None:
        raise DroneError("the vehicle does not answer the upload of a fence; check that it takes fences")
    result = results[-1]
    if result is None:
        result = session.wait(step, _UPLOAD_S)
    if result is None:
        raise DroneError(f"the upload of the fence did not end within {_UPLOAD_S:g} s; check the link")
    if result != mavlink.MAV_MISSION_ACCEPTED:
        entry = mavlink.enums["MAV_MISSION_RESULT"].get(result)
        words = f"result {result}" if entry is None else entry.name.removeprefix("MAV_MISSION_").lower()
        raise DroneError(f"the vehicle refuses the fence: {words.replace('_', ' ')}")


def download_fence(session: VehicleSession) -> tuple[FenceItem, ...]:
    """The fence that the vehicle has; empty if it has none.

    Raises:
        DroneError: the vehicle does not answer.
    """
    system_id = session.system_id
    count = session.request(
        mavlink.MAVLink_mission_request_list_message(system_id, AUTOPILOT_COMPONENT_ID, FENCE),
        lambda each: each.count if _is(each, "MISSION_COUNT") else None,
    )
    if count is None or count > MAX_ITEMS:
        raise DroneError("the vehicle does not tell its fence; check that it takes fences")
    items = []
    for seq in range(count):
        request = mavlink.MAVLink_mission_request_int_message(system_id, AUTOPILOT_COMPONENT_ID, seq, FENCE)
        item = session.request(request, partial(_numbered, seq))
        if item is None:
            raise DroneError(f"the vehicle does not tell item {seq + 1} of its fence; check the link")
        params = (item.param1, item.param2, item.param3, item.param4)
        items.append(FenceItem(item.command, item.frame, params, item.x, item.y, item.z))
    done = mavlink.MAV_MISSION_ACCEPTED
    session.send(mavlink.MAVLink_mission_ack_message(system_id, AUTOPILOT_COMPONENT_ID, done, FENCE))
    return tuple(items)


def is_same_fence(one: Sequence[FenceItem], other: Sequence[FenceItem]) -> bool:
    """Whether two fences have the same corners and circles; vehicles may change frame and unused fields."""
    return [(each.command, each.params[0], each.x, each.y) for each in one] == [
        (each.command, each.params[0], each.x, each.y) for each in other
    ]


def _message(system_id: int, seq: int, item: FenceItem) -> Message:
    param1, param2, param3, param4 = item.params
    return mavlink.MAVLink_mission_item_int_message(
        system_id,
        AUTOPILOT_COMPONENT_ID,
        seq,
        item.frame,
        item.command,
        current=0,
        autocontinue=1,
        param1=param1,
        param2=param2,
        param3=param3,
        param4=param4,
        x=item.x,
        y=item.y,
        z=item.z,
        mission_type=FENCE,
    )


def _is(message: Message, kind: str) -> bool:
    return bool(message.get_type() == kind and message.mission_type == FENCE)


def _numbered(seq: int, message: Message) -> Message | None:
    return message if _is(message, "MISSION_ITEM_INT") and message.seq == seq else None
