"""The challenge as Foxglove's 3D panel draws it: arena, base, frames and drone, and where the camera is.

Arena axes (x forward, y left, z up) are just those that Foxglove takes for the world.
"""

from __future__ import annotations

from typing import Any

from firmware_py.airframe import load_airframe
from framerunner.recording.messages import ARENA, CAMERA, DRONE, RGBA, Message, time_of, turn_of, vector_of
from geometry.vectors import Vec3
from scenarios.models import Arena, Scenario
from sitl.solids import Solid, base_solid, frame_solids
from vision.intrinsics import camera_matrix

_FLOOR = {"r": 0.88, "g": 0.69, "b": 0.22, "a": 0.6}
_BORDER = {"r": 0.5, "g": 0.5, "b": 0.5, "a": 0.7}
_BASE = {"r": 0.67, "g": 0.67, "b": 0.67, "a": 1.0}
_BODY = {"r": 0.15, "g": 0.15, "b": 0.2, "a": 1.0}
_NOSE = {"r": 1.0, "g": 0.6, "b": 0.0, "a": 1.0}
_FLOOR_M = 0.01
_UNTURNED = turn_of(0.0)


def scene(scenario: Scenario, time_us: int) -> Message:
    """All that stands still in the arena, and the drone, which moves with its own axes.

    Args:
        scenario: what is flown.
        time_us: vehicle time from which it is shown, microseconds.
    """
    arena = scenario.arena
    floor = _cube((0.0, 0.0, -_FLOOR_M / 2), (arena.length_x_m, arena.width_y_m, _FLOOR_M), _FLOOR)
    entities = [
        _entity(time_us, "arena", ARENA, cubes=[floor], lines=[_border(arena)]),
        _entity(time_us, "base", ARENA, cubes=[_solid(base_solid(scenario), _BASE)]),
    ]
    for frame in scenario.frames:
        bars = [_solid(bar, RGBA[frame.colour]) for bar in frame_solids(frame)]
        entities.append(_entity(time_us, f"{frame.colour} frame", ARENA, cubes=bars))
    length_m, width_m, height_m = load_airframe(scenario.airframe).envelope_m
    body = _cube((0.0, 0.0, 0.0), (length_m, width_m, height_m), _BODY)
    nose = _cube(
        (0.4 * length_m, 0.0, 0.6 * height_m), (0.2 * length_m, 0.2 * width_m, 0.2 * height_m), _NOSE
    )
    entities.append(_entity(time_us, "drone", DRONE, cubes=[body, nose]))
    return {"deletions": [], "entities": entities}


def camera_transform(scenario: Scenario, time_us: int) -> Message:
    """Where the camera sits on the drone, in the axes of images: x right, y down, z ahead."""
    return {
        "timestamp": time_of(time_us),
        "parent_frame_id": DRONE,
        "child_frame_id": CAMERA,
        "translation": vector_of(scenario.camera.position_flu_m),
        "rotation": {"x": -0.5, "y": 0.5, "z": -0.5, "w": 0.5},
    }


def calibration(scenario: Scenario, time_us: int) -> Message:
    """The ideal pinhole camera of the scenario."""
    camera = scenario.camera
    matrix = camera_matrix(camera.width_px, camera.height_px, camera.horizontal_fov_rad).tolist()
    return {
        "timestamp": time_of(time_us),
        "frame_id": CAMERA,
        "width": camera.width_px,
        "height": camera.height_px,
        "distortion_model": "plumb_bob",
        "D": [0.0] * 5,
        "K": [value for row in matrix for value in row],
        "R": [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        "P": [value for row in matrix for value in (*row, 0.0)],
    }


def _entity(time_us: int, name: str, axes: str, **primitives: list[Message]) -> Message:
    """An entity that stays for good and moves with its axes."""
    entity: dict[str, Any] = {
        "timestamp": time_of(time_us),
        "frame_id": axes,
        "id": name,
        "lifetime": {"sec": 0, "nsec": 0},
        "frame_locked": True,
        "metadata": [],
        "cubes": [],
        "lines": [],
    }
    return {**entity, **primitives}


def _solid(solid: Solid, colour: Message) -> Message:
    x, y, z = solid.half_extents_m
    return _cube(solid.centre_arena_m, (2 * x, 2 * y, 2 * z), colour, solid.yaw_rad)


def _cube(centre_m: Vec3, size_m: Vec3, colour: Message, yaw_rad: float = 0.0) -> Message:
    pose = {"position": vector_of(centre_m), "orientation": turn_of(yaw_rad)}
    return {"pose": pose, "size": vector_of(size_m), "color": colour}


def _border(arena: Arena) -> Message:
    """The twelve edges of the flying space."""
    x, y = arena.length_x_m / 2, arena.width_y_m / 2
    plan = ((x, y), (-x, y), (-x, -y), (x, -y))
    points: list[Vec3] = []
    for (x0, y0), (x1, y1) in zip(plan, (*plan[1:], plan[0]), strict=True):
        for z in (0.0, arena.height_m):
            points += [(x0, y0, z), (x1, y1, z)]
        points += [(x0, y0, 0.0), (x0, y0, arena.height_m)]
    return {
        "type": 2,  # LINE_LIST
        "pose": {"position": vector_of((0.0, 0.0, 0.0)), "orientation": _UNTURNED},
        "thickness": 1.0,
        "scale_invariant": True,
        "points": [vector_of(point) for point in points],
        "color": _BORDER,
        "colors": [],
        "indices": [],
    }
