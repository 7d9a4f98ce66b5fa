"""A layout for drones that start from the floor."""

from __future__ import annotations

from scenarios.models import Scenario


def lifted(scenario: Scenario, lift_m: float) -> Scenario:
    """The same layout with all frames hung higher, and the ceiling with them.

    So for a drone that starts from the floor, without a base: heights count from where it stands, which the
    app takes for the base's top. Lifted by the height of that base, all hangs as high above the real floor
    as the scenario says.
    """
    frames = tuple(frame.model_copy(update={"z_m": frame.z_m + lift_m}) for frame in scenario.frames)
    arena = scenario.arena.model_copy(update={"height_m": scenario.arena.height_m + lift_m})
    return scenario.model_copy(update={"frames": frames, "arena": arena})
