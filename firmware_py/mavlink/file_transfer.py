"""MAVLink FTP of a vehicle without files: a clear no, so that clients go on at once instead of timing out.

MAVProxy tries FTP before the parameter protocol, whatever the capabilities say. PX4 has files; here none yet.
"""

from __future__ import annotations

from firmware_py.mavlink.dialect import Message, mavlink
from firmware_py.mavlink.exchange import Exchange, Handler
from firmware_py.mavlink.links import Link

_PAYLOAD_BYTES = 251
_NAK = 129
_ACK = 128
_UNKNOWN_COMMAND = 7


def _refuse(exchange: Exchange, link: Link, message: Message) -> None:
    if not exchange.is_for_us(message):
        return
    request = message.payload
    opcode = request[3]
    if opcode in (_ACK, _NAK):
        return  # an answer, not a request
    sequence = (request[0] | request[1] << 8) + 1
    # sequence (2), session, opcode, size, opcode asked for, burst complete, padding, offset (4), data
    answer = [
        sequence & 0xFF,
        sequence >> 8 & 0xFF,
        request[2],
        _NAK,
        1,
        opcode,
        0,
        0,
        0,
        0,
        0,
        0,
        _UNKNOWN_COMMAND,
    ]
    answer += [0] * (_PAYLOAD_BYTES - len(answer))
    exchange.send(
        link,
        mavlink.MAVLink_file_transfer_protocol_message(
            message.target_network, message.get_srcSystem(), message.get_srcComponent(), answer
        ),
    )


HANDLERS: dict[int, Handler] = {mavlink.MAVLINK_MSG_ID_FILE_TRANSFER_PROTOCOL: _refuse}
