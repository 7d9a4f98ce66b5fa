"""STATUSTEXT: a text cut into pieces, and joined from them, without control characters."""

from __future__ import annotations

from dataclasses import dataclass

from framerunner.wire.dialect import Message, mavlink

PIECE_BYTES = 50
_MAX_PIECES = 10
_MAX_CHARS = 500
_TIMEOUT_S = 2.0  # of an incomplete text
_MAX_INCOMPLETE = 4


@dataclass(frozen=True, slots=True)
class Text:
    """A status text."""

    component: int  # id of its sender
    severity: int  # MAV_SEVERITY, 0 (emergency) to 7 (debug)
    text: str  # without control characters


@dataclass(slots=True)
class _IncompleteText:
    severity: int
    pieces: dict[int, bytes]
    since_s: float


class TextAssembler:
    """Joins long texts, which are sent in pieces of 50 bytes with one id."""

    def __init__(self) -> None:
        self._incomplete: dict[tuple[int, int], _IncompleteText] = {}

    def take(self, message: Message, component: int, now_s: float) -> list[Text]:
        """Take a STATUSTEXT; return the texts that are complete or given up."""
        raw = bytes(message._text_raw)
        if message.id == 0:
            return _text(component, message.severity, raw)
        key = (component, message.id)
        done = self.expire(now_s)
        if key not in self._incomplete and len(self._incomplete) >= _MAX_INCOMPLETE:
            done += self._joined(next(iter(self._incomplete)))
        parts = self._incomplete.setdefault(key, _IncompleteText(message.severity, {}, now_s))
        if message.chunk_seq < _MAX_PIECES:
            parts.pieces[message.chunk_seq] = raw
        if len(raw.split(b"\0", 1)[0]) < PIECE_BYTES or message.chunk_seq >= _MAX_PIECES - 1:
            done += self._joined(key)
        return done

    def expire(self, now_s: float) -> list[Text]:
        """Texts whose missing pieces are overdue, without these."""
        late = [key for key, parts in self._incomplete.items() if now_s - parts.since_s > _TIMEOUT_S]
        return [text for key in late for text in self._joined(key)]

    def _joined(self, key: tuple[int, int]) -> list[Text]:
        parts = self._incomplete.pop(key)
        last = max(parts.pieces, default=-1)
        joined = b"".join(parts.pieces.get(number, "…".encode()) for number in range(last + 1))
        return _text(key[0], parts.severity, joined)


def plain(raw: bytes | str, max_chars: int = _MAX_CHARS) -> str:
    """A text without control characters, shortened; bytes are read as UTF-8 up to a zero byte."""
    text = raw if isinstance(raw, str) else raw.split(b"\0", 1)[0].decode("utf-8", "replace")
    return "".join(sign if sign.isprintable() else " " for sign in text)[:max_chars].strip()


def statustexts(severity: int, data: bytes, number: int) -> list[Message]:
    """A text as one STATUSTEXT or, if it is too long, as several, with a number above zero."""
    if len(data) <= PIECE_BYTES:
        return [mavlink.MAVLink_statustext_message(severity, data, 0, 0)]
    # A text that fills its last piece needs an empty one after it, or the receiver waits for more.
    return [
        mavlink.MAVLink_statustext_message(severity, data[start : start + PIECE_BYTES], number, place)
        for place, start in enumerate(range(0, len(data) + 1, PIECE_BYTES))
    ]


def _text(component: int, severity: int, raw: bytes) -> list[Text]:
    text = plain(raw)
    return [Text(component, min(severity, 7), text)] if text else []
