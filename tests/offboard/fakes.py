"""A drone that moves as commanded and a camera that sees by exact geometry, both in simulated time."""

from __future__ import annotations

from collections.abc import AsyncGenerator
from dataclasses import dataclass, field
from itertools import pairwise, product
from math import atan2, ceil, cos, exp, floor, hypot, pi, remainder, sin
from textwrap import dedent

from offboard.drone import DroneError, DroneState, LimitedCommand, VelocityFluCommand
from offboard.limits import CONTEST, VelocityLimits
from offboard.mission import load_mission
from vision.detector import measure
from vision.types import NOT_SEEN, Detection, Detections

TICK_US = 50_000
CAMERA_AHEAD_M = 0.08
GRAVITY = 9.81
DRAG = 0.635 / 0.3  # of speed squared, over mass


@dataclass(frozen=True)
class Target:
    """A gate: centre in the arena and yaw of its normal."""

    x: float
    y: float
    z: float
    yaw: float


TEST_CASE_1 = {"red": Target(3, 2, 2, 3), "green": Target(-2, 1, 0.5, 2), "blue": Target(3, -1, 1, 1)}
START_1 = (-3.0, -3.0, 1.0)


@dataclass
class KinematicDrone:
    """Follows velocity commands with a first-order lag; can be told to fail at a tick.

    A pilot has it while `pilot_mode` says so: then it goes by `pilot_m_s`, not by commands.
    """

    x: float = 0.0
    y: float = 0.0
    yaw: float = 0.0
    base_m: float = 0.53
    lag_s: float = 0.7  # of the paper's own stabiliser, roughly
    faults: dict[int, Exception] = field(default_factory=dict)
    calls: list[str] = field(default_factory=list)
    limits: VelocityLimits = field(default_factory=lambda: VelocityLimits(CONTEST))

    def __post_init__(self) -> None:
        self.z = self.base_m
        self.start = (self.x, self.y)
        self.rates = [0.0, 0.0, 0.0, 0.0]
        self.pitch = self.roll = 0.0  # nose down, left side down: it tilts to accelerate and against drag
        self.command_now = VelocityFluCommand()
        self.latest: DroneState | None = None
        self.armed = False
        self.confirmed: bool | None = None  # as `motors_on` was last asked
        self.commands: list[VelocityFluCommand] = []
        self.time_us = 1_000_000
        self.path: list[tuple[float, float, float]] = []
        self.hold_error: DroneError | None = None
        self.pilot_mode = ""
        self.pilot_m_s = (0.0, 0.0, 0.0)
        self.landed = False
        self.landing_us = 0
        self.gone = ""

    async def connect(self) -> None:
        self.calls.append("connect")

    async def ready(self) -> None:
        self.calls.append("ready")

    async def motors_on(self, *, confirmed: bool = True) -> None:
        self.calls.append("motors_on")
        self.confirmed = confirmed
        self.armed = True

    async def motors_off(self) -> None:
        self.calls.append("motors_off")
        self.armed = False

    async def land(self) -> None:
        self.calls.append("land")
        self.armed = False
        self.z = self.base_m
        self.time_us += self.landing_us

    async def hold(self) -> None:
        self.calls.append("hold")
        if self.hold_error:
            raise self.hold_error

    async def land_now(self, *, demanded: bool = False) -> None:
        self.calls.append("land_now demanded" if demanded else "land_now")
        self.armed = False
        self.z = self.base_m

    def report_place(self, state):
        """This one knows its place."""

    async def refuse(self) -> None:
        self.calls.append("refuse")
        self.pilot_mode = "HOLD"
        self.pilot_m_s = (0.0, 0.0, 0.0)

    async def close(self) -> None:
        self.calls.append("close")

    def command(self, command: VelocityFluCommand, at: DroneState | None = None) -> LimitedCommand:
        limited = self.limits.limit(command, at or self.latest)
        self.commands.append(limited.command)
        self.command_now = limited.command
        return limited

    async def ticks(self) -> AsyncGenerator[DroneState, None]:
        tick = 0
        while True:
            self._move(TICK_US / 1e6)
            self.time_us += TICK_US
            tick += 1
            if tick in self.faults:
                raise self.faults[tick]
            self.path.append((self.x, self.y, self.z))
            self.latest = DroneState(
                *(self.time_us, self.x, self.y, self.z, self.yaw),
                velocity_arena_m_s=self._velocity(),
                armed=self.armed,
                offboard=self.armed and not self.pilot_mode,
                mode=self.pilot_mode or "OFFBOARD",
                landed=self.landed,
            )
            yield self.latest

    def _velocity(self) -> tuple[float, float, float]:
        if self.pilot_mode:
            return self.pilot_m_s
        forward, left, up, _ = self.rates
        c, s = cos(self.yaw), sin(self.yaw)
        return (c * forward - s * left, s * forward + c * left, up)

    def _move(self, dt_s: float) -> None:
        if not self.armed:
            return
        if self.pilot_mode:
            self.rates = [0.0, 0.0, 0.0, 0.0]
            self.x, self.y, self.z = (
                at + speed * dt_s for at, speed in zip((self.x, self.y, self.z), self.pilot_m_s, strict=True)
            )
            return
        c = self.command_now
        wanted = (c.forward_m_s, c.left_m_s, c.up_m_s, c.yaw_rate_rad_s)
        blend = 1 - exp(-dt_s / self.lag_s)
        before = self.rates
        self.rates = [rate + blend * (want - rate) for rate, want in zip(before, wanted, strict=True)]
        forward, left, up, turn = self.rates
        self.pitch = atan2((forward - before[0]) / dt_s + DRAG * forward * abs(forward), GRAVITY)
        self.roll = atan2((left - before[1]) / dt_s + DRAG * left * abs(left), GRAVITY)
        self.x += (forward * cos(self.yaw) - left * sin(self.yaw)) * dt_s
        self.y += (forward * sin(self.yaw) + left * cos(self.yaw)) * dt_s
        self.z = max(self.z + up * dt_s, 0.02)
        self.yaw = remainder(self.yaw + turn * dt_s, 2 * pi)


class NoCamera:
    """For missions without a camera: nothing is ever seen."""

    async def open(self) -> None:
        pass

    def latest(self, time_us: int) -> Detections:
        return Detections()

    async def close(self) -> None:
        pass


class GeometricPerception:
    """What a camera of 320 x 240 sees of gates that do not hide one another, at 10 Hz."""

    def __init__(self, drone: KinematicDrone, targets: dict[str, Target], latency_ticks: int = 0) -> None:
        self._drone = drone
        self._targets = targets
        self._next_us = 0
        self._pipe = [Detections()] * (latency_ticks + 1)

    async def open(self) -> None:
        pass

    async def close(self) -> None:
        pass

    def latest(self, time_us: int) -> Detections:
        if time_us >= self._next_us:
            self._next_us = time_us + 100_000
            seen = {colour: self._see(target) for colour, target in self._targets.items()}
            self._pipe.append(Detections(**seen, time_us=time_us))
        else:
            self._pipe.append(self._pipe[-1])
        return self._pipe.pop(0)

    def _see(self, target: Target) -> Detection:
        drone = self._drone
        points = []
        for side, up, depth in product((-0.21, 0.21), (-0.11, 0.11), (-0.01, 0.01)):
            dx = target.x - side * sin(target.yaw) + depth * cos(target.yaw) - drone.x
            dy = target.y + side * cos(target.yaw) + depth * sin(target.yaw) - drone.y
            dz = target.z + up - drone.z
            ahead = cos(drone.yaw) * dx + sin(drone.yaw) * dy - CAMERA_AHEAD_M
            left = cos(drone.yaw) * dy - sin(drone.yaw) * dx
            ahead, dz = _turned(ahead, dz, drone.pitch)
            left, dz = _turned(left, dz, drone.roll)
            if ahead < 0.02:
                return NOT_SEEN
            points.append((160.5 - 160 * left / ahead, 120.5 - 160 * dz / ahead))
        columns, rows = [p[0] for p in points], [p[1] for p in points]
        if max(columns) < 1 or min(columns) > 320 or max(rows) < 1 or min(rows) > 240:
            return NOT_SEEN
        return measure(
            max(1, ceil(min(rows))),
            min(240, floor(max(rows))),
            max(1, ceil(min(columns))),
            min(320, floor(max(columns))),
        )


def _turned(level: float, up: float, tilt: float) -> tuple[float, float]:
    """A point in axes whose first one is tilted down."""
    return (level * cos(tilt) - up * sin(tilt), level * sin(tilt) + up * cos(tilt))


def crossings(path: list[tuple[float, float, float]], target: Target) -> list[float]:
    """Distances from the gate's centre, in its plane, wherever a path goes through its opening."""
    found = []
    normal = (cos(target.yaw), sin(target.yaw))
    for before, after in pairwise(path):
        depth_a = (before[0] - target.x) * normal[0] + (before[1] - target.y) * normal[1]
        depth_b = (after[0] - target.x) * normal[0] + (after[1] - target.y) * normal[1]
        if depth_a * depth_b >= 0:
            continue
        share = depth_a / (depth_a - depth_b)
        x, y, z = (a + share * (b - a) for a, b in zip(before, after, strict=True))
        sideways = (y - target.y) * normal[0] - (x - target.x) * normal[1]
        if abs(sideways) < 0.19 and abs(z - target.z) < 0.09:
            found.append(hypot(sideways, z - target.z))
    return found


RUNAWAY = dedent("""\
    name: runaway
    description: Flies on for ever
    initial: rise
    states:
      rise:
        enter:
          - hover
          - cmd.vel_z = 0.5
        transitions:
          - when: imu.z > 1.2
            to: run
      run:
        during:
          - cmd.vel_x = {}
          - cmd.vel_y = {}
          - cmd.vel_z = {}
        transitions:
          - when: seconds_in_state > 4
            to: run_on
      run_on:
        during:
          - cmd.vel_x = {}
          - cmd.vel_y = {}
          - cmd.vel_z = {}
        transitions:
          - when: seconds_in_state > 1000
            to: end
      end:
        final: true
    """)


def runaway(folder, first, then=None):
    """A mission that rises, flies with a velocity for four seconds, and then with another for ever."""
    path = folder / "runaway.yaml"
    path.write_text(RUNAWAY.format(*first, *(then or first)), encoding="utf-8")
    return load_mission(str(path))
