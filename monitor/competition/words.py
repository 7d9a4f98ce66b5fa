"""Texts that people type or drones send: what is let in, and how it is refused."""

from __future__ import annotations

import unicodedata

from errors import UserError

_CONTROL = frozenset({"Cc", "Cs", "Zl", "Zp"})
_TURNING = frozenset("\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069")  # turn the text around them


class Refused(UserError):  # noqa: N818 - it says what happened
    """What was asked for is not done; the message is one line with field, value and mend.

    Attributes:
        status: of HTTP: 422 for bad input, 404 for what is not there, 409 when somebody was quicker.
    """

    def __init__(self, message: str, status: int = 422) -> None:
        super().__init__(message)
        self.status = status


def team_name(value: str) -> str:
    """Check a team's name, and write its spaces plainly.

    Raises:
        Refused: it is empty, too long or holds control characters.
    """
    if any(_is_control(character) for character in value):
        raise Refused(f"name {shown(value)} holds control characters; leave them out")
    name = " ".join(value.split())
    if not any(unicodedata.category(character)[0] in "LNPS" for character in name):
        raise Refused(f"name {shown(name)} shows nothing; give 1 to 60 characters")
    if len(name) > 60:
        raise Refused(f"name {shown(name)} has {len(name)} characters; use 60 or fewer")
    return name


def name_key(name: str) -> str:
    """A name as it is compared: without case, width of letters and what cannot be seen; spaces as one."""
    folded = unicodedata.normalize("NFKC", unicodedata.normalize("NFKC", name).casefold())
    seen = "".join(character for character in folded if unicodedata.category(character) != "Cf")
    return " ".join(seen.split())[:300]


def free_text(value: str, field: str, longest: int) -> str:
    """Check a text of several lines.

    Raises:
        Refused: it is too long or holds control characters other than ends of lines and tabs.
    """
    text = value.replace("\r\n", "\n").replace("\r", "\n").strip()
    if len(text) > longest:
        raise Refused(f"{field} {shown(text)} has {len(text)} characters; use {longest} or fewer")
    if any(_is_control(character) for character in text if character not in "\n\t"):
        raise Refused(f"{field} {shown(text)} holds control characters; leave them out")
    return text


def from_wire(value: object, longest: int) -> str:
    """A text that a drone or a referee sent, fit to be kept: cut, and without control characters."""
    text = value if isinstance(value, str) else ""
    return "".join(character for character in text[:longest] if not _is_control(character))


def shown(value: object) -> str:
    """A value within a sentence: short, and on one line."""
    text = value if isinstance(value, str) else str(value)
    kept = "".join("\ufffd" if _is_control(character) else character for character in text[:41])
    return f'"{kept[:40]}…"' if len(text) > 40 else f'"{kept}"'


def _is_control(character: str) -> bool:
    return unicodedata.category(character) in _CONTROL or character in _TURNING
