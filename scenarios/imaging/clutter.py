"""What surrounds the arena and does not matter for the flight: a hall's walls, posters, stripes, tape."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from scenarios.part import Part

Surface = Literal["floor", "front", "back", "left", "right"]
"""The arena's floor, and the walls of the hall at +x, -x, +y and -y."""
PatchColour = Literal["red", "green", "blue", "cyan", "magenta", "yellow", "orange", "white", "black"]
SURFACES: tuple[Surface, ...] = ("floor", "front", "back", "left", "right")
PATCH_COLOURS: tuple[PatchColour, ...] = (
    "red",
    "green",
    "blue",
    "cyan",
    "magenta",
    "yellow",
    "orange",
    "white",
    "black",
)


class Patch(Part):
    """A flat rectangle on a surface: a poster, a stripe, a sheet; or only its border."""

    surface: Surface = Field(description="what it is on")
    colour: PatchColour = Field(description="of print, less pure than a frame's")
    across_m: float = Field(
        ge=-500, le=500, description="centre: x on the floor, else from the wall's middle"
    )
    up_m: float = Field(ge=-500, le=500, description="centre: y on the floor, else above the floor")
    width_m: float = Field(ge=0.01, le=100, description="along the first of them, before it is turned")
    height_m: float = Field(ge=0.01, le=100, description="along the second of them, before it is turned")
    turn_rad: float = Field(0.0, ge=-6.3, le=6.3, description="in its plane")
    border_m: float | None = Field(
        None,
        ge=0.001,
        le=50,
        description="width of its border if it is nothing but that; by default it is whole",
    )


class Hall(Part):
    """A room around the arena. It is only seen: nothing collides with its walls."""

    beyond_m: float = Field(1.5, ge=0.01, le=100, description="from the arena's border to the walls")
    height_m: float = Field(5.0, ge=0.1, le=100, description="of the ceiling")
