"""The response of a vehicle is identified in flight, whatever its loops, and its motion is predicted."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from math import atan2, cos, exp, hypot, pi, remainder, sin, tan

import pytest

from framerunner.geometry.rotations import quaternion_from_euler
from framerunner.geometry.vectors import turned
from offboard.drone import DroneState, VelocityFluCommand
from offboard.response.estimate import ResponseEstimate
from offboard.response.rate_response import RateResponse
from offboard.response.tilt_loop import GRAVITY_M_S2

TICK_S = 0.05
STEPS = 10  # of the simulated vehicle in a tick


@dataclass
class Vehicle:
    """A multicopter with a velocity loop, which asks for a tilt of B r - K v + I integral."""

    command: float = 0.3
    velocity: float = 0.3
    integral: float = 0.0
    drag_per_m: float = 0.3
    compensates: bool = False  # drag, and level axes that turn
    tilt_lag_s: float = 0.08
    dead_s: float = 0.0
    lag_s: float = 0.0  # of commands in arena axes, before the loop
    wind_m_s2: float = 0.0
    armed: bool = True
    ticks: int = 0
    yaw: float = 0.3
    turn: float = 0.0
    up: float = 0.0
    position: list[float] = field(default_factory=lambda: [0.0, 0.0, 1.0])
    plan: list[float] = field(default_factory=lambda: [0.0, 0.0])
    tilts: list[float] = field(default_factory=lambda: [0.0, 0.0])
    integrals: list[float] = field(default_factory=lambda: [0.0, 0.0])
    lagged: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        self.waiting = deque([(VelocityFluCommand(), (0.0, 0.0))] * round(self.dead_s / TICK_S))

    @property
    def state(self) -> DroneState:
        """As telemetry reports it."""
        forward, left = self.tilts
        # In level axes the thrust points forward by one tilt, then to the left by the other.
        up = cos(left) * cos(forward)
        roll = -atan2(sin(left), hypot(up, cos(left) * sin(forward)))
        attitude = quaternion_from_euler(roll, forward, self.yaw)
        velocity = (self.plan[0], self.plan[1], self.up)
        return DroneState(
            self.ticks * 50_000,
            *self.position,
            self.yaw,
            velocity,
            armed=self.armed,
            landed=False,
            attitude_arena=attitude,
        )

    def fly(self, command: VelocityFluCommand) -> None:
        """A tick."""
        self.waiting.append((command, turned(command.forward_m_s, command.left_m_s, self.yaw)))
        given, aim = self.waiting.popleft()
        step_s = TICK_S / STEPS
        for _ in range(STEPS):
            kept = exp(-step_s / self.lag_s) if self.lag_s else 0.0
            self.lagged = (
                aim[0] + kept * (self.lagged[0] - aim[0]),
                aim[1] + kept * (self.lagged[1] - aim[1]),
            )
            self._step(given, step_s)
        self.ticks += 1

    def _step(self, given: VelocityFluCommand, step_s: float) -> None:
        wanted = turned(*self.lagged, -self.yaw) if self.lag_s else (given.forward_m_s, given.left_m_s)
        level = turned(*self.plan, -self.yaw)
        for axis in (0, 1):
            v, off = level[axis], wanted[axis] - level[axis]
            self.integrals[axis] += off * step_s
            demand = self.command * wanted[axis] - self.velocity * v + self.integral * self.integrals[axis]
            if self.compensates:
                demand += self.drag_per_m * v * abs(v) / GRAVITY_M_S2
                demand += (self.turn if axis else -self.turn) * level[1 - axis] / GRAVITY_M_S2
            self.tilts[axis] += (demand - self.tilts[axis]) * step_s / self.tilt_lag_s
        forward = GRAVITY_M_S2 * tan(self.tilts[0])
        left = hypot(forward, GRAVITY_M_S2) * tan(self.tilts[1])
        drags = []
        for tilt, v in zip(self.tilts, level, strict=True):  # along the body's axes
            along = v * cos(tilt) - self.up * sin(tilt)
            drags.append(self.drag_per_m * along * abs(along) / cos(tilt))
        ax, ay = turned(forward - drags[0], left - drags[1], self.yaw)
        self.plan[0] += (ax + self.wind_m_s2) * step_s
        self.plan[1] += ay * step_s
        self.up += (given.up_m_s - self.up) * step_s / 0.1
        self.turn += (given.yaw_rate_rad_s - self.turn) * step_s / 0.05
        self.yaw = remainder(self.yaw + self.turn * step_s, 2 * pi)
        for axis, speed in enumerate((*self.plan, self.up)):
            self.position[axis] += speed * step_s


def command_at(time_s: float) -> VelocityFluCommand:
    """Starts, stops, turns and climbs, as of a flight."""
    quarter = int(time_s / 1.5) % 4
    return VelocityFluCommand(
        (0.8, 0.8, 0.0, -0.5)[quarter],
        (0.0, 0.4, -0.4, 0.0)[quarter],
        (0.4, 0.0, -0.4, 0.0)[quarter],
        (0.6, 0.0, -0.8, 0.5)[quarter],
    )


def learn(vehicle: Vehicle, seconds: float) -> ResponseEstimate:
    """The estimate after some seconds of flight."""
    estimate, sent = ResponseEstimate(), None
    for tick in range(round(seconds / TICK_S)):
        estimate.update(vehicle.state, sent)
        sent = command_at(tick * TICK_S)
        vehicle.fly(sent)
    estimate.update(vehicle.state, sent)
    return estimate


OWN = {"command": 0.25, "velocity": 0.5, "integral": 0.66, "drag_per_m": 2.0, "compensates": True}
VEHICLES = {
    "weighted set point, integral, drag compensated": OWN,
    "proportional, light drag": {"command": 0.5, "velocity": 0.5, "drag_per_m": 0.1, "tilt_lag_s": 0.12},
    "PX4's gains against drag": {"command": 0.18, "velocity": 0.18, "integral": 0.04, "drag_per_m": 0.6},
    "commands are late": {**OWN, "dead_s": 0.15, "lag_s": 0.6},
    "commands are very late": {"dead_s": 0.3, "lag_s": 0.4},
}


@pytest.mark.parametrize("name", VEHICLES)
def test_the_velocity_that_commands_on_their_way_lead_to_is_predicted(name: str):
    vehicle = Vehicle(**VEHICLES[name])
    estimate, sent = learn(vehicle, 8.0), None
    predicted: deque[tuple[int, tuple[float, float], tuple[float, float]]] = deque()
    off_m_s, changes_m_s = [], []
    for tick in range(160, 400):
        state = vehicle.state
        if sent is not None:
            estimate.update(state, sent)
        x, y = vehicle.plan
        while predicted and predicted[0][0] <= vehicle.ticks:
            _, (vx, vy), (was_x, was_y) = predicted.popleft()
            off_m_s.append(hypot(vx - x, vy - y))
            changes_m_s.append(hypot(was_x - x, was_y - y))
        turn = vehicle.turn
        coming = estimate.predict(state, lambda time_s, yaw=state.yaw, turn=turn: yaw + turn * time_s)
        predicted.append((vehicle.ticks + round(coming.time_s / TICK_S), coming.velocity_m_s, (x, y)))
        sent = command_at(tick * TICK_S)
        vehicle.fly(sent)
    middle = len(off_m_s) // 2
    assert middle > 100
    assert sorted(off_m_s)[middle] < 0.3 * sorted(changes_m_s)[middle]


@pytest.mark.parametrize(("dead_s", "lag_s"), [(0.0, 0.0), (0.15, 0.6), (0.35, 0.4), (0.1, 0.8)])
def test_how_late_commands_are_is_found_within_six_seconds(dead_s: float, lag_s: float):
    estimate = learn(Vehicle(**{**OWN, "dead_s": dead_s, "lag_s": lag_s}), 6.0)
    assert estimate.response.known
    assert estimate.response.late_s == pytest.approx(0.1 + dead_s + lag_s, abs=0.16)
    assert estimate.loop.turning is (lag_s == 0.0)


def test_gains_and_drag_are_found():
    loop = learn(Vehicle(**OWN), 15.0).loop
    assert loop.command == pytest.approx(0.25, rel=0.25)
    assert loop.velocity == pytest.approx(0.5, rel=0.2)
    assert loop.integral == pytest.approx(0.66, rel=0.25)


def test_wind_is_a_disturbance_of_the_motion_and_not_of_the_loop():
    still, windy = learn(Vehicle(**OWN), 15.0), learn(Vehicle(**OWN, wind_m_s2=0.8), 15.0)
    assert windy.motion.disturbance_m_s2[0] - still.motion.disturbance_m_s2[0] == pytest.approx(0.8, abs=0.3)
    assert windy.loop.command == pytest.approx(still.loop.command, rel=0.2)


def test_nothing_is_learnt_from_a_drone_that_is_carried_by_hand():
    carried, untold = learn(Vehicle(**OWN, armed=False), 8.0), ResponseEstimate()
    assert not carried.response.known
    assert carried.loop == untold.loop
    assert carried.motion.drag_per_m == untold.motion.drag_per_m


def test_a_known_model_is_kept_near_a_gate():
    vehicle, sent = Vehicle(**OWN), None
    estimate = learn(vehicle, 8.0)
    before = estimate.response
    late = Vehicle(**{**OWN, "dead_s": 0.3})
    late.ticks = vehicle.ticks
    for tick in range(100):
        estimate.update(late.state, sent, near_gate=True)
        sent = command_at(tick * TICK_S)
        late.fly(sent)
    assert estimate.response == before


@pytest.mark.parametrize(("dead_s", "lag_s"), [(0.05, 0.05), (0.25, 0.6), (0.55, 0.3)])
def test_dead_time_and_lag_of_a_climb_are_found_and_predicted(dead_s: float, lag_s: float):
    climb, speed, height_m = RateResponse(), 0.0, 0.0
    waiting = deque([0.0] * round(dead_s / TICK_S))
    for tick in range(400):
        command = command_at(tick * TICK_S).up_m_s
        waiting.append(command)
        speed += (1.0 - exp(-TICK_S / lag_s)) * (waiting.popleft() - speed)
        height_m += speed * TICK_S
        climb.update(command, speed + 0.05, learns=True, chooses=True)
    assert (climb.dead_s, climb.lag_s) == pytest.approx((dead_s, lag_s))
    coming, before_m = climb.predict(), height_m
    while waiting:
        speed += (1.0 - exp(-TICK_S / lag_s)) * (waiting.popleft() - speed)
        height_m += (speed + 0.05) * TICK_S
    assert coming.disturbance == pytest.approx(0.05, abs=0.01)
    assert coming.moved == pytest.approx(height_m - before_m, abs=0.01)
    assert coming.rate == pytest.approx(speed + 0.05, abs=0.02)
