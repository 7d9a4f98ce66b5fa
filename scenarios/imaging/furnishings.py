"""What is in a hall around the arena: pictures and windows on its walls, and people who stand before them."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal, get_args

from pydantic import Field

from scenarios.part import Metres, Part

HallWall = Literal["front", "back", "left", "right"]
"""The walls of the hall at +x, -x, +y and -y."""
WALLS: tuple[HallWall, ...] = get_args(HallWall)
Surface = Literal["floor"] | HallWall
"""The arena's floor, and the walls."""
PatchColour = Literal["red", "green", "blue", "cyan", "magenta", "yellow", "orange", "white", "black"]
PATCH_COLOURS: tuple[PatchColour, ...] = get_args(PatchColour)
"""Of print, paint and cloth: less pure than a gate's."""

PHOTOGRAPHS = (
    "astronaut",
    "chelsea",
    "coffee",
    "rocket",
    "hubble_deep_field",
    "retina",
    "motorcycle_left",
    "ihc",
)
"""Of the package scikit-image. Where it is not installed, drawn pictures are in their places."""

Size = Annotated[float, Field(ge=0.05, le=20)]


class Picture(Part):
    """A picture on a wall."""

    surface: HallWall = Field(description="what it hangs on")
    image: str = Field(
        min_length=1,
        max_length=400,
        description=f"a JPEG or PNG file; or one of {', '.join(PHOTOGRAPHS)}, photographs of scikit-image",
    )
    across_m: Metres = Field(description="centre, from the wall's middle")
    up_m: Metres = Field(description="centre, above the floor")
    width_m: Size = Field(1.0, description="of the picture")
    height_m: Size = Field(0.75, description="of the picture, whose image is stretched to it")


class Window(Part):
    """A window in a wall, as bright as the day, with a frame, a bar in its middle and a sill."""

    surface: HallWall = Field(description="what it is in")
    across_m: Metres = Field(description="centre, from the wall's middle")
    up_m: Metres = Field(1.6, description="centre, above the floor")
    width_m: Size = Field(1.4, description="with its frame")
    height_m: Size = Field(1.2, description="with its frame")
    bar_m: float = Field(0.07, ge=0.005, le=1, description="width of frame and bar")
    colour: PatchColour = Field("white", description="of frame and bar")


class Person(Part):
    """Somebody who stands in the hall, outside the arena. They are only seen, like the hall."""

    often_unused: ClassVar = ("height_m",)

    x_m: Metres = Field(description="centre")
    y_m: Metres = Field(description="centre")
    yaw_rad: float = Field(0.0, ge=-6.3, le=6.3, description="where they look, counter-clockwise from x")
    height_m: float = Field(1.75, ge=0.5, le=2.5, description="with the head")
    shirt: PatchColour = Field("blue", description="colour")
    trousers: PatchColour = Field("black", description="colour")
