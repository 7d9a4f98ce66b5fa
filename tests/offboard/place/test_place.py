"""The estimate of the place on flights whose vehicle drifts, by what the navigator's world model returns."""

from dataclasses import dataclass, replace
from math import cos, hypot, pi, remainder, sin

import numpy as np
import pytest

from framerunner.geometry.rotations import quaternion_from_euler, rotation, to_body
from framerunner.geometry.vectors import turned
from offboard.drone import DroneState, ImuInterval, ReportedAccuracy
from offboard.navigation.goals import CONTEST, PathGate
from offboard.navigation.view import GateEstimate, Surroundings
from offboard.navigation.world_model import WorldModel
from offboard.place.inertial_track import GRAVITY_M_S2
from scenarios.models import Arena, Base, Camera
from tests.offboard.navigation.sightings import STD_PX, corners_px, gate_at
from vision.types import Detections, GateCorner, GateSighting

TICK_US, IMU_US, IMAGE_US, LATE_US = 50_000, 10_000, 150_000, 100_000
FLOW = ReportedAccuracy(0.2, 0.05, 0.04, 0.03, 0.02)
MOCAP = ReportedAccuracy(0.003, 0.003, 0.01, 0.01, 0.006)
RED, GREEN = gate_at(2.5, 0.5, 1.2, 0.2), gate_at(1.5, -2.0, 1.4, 0.9, "green")


def std_m(state):
    """Of the coordinate that is known worst."""
    return max(state.estimate.position_std_m)


def truth(time_s):
    """Position and yaw of a drone that looks at both gates, by turns, and flies to and fro."""
    t = max(0.0, time_s - 1.0)  # it stands before
    rise = 0.5 - 0.5 * cos(min(t, 2.0) * pi / 2.0)
    place = (-1.0 + 0.8 * sin(0.5 * t) * rise, 0.6 * sin(0.7 * t) * rise, 0.2 + rise)
    return place, (-0.25 + 0.25 * sin(0.4 * t)) * rise


def at(time_s):
    place, yaw = truth(time_s)
    tilt = 0.1 if time_s > 1.0 else 0.0
    return place, yaw, quaternion_from_euler(tilt * sin(2.0 * time_s), tilt * cos(1.7 * time_s), yaw)


def difference(of, time_s, step_s=1e-3):
    before, after = of(time_s - step_s), of(time_s + step_s)
    return tuple((b - a) / (2 * step_s) for a, b in zip(before, after, strict=True))


@dataclass
class Vehicle:
    """A vehicle whose reported heading, velocity and place are wrong; it flies without noise of its own."""

    seed: int
    accuracy: ReportedAccuracy = FLOW
    sends_imu: bool = True

    def __post_init__(self):
        self.random = np.random.default_rng(self.seed)
        self.wrong_m_s = 0.03 * self.random.standard_normal(3)
        self.drift_m = np.zeros(3)
        self.turn_rad = 0.0
        self.bias_m_s2 = 0.02 * self.random.standard_normal(3)

    def imu(self, time_us):
        middle_s = (time_us - IMU_US / 2) * 1e-6
        velocity = lambda t: difference(lambda s: truth(s)[0], t)  # noqa: E731
        ax, ay, az = difference(velocity, middle_s)
        start, end = at(middle_s - 5e-4)[2], at(middle_s + 5e-4)[2]
        _, x, y, z = quotient(start, end)
        force = to_body(rotation(at(middle_s)[2]), ax, ay, az + GRAVITY_M_S2)
        noise = 0.027 / (IMU_US * 1e-6) ** 0.5 * self.random.standard_normal(3)
        return ImuInterval(
            time_us, (2e3 * x, 2e3 * y, 2e3 * z), tuple(np.array(force) + self.bias_m_s2 + noise)
        )

    def state(self, time_us):
        time_s = time_us * 1e-6
        place, yaw, attitude = at(time_s)
        landed = time_s < 1.2
        if not landed:
            kept = np.exp(-TICK_US * 1e-6 / 2.0)
            self.wrong_m_s = kept * self.wrong_m_s + 0.03 * (1 - kept**2) ** 0.5 * (
                self.random.standard_normal(3)
            )
            self.drift_m += TICK_US * 1e-6 * self.wrong_m_s * (1.0, 1.0, 0.0)  # it measures the height
            self.turn_rad = 0.03 * min(1.0, time_s - 1.2)
        vx, vy, vz = difference(lambda s: truth(s)[0], time_s)
        vx, vy = turned(vx, vy, self.turn_rad)
        wrong = self.wrong_m_s if not landed else np.zeros(3)
        imu = tuple(self.imu(time_us - late) for late in range(TICK_US - IMU_US, -1, -IMU_US))
        return DroneState(
            time_us,
            *(np.array(place) + self.drift_m).tolist(),
            remainder(yaw + self.turn_rad, 2 * pi),
            tuple(np.array((vx, vy, vz)) + wrong),
            armed=True,
            landed=landed,
            attitude_arena=turned_left(self.turn_rad, attitude),
            imu=imu if self.sends_imu else (),
            accuracy=self.accuracy,
        )

    def image(self, time_us, gates):
        place, _, attitude = at(time_us * 1e-6)
        seen = []
        for gate in gates:
            points = corners_px(gate, place, attitude)
            if points is None or np.abs(points).max() > 118:
                continue
            noisy = points + STD_PX * self.random.standard_normal((4, 2))
            found = tuple(GateCorner(right, down, STD_PX, STD_PX) for right, down in noisy.tolist())
            seen.append(GateSighting(gate.colour, found, True, ()))
        return Detections(time_us=time_us, frames=tuple(seen))


def quotient(start, end):
    w, x, y, z = start
    return np.array(
        (
            (w, x, y, z),
            (-x, w, z, -y),
            (-y, -z, w, x),
            (-z, y, -x, w),
        )
    ) @ np.array(end)


def turned_left(angle, attitude):
    w, x, y, z = attitude
    c, s = cos(angle / 2), sin(angle / 2)
    return (c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w)


def fly(vehicle, seconds=16.0, gates=lambda _: (RED, GREEN), change=lambda state: state):
    """States as the world model estimates them, and the model."""
    world = WorldModel(Surroundings(Arena(), Base(), Camera()), CONTEST)
    states = []
    for time_us in range(TICK_US, round(seconds * 1e6), TICK_US):
        image_us = time_us - LATE_US
        is_due = image_us > 0 and image_us % IMAGE_US == 0
        images = (vehicle.image(image_us, gates(image_us * 1e-6)),) if is_due else ()
        states.append(world.observe(change(vehicle.state(time_us)), images))
    return states, world


def errors(states):
    """Of the position, metres, shape (n, 3)."""
    return np.array(
        [np.array((s.x, s.y, s.z)) - np.array(truth(s.time_us * 1e-6)[0]) for s in states if not s.landed]
    )


def test_the_error_of_the_place_stays_within_what_is_stated():
    inside, squares, reported = [], [], []
    for seed in range(6):
        states, _ = fly(Vehicle(seed))
        flying = [s for s in states if not s.landed]
        wrong = errors(states)
        stated = np.array([std_m(s) for s in flying])
        assert (stated > 0.0).all()
        inside += (np.abs(wrong) < 3.0 * stated[:, None]).all(axis=1).tolist()
        squares.append(float((wrong[-100:, :2] ** 2).sum(axis=1).mean()))
        vehicle = Vehicle(seed)
        drifted = [vehicle.state(t) for t in range(TICK_US, 16_000_000, TICK_US)]
        reported.append(float((errors(drifted)[-100:, :2] ** 2).sum(axis=1).mean()))
    assert np.mean(inside) > 0.97
    assert np.mean(squares) < 0.25 * np.mean(reported)


def test_a_gate_is_where_it_is_seen_from_the_drone_though_both_have_drifted():
    states, world = fly(Vehicle(3), 14.0)
    now = states[-1]
    place, yaw = truth(now.time_us * 1e-6)
    for gate in (RED, GREEN):
        known = world.gate(gate.colour)
        x, y = turned(known.position_m[0] - now.x, known.position_m[1] - now.y, -now.yaw)
        true_x, true_y = turned(gate.x_m - place[0], gate.y_m - place[1], -yaw)
        assert hypot(x - true_x, y - true_y) < max(0.02, 4.0 * max(known.position_std_m))
        assert max(known.position_std_m) < 0.03  # that of the drone in the arena is larger
    assert std_m(now) > max(known.position_std_m)  # it has drifted with its gates


def test_what_the_vehicle_reports_too_much_of_its_velocity_is_told():
    told = []
    for seed in (1, 2, 3):
        vehicle = Vehicle(seed)
        vehicle.state = constant_error(vehicle, (0.12, 0.0, 0.0))
        _, world = fly(vehicle)
        forward, left, _ = world.localization.velocity_error_flu_m_s
        told.append(hypot(forward, left))
    assert np.mean(told) == pytest.approx(0.12, abs=0.04)


def constant_error(vehicle, wrong_m_s):
    usual = vehicle.state

    def state(time_us):
        vehicle.wrong_m_s = np.array(wrong_m_s)
        found = usual(time_us)
        x, y, z = (v - w for v, w in zip(found.velocity_arena_m_s, vehicle.wrong_m_s, strict=True))
        a, b, c = wrong_m_s if not found.landed else (0.0, 0.0, 0.0)
        return replace(found, velocity_arena_m_s=(x + a, y + b, z + c))

    return state


@pytest.mark.parametrize("vehicle", [Vehicle(0, accuracy=MOCAP), Vehicle(0, sends_imu=False)])
def test_a_vehicle_that_knows_its_place_or_sends_no_samples_is_believed(vehicle):
    world = WorldModel(Surroundings(Arena(), Base(), Camera()), CONTEST)
    for time_us in range(TICK_US, 3_000_000, TICK_US):
        state = vehicle.state(time_us)
        assert world.observe(state, ()) is state
    assert world.localization.velocity_error_flu_m_s == (0.0, 0.0, 0.0)


def test_a_vehicle_that_loses_its_motion_capture_is_not_believed_any_longer():
    lost = replace(MOCAP, position_std_m=0.02)
    states, _ = fly(
        Vehicle(2, accuracy=MOCAP),
        change=lambda state: replace(state, accuracy=lost) if state.time_us > 5_000_000 else state,
    )
    is_estimated = [state.estimate is not None for state in states]
    assert is_estimated == [state.time_us > 5_000_000 for state in states]
    assert np.abs(errors(states)[-40:]).max() < 0.3


def test_a_gate_that_turns_out_to_be_elsewhere_is_forgotten_and_found_again():
    moved = gate_at(2.5, -0.6, 1.2, 0.2)
    states, world = fly(Vehicle(4), 24.0, lambda time_s: (RED if time_s < 8.0 else moved,))
    now = states[-1]
    place, yaw = truth(now.time_us * 1e-6)
    known = world.gate("red")
    x, y = turned(known.position_m[0] - now.x, known.position_m[1] - now.y, -now.yaw)
    true_x, true_y = turned(moved.x_m - place[0], moved.y_m - place[1], -yaw)
    assert hypot(x - true_x, y - true_y) < 0.1
    assert np.abs(errors(states)[-1]).max() < 0.6  # it did not drag the drone along


def test_samples_that_are_lost_for_a_while_make_the_place_less_sure_and_do_not_break_it():
    def lose(state):
        return replace(state, imu=()) if 6_000_000 < state.time_us < 7_500_000 else state

    states, _ = fly(Vehicle(5), change=lose)
    by_time = {state.time_us: state for state in states}
    assert std_m(by_time[7_600_000]) > std_m(by_time[5_900_000])
    stated = np.array([std_m(s) for s in states if not s.landed])
    assert np.abs(errors(states)[-40:]).max() < 3.0 * stated[-40:].max()


def test_a_vehicle_whose_samples_end_in_flight_is_followed_by_its_reports():
    states, world = fly(
        Vehicle(5), change=lambda state: replace(state, imu=()) if state.time_us > 6_000_000 else state
    )
    drifting = Vehicle(5)
    reported = [drifting.state(time_us) for time_us in range(TICK_US, 16_000_000, TICK_US)]
    moved = errors(states)[-1] - errors(reported)[-1]
    assert np.abs(moved).max() < 0.4  # as far from the reports as when the samples ended
    assert std_m(states[-1]) > 0.2
    assert hypot(*world.localization.velocity_error_flu_m_s) < 0.1


def test_the_same_flight_gives_the_same_estimate():
    first, _ = fly(Vehicle(7), 6.0)
    second, _ = fly(Vehicle(7), 6.0)
    assert first == second


def test_what_has_another_colour_than_the_task_s_gates_does_not_move_the_drone():
    """Such as a poster, whose size is not a gate's, or a thing that moves: here 15 cm a second."""

    def gates(time_s):
        thing = gate_at(2.5, 0.5 + 0.15 * max(0.0, time_s - 5.0), 1.2, 0.2)
        return (thing.model_copy(update={"colour": "cyan"}),)

    states, _ = fly(Vehicle(6), gates=gates)
    alone, _ = fly(Vehicle(6), gates=lambda _: ())
    assert np.abs(errors(states)[-1]).max() < 0.3
    assert std_m(states[-1]) > 0.9 * std_m(alone[-1])


NEAR_RED = gate_at(1.4, 0.1, 1.2, 0.2)
UNSEEN_S, SEEN_AGAIN_S, END_S = 12.0, 16.0, 18.0


def fly_by_gate(end_s, *, stays):
    """The drone in the arena and in flight, and the gate in flight: it is not seen for a while."""
    vehicle = Vehicle(8)
    world = WorldModel(Surroundings(Arena(), Base(), Camera()), CONTEST)
    flown = []
    for time_us in range(TICK_US, round(1e6 * end_s), TICK_US):
        image_us = time_us - LATE_US
        blind = UNSEEN_S < image_us * 1e-6 < SEEN_AGAIN_S
        is_due = image_us > 0 and image_us % IMAGE_US == 0 and not blind
        images = (vehicle.image(image_us, (NEAR_RED,)),) if is_due else ()
        if stays:
            world.localization.stay_by("red")
        state = world.observe(vehicle.state(time_us), images)
        at = world.localization.state_in_flight(state)
        if time_us > 1e6 * UNSEEN_S:
            gate = world.gate("red")
            flown.append([(s.x, s.y, s.z) for s in (state, at)] + [gate.position_m])
    return np.array(flown).transpose(1, 0, 2)


def steps_m(places):
    return np.linalg.norm(np.diff(places, axis=0), axis=1)


def test_a_correction_of_the_place_does_not_move_the_drone_in_flight_while_it_is_by_a_gate():
    arena, flown, gate = fly_by_gate(END_S, stays=True)
    assert steps_m(arena).max() > 0.1  # else nothing was tested
    assert steps_m(flown).max() < 0.04
    assert np.abs(flown - arena)[-1].max() > 0.1
    true = np.array((NEAR_RED.x_m, NEAR_RED.y_m)) - truth(END_S - 0.05)[0][:2]
    assert (gate - flown)[-1, :2] == pytest.approx(true, abs=0.03)


def test_away_from_a_gate_flight_comes_back_to_the_arena_after_a_correction():
    arena, flown, _ = fly_by_gate(END_S + 1.5, stays=False)
    assert steps_m(flown).max() < 0.06 < steps_m(arena).max()
    assert np.abs(flown - arena)[-1].max() < 0.02


def test_a_picture_of_a_gate_that_is_larger_than_one_is_not_believed_to_be_one():
    """If it were, the drone's place would be wrong by 22 stated deviations in each of these flights.

    Were the place from where it was seen first known exactly, it would be 7 in the mean.
    """
    larger, worst = {"outer_width_m": 1.5 * RED.outer_width_m, "outer_height_m": 1.5 * RED.outer_height_m}, []
    for seed in (31, 32, 33):
        states, world = fly(Vehicle(seed), gates=lambda _: (RED.model_copy(update=larger),))
        stated = np.array([std_m(state) for state in states if not state.landed])
        worst.append(float((np.abs(errors(states)).max(axis=1) / stated).max()))
        gate = world.gate("red")
        assert gate is None or not gate.certain
    assert np.mean(worst) < 5.0


class Squeezed(Vehicle):
    """A vehicle whose images show gates lower than they are for a while, as nearly edge-on ones are found."""

    def image(self, time_us, gates):
        image = super().image(time_us, gates)
        if not 8.0 < time_us * 1e-6 < 11.0:
            return image
        frames = []
        for gate in image.frames:
            by_px = (2.5, 0.8, -2.5, -0.8)
            corners = zip(gate.corners, by_px, strict=True)
            found = tuple(replace(corner, down_px=corner.down_px + px) for corner, px in corners)
            frames.append(replace(gate, corners=found))
        return replace(image, frames=tuple(frames))


def test_views_that_are_farther_off_than_they_state_do_not_drag_the_drone_along():
    """If they were used with the noise that they state, it would be 0.45 m off in each of these flights."""
    worst = [np.abs(errors(fly(Squeezed(seed), 12.0)[0])[-60:]).max() for seed in range(3)]
    assert np.mean(worst) < 0.2


def test_a_gate_by_the_arena_s_side_has_room_if_the_place_may_be_off_by_what_lacks():
    by_side = PathGate((4.7, 1.0, 1.2), 0.3)
    for accuracy, is_wider in ((FLOW, True), (MOCAP, False)):
        states, world = fly(Vehicle(5, accuracy=accuracy), 12.0, lambda _: ())
        arena, told = world.arena_with(by_side), world.arena
        wider_m = (arena.length_x_m - told.length_x_m) / 2
        assert (wider_m >= 0.2) == is_wider
        assert wider_m <= (3.0 * std_m(states[-1]) if is_wider else 0.0)
        assert world.arena_with(PathGate((3.0, 1.0, 1.2), 0.3)) == told
        assert world.arena_with(PathGate((3.0, 1.0, 1.2), 0.3), by_side) == arena
        beyond = GateEstimate("red", (5.2, 1.0, 1.2), 0.3, (0.1, 0.1, 0.1), 0.1, False, False, 9, 0)
        crossed_m = world.gate_of(beyond).centre_m[0]
        assert crossed_m == pytest.approx(5.2 if is_wider else told.length_x_m / 2)


def test_a_gate_that_is_forgotten_begins_anew_on_the_map_and_as_a_landmark():
    _, world = fly(Vehicle(6), 12.0)
    assert world.gate("red") is not None
    assert "red" in world.localization.finish(12_000_000)
    world.forget("red")
    assert world.gate("red") is None
    assert "red" not in world.localization.finish(12_000_000)
