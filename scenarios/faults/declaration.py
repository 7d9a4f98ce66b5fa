"""Faults that a flight can have: which part fails, in what way, by how much and when.

They can be written in one line, as on the command line: `gps off at 12 s for 5 s`.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated, Self

from pydantic import BeforeValidator, Field, ValidationError, model_validator

from framerunner.errors import UserError
from framerunner.files.yaml_file import refusal
from scenarios.part import Part


class FaultPart(StrEnum):
    """What can fail."""

    GYROSCOPE = "gyroscope"
    ACCELEROMETER = "accelerometer"
    MAGNETOMETER = "magnetometer"
    BAROMETER = "barometer"
    GPS = "gps"
    RANGE_FINDER = "range_finder"
    OPTICAL_FLOW = "optical_flow"
    EXTERNAL_POSE = "external_pose"
    BATTERY_MONITOR = "battery_monitor"
    BATTERY = "battery"
    MOTOR = "motor"
    CAMERA = "camera"
    LINK = "link"
    RC = "rc"


class FaultKind(StrEnum):
    """How it fails."""

    OFF = "off"
    STUCK = "stuck"
    WRONG = "wrong"
    SCALED = "scaled"
    NOISY = "noisy"
    DELAYED = "delayed"
    LOSSY = "lossy"
    BLACK = "black"
    WEAK = "weak"
    SAG = "sag"


@dataclass(frozen=True, slots=True)
class FaultSize:
    """What the size of a fault means.

    Attributes:
        default: where none is given.
        low: smallest.
        high: largest.
        unit: of the size; empty: a share, or a factor.
        meaning: in words.
    """

    default: float
    low: float
    high: float
    unit: str
    meaning: str


_SHARE_LOST = FaultSize(0.5, 0.01, 1.0, "", "share of the samples that is lost at random")


def _late(default_s: float) -> FaultSize:
    return FaultSize(default_s, 0.004, 5.0, "s", "by how much later each sample arrives")


def _sensor(
    unit: str, *, wrong: float, noisy: float, high: float, delay_s: float, scaled: bool = True
) -> dict[FaultKind, FaultSize | None]:
    """The kinds of faults of a sensor; sizes in its unit."""
    kinds: dict[FaultKind, FaultSize | None] = {
        FaultKind.OFF: None,
        FaultKind.STUCK: None,
        FaultKind.WRONG: FaultSize(wrong, -high, high, unit, "added to each component"),
        FaultKind.NOISY: FaultSize(noisy, 0.0, high, unit, "standard deviation of what is added"),
        FaultKind.DELAYED: _late(delay_s),
        FaultKind.LOSSY: _SHARE_LOST,
    }
    if scaled:
        kinds[FaultKind.SCALED] = FaultSize(1.2, 0.0, 10.0, "", "factor of each component")
    return kinds


SIZES: dict[FaultPart, dict[FaultKind, FaultSize | None]] = {
    FaultPart.GYROSCOPE: _sensor("rad/s", wrong=0.05, noisy=0.1, high=50.0, delay_s=0.02),
    FaultPart.ACCELEROMETER: _sensor("m/s2", wrong=0.5, noisy=2.0, high=200.0, delay_s=0.02),
    FaultPart.MAGNETOMETER: _sensor("gauss", wrong=0.2, noisy=0.1, high=10.0, delay_s=0.2),
    FaultPart.BAROMETER: _sensor("Pa", wrong=50.0, noisy=50.0, high=1e5, delay_s=0.5, scaled=False),
    FaultPart.GPS: _sensor("m", wrong=5.0, noisy=3.0, high=1e4, delay_s=0.5, scaled=False),
    FaultPart.RANGE_FINDER: _sensor("m", wrong=0.5, noisy=0.2, high=100.0, delay_s=0.5),
    FaultPart.OPTICAL_FLOW: _sensor("rad/s", wrong=0.5, noisy=1.0, high=50.0, delay_s=0.2),
    FaultPart.EXTERNAL_POSE: _sensor("m", wrong=0.3, noisy=0.05, high=1e4, delay_s=0.2, scaled=False),
    FaultPart.BATTERY_MONITOR: {
        FaultKind.OFF: None,
        FaultKind.STUCK: None,
        FaultKind.WRONG: FaultSize(-2.0, -100.0, 100.0, "V", "added to the voltage"),
        FaultKind.NOISY: FaultSize(
            0.5, 0.0, 100.0, "V", "standard deviation of what is added to the voltage"
        ),
    },
    FaultPart.BATTERY: {
        FaultKind.SAG: FaultSize(0.2, 0.01, 1.0, "", "share of the voltage at its terminals that is lost")
    },
    FaultPart.MOTOR: {
        FaultKind.OFF: None,
        FaultKind.STUCK: None,
        FaultKind.WEAK: FaultSize(0.2, 0.01, 1.0, "", "share of its thrust that is lost"),
    },
    FaultPart.CAMERA: {
        FaultKind.OFF: None,
        FaultKind.STUCK: None,
        FaultKind.BLACK: None,
        FaultKind.DELAYED: _late(0.3),
        FaultKind.LOSSY: _SHARE_LOST,
    },
    FaultPart.LINK: {
        FaultKind.OFF: None,
        FaultKind.DELAYED: _late(0.2),
        FaultKind.LOSSY: _SHARE_LOST,
    },
    FaultPart.RC: {
        FaultKind.OFF: None,
        FaultKind.STUCK: None,
    },
}
"""The kinds of faults of each part, and what their size means; None: it has no size."""

MAX_TIME_S = 36_000.0


def _named(value: object, names: type[FaultPart] | type[FaultKind]) -> object:
    """A part or kind by its name, also where files are read strictly."""
    if not isinstance(value, str):
        return value
    try:
        return names(value)
    except ValueError:
        raise refusal(value, f"is not known; use one of {', '.join(names)}") from None


_PartName = Annotated[FaultPart, BeforeValidator(lambda value: _named(value, FaultPart))]
_KindName = Annotated[FaultKind, BeforeValidator(lambda value: _named(value, FaultKind))]


class Fault(Part):
    """One fault of a flight.

    Its time counts from arming, so it is the same in every try: it ends, if not before, when the vehicle is
    disarmed, and comes again in the next try.
    """

    part: _PartName = Field(description="what fails")
    kind: _KindName = Field(description="how it fails")
    at_s: float = Field(0.0, ge=0, le=MAX_TIME_S, description="when it begins: seconds after arming")
    for_s: float | None = Field(
        None, ge=0.001, le=MAX_TIME_S, description="how long; without it, until the end"
    )
    size: float | None = Field(None, description="how much; each kind has a default")
    number: int | None = Field(None, ge=1, le=16, description="which motor, from 1; without it, the first")

    @property
    def amount(self) -> float:
        """The size, or its default; 0 for a kind without."""
        meant = SIZES[self.part][self.kind]
        return 0.0 if meant is None else meant.default if self.size is None else self.size

    def __str__(self) -> str:
        """The fault as it is written in one line."""
        meant = SIZES[self.part][self.kind]
        words = [self.part.value.replace("_", " ")]
        if self.number is not None:
            words.append(str(self.number))
        words.append(self.kind.value)
        if meant is not None:
            words.append(f"{self.amount:g} {meant.unit}".strip())
        words.append(f"at {self.at_s:g} s")
        if self.for_s is not None:
            words.append(f"for {self.for_s:g} s")
        return " ".join(words)

    @model_validator(mode="after")
    def _is_a_fault_of_its_part(self) -> Self:
        kinds = SIZES[self.part]
        if self.kind not in kinds:
            can = ", ".join(kind.value for kind in kinds)
            raise refusal(self.kind.value, f"is no fault of a {self.part.value}; use one of {can}", "kind")
        meant = kinds[self.kind]
        if self.size is not None:
            if meant is None:
                raise refusal(
                    self.size, f"is not needed: {self.part} {self.kind} has none; remove it", "size"
                )
            if not meant.low <= self.size <= meant.high:
                unit = f" {meant.unit}" if meant.unit else ""
                message = f"is out of range; use {meant.low:g} to {meant.high:g}{unit} ({meant.meaning})"
                raise refusal(self.size, message, "size")
        if self.number is not None and self.part is not FaultPart.MOTOR:
            raise refusal(self.number, f"numbers a motor; a {self.part.value} has none, remove it", "number")
        return self


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
