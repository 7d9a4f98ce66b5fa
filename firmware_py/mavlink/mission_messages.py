"""Mission messages with the plan's opaque id, an extension that pymavlink's dialects do not know yet.

Receivers that do not know it either read the rest as ever.
"""

from __future__ import annotations

from struct import Struct

from wire.dialect import Message, mavlink


class MissionCount(mavlink.MAVLink_message):  # type: ignore[misc]  # pymavlink has no types
    """MISSION_COUNT (44)."""

    id = mavlink.MAVLINK_MSG_ID_MISSION_COUNT
    msgname = "MISSION_COUNT"
    crc_extra = mavlink.MAVLink_mission_count_message.crc_extra
    unpacker = Struct("<HBBBI")

    def __init__(self, target: tuple[int, int], count: int, mission_type: int, opaque_id: int) -> None:
        """Args: target system and component, number of items, MAV_MISSION_TYPE, id of the plan or 0."""
        mavlink.MAVLink_message.__init__(self, self.id, self.msgname)
        self.fields = (count, *target, mission_type, opaque_id)

    def pack(self, mav: Message, force_mavlink1: bool = False) -> bytes:
        """The packet."""
        payload = self.unpacker.pack(*self.fields)
        return bytes(self._pack(mav, self.crc_extra, payload, force_mavlink1=force_mavlink1))


class MissionAck(mavlink.MAVLink_message):  # type: ignore[misc]  # pymavlink has no types
    """MISSION_ACK (47)."""

    id = mavlink.MAVLINK_MSG_ID_MISSION_ACK
    msgname = "MISSION_ACK"
    crc_extra = mavlink.MAVLink_mission_ack_message.crc_extra
    unpacker = Struct("<BBBBI")

    def __init__(self, target: tuple[int, int], result: int, mission_type: int, opaque_id: int = 0) -> None:
        """Args: target system and component, MAV_MISSION_RESULT, MAV_MISSION_TYPE, id of the new plan."""
        mavlink.MAVLink_message.__init__(self, self.id, self.msgname)
        self.fields = (*target, result, mission_type, opaque_id)

    def pack(self, mav: Message, force_mavlink1: bool = False) -> bytes:
        """The packet."""
        payload = self.unpacker.pack(*self.fields)
        return bytes(self._pack(mav, self.crc_extra, payload, force_mavlink1=force_mavlink1))


class MissionCurrent(mavlink.MAVLink_message):  # type: ignore[misc]  # pymavlink has no types
    """MISSION_CURRENT (42)."""

    id = mavlink.MAVLINK_MSG_ID_MISSION_CURRENT
    msgname = "MISSION_CURRENT"
    crc_extra = mavlink.MAVLink_mission_current_message.crc_extra
    unpacker = Struct("<HHBBIII")

    def __init__(self, seq: int, total: int, state: int, mode: int, opaque_ids: tuple[int, int, int]) -> None:
        """Args: item, number of items, MISSION_STATE, 1 active or 2 not, ids of mission, fence and rally."""
        mavlink.MAVLink_message.__init__(self, self.id, self.msgname)
        self.fields = (seq, total, state, mode, *opaque_ids)

    def pack(self, mav: Message, force_mavlink1: bool = False) -> bytes:
        """The packet."""
        payload = self.unpacker.pack(*self.fields)
        return bytes(self._pack(mav, self.crc_extra, payload, force_mavlink1=force_mavlink1))
