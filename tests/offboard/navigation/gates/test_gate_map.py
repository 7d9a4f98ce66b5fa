"""The map of gates, shown gates by an ideal finder from flights along known paths."""

from math import cos, pi, radians, sin

import numpy as np
import pytest

from offboard.navigation.gates.gate_track import half_turn
from offboard.navigation.search.likelihood import LineOfSight
from offboard.navigation.view import GateEstimate
from scenarios.models import Gate
from tests.offboard.navigation.sightings import Flight, gate_at


def errors(estimate: GateEstimate | None, gate: Gate) -> tuple[float, float]:
    """Errors of the position (metres) and the yaw (radians)."""
    assert estimate is not None
    away = np.subtract(estimate.position_m, gate.position_arena_m)
    return float(np.linalg.norm(away)), abs(half_turn(estimate.yaw_rad - gate.yaw_rad))


@pytest.mark.parametrize("angle_deg", [-60, -35, -10, 0, 20, 50])
def test_approach_makes_a_gate_certain_and_right(angle_deg: float) -> None:
    gate = gate_at(1.0, 2.0, 1.4, 2.6)
    flight = Flight(seed=angle_deg + 100)
    flight.approach(gate, radians(angle_deg), 4.0, 1.0)
    (estimate,) = flight.map.gates
    assert estimate.certain
    assert not estimate.ambiguous
    position_m, yaw_rad = errors(estimate, gate)
    assert position_m < 0.015
    assert yaw_rad < radians(2.0)
    assert estimate.seen_us == flight.time_us


def test_far_view_is_ambiguous_until_another_side_view_decides() -> None:
    gate = gate_at(0.0, 0.0, 1.5, 0.0)
    flight = Flight()
    flight.look([gate], (-4.5 * cos(0.7), -4.5 * sin(0.7), 1.5), 0.7)
    first = flight.map.best("red")
    assert first is not None
    assert first.ambiguous
    assert not first.certain
    for step in range(25):
        bearing = 0.7 - step * 0.04
        flight.look([gate], (-4.0 * cos(bearing), -4.0 * sin(bearing), 1.5), bearing)
    estimate = flight.map.best("red")
    assert estimate is not None
    assert not estimate.ambiguous
    assert errors(estimate, gate)[1] < radians(6.0)


def test_stated_deviations_are_those_of_the_errors() -> None:
    squares = []
    for seed in range(40):
        flight = Flight(seed)
        gate = gate_at(1.0, -1.0, 1.0 + seed / 40, seed / 7)
        flight.approach(gate, radians(3.0 * seed - 60.0), 4.0, 2.0)
        estimate = flight.map.best("red")
        assert estimate is not None
        away = np.subtract(estimate.position_m, gate.position_arena_m)
        yaw_rad = half_turn(estimate.yaw_rad - gate.yaw_rad)
        normalised = np.array((*away, yaw_rad)) / (*estimate.position_std_m, estimate.yaw_std_rad)
        squares.append(normalised**2)
    mean = np.mean(squares, axis=0)
    assert (mean > 0.3).all(), mean
    assert (mean < 1.7).all(), mean  # 1 is exact; of 40 samples 99.7 % are below


def test_view_from_one_place_does_not_become_certain_by_repetition() -> None:
    gate = gate_at(0.0, 0.0, 1.5, 0.0)
    flight = Flight()
    flight.approach(gate, 0.5, 4.0, 4.0)
    before = flight.map.best("red")
    for _ in range(5):
        flight.time_us += 100_000
        flight.random = np.random.default_rng(0)  # the same errors each time
        flight.look([gate], (4.0 * cos(0.5), 4.0 * sin(0.5), 1.5), 0.5 + pi)
    after = flight.map.best("red")
    assert before is not None
    assert after is not None
    assert after.views <= before.views + 1


def test_gate_seen_almost_edge_on_is_not_taken_for_its_mirror_image() -> None:
    gate = gate_at(0.0, 0.0, 1.5, 0.0)
    for seed in range(10):
        flight = Flight(seed)
        for step in range(8):
            bearing = pi / 2 - radians(9.0 - 0.3 * step)
            flight.look([gate], (-4.5 * cos(bearing), -4.5 * sin(bearing), 1.5), bearing)
        estimate = flight.map.best("red")
        assert estimate is not None
        assert estimate.ambiguous or errors(estimate, gate)[1] < 4.0 * estimate.yaw_std_rad


def test_two_gates_in_line_and_one_partly_seen_are_kept_apart() -> None:
    near, far = gate_at(0.0, 0.1, 1.5, 0.2), gate_at(2.0, -0.2, 1.4, -0.3, "green")
    flight = Flight(3)
    flight.approach(near, pi, 3.0, 0.5, (far,))
    red, green = flight.map.best("red"), flight.map.best("green")
    assert len(flight.map.gates) == 2
    assert errors(red, near)[0] < 0.015
    assert errors(green, far)[0] < 0.06
    # So near that only a part of it is in the image, what is seen still counts.
    assert red is not None
    flight.look([near, far], (-0.3, 0.25, 1.5), 0.2)
    after = flight.map.best("red")
    assert after is not None
    assert after.seen_us == flight.time_us


def test_two_gates_of_one_colour_are_two() -> None:
    gates = [gate_at(0.0, 0.5, 1.5, 0.0, "red"), gate_at(0.0, -0.5, 1.2, 0.4)]
    flight = Flight(4)
    for step in range(20):
        flight.look(gates, (-3.5 + step * 0.1, 0.0, 1.4), 0.0)
    found = sorted(flight.map.gates, key=lambda estimate: -estimate.position_m[1])
    assert len(found) == 2
    for estimate, gate in zip(found, gates, strict=True):
        assert errors(estimate, gate)[0] < 0.05


def test_ghost_is_forgotten_and_a_hidden_gate_is_not() -> None:
    gate, ghost = gate_at(1.0, 0.0, 1.5, 0.0, "green"), gate_at(0.5, 1.0, 1.5, 0.0)
    flight = Flight()
    flight.look([gate, ghost], (-2.0, 0.0, 1.5), 0.0)
    assert flight.map.best("red") is not None
    for step in range(4):
        flight.look([gate], (-2.0 + 0.1 * step, 0.0, 1.5), 0.0)
    assert flight.map.best("red") is None
    before = gate_at(0.0, 0.0, 1.5, 0.0, "blue")
    flight.look([gate, before], (-1.6, 0.0, 1.5), 0.0)
    for step in range(30):  # the blue gate hides the green one
        flight.look([before], (-1.5, 0.01 * step, 1.5), 0.0)
    assert {estimate.colour for estimate in flight.map.gates} == {"green", "blue"}


def test_wrong_start_is_corrected_by_the_images() -> None:
    truth, wrong = gate_at(0.0, 0.0, 1.5, 0.5), gate_at(0.1, 0.05, 1.45, -0.4)
    flight = Flight(1)
    flight.approach(wrong, 0.4, 2.5, 2.0)
    assert errors(flight.map.best("red"), wrong)[0] < 0.03
    flight.approach(truth, -0.5, 2.5, 1.0)
    (estimate,) = flight.map.gates
    position_m, yaw_rad = errors(estimate, truth)
    assert position_m < 0.015
    assert yaw_rad < radians(2.0)


def test_certain_gate_replaces_one_that_was_seen_badly_beside_it() -> None:
    truth, wrong = gate_at(0.0, 0.0, 1.5, 0.5), gate_at(0.3, -0.3, 1.3, 0.5)
    flight = Flight(1)
    for step in range(30):
        flight.look([wrong], (-4.0, -1.0 + 0.01 * step, 1.4), 0.2)
    believed = flight.map.best("red")
    assert believed is not None
    assert not believed.certain
    flight.approach(truth, pi, 2.0, 1.0)
    flight.look([], (-1.0, 0.0, 1.5), 0.5)  # an image that should show it
    (estimate,) = flight.map.gates
    assert estimate.certain
    assert errors(estimate, truth)[0] < 0.015


def test_gate_far_outside_the_arena_is_none() -> None:
    flight = Flight()
    for step in range(5):
        flight.look([gate_at(6.5, 0.0, 1.5, 0.0)], (4.0 + 0.1 * step, 0.0, 1.5), 0.0)
    assert flight.map.gates == ()


def test_gate_that_seems_to_be_outside_is_on_the_map_when_it_is_seen_inside() -> None:
    """Where something hides a part of a gate, it looks smaller and farther away than it is."""
    flight = Flight(3)
    for step in range(8):
        flight.look([gate_at(5.4, 0.0, 1.5, 0.0)], (2.0 + 0.1 * step, 0.0, 1.5), 0.0)
    assert flight.map.best("red") is None
    for step in range(8):
        flight.look([gate_at(4.9, 0.0, 1.5, 0.0)], (2.8 + 0.1 * step, 0.0, 1.5), 0.0)
    (estimate,) = flight.map.gates
    assert estimate == flight.map.best("red")
    assert errors(estimate, gate_at(4.9, 0.0, 1.5, 0.0))[0] < 0.1


def test_outline_that_is_partly_hidden_does_not_replace_a_known_gate() -> None:
    gate = gate_at(0.0, 0.0, 1.5, 0.3)
    flight = Flight(2)
    flight.approach(gate, 0.2, 3.0, 1.5)
    for step in range(20):  # a pole passes before one of its sides
        hidden_m = 0.2 - 0.005 * step
        shift_m = hidden_m / 2
        seen = gate.model_copy(
            update={
                "outer_width_m": gate.outer_width_m - hidden_m,
                "x_m": -shift_m * sin(gate.yaw_rad),
                "y_m": shift_m * cos(gate.yaw_rad),
            }
        )
        bearing = 0.5 + 0.02 * step
        flight.look([seen], (1.5 * cos(bearing), 1.5 * sin(bearing), 1.5), bearing + pi)
    (estimate,) = flight.map.gates
    assert errors(estimate, gate)[0] < 0.015


def test_gate_seen_once_is_forgotten_and_one_seen_often_is_kept() -> None:
    glimpse, known = gate_at(2.0, 0.5, 1.5, 0.0), gate_at(2.0, -0.5, 1.5, 0.0, "green")
    flight = Flight(5)
    flight.look([glimpse, known], (-1.0, 0.0, 1.5), 0.0)
    for _ in range(4):
        flight.look([known], (1.0, -0.5, 1.5), 0.0)
    for _ in range(60):
        flight.look([], (-1.0, 0.0, 1.5), pi)
    assert [estimate.colour for estimate in flight.map.gates] == ["green"]


def picture(size: float, x: float, y: float, z: float, yaw: float) -> Gate:
    """A picture of a gate, so many times as large."""
    size_m = {"outer_width_m": 0.42 * size, "outer_height_m": 0.22 * size}
    return Gate.model_validate({"colour": "red", "x_m": x, "y_m": y, "z_m": z, "yaw_rad": yaw, **size_m})


@pytest.mark.parametrize("heading_deg", [0, 40, -70])
@pytest.mark.parametrize("size", [1.4, 1.8, 2.5])
def test_a_picture_of_another_size_is_no_gate(size: float, heading_deg: int) -> None:
    on_wall = picture(size, 6.5, 0.5, 2.0, pi)
    flight = Flight(seed=round(10 * size))
    for step in range(40):
        along_m = 0.1 * step
        place = (1.0 + along_m * cos(radians(heading_deg)), along_m * sin(radians(heading_deg)), 1.5)
        flight.look([on_wall], place, 0.0)
    assert flight.map.gates == ()
    ahead = LineOfSight((0.0, 0.5, 2.0), (1.0, 0.0, 0.0))
    aside = LineOfSight((0.0, 2.0, 2.0), (1.0, 0.0, 0.0))
    assert [flight.map.is_lookalike("red", line) for line in (ahead, aside)] == [True, False]
    assert not flight.map.is_lookalike("blue", ahead)
    flight.map.forget("red")
    assert not flight.map.is_lookalike("red", ahead)


def test_a_gate_before_a_picture_of_its_colour_stays_on_the_map() -> None:
    on_wall, gate = picture(2.3, 6.5, -1.0, 2.2, pi), gate_at(3.5, 1.0, 1.2, 0.3)
    flight = Flight()
    for step in range(35):
        flight.look([on_wall, gate], (0.02 * step, -2.0 + 0.1 * step, 1.5), 0.1)
    (estimate,) = flight.map.gates
    position_m, _ = errors(estimate, gate)
    assert position_m < 0.1


@pytest.mark.parametrize("seed", range(12))
def test_a_gate_is_not_taken_for_a_picture(seed: int) -> None:
    gate = gate_at(2.5, 0.3 * seed - 1.5, 1.0 + 0.1 * seed, 0.5 * seed)
    flight = Flight(seed)
    for step in range(40):
        bearing = 0.15 * seed * step / 10
        flight.look([gate], (-2.0 + 0.08 * step * cos(bearing), 0.08 * step * sin(bearing), 1.5), 0.0)
        assert flight.map.best("red") is not None or step < 10
    assert not flight.map.is_lookalike("red", LineOfSight((-2.0, gate.y_m, gate.z_m), (1.0, 0.0, 0.0)))


@pytest.mark.parametrize("heading_deg", [0, 12, 60, -60])
@pytest.mark.parametrize("size", [1.5, 1.9, 2.7])
def test_a_larger_thing_elsewhere_is_never_certain(size: float, heading_deg: int) -> None:
    """The drone looks around, flies on as to a gate, stops and looks around again."""
    on_wall = picture(size, 7.0, 0.5, 1.8, pi)
    for seed in range(3):
        flight = Flight(seed)
        for step in range(70):
            along_m = 0.06 * (min(max(step - 10, 0), 20) + min(max(step - 45, 0), 20))
            place = (
                7.0 - 2.1 * size + along_m * cos(radians(heading_deg)),
                along_m * sin(radians(heading_deg)),
                1.2,
            )
            flight.look([on_wall], place, 0.3 * sin(0.7 * step))
            assert not any(estimate.certain for estimate in flight.map.gates), (seed, step)


def test_a_gate_is_certain_only_after_a_way_that_shows_its_size() -> None:
    gate = gate_at(2.0, 0.0, 1.5, 0.4)
    flight = Flight()
    for step in range(30):
        flight.look([gate], (0.5, 0.2, 1.4), 0.25 * sin(0.6 * step))
    before = flight.map.best("red")
    assert before is not None
    assert before.views > 10
    assert not before.certain
    for step in range(8):
        flight.look([gate], (0.5 + 0.05 * step, 0.2, 1.4), 0.25 * sin(0.6 * step))
    after = flight.map.best("red")
    assert after is not None
    assert after.certain
