"""Uploads a fence to a vehicle and reads it back, by the mission protocol.

https://mavlink.io/en/services/mission.html; a fence is a plan of the type MAV_MISSION_TYPE_FENCE.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from framerunner.preflight.session import VehicleSession
from offboard.drone import DroneError
from wire.dialect import AUTOPILOT_COMPONENT_ID, Message, mavlink

FENCE = mavlink.MAV_MISSION_TYPE_FENCE
_INCLUSION = mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION
_UPLOAD_S = 5.0
_REQUESTS = ("MISSION_REQUEST_INT", "MISSION_REQUEST")
_MAX_ITEMS = 1000

Vertex = tuple[int, int]
"""Latitude and longitude, 1e-7 degrees."""


def upload_fence(session: VehicleSession, vertices: Sequence[Vertex]) -> None:
    """Replace the vehicle's fence by one polygon that it must stay in.

    Raises:
        DroneError: the vehicle refuses it or does not answer.
    """
    count = mavlink.MAVLink_mission_count_message(
        session.system_id, AUTOPILOT_COMPONENT_ID, len(vertices), FENCE
    )

    def step(message: Message) -> int | None:
        """Answer a request for an item; the result once the vehicle acknowledges."""
        if getattr(message, "mission_type", None) != FENCE:
            return None
        if message.get_type() in _REQUESTS and message.seq < len(vertices):
            session.send(_item(session.system_id, message.seq, vertices))
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


def read_fence(session: VehicleSession) -> tuple[Vertex, ...] | None:
    """The vehicle's fence, if it is one polygon to stay in or empty; None if it is another one.

    Raises:
        DroneError: the vehicle does not answer.
    """
    target = (session.system_id, AUTOPILOT_COMPONENT_ID)
    count = session.request(
        mavlink.MAVLink_mission_request_list_message(*target, FENCE),
        lambda each: each.count if _is(each, "MISSION_COUNT") else None,
    )
    if count is None or count > _MAX_ITEMS:
        raise DroneError("the vehicle does not tell its fence; check that it takes fences")
    vertices: list[Vertex] | None = []
    for seq in range(count):
        request = mavlink.MAVLink_mission_request_int_message(*target, seq, FENCE)
        item = session.request(request, partial(_numbered, seq))
        if item is None:
            raise DroneError(f"the vehicle does not tell item {seq + 1} of its fence; check the link")
        if item.command != _INCLUSION or round(item.param1) != count:
            vertices = None
        elif vertices is not None:
            vertices.append((item.x, item.y))
    session.send(mavlink.MAVLink_mission_ack_message(*target, mavlink.MAV_MISSION_ACCEPTED, FENCE))
    return None if vertices is None else tuple(vertices)


def _item(system_id: int, seq: int, vertices: Sequence[Vertex]) -> Message:
    x, y = vertices[seq]
    where = (system_id, AUTOPILOT_COMPONENT_ID, seq, mavlink.MAV_FRAME_GLOBAL, _INCLUSION, 0, 1)
    return mavlink.MAVLink_mission_item_int_message(*where, len(vertices), 0.0, 0.0, 0.0, x, y, 0.0, FENCE)


def _is(message: Message, kind: str) -> bool:
    return bool(message.get_type() == kind and message.mission_type == FENCE)


def _numbered(seq: int, message: Message) -> Message | None:
    return message if _is(message, "MISSION_ITEM_INT") and message.seq == seq else None
