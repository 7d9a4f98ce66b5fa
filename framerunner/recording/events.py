"""The events of a recorded flight, and the error of recordings."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

from framerunner.errors import UserError
from framerunner.geometry.vectors import Vec3
from offboard.app import Moment
from scenarios.result import FlightResult
from vision.types import Image


class RecordingError(UserError):
    """A recording that cannot be written or shown; the message is one line for people."""


@dataclass(frozen=True, slots=True)
class RecordedImage:
    """An image of the drone's camera, BGR, shape (height, width, 3), at a vehicle time in microseconds."""

    time_us: int
    image: Image


@dataclass(frozen=True, slots=True)
class Crossed:
    """The drone crossed the gate of a colour, at a vehicle time in microseconds."""

    time_us: int
    colour: str


@dataclass(frozen=True, slots=True)
class TruePlace:
    """Where a simulated drone truly was, arena metres, at a vehicle time in microseconds."""

    time_us: int
    position_m: Vec3


Event = Moment | RecordedImage | Crossed | TruePlace


class Recorded(Protocol):
    """A recorded flight, whatever file it is read from."""

    @property
    def title(self) -> str:
        """What was flown, for people."""
        ...

    @property
    def result(self) -> FlightResult | None:
        """None if the flight left none."""
        ...

    def events(self) -> Iterator[Event]:
        """All events in order of vehicle time; raises `RecordingError` where the file is damaged."""
        ...


def time_of_event(event: Event) -> int:
    """Vehicle time, microseconds."""
    return event.state.time_us if isinstance(event, Moment) else event.time_us
