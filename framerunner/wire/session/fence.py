"""Uploads a fence to a vehicle and downloads the one it has, by the mission protocol.

https://mavlink.io/en/services/mission.html; a fence is a plan of the type MAV_MISSION_TYPE_FENCE.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

from framerunner.wire.dialect import AUTOPILOT_COMPONENT_ID, Message, mavlink
from framerunner.wire.session.client import VehicleClient
from framerunner.wire.session.session import VehicleError, Wait

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


def upload_fence(client: VehicleClient, items: Sequence[FenceItem]) -> None:
    """Replace the vehicle's fence; without items it has none afterwards.

    Raises:
        VehicleError: the vehicle refuses it or does not answer.
    """
    session, is_heard = client.session, False

    def answer(message: Message) -> int | Wait | None:
        """Answer a request for an item; the result once the vehicle acknowledges."""
        nonlocal is_heard
        kind = message.get_type()
        if kind not in (*_REQUESTS, "MISSION_ACK") or message.mission_type != FENCE:
            return None
        is_heard = True
        if kind == "MISSION_ACK":
            return int(message.type)
        if message.seq < len(items):
            session.send(_message(session.vehicle, message.seq, items[message.seq]))
        return Wait(_UPLOAD_S, is_last=True)

    count = mavlink.MAVLink_mission_count_message(session.vehicle, AUTOPILOT_COMPONENT_ID, len(items), FENCE)
    result = client.answer(session.request(count, answer))
    if result is None and not is_heard:
        raise VehicleError("the vehicle does not answer the upload of a fence; check that it takes fences")
    if result is None:
        raise VehicleError(f"the upload of the fence did not end within {_UPLOAD_S:g} s; check the link")
    if result != mavlink.MAV_MISSION_ACCEPTED:
        entry = mavlink.enums["MAV_MISSION_RESULT"].get(result)
        words = f"result {result}" if entry is None else entry.name.removeprefix("MAV_MISSION_").lower()
        raise VehicleError(f"the vehicle refuses the fence: {words.replace('_', ' ')}")


def download_fence(client: VehicleClient) -> tuple[FenceItem, ...]:
    """The fence that the vehicle has; empty if it has none.

    Raises:
        VehicleError: the vehicle does not answer.
    """
    session, system_id = client.session, client.session.vehicle

    def count_of(message: Message) -> int | None:
        is_count = message.get_type() == "MISSION_COUNT" and message.mission_type == FENCE
        return int(message.count) if is_count else None

    request = mavlink.MAVLink_mission_request_list_message(system_id, AUTOPILOT_COMPONENT_ID, FENCE)
    count = client.answer(session.request(request, count_of))
    if count is None or count > MAX_ITEMS:
        raise VehicleError("the vehicle does not tell its fence; check that it takes fences")
    items = []
    for seq in range(count):
        request = mavlink.MAVLink_mission_request_int_message(system_id, AUTOPILOT_COMPONENT_ID, seq, FENCE)
        item = client.answer(session.request(request, partial(_numbered, seq)))
        if item is None:
            raise VehicleError(f"the vehicle does not tell item {seq + 1} of its fence; check the link")
        params = (item.param1, item.param2, item.param3, item.param4)
        items.append(FenceItem(item.command, item.frame, params, item.x, item.y, item.z))
    session.send(
        mavlink.MAVLink_mission_ack_message(
            system_id, AUTOPILOT_COMPONENT_ID, mavlink.MAV_MISSION_ACCEPTED, FENCE
        )
    )
    client.turn()
    return tuple(items)


def is_same_fence(one: Sequence[FenceItem], other: Sequence[FenceItem]) -> bool:
    """Whether two fences have the same corners and circles; vehicles may change frame and unused fields."""
    return [(each.command, each.params[0], each.x, each.y) for each in one] == [
        (each.command, each.params[0], each.x, each.y) for each in other
    ]


def _message(system_id: int, seq: int, item: FenceItem) -> Message:
    return mavlink.MAVLink_mission_item_int_message(
        system_id,
        AUTOPILOT_COMPONENT_ID,
        seq,
        item.frame,
        item.command,
        0,
        1,
        *item.params,
        item.x,
        item.y,
        item.z,
        FENCE,
    )


def _numbered(seq: int, message: Message) -> Message | None:
    is_item = message.get_type() == "MISSION_ITEM_INT" and message.mission_type == FENCE
    return message if is_item and message.seq == seq else None
