"""What one link has carried, and how LINK_NODE_STATUS tells it."""

from __future__ import annotations

from wire.dialect import Message, mavlink

_WINDOW_US = 1_000_000
_MAX_SENDERS = 64  # whose gaps are counted; a noisy network must not fill the memory
_LATE = 128  # a number that far ahead is an old packet that came late


class Traffic:
    """Counts of one link, both ways.

    Attributes:
        messages_sent: packets, forwarded ones too.
        bytes_sent: of these packets.
        messages_heard: sound packets that came in.
        bytes_heard: of these packets.
        messages_lost: gaps in the senders' sequence numbers.
    """

    __slots__ = (
        "_next",
        "_rates_bytes_s",
        "_window",
        "bytes_heard",
        "bytes_sent",
        "messages_heard",
        "messages_lost",
        "messages_sent",
    )

    def __init__(self) -> None:
        self.messages_sent = 0
        self.bytes_sent = 0
        self.messages_heard = 0
        self.bytes_heard = 0
        self.messages_lost = 0
        self._next: dict[tuple[int, int], int] = {}
        self._window = (0, 0, 0)  # time, bytes sent and heard where it began
        self._rates_bytes_s = (0, 0)

    def hear(self, sender: tuple[int, int], sequence: int, size: int) -> None:
        """Count a sound packet.

        Args:
            sender: system and component id.
            sequence: the packet's number, 0 to 255.
            size: in bytes.
        """
        self.messages_heard += 1
        self.bytes_heard += size
        expected = self._next.get(sender)
        if expected is None:
            if len(self._next) >= _MAX_SENDERS:
                return
        else:
            gap = (sequence - expected) % 256
            if gap >= _LATE:
                return
            self.messages_lost += gap
        self._next[sender] = (sequence + 1) % 256

    def rates_bytes_s(self, time_us: int) -> tuple[int, int]:
        """Bytes sent and heard a second, over the last second or more."""
        since_us, sent, heard = self._window
        span_us = time_us - since_us
        if span_us >= _WINDOW_US:
            self._rates_bytes_s = (
                (self.bytes_sent - sent) * 1_000_000 // span_us,
                (self.bytes_heard - heard) * 1_000_000 // span_us,
            )
            self._window = (time_us, self.bytes_sent, self.bytes_heard)
        return self._rates_bytes_s


def link_node_status(traffic: Traffic, noise_bytes: int, overflows: int, time_us: int) -> Message:
    """LINK_NODE_STATUS.

    Args:
        traffic: of the link.
        noise_bytes: that came in and were no part of a packet; told as parse errors.
        overflows: how often bytes that came in were dropped because too many waited.
        time_us: vehicle time.
    """
    sent_bytes_s, heard_bytes_s = traffic.rates_bytes_s(time_us)
    return mavlink.MAVLink_link_node_status_message(
        time_us,
        0,
        0,
        min(sent_bytes_s, 0xFFFFFFFF),
        min(heard_bytes_s, 0xFFFFFFFF),
        min(noise_bytes, 0xFFFF),
        0,
        min(overflows, 0xFFFF),
        traffic.messages_sent & 0xFFFFFFFF,
        traffic.messages_heard & 0xFFFFFFFF,
        traffic.messages_lost & 0xFFFFFFFF,
    )
