"""What a recording gives back, one after another."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

from offboard.app import Moment
from scenarios.result import FlightResult
from vision.types import Image


@dataclass(frozen=True, slots=True)
class Picture:
    """An image of the drone's camera.

    Attributes:
        time_us: vehicle time, microseconds.
        image: BGR, shape (height, width, 3), uint8.
    """

    time_us: int
    image: Image


@dataclass(frozen=True, slots=True)
class Crossed:
    """The drone crossed a frame.

    Attributes:
        time_us: vehicle time, microseconds.
        colour: the frame.
    """

    time_us: int
    colour: str


Event = Moment | Picture | Crossed


class Recorded(Protocol):
    """A recorded flight, from whatever file."""

    @property
    def title(self) -> str:
        """What was flown, for people."""
        ...

    @property
    def result(self) -> FlightResult | None:
        """None if the flight left none."""
        ...

    def events(self) -> Iterator[Event]:
        """All that happened, in order of vehicle time; raises `RecordingError` where the file is damaged."""
        ...


def time_of_event(event: Event) -> int:
    """Vehicle time, microseconds."""
    return event.state.time_us if isinstance(event, Moment) else event.time_us
