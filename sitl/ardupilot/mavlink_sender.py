"""Which sender of MAVLink datagrams is the connected ArduPilot."""

from __future__ import annotations

from collections.abc import Callable

from framerunner.wire.dialect import mavlink
from framerunner.wire.framing import PacketReader
from sitl.autopilots.sole_sender import Sign, SoleSender


def mavlink_sender(port: int, system_id: int, notice: Callable[[str], None]) -> SoleSender[bytes]:
    """Selects ArduPilot's datagrams; others cannot take its place by being the first.

    Its first port is its console until its MAVLink begins: it prints text there.

    Args:
        port: UDP port that they are sent to.
        system_id: of its MAVLink.
        notice: called with lines for people.
    """

    def is_of_vehicle(data: bytes) -> bool:
        return any(
            message.get_type() == "HEARTBEAT"
            and message.get_srcSystem() == system_id
            and message.autopilot == mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA
            for message in PacketReader().feed(data)
        )

    sender = SoleSender[bytes]("ArduPilot", port, notice)
    sender.sign = Sign(is_of_vehicle, f"MAVLink of ArduPilot with --sysid {system_id}", bytes.isascii)
    return sender
