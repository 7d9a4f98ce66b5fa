"""Faults written in one line, as on the command line: `gps off at 12 s for 5 s`."""

from __future__ import annotations

import re

from pydantic import ValidationError

from framerunner.errors import UserError
from scenarios.faults.declaration import SIZES, Fault, FaultKind, FaultPart

_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_FORM = re.compile(
    r"(?P<part>[a-z][a-z _-]*?)"
    r"(?:\s+(?P<number>\d+))?"
    rf"\s+(?P<kind>{'|'.join(FaultKind)})"
    rf"(?:\s+(?P<size>{_NUMBER})\s*(?P<unit>%|[A-Za-z][A-Za-z/0-9²]*)?)?"
    rf"\s+at\s+(?P<at>{_NUMBER})\s*s?"
    rf"(?:\s+for\s+(?P<lasts>{_NUMBER})\s*s?)?"
)
GRAMMAR = "PART [NUMBER] KIND [SIZE] at SECONDS [for SECONDS], such as `gps off at 12 s for 5 s`"


class FaultError(UserError):
    """A fault that cannot be understood or cannot happen; the message is one line for people."""


def parse_fault(text: str) -> Fault:
    """Read a fault in one line: `str` of a fault is such a line.

    Raises:
        FaultError: the text has another form, or no such fault can be.
    """
    found = _FORM.fullmatch(" ".join(text.split()))
    if found is None:
        raise FaultError(f"fault {text!r}: write {GRAMMAR}")
    name = re.sub(r"[ -]", "_", found["part"])
    try:
        part, kind = FaultPart(name), FaultKind(found["kind"])
    except ValueError:
        raise FaultError(
            f"fault {text!r}: no part {found['part']!r}; use one of {', '.join(FaultPart)}"
        ) from None
    size = None if found["size"] is None else float(found["size"])
    meant = SIZES[part].get(kind)
    unit = (found["unit"] or "").replace("²", "2")
    if unit and meant is not None and unit != meant.unit:
        if unit != "%" or meant.unit:
            raise FaultError(f"fault {text!r}: the size of {part} {kind} is in {meant.unit or 'shares of 1'}")
        assert size is not None
        size = size / 100.0
    try:
        return Fault(
            part=part,
            kind=kind,
            size=size,
            number=None if found["number"] is None else int(found["number"]),
            at_s=float(found["at"]),
            for_s=None if found["lasts"] is None else float(found["lasts"]),
        )
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        at = ".".join(map(str, first["loc"]))
        raise FaultError(f"fault {text!r}: {f'{at}: ' if at else ''}{first['msg']}") from None
