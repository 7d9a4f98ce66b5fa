"""The shape of a gate: an upright rectangle of four bars with an opening to fly through."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

SIZE_LIMITS_M = (0.01, 10)
BAR_LIMITS_M = (0.001, 1)


@dataclass(frozen=True, slots=True)
class GateShape:
    """Sizes of a gate; the defaults are those of the frame challenge.

    Attributes:
        outer_width_m: horizontal, bars included.
        outer_height_m: vertical, bars included.
        bar_m: width of the bars, seen from the front.
        depth_m: thickness of the bars, along the gate's normal.
    """

    outer_width_m: float = 0.42
    outer_height_m: float = 0.22
    bar_m: float = 0.02
    depth_m: float = 0.02

    @property
    def opening_m(self) -> tuple[float, float]:
        """Clear width and height between the bars."""
        return (self.outer_width_m - 2 * self.bar_m, self.outer_height_m - 2 * self.bar_m)

    @property
    def half_m(self) -> tuple[float, float]:
        """Half the outer width and height."""
        return (self.outer_width_m / 2, self.outer_height_m / 2)


PAPER_GATE = GateShape()


@dataclass(frozen=True, slots=True)
class GateShapes:
    """The shape of the gates of each colour, which a drone is told before the flight.

    Attributes:
        by_colour: of the colours whose shape is known.
        other: of all other gates.
    """

    by_colour: Mapping[str, GateShape] = field(default_factory=dict)
    other: GateShape = PAPER_GATE

    def of(self, colour: str) -> GateShape:
        """The shape of the gates of a colour."""
        return self.by_colour.get(colour, self.other)
