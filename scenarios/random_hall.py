"""What random scenarios look like around the arena: textures, and a hall with all that is in it."""

from __future__ import annotations

from math import atan2, hypot
from typing import TYPE_CHECKING, Annotated, Self

from pydantic import Field, model_validator

from framerunner.files.yaml_file import refusal
from framerunner.geometry.gate_shape import PAPER_GATE
from scenarios.imaging.effects import Hall, Patch
from scenarios.imaging.furnishings import (
    PATCH_COLOURS,
    PHOTOGRAPHS,
    WALLS,
    HallWall,
    PatchColour,
    Person,
    Picture,
    Surface,
    Window,
)
from scenarios.imaging.textures import MAX_TEXTURE_SEED, Pattern, Texture
from scenarios.models import Arena
from scenarios.part import Part
from scenarios.random_numbers import Range, random_stream, within

if TYPE_CHECKING:
    from numpy.random import Generator

_ALL_ROUND_RAD = Range(low=-3.141, high=3.141)
_SLANT_RAD = Range(low=-0.3, high=0.3)
_BORDERS = 3  # every third patch is nothing but a border, in the proportions of a gate
_GATE_SHAPE = PAPER_GATE.outer_height_m / PAPER_GATE.outer_width_m
_WINDOW_WIDTH_M = Range(low=0.8, high=2.0)
_WINDOW_HEIGHT_M = Range(low=0.8, high=1.6)
_SILL_M = Range(low=0.7, high=1.2)
_WINDOW_COLOURS: tuple[PatchColour, ...] = ("white", "white", "black", "red", "green", "blue")
_PERSON_HEIGHT_M = Range(low=1.5, high=1.95)
_PEOPLE_APART_M = 0.9
_PERSON_DRAWS = 30
_PERSON_SPREAD_M = 0.3  # of a person's middle from a wall


class RandomTextures(Part):
    """Patterns of floor and walls, each of a list equally likely, in a variant of their own."""

    floor: tuple[Pattern, ...] = Field((), max_length=20, description="of the floor; empty: tatami mats")
    walls: tuple[Pattern, ...] = Field((), max_length=20, description="of the hall's walls; empty: plain")

    def draw_floor(self, seed: int) -> Texture | None:
        """Draw the floor's texture."""
        return _draw_texture(self.floor, random_stream(seed, "textures.floor"))

    def draw_walls(self, seed: int) -> Texture | None:
        """Draw the walls' texture."""
        return _draw_texture(self.walls, random_stream(seed, "textures.walls"))


def _draw_texture(patterns: tuple[Pattern, ...], stream: Generator) -> Texture | None:
    if not patterns:
        return None
    pattern = patterns[int(stream.random() * len(patterns))]
    return Texture(pattern=pattern, seed=int(stream.random() * MAX_TEXTURE_SEED))


class RandomClutter(Part):
    """A hall with flat things in all colours, every third only a border, and with what else is in it."""

    posters: int = Field(0, ge=0, le=100, description="how many things on the walls")
    marks: int = Field(0, ge=0, le=100, description="how many things on the floor")
    pictures: int = Field(0, ge=0, le=100, description="how many photographs on the walls")
    windows: int = Field(0, ge=0, le=100, description="how many windows in the walls")
    people: int = Field(0, ge=0, le=50, description="how many people stand between the arena and the walls")
    size_m: Annotated[Range, within(0.05, 10.0)] = Field(
        description="width and height of each; a border has the proportions of a frame"
    )
    up_m: Range = Field(description="centres of the posters above the floor")
    border_m: Annotated[Range, within(0.005, 1.0)] = Field(description="width of borders")
    beyond_m: float = Field(
        Hall().beyond_m, ge=0.01, le=100, description="from the arena to the hall's walls"
    )
    height_m: float = Field(Hall().height_m, ge=0.1, le=100, description="of the hall")

    @model_validator(mode="after")
    def _posters_are_on_the_walls(self) -> Self:
        self.up_m.check(0.0, self.height_m, "up_m")
        return self

    @model_validator(mode="after")
    def _has_room_for_people(self) -> Self:
        least_m = Arena().margin_m + 2.0 * _PERSON_SPREAD_M
        if self.people and self.beyond_m < least_m:
            message = f"leaves no room for people outside the arena and its margin; use {least_m} or more"
            raise refusal(self.beyond_m, message, "beyond_m")
        return self

    def draw_hall(self, seed: int, wall_texture: Texture | None) -> Hall:
        """Draw the hall, what hangs on its walls, and who stands before them."""
        pictures, windows, people = (
            random_stream(seed, f"clutter.{kind}") for kind in ("pictures", "windows", "people")
        )
        return Hall(
            beyond_m=self.beyond_m,
            height_m=self.height_m,
            wall_texture=wall_texture,
            windows=tuple(self._window(WALLS[index % 4], windows) for index in range(self.windows)),
            pictures=tuple(self._picture(WALLS[index % 4], pictures) for index in range(self.pictures)),
            people=self._draw_people(people),
        )

    def draw_patches(self, seed: int) -> tuple[Patch, ...]:
        """Draw the things on walls and floor."""
        stream = random_stream(seed, "clutter")
        surfaces: list[Surface] = [WALLS[index % 4] for index in range(self.posters)] + ["floor"] * self.marks
        return tuple(self._patch(surface, index, stream) for index, surface in enumerate(surfaces))

    def _patch(self, surface: Surface, index: int, stream: Generator) -> Patch:
        arena = Arena()
        colour: PatchColour = PATCH_COLOURS[int(stream.random() * len(PATCH_COLOURS))]
        x_m, y_m = arena.length_x_m / 2, arena.width_y_m / 2
        if surface == "floor":
            across = Range(low=-x_m, high=x_m).draw_value(stream)
            up = Range(low=-y_m, high=y_m).draw_value(stream)
            turn = _ALL_ROUND_RAD.draw_value(stream)
        else:
            across = self._along(surface).draw_value(stream)
            up = self.up_m.draw_value(stream)
            turn = _SLANT_RAD.draw_value(stream)
        width, height = self.size_m.draw_value(stream), self.size_m.draw_value(stream)
        border = self.border_m.draw_value(stream)
        is_border = index % _BORDERS == 0
        return Patch(
            surface=surface,
            colour=colour,
            across_m=across,
            up_m=up,
            width_m=width,
            height_m=round(width * _GATE_SHAPE, 3) if is_border else height,
            turn_rad=turn,
            border_m=border if is_border else None,
        )

    def _along(self, surface: Surface, spare_m: float = 1.0) -> Range:
        """Of a wall's length, without what is nearer to its ends."""
        arena = Arena()
        extent_m = arena.width_y_m if surface in {"front", "back"} else arena.length_x_m
        half_m = extent_m / 2 + self.beyond_m - spare_m
        return Range(low=-half_m, high=half_m)

    def _window(self, surface: HallWall, stream: Generator) -> Window:
        width_m, height_m = _WINDOW_WIDTH_M.draw_value(stream), _WINDOW_HEIGHT_M.draw_value(stream)
        return Window(
            surface=surface,
            across_m=self._along(surface).draw_value(stream),
            up_m=round(_SILL_M.draw_value(stream) + height_m / 2, 3),
            width_m=width_m,
            height_m=height_m,
            bar_m=self.border_m.draw_value(stream),
            colour=_WINDOW_COLOURS[int(stream.random() * len(_WINDOW_COLOURS))],
        )

    def _picture(self, surface: HallWall, stream: Generator) -> Picture:
        return Picture(
            surface=surface,
            image=PHOTOGRAPHS[int(stream.random() * len(PHOTOGRAPHS))],
            across_m=self._along(surface).draw_value(stream),
            up_m=self.up_m.draw_value(stream),
            width_m=self.size_m.draw_value(stream),
            height_m=self.size_m.draw_value(stream),
        )

    def _draw_people(self, stream: Generator) -> tuple[Person, ...]:
        """People who do not stand in each other; if there is no room for one, he is left out."""
        people: list[Person] = []
        for index in range(self.people):
            for _ in range(_PERSON_DRAWS):
                person = self._person(WALLS[index % 4], stream)
                if all(hypot(person.x_m - p.x_m, person.y_m - p.y_m) >= _PEOPLE_APART_M for p in people):
                    people.append(person)
                    break
        return tuple(people)

    def _person(self, surface: HallWall, stream: Generator) -> Person:
        """Somebody before a wall, who looks about to the middle of the arena."""
        arena = Arena()
        beyond_m = Range(
            low=arena.margin_m + _PERSON_SPREAD_M, high=round(self.beyond_m - _PERSON_SPREAD_M, 3)
        ).draw_value(stream)
        along_m = self._along(surface, spare_m=0.5).draw_value(stream)
        side = 1.0 if surface in {"front", "left"} else -1.0
        if surface in {"front", "back"}:
            x_m, y_m = side * (arena.length_x_m / 2 + beyond_m), along_m
        else:
            x_m, y_m = along_m, side * (arena.width_y_m / 2 + beyond_m)
        shirt, trousers = (PATCH_COLOURS[int(stream.random() * len(PATCH_COLOURS))] for _ in range(2))
        return Person(
            x_m=round(x_m, 3),
            y_m=round(y_m, 3),
            yaw_rad=round(atan2(-y_m, -x_m) + _SLANT_RAD.draw_value(stream), 3),
            height_m=_PERSON_HEIGHT_M.draw_value(stream),
            shirt=shirt,
            trousers=trousers,
        )
