"""The painted camera: geometry against cv2.projectPoints and a ray tracer, and its behaviour at odd poses."""

from math import atan2, cos, inf, nan, pi, sin

import cv2
import numpy as np
import numpy.typing as npt
import pytest

from framerunner.geometry.solids import Solid
from framerunner.geometry.vectors import Quaternion, Vec3
from scenarios.models import Arena, Base, Camera, Decoy, Doorway, Gate, Light, Pole, Scenario, Wall
from sitl.camera import SimulatedCamera as PaintedCamera
from sitl.camera_projection import SUBPIXELS, Mesh, Pinhole
from sitl.camera_scene import GROUND_BGR, SKY_BGR, build_scene
from sitl.optics.painter import Image
from sitl.solids import gate_solids
from sitl.video import encode_jpeg
from vision.detector import detect
from vision.types import NOT_SEEN

MIXED, SKY, GROUND, TATAMI, BASE, RED, GREEN, BLUE, CYAN, MAGENTA, VIOLET = range(-1, 10)
CLASSES = {"base": BASE, "red": RED, "green": GREEN, "blue": BLUE}
CLASSES |= {"cyan": CYAN, "magenta": MAGENTA, "pole": VIOLET, "wall": VIOLET}
OVERSAMPLING = 3


def gate(colour: str, x: float, y: float, z: float, yaw: float) -> Gate:
    return Gate.model_validate({"colour": colour, "x_m": x, "y_m": y, "z_m": z, "yaw_rad": yaw})


GATES = (gate("red", 3, 2, 2, 3), gate("green", -2, 1, 0.5, 2), gate("blue", 3, -1, 1, 1))
SCENARIO = Scenario(name="scene", base=Base(x_m=-3, y_m=-3), frames=GATES)


def quaternion(yaw: float, pitch: float = 0.0, roll: float = 0.0) -> Quaternion:
    """Attitude FLU to arena from Z-Y-X angles; positive pitch is nose down."""
    cy, sy, cp, sp, cr, sr = (f(a / 2) for a in (yaw, pitch, roll) for f in (cos, sin))
    return (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    )


def rotation(q: Quaternion) -> npt.NDArray[np.float64]:
    """Rotation matrix by another method than the camera's: turn each axis by q v q*."""
    w, v = q[0], np.array(q[1:])
    return np.array([e + 2 * np.cross(v, np.cross(v, e) + w * e) for e in np.eye(3)]).T


def eye(scenario: Scenario, position: Vec3, q: Quaternion) -> npt.NDArray[np.float64]:
    return np.array(position) + rotation(q) @ np.array(scenario.camera.position_flu_m)


def focal(camera: Camera) -> float:
    return float(camera.width_px / 2 / np.tan(camera.horizontal_fov_rad / 2))


def outer_corners(one: Gate) -> npt.NDArray[np.float64]:
    c, s = cos(one.yaw_rad), sin(one.yaw_rad)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    half = np.array([one.bar_m, one.outer_width_m, one.outer_height_m]) / 2
    signs = np.array([(a, b, d) for a in (-1, 1) for b in (-1, 1) for d in (-1, 1)])
    return np.array(one.position_arena_m) + (signs * half) @ turn.T


def projected(
    scenario: Scenario, points: npt.NDArray[np.float64], position: Vec3, q: Quaternion
) -> npt.NDArray[np.float64]:
    """Exact image of arena points by OpenCV, pixels, shape (k, 2)."""
    camera = scenario.camera
    f = focal(camera)
    matrix = np.array([[f, 0, (camera.width_px - 1) / 2], [0, f, (camera.height_px - 1) / 2], [0, 0, 1]])
    to_camera = np.array([[0, -1, 0], [0, 0, -1], [1, 0, 0]]) @ rotation(q).T
    rvec, _ = cv2.Rodrigues(to_camera)
    image, _ = cv2.projectPoints(points, rvec, -to_camera @ eye(scenario, position, q), matrix, None)
    return image.reshape(-1, 2)


def facing(
    one: Gate, distance: float, turn: float = 0.0, side: float = 0.0, up: float = 0.0
) -> tuple[Vec3, Quaternion]:
    """Pose whose camera stands before a gate, `turn` round it, looking at its centre (moved by side, up)."""
    yaw = one.yaw_rad + turn
    x = one.x_m - distance * cos(yaw) - side * sin(yaw) - 0.08 * cos(yaw)
    y = one.y_m - distance * sin(yaw) + side * cos(yaw) - 0.08 * sin(yaw)
    return (x, y, one.z_m + up), quaternion(yaw)


def palette(scenario: Scenario) -> dict[int, int]:
    """What every painted colour stands for."""
    scene = build_scene(scenario)
    names = [BASE, *(CLASSES[one.colour] for one in scenario.all_gates)]
    names += [CLASSES[prism.name] for prism in scenario.prisms]
    colours = [(colour, SKY) for colour in SKY_BGR] + [(GROUND_BGR, GROUND), (scene.tatami.colour, TATAMI)]
    colours += [(face.colour, TATAMI) for face in scene.mats]
    for face in scene.shadows:
        on_tatami = face.colour[2] > 1.5 * face.colour[0]  # it is golden, the ground is grey
        colours.append((face.colour, TATAMI if on_tatami else GROUND))
    for name, body in zip(names, scene.bodies, strict=True):
        colours += [(face.colour, name) for face in body.faces]
    known: dict[int, int] = {}
    for (b, g, r), name in colours:
        assert known.setdefault(b << 16 | g << 8 | r, name) == name, "two things of one colour"
    return known


def classes(image: Image, scenario: Scenario) -> npt.NDArray[np.int64]:
    """What every pixel shows, by its colour; those that show several things are mixed."""
    codes = image.astype(np.int64) @ np.array([1 << 16, 1 << 8, 1])
    result = np.full(codes.shape, MIXED)
    for code, name in palette(scenario).items():
        result[codes == code] = name
    assert (result != MIXED).mean() > 0.5
    return result


def traced(scenario: Scenario, position: Vec3, q: Quaternion, n: int = OVERSAMPLING) -> npt.NDArray[np.int64]:
    """What every part of a pixel shows, by ray tracing.

    Shape (height + 2, width + 2) times n: with a border of one pixel around the image.
    """
    camera = scenario.camera
    u = (np.arange((camera.width_px + 2) * n) + 0.5) / n - 1.5 - (camera.width_px - 1) / 2
    v = (np.arange((camera.height_px + 2) * n) + 0.5) / n - 1.5 - (camera.height_px - 1) / 2
    right, down = (grid.ravel() / focal(camera) for grid in np.meshgrid(u, v))
    rays = np.stack([np.ones_like(right), -right, -down], axis=1) @ rotation(q).T
    origin = eye(scenario, position, q)
    to_floor = np.where(rays[:, 2] < 0, -origin[2] / np.where(rays[:, 2] < 0, rays[:, 2], -1.0), inf)
    nearest, result = to_floor.copy(), np.where(to_floor < inf, GROUND, SKY)
    with np.errstate(invalid="ignore", over="ignore"):
        place = origin[:2] + np.where(to_floor < inf, to_floor, 0.0)[:, None] * rays[:, :2]
    result[(to_floor < inf) & (abs(place) <= 5).all(axis=1)] = TATAMI
    solids = [scenario.base.solid] + [bar for one in scenario.all_gates for bar in gate_solids(one)]
    solids += scenario.prisms
    for solid in solids:
        entry = entry_of_rays(solid, origin, rays)
        hit = entry < nearest
        nearest[hit], result[hit] = entry[hit], CLASSES[solid.name]
    return result.reshape((camera.height_px + 2) * n, (camera.width_px + 2) * n)


def entry_of_rays(
    solid: Solid, origin: npt.NDArray[np.float64], rays: npt.NDArray[np.float64]
) -> npt.NDArray[np.float64]:
    """Slab method: depth at which rays enter a box from outside, inf where they do not."""
    c, s = cos(solid.yaw_rad), sin(solid.yaw_rad)
    turn = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    start, direction = turn @ (origin - np.array(solid.centre_arena_m)), rays @ turn.T
    half = np.array(solid.half_extents_m)
    with np.errstate(divide="ignore", invalid="ignore"):
        one, other = (-half - start) / direction, (half - start) / direction
    entry, leave = np.minimum(one, other).max(axis=1), np.maximum(one, other).min(axis=1)
    return np.where((entry < leave) & (entry > 0.01), entry, inf)


def wrong_pixels(scenario: Scenario, position: Vec3, q: Quaternion) -> npt.NDArray[np.bool_]:
    """Pixels that show what is nowhere within a pixel of them by ray tracing."""
    painted = classes(PaintedCamera(scenario).render(position, q), scenario)
    truth, n = traced(scenario, position, q), OVERSAMPLING
    height, width = painted.shape
    wrong = np.zeros(painted.shape, np.bool_)
    for name in range(VIOLET + 1):
        around = cv2.dilate((truth == name).astype(np.uint8), np.ones((2 * n + 1, 2 * n + 1), np.uint8))
        pixels = around.reshape(height + 2, n, width + 2, n).max(axis=(1, 3))
        wrong |= (painted == name) & (pixels[1:-1, 1:-1] == 0)
    return wrong


SMALL = SCENARIO.model_copy(update={"camera": Camera(width_px=96, height_px=72)})
WALL = Scenario(
    name="crowd",
    camera=Camera(width_px=96, height_px=72),
    frames=(
        gate("red", 0.8, -0.15, 1.0, 0.0),
        gate("green", 0.65, 0.15, 0.95, 1.2),
        gate("blue", 0.6, 0.1, 1.2, 0.5),
    ),
    base=Base(x_m=1.2, y_m=0.2, top_m=0.8),
)


CROWD = SMALL.model_copy(
    update={
        "decoys": (
            Decoy(colour="cyan", x_m=0.9, y_m=1.2, z_m=1.0, yaw_rad=1.4),
            Decoy(colour="magenta", x_m=0.2, y_m=-3, z_m=1.5, yaw_rad=0.3),
        ),
        "poles": (Pole(x_m=-1.5, y_m=-1.5), Pole(x_m=4.8, y_m=2.2), Pole(x_m=0.9, y_m=-2.5, height_m=1.5)),
        "walls": (Wall(x_m=0, y_m=-2, end_x_m=1, end_y_m=3, doorway=Doorway(offset_m=3.3)),),
    }
)


@pytest.mark.parametrize("seed", range(12))
def test_agrees_with_a_ray_tracer_anywhere(seed: int) -> None:
    rng = np.random.default_rng(seed)
    x, y, z = rng.uniform((-5, -5, 0.05), (5, 5, 4))
    yaw, pitch, roll = rng.uniform((-pi, -0.6, -0.6), (pi, 0.6, 0.6))
    assert not wrong_pixels(SMALL, (x, y, z), quaternion(yaw, pitch, roll)).any()


@pytest.mark.parametrize("seed", range(12))
def test_agrees_with_a_ray_tracer_upside_down_and_close_to_the_floor(seed: int) -> None:
    rng = np.random.default_rng(100 + seed)
    x, y, z = rng.uniform((-5, -5, 0.1), (5, 5, 0.3))
    yaw, pitch, roll = rng.uniform((-pi, -pi / 2, -pi), (pi, pi / 2, pi))
    assert not wrong_pixels(SMALL, (x, y, z), quaternion(yaw, pitch, roll)).any()


@pytest.mark.parametrize("seed", range(10))
def test_agrees_with_a_ray_tracer_between_obstacles(seed: int) -> None:
    rng = np.random.default_rng(400 + seed)
    position = rng.uniform((-5, -5, 0.1), (5, 5, 4.5))
    if any(solid.distance_m(position) < 0.15 for solid in CROWD.prisms):
        position[0] -= 0.5
    aim = rng.uniform((-0.5, -2.5, 0.5), (1.5, 3.0, 3.0)) - position  # at the wall and what is around it
    pitch, roll = atan2(-aim[2], np.hypot(aim[0], aim[1])), rng.uniform(-0.3, 0.3)
    x, y, z = position
    assert not wrong_pixels(CROWD, (x, y, z), quaternion(atan2(aim[1], aim[0]), pitch, roll)).any()


@pytest.mark.parametrize("seed", range(24))
def test_agrees_with_a_ray_tracer_close_to_gates_and_through_them(seed: int) -> None:
    rng = np.random.default_rng(200 + seed)
    one = GATES[seed % 3]
    distance, turn, side, up = rng.uniform((-0.05, -0.6, -0.12, -0.05), (0.5, 0.6, 0.12, 0.05))
    position, q = facing(one, distance, turn, side, up)
    assert not wrong_pixels(SMALL, position, q).any()


@pytest.mark.parametrize("seed", range(36))
def test_things_before_each_other_hide_rightly(seed: int) -> None:
    rng = np.random.default_rng(300 + seed)
    around, distance, height = rng.uniform((-pi, 0.5, 0.3), (pi, 1.5, 1.8))
    x, y = 0.8 - distance * cos(around), 0.1 - distance * sin(around)
    assert not wrong_pixels(WALL, (x, y, height), quaternion(around, (height - 1) / distance)).any()


def test_nearer_gate_hides_the_farther_one_from_both_sides() -> None:
    gates = (gate("red", -1, 0, 1, 0), gate("green", 1, 0, 1, 0))
    camera = PaintedCamera(Scenario(name="two", frames=gates, base=Base(x_m=4, y_m=4)))
    bar = 0.1  # height of the upper bars above the middle: both are seen along one line
    from_behind = camera.render((-2.08, 0, 1 + bar), quaternion(0))
    from_ahead = camera.render((2.08, 0, 1 + bar), quaternion(pi))
    assert from_behind[119, 160, 2] > 100
    assert from_behind[119, 160, 1] == 0
    assert from_ahead[119, 160, 1] > 100
    assert from_ahead[119, 160, 2] == 0


def test_projection_is_that_of_opencv() -> None:
    rng = np.random.default_rng(1)
    scene = build_scene(SCENARIO)
    faces = [face for body in scene.bodies for face in body.faces]
    corners = np.concatenate([face.corners_arena_m for face in faces])
    settings = SCENARIO.camera
    mesh = Mesh(
        faces,
        [],
        Pinhole(settings.width_px, settings.height_px, focal(settings), settings.near_m, settings.far_m),
    )
    compared = 0
    for _ in range(50):
        x, y, z = rng.uniform((-5, -5, 0.1), (5, 5, 4))
        q = quaternion(*rng.uniform((-pi, -1, -1), (pi, 1, 1)))
        turn, place = rotation(q), eye(SCENARIO, (x, y, z), q)
        rows = tuple((float(a), float(b), float(c)) for a, b, c in turn)
        u, v, w = mesh.project(tuple(place.tolist()), rows).corners[:3]
        pixels = np.array([u, v]).T / (w[:, None] * SUBPIXELS)
        depth = (corners - place) @ turn[:, 0]
        exact = projected(SCENARIO, corners, (x, y, z), q)
        usable = (depth > 0.05) & (abs(exact) < 1e4).all(axis=1)
        compared += int(usable.sum())
        assert (abs(pixels - exact)[usable] <= 1e-6).all()
    assert compared > 1000


EVEN = Light(sun_direction_arena=(0.3, 0.3, 0.1), ambient=1.0)  # no shades, no shadows


def share_of_gate(camera: Camera, one: Gate, position: Vec3, q: Quaternion) -> npt.NDArray[np.float64]:
    """Which share of every pixel a green gate fills, by how much it dims the blue of what is behind it."""
    alone = Scenario(name="alone", frames=(one,), base=Base(x_m=-4.5, y_m=4.5), light=EVEN, camera=camera)
    without = PaintedCamera(alone.model_copy(update={"frames": ()})).render(position, q)
    shown = PaintedCamera(alone).render(position, q)
    return 1.0 - shown[:, :, 0] / without[:, :, 0].astype(np.float64)


def test_a_pixel_is_filled_by_the_share_that_a_gate_covers() -> None:
    n = 6
    rng = np.random.default_rng(2)
    one, camera = gate("green", 0, 0, 2, 0.4), Camera(width_px=96, height_px=72, horizontal_fov_rad=0.6)
    alone = Scenario(name="alone", frames=(one,), base=Base(x_m=-4.5, y_m=4.5), camera=camera)
    beyond, square, edges = [], [], []
    for _ in range(20):
        distance, turn, side, up = rng.uniform((1.0, -1.3, -0.2, -0.2), (9, 1.3, 0.2, 0.2))
        position, q = facing(one, distance, turn, side, up)
        q = quaternion(one.yaw_rad + turn, 0.0, rng.uniform(-0.3, 0.3))
        shown = share_of_gate(camera, one, position, q)
        covered = traced(alone, position, q, n) == GREEN
        true = covered.reshape(74, n, 98, n).mean(axis=(1, 3))[1:-1, 1:-1]
        error = shown - true
        # Across every column and row the edges of the gate are crossed so many times.
        edges.append(np.hypot(abs(np.diff(true, axis=0)).sum(), abs(np.diff(true, axis=1)).sum()))
        beyond.append(error.sum())
        square.append((error * error).sum())
    assert abs(sum(beyond) / sum(edges)) < 0.03  # pixels on each side
    assert np.sqrt(sum(square) / sum(edges)) < 0.12


def test_nothing_shows_through_between_the_faces_of_a_bar() -> None:
    one, around = gate("green", 0, 0, 2, 0.0), np.ones((3, 3), np.uint8)
    for turn in np.linspace(-1.2, 1.2, 25).tolist():
        position, _ = facing(one, 0.35, turn, 0.05, 0.1)  # its bars are some ten pixels wide
        filled = share_of_gate(Camera(), one, position, quaternion(turn))
        closed = cv2.morphologyEx((filled > 0.5).astype(np.uint8), cv2.MORPH_CLOSE, around)
        inside = cv2.erode(closed, around)[2:-2, 2:-2] == 1
        assert inside.sum() > 500
        assert filled[2:-2, 2:-2][inside].min() > 0.98


@pytest.mark.parametrize("distance", [6.0, 8.0, 10.0])
def test_bars_thinner_than_a_pixel_fade_and_do_not_vanish(distance: float) -> None:
    one, camera = gate("green", 0, 0, 1.5, 0), Camera()
    for roll in (0.0, 0.1, 0.3):
        position, _ = facing(one, distance, 0.2, 0.1, 0.1)
        filled = share_of_gate(camera, one, position, quaternion(0.2, 0.0, roll))
        bar_px = focal(camera) * one.bar_m / distance
        around_px = 2 * focal(camera) * (one.outer_width_m * cos(0.2) + one.outer_height_m) / distance
        assert filled.sum() == pytest.approx(around_px * bar_px, rel=0.25)
        assert filled.max() < 0.95
        # In every column that the gate spans, and in every row.
        columns, rows = (np.nonzero(filled.sum(axis=axis) > 0.3 * bar_px)[0] for axis in (0, 1))
        assert (np.diff(columns) == 1).all()
        assert (np.diff(rows) == 1).all()


@pytest.mark.parametrize("ambient", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("sun", [(-0.5, 0.1, -0.9), (0.3, 0.3, 0.1), (0.0, 0.0, -1.0)])
def test_gates_keep_their_colour_in_light_and_shade(ambient: float, sun: Vec3) -> None:
    scenario = SCENARIO.model_copy(update={"light": Light(ambient=ambient, sun_direction_arena=sun)})
    for body, one in zip(build_scene(scenario).bodies[1:], GATES, strict=True):
        shown = ("blue", "green", "red").index(one.colour)
        for face in body.faces:
            others = [face.colour[i] for i in range(3) if i != shown]
            assert others == [0, 0]
            assert face.colour[shown] > 60


@pytest.mark.parametrize("ambient", [0.0, 0.5, 1.0])
def test_nothing_but_gates_has_a_gate_colour(ambient: float) -> None:
    bare = SCENARIO.model_copy(update={"frames": (), "light": Light(ambient=ambient)})
    camera = PaintedCamera(bare)
    for yaw in (0.5, 2.0, 4.0):
        image = camera.render((-3.5, -3.5, 1.0), quaternion(yaw, 0.3)).astype(int)
        b, g, r = image[:, :, 0], image[:, :, 1], image[:, :, 2]
        for shown, following, other in ((r, g, b), (g, b, r), (b, r, g)):
            # Well away from the detector's limits, so that compression cannot bring it over them.
            assert not ((shown - following > 35) & (abs(following - other) < 30)).any()


@pytest.mark.parametrize("ambient", [0.0, 0.5, 1.0])
def test_the_papers_detector_sees_no_obstacle(ambient: float) -> None:
    # Without decoys: where cyan and the golden floor share a pixel, that is green.
    bare = {"frames": (), "decoys": (), "camera": Camera(), "light": Light(ambient=ambient)}
    scenario = CROWD.model_copy(update=bare)
    camera, rng = PaintedCamera(scenario), np.random.default_rng(7)
    for yaw in np.linspace(-pi, pi, 8, endpoint=False):
        x, y = 0.5 - 3.5 * cos(yaw), 0.5 - 3.5 * sin(yaw)
        image = camera.render((x, y, float(rng.uniform(0.5, 3.0))), quaternion(float(yaw)))
        sent = cv2.imdecode(np.frombuffer(encode_jpeg(image), np.uint8), cv2.IMREAD_COLOR)
        for each in (image, sent):
            found = detect(np.ascontiguousarray(each))
            assert (found.red, found.green, found.blue) == (NOT_SEEN,) * 3


@pytest.mark.parametrize(
    ("position", "q"),
    [
        ((3.0, 2.0, 2.1), quaternion(3)),
        ((-3.0, -3.0, 0.3), quaternion(0)),
        ((0.0, 0.0, 1.0), quaternion(0, 0, pi)),
        ((0.0, 0.0, 1.0), quaternion(0, pi / 2)),
        ((0.0, 0.0, 1.0), quaternion(0, -pi / 2)),
        ((0.0, 0.0, -1.0), quaternion(0)),
        ((0.0, 0.0, 0.0), quaternion(0)),
        ((0.0, 0.0, 1e-9), quaternion(1)),
        ((1e4, 1e4, 1e4), quaternion(-2.4, 0.6)),
        ((-1e300, 1e300, 1e300), quaternion(0)),
        ((3.0 - 0.08, 2.0, 2.0), (1.0, 0.0, 0.0, 0.0)),
        ((3.0 - 0.08, 2.0, 2.0), (2.0, 0.0, 0.0, 0.0)),
    ],
)
@pytest.mark.filterwarnings("error")
def test_odd_poses_give_an_image(position: Vec3, q: Quaternion) -> None:
    image = PaintedCamera(SCENARIO).render(position, q)
    assert image.shape == (240, 320, 3)
    assert image.dtype == np.uint8


@pytest.mark.filterwarnings("error")
def test_corners_exactly_on_the_near_plane_and_on_the_eye() -> None:
    camera = PaintedCamera(SCENARIO.model_copy(update={"camera": Camera(position_flu_m=(0.0, 0.0, 0.0))}))
    for corner in outer_corners(GATES[2]):
        for depth in (0.0, 0.01):
            x, y, z = corner.tolist()
            camera.render((x - depth, y, z), (1.0, 0.0, 0.0, 0.0))


@pytest.mark.filterwarnings("error")
def test_extreme_settings_give_an_image() -> None:
    narrow = Camera(width_px=64, height_px=64, horizontal_fov_rad=0.11, near_m=0.001)
    wide = Camera(width_px=64, height_px=48, horizontal_fov_rad=2.99)
    large = Arena(length_x_m=1000, width_y_m=1000)
    for settings in (narrow, wide):
        scenario = SCENARIO.model_copy(update={"camera": settings, "arena": large})
        for yaw in (0.0, 1.0, 2.5):
            assert PaintedCamera(scenario).render((0.0, 0.0, 1.0), quaternion(yaw, 0.2)).shape[1] == 64


@pytest.mark.parametrize("position", [(nan, 0.0, 1.0), (0.0, inf, 1.0), (0.0, 0.0, -inf)])
def test_position_must_be_finite(position: Vec3) -> None:
    with pytest.raises(ValueError, match="position_arena_m: every component must be finite"):
        PaintedCamera(SCENARIO).render(position, quaternion(0))


@pytest.mark.parametrize("q", [(nan, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0), (inf, 0.0, 0.0, 0.0)])
def test_attitude_must_be_a_rotation(q: Quaternion) -> None:
    with pytest.raises(ValueError, match="attitude_arena: need a finite quaternion"):
        PaintedCamera(SCENARIO).render((0.0, 0.0, 1.0), q)


def test_same_pose_same_image_and_a_new_one_each_time() -> None:
    first, second = PaintedCamera(SCENARIO), PaintedCamera(SCENARIO)
    pose = facing(GATES[0], 1.0, 0.3)
    image = first.render(*pose)
    first.render((0.0, 0.0, 1.0), quaternion(1))
    again = first.render(*pose)
    assert np.array_equal(image, again)
    assert np.array_equal(image, second.render(*pose))
    assert not np.shares_memory(image, again)


def test_gates_beyond_the_far_plane_are_not_seen() -> None:
    one = gate("red", 4, 0, 1, 0)
    for far, seen in ((20.0, True), (5.0, False)):
        scenario = Scenario(name="far", frames=(one,), camera=Camera(far_m=far))
        image = PaintedCamera(scenario).render((-4.0, 0.0, 1.0), quaternion(0))
        without = PaintedCamera(scenario.model_copy(update={"frames": ()})).render(
            (-4.0, 0.0, 1.0), quaternion(0)
        )
        redder = (image[:, :, 2].astype(int) - image[:, :, 1]) - (
            without[:, :, 2].astype(int) - without[:, :, 1]
        )
        assert (redder > 25).any() == seen


def test_shadow_lies_where_the_sun_throws_it() -> None:
    one = gate("red", 0, 0, 1, 0)
    scenario = Scenario(name="sun", frames=(one,), base=Base(x_m=4, y_m=4))
    down = quaternion(0, pi / 2)
    # Sun (-0.5, 0.1, -0.9): the middle of the lower bar's shadow lies at its height times (-5, 1) / 9.
    x, y = 0.9 * -5 / 9, 0.9 / 9
    image = PaintedCamera(scenario).render((x, y, 0.8), down)
    lit = PaintedCamera(scenario.model_copy(update={"frames": ()})).render((x, y, 0.8), down)
    middle = (slice(118, 122), slice(158, 162))
    assert image[middle].mean() < 0.8 * lit[middle].mean()


def test_no_gates_and_empty_floor() -> None:
    image = PaintedCamera(Scenario(name="empty")).render((-3.0, 0.0, 1.0), quaternion(atan2(0.0, 1.0)))
    assert set(np.unique(classes(image, Scenario(name="empty")))) == {MIXED, SKY, GROUND, TATAMI, BASE}
