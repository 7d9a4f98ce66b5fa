"""QR codes, for a terminal and for pages."""

from __future__ import annotations

import io

import segno

_QUIET_ZONE = 4  # modules of white around a code that the standard (ISO/IEC 18004) asks for
# Not in the colours of the terminal: not every phone reads an inverted code.
_WHITE_ON_BLACK = "\x1b[97;40m"
_PLAIN = "\x1b[0m"


def terminal_code(text: str) -> str:
    """A QR code as lines of half blocks, for a terminal that knows UTF-8 and colours."""
    lines = io.StringIO()
    segno.make_qr(text, error="l").terminal(lines, border=2, compact=True)
    return "\n".join(f"{_WHITE_ON_BLACK}{line}{_PLAIN}" for line in lines.getvalue().splitlines() if line)


def svg_code(text: str) -> str:
    """A QR code as an SVG image, black on white, that fills what it stands in."""
    code = segno.make_qr(text, error="m")
    return str(code.svg_inline(border=_QUIET_ZONE, dark="#000", light="#fff", omitsize=True))
