"""STATUSTEXT: one text from its pieces, made safe to show."""

from __future__ import annotations

from dataclasses import dataclass

from wire.dialect import Message

_PIECE_BYTES = 50
_MAX_PIECES = 10
_MAX_CHARS = 500
_OPEN_S = 2.0  # a text waits for its next piece this long
_MAX_OPEN = 4


@dataclass(frozen=True, slots=True)
class Text:
    """A text from a vehicle to people.

    Attributes:
        component: which of its components.
        severity: MAV_SEVERITY, 0 (emergency) to 7 (debug).
        text: without control characters.
    """

    component: int
    severity: int
    text: str


@dataclass(slots=True)
class _Open:
    severity: int
    pieces: dict[int, bytes]
    since_s: float


class TextAssembler:
    """Joins long texts, which come in pieces of 50 bytes under one id."""

    def __init__(self) -> None:
        self._open: dict[tuple[int, int], _Open] = {}

    def take(self, message: Message, component: int, now_s: float) -> list[Text]:
        """Take a STATUSTEXT; the texts that are whole now."""
        raw = bytes(message._text_raw)
        if message.id == 0:
            return _text(component, message.severity, raw)
        key = (component, message.id)
        done = self._make_room(key, now_s)
        parts = self._open.setdefault(key, _Open(message.severity, {}, now_s))
        if message.chunk_seq < _MAX_PIECES:
            parts.pieces[message.chunk_seq] = raw
        if len(raw.split(b"\0", 1)[0]) < _PIECE_BYTES or message.chunk_seq >= _MAX_PIECES - 1:
            done += self._close(key)
        return done

    def expire(self, now_s: float) -> list[Text]:
        """Texts whose last pieces are not coming any more."""
        late = [key for key, parts in self._open.items() if now_s - parts.since_s > _OPEN_S]
        return [text for key in late for text in self._close(key)]

    def _make_room(self, key: tuple[int, int], now_s: float) -> list[Text]:
        done = self.expire(now_s)
        if key not in self._open and len(self._open) >= _MAX_OPEN:
            done += self._close(next(iter(self._open)))
        return done

    def _close(self, key: tuple[int, int]) -> list[Text]:
        parts = self._open.pop(key)
        last = max(parts.pieces, default=-1)
        joined = b"".join(parts.pieces.get(place, "…".encode()) for place in range(last + 1))
        return _text(key[0], parts.severity, joined)


def plain(raw: bytes | str, longest: int = _MAX_CHARS) -> str:
    """A text to be shown: no control characters, not too long.

    Args:
        raw: UTF-8 or what claims to be; ends at a zero byte.
        longest: characters.
    """
    text = raw if isinstance(raw, str) else raw.split(b"\0", 1)[0].decode("utf-8", "replace")
    return "".join(sign if sign.isprintable() else " " for sign in text)[:longest].strip()


def _text(component: int, severity: int, raw: bytes) -> list[Text]:
    text = plain(raw)
    return [Text(component, min(severity, 7), text)] if text else []
