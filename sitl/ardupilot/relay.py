"""MAVLink between ArduPilot and the app that flies it, so that the same seed is the same flight again.

ArduPilot reads one datagram of its MAVLink port in each run of its loop, so one that comes by wall time, such
as a heartbeat, delays the setpoint behind it. So what the app sends waits here until simulated time has stood
still and goes on, and is then one datagram, or few if it is much.

ArduPilot's loop stands still with simulated time, and it returns no PINGs. The relay returns them: by then it
has all that the app has sent before, and the app has all that ArduPilot has sent before.
"""

from __future__ import annotations

from collections import deque

from framerunner.wire.dialect import Message, companion_heartbeat, mavlink
from framerunner.wire.framing import HEADER_BYTES_V2, MARKERS, PacketReader, message_id_of, packed
from framerunner.wire.transports.sockets import Address, UdpSocket, connect_udp
from sitl.ardupilot.sole_sender import SoleSender

HEARTBEAT_S = 1.0
RELAY_PORT = 9007
"""UDP port of instance 0, between those of the JSON interface."""
_ROOM_BYTES = 400  # of a datagram; ArduPilot's buffer is 512, and what exceeds it is lost
_DATAGRAMS_AT_ONCE = 8  # ArduPilot's loop runs twelve times from one tick of the app to the next
_COMPONENT_ID = int(mavlink.MAV_COMP_ID_UDP_BRIDGE)
_PING = int(mavlink.MAVLINK_MSG_ID_PING)
_FIRST = (
    int(mavlink.MAVLINK_MSG_ID_COMMAND_LONG),
    int(mavlink.MAVLINK_MSG_ID_SET_POSITION_TARGET_LOCAL_NED),
)
"""Sent before anything else, because they fly the drone."""


class AppRelay:
    """Passes datagrams on between ArduPilot and the app.

    Args:
        listening: where ArduPilot sends to.
        app: where the app listens.
        sender: selects ArduPilot's datagrams.
        system_id: of the vehicle.
    """

    def __init__(self, listening: UdpSocket, app: Address, sender: SoleSender[bytes], system_id: int) -> None:
        self.ardupilot, self.app = listening, connect_udp(app)
        self._sender = sender
        self._codec = mavlink.MAVLink(None, srcSystem=system_id, srcComponent=_COMPONENT_ID)
        self._reader = PacketReader()
        self._first: deque[bytes] = deque()
        self._others: deque[bytes] = deque()

    def from_ardupilot(self) -> None:
        """Pass on to the app what has arrived."""
        for data in self._sender.select(self.ardupilot.read_all()):
            self.app.write(data)

    def from_app(self) -> None:
        """Keep what has arrived until `flush`; return PINGs."""
        for data, _ in self.app.read_all():
            number = _message_id(data)
            if number == _PING:
                self._return(data)
            else:
                (self._first if number in _FIRST else self._others).append(data)

    def send_heartbeat(self) -> None:
        """Send the app a heartbeat of the relay's, which is due each `HEARTBEAT_S` of wall time.

        The app's MAVLink library sends nothing to an address from which nothing has come for some seconds, as
        while simulated time stands still. Call it only when the library knows ArduPilot: until then it sends
        commands as PX4 takes them, with NaN, at which ArduPilot's simulation ends with a floating point
        exception.
        """
        self._tell(companion_heartbeat())

    def flush(self) -> None:
        """Send to ArduPilot what the app has sent, in few datagrams; it must have sent something before."""
        address = self._sender.address
        if address is None:
            return
        for _ in range(_DATAGRAMS_AT_ONCE):
            if not (datagram := self._next_datagram()):
                return
            self.ardupilot.write(datagram, address)

    def close(self) -> None:
        """Close the sockets."""
        self.ardupilot.close()
        self.app.close()

    def _next_datagram(self) -> bytes:
        datagram = bytearray()
        while queue := self._first or self._others:
            if datagram and len(datagram) + len(queue[0]) > _ROOM_BYTES:
                break
            datagram += queue.popleft()
        return bytes(datagram)

    def _return(self, data: bytes) -> None:
        self.from_ardupilot()  # what it has sent before
        for message in self._reader.feed(data):
            if message.get_type() == "PING" and message.target_system == 0:
                self._tell(
                    mavlink.MAVLink_ping_message(
                        message.time_usec,
                        message.seq,
                        target_system=message.get_srcSystem(),
                        target_component=message.get_srcComponent(),
                    )
                )

    def _tell(self, message: Message) -> None:
        """Send a message of the relay to the app."""
        self.app.write(packed(message, self._codec))


def _message_id(packet: bytes) -> int | None:
    """Of a packet's header; None: it is none."""
    is_header = len(packet) >= HEADER_BYTES_V2 and packet[0] in MARKERS
    return message_id_of(packet) if is_header else None
