"""Scenarios drawn at random: the same level and seed give the same scenario on every machine."""

from __future__ import annotations

import itertools

from numpy.random import Generator

from scenarios.level import STEPS_PER_UNIT, Layout, Level, LevelError, Range
from scenarios.models import COLOURS, Base, Frame, Scenario, Start
from scenarios.streams import SeedError, random_stream

MAX_DRAWS = 20_000  # a fifth of a second; level calm needs two draws on average

Steps = tuple[int, int]  # x and y of a place in millimetres


def random_scenario(level: Level, seed: int) -> Scenario:
    """Draw a scenario, uniformly over all that the level allows.

    The level's name has no part in the draw: levels with one layout have the same places for the same seed,
    so that what else they make harder can be compared flight by flight.

    Args:
        level: what to draw from, see `load_level`.
        seed: 0 to `streams.MAX_SEED`.

    Returns:
        A scenario named `<level>-<seed>`, in whole millimetres and milliradians.

    Raises:
        LevelError: the seed is out of range, or the level's distances leave (nearly) no room.
    """
    layout = level.layout
    try:
        places = _places(layout, random_stream(seed, "layout.places"))
        heights = random_stream(seed, "layout.frame_heights")
        yaws = random_stream(seed, "layout.frame_yaws")
        start_yaw_rad = _draw(layout.start_yaw_rad, random_stream(seed, "layout.start_yaw")) / STEPS_PER_UNIT
    except LevelError as error:
        raise LevelError(f"level {level.name}, seed {seed}: {error}") from None
    except SeedError as error:
        raise LevelError(str(error)) from None
    (base_x_m, base_y_m), *frame_places = [(x / STEPS_PER_UNIT, y / STEPS_PER_UNIT) for x, y in places]
    return Scenario(
        name=f"{level.name}-{seed}",
        description=f"Random scenario of level {level.name}, seed {seed}.",
        base=Base(x_m=base_x_m, y_m=base_y_m),
        start=Start(x_m=base_x_m, y_m=base_y_m, yaw_rad=start_yaw_rad),
        frames=tuple(
            Frame(
                colour=colour,
                x_m=x_m,
                y_m=y_m,
                z_m=_draw(layout.frame_z_m, heights) / STEPS_PER_UNIT,
                yaw_rad=_draw(layout.frame_yaw_rad, yaws) / STEPS_PER_UNIT,
            )
            for colour, (x_m, y_m) in zip(COLOURS, frame_places, strict=True)
        ),
    )


def _places(layout: Layout, stream: Generator) -> list[Steps]:
    """Draw the places of base and frames.

    All are drawn again when two are too near: redrawing only the last one would favour some layouts.
    """
    count = 1 + len(COLOURS)
    apart_steps_2 = (layout.apart_m * STEPS_PER_UNIT) ** 2
    for _ in range(MAX_DRAWS):
        places = [(_draw(layout.x_m, stream), _draw(layout.y_m, stream)) for _ in range(count)]
        # Not ">=": places exactly that far apart would be too near for whoever calculates in rounded metres.
        if all(_distance_2(*pair) > apart_steps_2 for pair in itertools.combinations(places, 2)):
            return places
    room = " × ".join(f"{span.high - span.low:g}" for span in (layout.x_m, layout.y_m))
    raise LevelError(
        f"{MAX_DRAWS} draws found no room for {count} places {layout.apart_m:g} m apart in {room} m; "
        "lower layout.apart_m or widen layout.x_m and layout.y_m"
    )


def _distance_2(one: Steps, other: Steps) -> int:
    return (one[0] - other[0]) ** 2 + (one[1] - other[1]) ** 2


def _draw(span: Range, stream: Generator) -> int:
    """Draw a whole number of thousandths, each of the range equally likely."""
    low, high = span.steps
    return low + int(stream.random() * (high - low + 1))
