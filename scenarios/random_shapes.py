"""Shapes of the frames of random scenarios, and the size and mounting of their cameras."""

from __future__ import annotations

from math import ceil
from typing import TYPE_CHECKING, Annotated

from pydantic import Field

from framerunner.geometry.gate_shape import GateShape
from framerunner.geometry.rotations import MAX_MOUNTING_RAD
from scenarios.imaging.effects import CameraEffects
from scenarios.models import COLOURS, Camera
from scenarios.part import Part
from scenarios.random_numbers import MAX_DRAWS, STEPS_PER_UNIT, LevelError, Range, random_stream, within

if TYPE_CHECKING:
    from numpy.random import Generator

_MM = 3  # decimals
_ROUNDING = 1e-6
_NONE = Range(low=0.0, high=0.0)
_Size = Annotated[Range, within(0.05, 5.0)]
_Opening = Annotated[float, Field(ge=0.05, le=5.0)]
_Pixels = Annotated[int, Field(ge=16, le=4096)]
_OneImageSize = tuple[_Pixels, _Pixels]


class RandomShapes(Part):
    """Ranges of the frames' shapes. One that does not fit the limits is drawn again, as a whole."""

    outer_width_m: _Size = Field(description="horizontal, bars included")
    aspect: Annotated[Range, within(0.1, 10.0)] = Field(description="outer height, as a share of the width")
    outer_height_m: _Size = Field(description="limits of the height")
    bar_share: Annotated[Range, within(0.01, 0.3)] = Field(
        description="width of the bars, as a share of the shorter side"
    )
    bar_m: Annotated[Range, within(0.005, 0.5)] = Field(description="limits of that width")
    depth_share: Annotated[Range, within(0.1, 5.0)] = Field(
        description="thickness of the bars along the normal, as a share of their width"
    )
    least_opening_m: tuple[_Opening, _Opening] = Field(
        description="clear width and height that the drone needs, between the bars"
    )
    clear_m: float = Field(ge=0, le=2, description="below each frame; one that would hang lower is raised")
    mixed: float = Field(ge=0, le=1, description="share of the layouts in which each frame has its own shape")

    def draw(self, seed: int) -> tuple[GateShape, ...]:
        """Draw the shapes of a scenario's frames, in the order of the colours, in whole millimetres.

        Raises:
            LevelError: (nearly) nothing fits the limits.
        """
        stream = random_stream(seed, "shapes")
        one = self._draw_one(stream)
        if random_stream(seed, "shapes.mixed").random() >= self.mixed:
            return (one,) * len(COLOURS)
        return (one, *(self._draw_one(stream) for _ in COLOURS[1:]))

    def height_of(self, shape: GateShape, z_m: float) -> float:
        """The height of a frame's centre: that drawn, or what the shape needs above the floor."""
        least_m = shape.outer_height_m / 2 + self.clear_m
        return max(z_m, ceil(least_m * STEPS_PER_UNIT - _ROUNDING) / STEPS_PER_UNIT)

    def _draw_one(self, stream: Generator) -> GateShape:
        for _ in range(MAX_DRAWS):
            width_m = self.outer_width_m.draw_value(stream)
            height_m = round(width_m * self.aspect.draw_value(stream), _MM)
            bar_m = round(min(width_m, height_m) * self.bar_share.draw_value(stream), _MM)
            depth_m = round(bar_m * self.depth_share.draw_value(stream), _MM)
            shape = GateShape(width_m, height_m, bar_m, depth_m)
            limits = ((height_m, self.outer_height_m), (bar_m, self.bar_m))
            openings = zip(shape.opening_m, self.least_opening_m, strict=True)
            fits = all(limit.low <= size_m <= limit.high for size_m, limit in limits)
            if fits and all(size_m >= least_m for size_m, least_m in openings):
                return shape
        raise LevelError(
            f"shapes: {MAX_DRAWS} draws found no frame within outer_height_m and bar_m whose opening is "
            "least_opening_m or more; widen outer_width_m or aspect"
        )


class RandomView(Part):
    """The camera's image and how it is turned on the drone; all else is the challenge's camera's."""

    sizes_px: tuple[_OneImageSize, ...] = Field(
        min_length=1, description="columns and rows of the image; each pair is equally likely"
    )
    horizontal_fov_rad: Annotated[Range, within(0.5, 2.4)] = Field(description="angle of view over the width")
    pitch_rad: Annotated[Range, within(-MAX_MOUNTING_RAD, MAX_MOUNTING_RAD)] = Field(
        _NONE, description="how far it is tilted, up is positive"
    )

    def draw(self, seed: int, effects: CameraEffects | None) -> Camera:
        """Draw the camera of a scenario, angles in whole milliradians."""
        sizes = self.sizes_px
        width_px, height_px = sizes[int(random_stream(seed, "view.size").random() * len(sizes))]
        return Camera(
            width_px=width_px,
            height_px=height_px,
            horizontal_fov_rad=self.horizontal_fov_rad.draw_value(random_stream(seed, "view.fov")),
            mounting_frd_rad=(0.0, self.pitch_rad.draw_value(random_stream(seed, "view.pitch")), 0.0),
            effects=effects,
        )
