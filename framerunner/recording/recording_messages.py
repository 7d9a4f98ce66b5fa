"""Makes the messages of a recording from the ticks of a flight and from its scenario.

Arena axes (x forward, y left, z up) are also Foxglove's world axes.
"""

from __future__ import annotations

from base64 import b64encode
from dataclasses import asdict
from itertools import pairwise
from math import cos, isfinite, sin
from typing import Any

from framerunner.flying.navigation_reporter import has_place
from framerunner.geometry.rotations import mounting_flu, multiply, quaternion_from_yaw
from framerunner.geometry.solids import Solid
from framerunner.geometry.vectors import Quaternion, Vec3
from framerunner.vehicle.airframe import load_airframe
from framerunner.wire.mission_report import Plain
from offboard.app import Moment
from offboard.drone import DroneState, PlaceEstimate
from offboard.navigation.view import GateEstimate, NavigationView
from scenarios.imaging.effects import LensDistortion
from scenarios.models import COLOURS, Arena, Scenario
from sitl.solids import gate_solids
from vision.intrinsics import camera_matrix
from vision.types import Detection, Detections

Message = dict[str, Any]

ARENA = "arena"
DRONE = "drone"
CAMERA = "camera"
RGBA: dict[str, Message] = {
    "red": {"r": 1.0, "g": 0.0, "b": 0.0, "a": 1.0},
    "green": {"r": 0.0, "g": 0.8, "b": 0.0, "a": 1.0},
    "blue": {"r": 0.0, "g": 0.0, "b": 1.0, "a": 1.0},
}
_DECOY_RGBA: dict[str, Message] = {
    "cyan": {"r": 0.0, "g": 0.8, "b": 0.8, "a": 1.0},
    "magenta": {"r": 1.0, "g": 0.0, "b": 1.0, "a": 1.0},
}
_OTHER = {"r": 0.5, "g": 0.5, "b": 0.5, "a": 1.0}  # a gate that is no part of the task
_FLOOR = {"r": 0.88, "g": 0.69, "b": 0.22, "a": 0.6}
_BORDER = {"r": 0.5, "g": 0.5, "b": 0.5, "a": 0.7}
_BASE = {"r": 0.67, "g": 0.67, "b": 0.67, "a": 1.0}
_PRISM = {"r": 0.47, "g": 0.27, "b": 0.71, "a": 0.6}  # poles and walls; what is behind them is seen too
_ESTIMATE = {"r": 0.1, "g": 0.55, "b": 0.9, "a": 0.3}
_BODY = {"r": 0.15, "g": 0.15, "b": 0.2, "a": 1.0}
_NOSE = {"r": 1.0, "g": 0.6, "b": 0.0, "a": 1.0}
_CLEAR = {"r": 0.0, "g": 0.0, "b": 0.0, "a": 0.0}
_LABEL = {"r": 1.0, "g": 1.0, "b": 1.0, "a": 1.0}
_INFO = 2
_FLOOR_M = 0.01
_DASHES_A_LEG = 4
_MAX_TEXT = 80  # characters of a goal


def time_of(time_us: int) -> Message:
    """Vehicle time, microseconds, as seconds and nanoseconds."""
    seconds, rest_us = divmod(time_us, 1_000_000)
    return {"sec": seconds, "nsec": rest_us * 1000}


def _vector(vector: Vec3) -> Message:
    return {"x": vector[0], "y": vector[1], "z": vector[2]}


def _quaternion(attitude: Quaternion) -> Message:
    return {"x": attitude[1], "y": attitude[2], "z": attitude[3], "w": attitude[0]}


def _yaw_quaternion(yaw_rad: float) -> Message:
    return _quaternion(quaternion_from_yaw(yaw_rad))


def telemetry(moment: Moment) -> Message:
    """The drone's state at a tick."""
    state = moment.state
    return {
        "timestamp": time_of(state.time_us),
        "flight_time_s": moment.flight_time_s,
        "position_arena_m": _vector((state.x, state.y, state.z)),
        "velocity_arena_m_s": _vector(state.velocity_arena_m_s),
        "position_age_s": state.position_age_s,
        "attitude_arena": _quaternion(state.attitude_arena),
        "yaw_rad": state.yaw,
        "armed": state.armed,
        "offboard": state.offboard,
        "landed": state.landed,
        "mode": state.mode,
    }


def transform(state: DroneState) -> Message:
    """The drone's pose."""
    position_m = (state.x, state.y, state.z)
    return _transform(state.time_us, (ARENA, DRONE), position_m, _quaternion(state.attitude_arena))


def _transform(time_us: int, frames: tuple[str, str], translation_m: Vec3, rotation: Message) -> Message:
    return {
        "timestamp": time_of(time_us),
        "parent_frame_id": frames[0],
        "child_frame_id": frames[1],
        "translation": _vector(translation_m),
        "rotation": rotation,
    }


def estimate(place: PlaceEstimate, time_us: int) -> Message:
    """Where the app itself has estimated the drone to be."""
    return {
        "timestamp": time_of(time_us),
        "position_arena_m": _vector(place.position_m),
        "yaw_rad": place.yaw_rad,
        "position_covariance_m2": list(place.covariance_m2),
        "yaw_std_rad": place.yaw_std_rad,
    }


def estimate_scene(place: PlaceEstimate, time_us: int) -> Message:
    """That as a drawing: an ellipsoid of two standard deviations."""
    ellipsoid = _ellipsoid(place.position_m, place.position_std_m, _ESTIMATE)
    return {"deletions": [], "entities": [_entity(time_us, "estimate", ARENA, spheres=[ellipsoid])]}


def truth(position_m: Vec3, time_us: int) -> Message:
    """Where a simulated drone truly was."""
    return {"timestamp": time_of(time_us), "position_arena_m": _vector(position_m)}


def setpoint(moment: Moment) -> Message:
    """The mission's command at a tick."""
    return {"timestamp": time_of(moment.state.time_us), **asdict(moment.command)}


def detections(seen: Detections, time_us: int) -> Message:
    """The detections of one image, at the vehicle time of the first tick that used them, microseconds."""
    message: Message = {"timestamp": time_of(time_us)}
    if seen.time_us is not None:
        message["image_timestamp"] = time_of(seen.time_us)
    for colour in COLOURS:
        message[colour] = _detection(getattr(seen, colour))
    return message


def _detection(detection: Detection) -> Message:
    """Only finite numbers: JSON has neither infinity nor NaN."""
    message: Message = {"seen": detection.seen}
    for name in ("n", "s", "e", "w", "d", "a", "signed_a"):
        value: float = getattr(detection, name)
        if isfinite(value):
            message[name] = value
    return message


def boxes(seen: Detections, image_us: int, size_px: tuple[int, int]) -> Message:
    """Boxes around the detections of one image, to be drawn over it; the image has width and height."""
    time = time_of(image_us)
    outlines, texts = [], []
    for colour in COLOURS:
        detection: Detection = getattr(seen, colour)
        if not detection.seen:
            continue
        left, top, right, bottom = box_edges(detection, size_px)
        corners = ((left, top), (right, top), (right, bottom), (left, bottom))
        outlines.append(
            {
                "timestamp": time,
                "type": 2,  # LINE_LOOP
                "points": [{"x": x, "y": y} for x, y in corners],
                "outline_color": _LABEL,
                "outline_colors": [],
                "fill_color": _CLEAR,
                "thickness": 1.0,
                "metadata": [],
            }
        )
        distance = f" {detection.d:.2f} m" if isfinite(detection.d) else ""
        texts.append(
            {
                "timestamp": time,
                "position": {"x": left, "y": top},
                "text": f"{colour}{distance}",
                "font_size": 10.0,
                "text_color": _LABEL,
                "background_color": {**RGBA[colour], "a": 0.6},
                "metadata": [],
            }
        )
    return {"circles": [], "points": outlines, "texts": texts}


def box_edges(detection: Detection, size_px: tuple[int, int]) -> tuple[float, float, float, float]:
    """Left, top, right and bottom edge of a detection's box, pixels from the image's top left corner.

    The paper counts rows and columns from 1, so n = height / 2 - row and e = column - (width / 2 + 1); see
    `vision.detector.measure`. The edges are those of the outer pixels, not their centres.
    """
    width, height = size_px
    left, right = detection.w + width / 2, detection.e + width / 2 + 1
    return (left, height / 2 - detection.n - 1, right, height / 2 - detection.s)


def image(data: bytes, kind: str, time_us: int) -> Message:
    """An image, compressed as `kind`, "png" or "jpeg"; time is the vehicle time of its exposure."""
    return {
        "timestamp": time_of(time_us),
        "frame_id": CAMERA,
        "data": b64encode(data).decode("ascii"),
        "format": kind,
    }


def mission_state(moment: Moment, previous: str, previous_s: float) -> Message:
    """A mission's state at its first tick, and the state before, with the seconds spent in it."""
    taken = moment.transition
    guard: Message = {}
    if taken is not None:
        values = [_guard_value(*each) for each in taken.values]
        guard = {"when": taken.when, "values": values, "transitions": list(taken.ids)}
    return {
        "timestamp": time_of(moment.state.time_us),
        "flight_time_s": moment.flight_time_s,
        "state": moment.mission_state,
        "previous": previous,
        "previous_s": previous_s,
        **guard,
    }


def _guard_value(name: str, value: Plain) -> Message:
    """A value of a guard; a number that is not finite is left out."""
    if isinstance(value, bool):
        return {"name": name, "flag": value}
    if isinstance(value, int | float):
        return {"name": name, "number": float(value)} if isfinite(value) else {"name": name}
    return {"name": name, "text": str(value)}


def crossing(time_us: int, colour: str, time_s: float, offset_m: float, side: str) -> Message:
    """A gate was crossed; see `scenarios.crossing.Passage`."""
    return {
        "timestamp": time_of(time_us),
        "colour": colour,
        "time_s": time_s,
        "offset_m": offset_m,
        "side": side,
    }


def log(time_us: int, name: str, text: str) -> Message:
    """A line of text."""
    timestamp = time_of(time_us)
    return {"timestamp": timestamp, "level": _INFO, "message": text, "name": name, "file": "", "line": 0}


def gate_map(view: NavigationView, time_us: int) -> Message:
    """The navigator's map; a number that is not finite is left out, with its gate if that has no place."""
    gates = [_mapped_gate(gate) for gate in view.gates if has_place(gate)]
    return {"timestamp": time_of(time_us), "goal": view.goal[:_MAX_TEXT], "frames": gates}


def _mapped_gate(gate: GateEstimate) -> Message:
    message = {
        "colour": gate.colour,
        "position_arena_m": _vector(gate.position_m),
        "yaw_rad": gate.yaw_rad,
        "ambiguous": gate.ambiguous,
        "certain": gate.certain,
        "views": gate.views,
        "seen": time_of(gate.seen_us),
        "shape": asdict(gate.shape),
    }
    if all(map(isfinite, gate.position_std_m)):
        message["position_std_m"] = _vector(gate.position_std_m)
    if isfinite(gate.yaw_std_rad):
        message["yaw_std_rad"] = gate.yaw_std_rad
    return message


def path(view: NavigationView, time_us: int) -> Message:
    """The navigator's planned path."""
    points = [point for point in view.path_m if all(map(isfinite, point))]
    poses = [{"position": _vector(point), "orientation": _yaw_quaternion(0.0)} for point in points]
    return {"timestamp": time_of(time_us), "frame_id": ARENA, "poses": poses}


def map_scene(view: NavigationView, time_us: int) -> Message:
    """The map as a drawing: outlines, dashed until certain, with ellipsoids of two standard deviations."""
    entities = [
        _entity(time_us, f"{number} {gate.colour}", ARENA, **_drawn_estimate(gate))
        for number, gate in enumerate(view.gates)
        if has_place(gate)
    ]
    return {"deletions": [{"timestamp": time_of(time_us), "type": 1, "id": ""}], "entities": entities}


def _drawn_estimate(gate: GateEstimate) -> dict[str, list[Message]]:
    colour = RGBA.get(gate.colour, _OTHER)
    half_width, half_height = gate.shape.half_m
    c, s = cos(gate.yaw_rad), sin(gate.yaw_rad)
    x, y, z = gate.position_m
    corners = [(-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1)]
    loop = [(x - s * a * half_width, y + c * a * half_width, z + b * half_height) for a, b in corners]
    lines = [_lines(_dashes(loop) if not gate.certain else _pairs(loop), colour, 2.0)]
    if not all(map(isfinite, gate.position_std_m)):
        return {"lines": lines}
    sphere = _ellipsoid(gate.position_m, gate.position_std_m, {**colour, "a": 0.25})
    return {"lines": lines, "spheres": [sphere]}


def _ellipsoid(centre_m: Vec3, std_m: Vec3, colour: Message) -> Message:
    """An ellipsoid of two standard deviations."""
    x, y, z = std_m
    return _cube(centre_m, (4 * x, 4 * y, 4 * z), colour)


def _pairs(points: list[Vec3]) -> list[Vec3]:
    """The ends of each leg of a line."""
    return [end for leg in pairwise(points) for end in leg]


def _dashes(points: list[Vec3]) -> list[Vec3]:
    """The ends of the dashes of a dashed line."""
    ends: list[Vec3] = []
    for (x0, y0, z0), (x1, y1, z1) in pairwise(points):
        for number in range(2 * _DASHES_A_LEG):
            part = number / (2 * _DASHES_A_LEG - 1)
            ends.append((x0 + part * (x1 - x0), y0 + part * (y1 - y0), z0 + part * (z1 - z0)))
    return ends


def scene(scenario: Scenario, time_us: int) -> Message:
    """All that is in the arena, and the drone, which moves with its own axes, from a vehicle time on."""
    arena = scenario.arena
    floor = _cube((0.0, 0.0, -_FLOOR_M / 2), (arena.length_x_m, arena.width_y_m, _FLOOR_M), _FLOOR)
    entities = [
        _entity(time_us, "arena", ARENA, cubes=[floor], lines=[_border(arena)]),
        _entity(time_us, "base", ARENA, cubes=[_solid(scenario.base.solid, _BASE)]),
    ]
    for gate in scenario.frames:
        bars = [_solid(bar, RGBA[gate.colour]) for bar in gate_solids(gate)]
        entities.append(_entity(time_us, f"{gate.colour} frame", ARENA, cubes=bars))
    obstacles = [
        _solid(bar, _DECOY_RGBA[decoy.colour]) for decoy in scenario.decoys for bar in gate_solids(decoy)
    ]
    obstacles += [_solid(prism, _PRISM) for prism in scenario.prisms]
    if obstacles:
        entities.append(_entity(time_us, "obstacles", ARENA, cubes=obstacles))
    length_m, width_m, height_m = load_airframe(scenario.airframe).envelope_m
    body = _cube((0.0, 0.0, 0.0), (length_m, width_m, height_m), _BODY)
    nose = _cube(
        (0.4 * length_m, 0.0, 0.6 * height_m), (0.2 * length_m, 0.2 * width_m, 0.2 * height_m), _NOSE
    )
    entities.append(_entity(time_us, "drone", DRONE, cubes=[body, nose]))
    return {"deletions": [], "entities": entities}


def camera_transform(scenario: Scenario, time_us: int) -> Message:
    """The camera's pose on the drone, in the axes of images: x right, y down, z forward."""
    camera = scenario.camera
    turned = multiply(mounting_flu(camera.mounting_frd_rad), (0.5, -0.5, 0.5, -0.5))
    rotation = dict(zip("wxyz", turned, strict=True))
    return _transform(time_us, (DRONE, CAMERA), camera.position_flu_m, rotation)


def calibration(scenario: Scenario, time_us: int) -> Message:
    """The camera of the scenario: a pinhole camera and the distortion of its lens."""
    camera = scenario.camera
    lens = LensDistortion() if camera.effects is None else camera.effects.lens
    matrix = camera_matrix(camera.width_px, camera.height_px, camera.horizontal_fov_rad).tolist()
    return {
        "timestamp": time_of(time_us),
        "frame_id": CAMERA,
        "width": camera.width_px,
        "height": camera.height_px,
        "distortion_model": "plumb_bob",
        "D": list(lens.coefficients),
        "K": [value for row in matrix for value in row],
        "R": [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        "P": [value for row in matrix for value in (*row, 0.0)],
    }


def _entity(time_us: int, name: str, axes: str, **primitives: list[Message]) -> Message:
    """An entity without an end that moves with its axes."""
    entity: dict[str, Any] = {
        "timestamp": time_of(time_us),
        "frame_id": axes,
        "id": name,
        "lifetime": {"sec": 0, "nsec": 0},
        "frame_locked": True,
        "metadata": [],
        "cubes": [],
        "spheres": [],
        "lines": [],
    }
    return {**entity, **primitives}


def _solid(solid: Solid, colour: Message) -> Message:
    x, y, z = solid.half_extents_m
    return _cube(solid.centre_arena_m, (2 * x, 2 * y, 2 * z), colour, solid.yaw_rad)


def _cube(centre_m: Vec3, size_m: Vec3, colour: Message, yaw_rad: float = 0.0) -> Message:
    pose = {"position": _vector(centre_m), "orientation": _yaw_quaternion(yaw_rad)}
    return {"pose": pose, "size": _vector(size_m), "color": colour}


def _border(arena: Arena) -> Message:
    """The twelve edges of the flying space."""
    x, y = arena.length_x_m / 2, arena.width_y_m / 2
    plan = ((x, y), (-x, y), (-x, -y), (x, -y))
    points: list[Vec3] = []
    for (x0, y0), (x1, y1) in zip(plan, (*plan[1:], plan[0]), strict=True):
        for z in (0.0, arena.height_m):
            points += [(x0, y0, z), (x1, y1, z)]
        points += [(x0, y0, 0.0), (x0, y0, arena.height_m)]
    return _lines(points, _BORDER, 1.0)


def _lines(ends: list[Vec3], colour: Message, thickness_px: float) -> Message:
    """Lines, each between two successive ends."""
    return {
        "type": 2,  # LINE_LIST
        "pose": {"position": _vector((0.0, 0.0, 0.0)), "orientation": _yaw_quaternion(0.0)},
        "thickness": thickness_px,
        "scale_invariant": True,
        "points": [_vector(point) for point in ends],
        "color": colour,
        "colors": [],
        "indices": [],
    }
