"""Random layouts, known: plans through them, what a plan must obey, and flights in lockstep or as told."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass, replace
from math import cos, hypot, sin

import numpy as np

from framerunner.flying.lockstep import LockstepVehicle
from framerunner.flying.plan import FlightPlan
from framerunner.flying.response import ResponseDelay
from framerunner.geometry.solids import Solid
from framerunner.geometry.vectors import Vec3
from offboard.drone import DroneState, VelocityFluCommand
from offboard.limits import VelocityLimits
from offboard.navigation.following import PathFollower
from offboard.navigation.goals import CONTEST, FlightStyle, Goal, Motion, Obstacles, PathGate, Point, Refusal
from offboard.navigation.path import Path
from offboard.navigation.planner.timing import LEFT_M
from offboard.navigation.planning import plan
from scenarios.models import COLOURS, Arena, Scenario
from scenarios.random_scenarios import load_level, random_scenario
from scenarios.result import RefereeReport

STEP_S = 0.01


def flown(state: DroneState, command: VelocityFluCommand) -> DroneState:
    """The state a tick later of a drone that flies as it is told."""
    c, s, forward, left = cos(state.yaw), sin(state.yaw), command.forward_m_s, command.left_m_s
    velocity = (c * forward - s * left, s * forward + c * left, command.up_m_s)
    x, y, z = (at + 0.05 * v for at, v in zip((state.x, state.y, state.z), velocity, strict=True))
    yaw, time_us = state.yaw + 0.05 * command.yaw_rate_rad_s, state.time_us + 50_000
    return replace(state, time_us=time_us, x=x, y=y, z=z, yaw=yaw, velocity_arena_m_s=velocity)


@dataclass(frozen=True)
class Layout:
    """A scenario as the planner sees it, all of it known."""

    scenario: Scenario
    gates: tuple[PathGate, ...]

    @classmethod
    def random(cls, seed: int, level: str = "calm") -> Layout:
        """A layout of a level."""
        return cls.of(random_scenario(load_level(level), seed))

    @classmethod
    def of(cls, scenario: Scenario) -> Layout:
        """A scenario's layout."""
        gates = sorted(scenario.frames, key=lambda gate: COLOURS.index(gate.colour))
        return cls(
            scenario, tuple(PathGate(gate.position_arena_m, gate.yaw_rad, gate.shape) for gate in gates)
        )

    @property
    def goals(self) -> list[Goal]:
        """All gates, then back over the base."""
        base = self.scenario.base
        return [*self.gates, Point((base.x_m, base.y_m, 0.6))]

    @property
    def columns_m(self) -> tuple[Vec3, ...]:
        """Discs that cover what stands on the floor."""
        return tuple(disc for solid in self.scenario.prisms for disc in _discs(solid))

    @property
    def obstacles(self) -> Obstacles:
        """All of them, with the gates."""
        decoys = tuple(
            PathGate(decoy.position_arena_m, decoy.yaw_rad, decoy.shape) for decoy in self.scenario.decoys
        )
        return Obstacles((*self.gates, *decoys), self.columns_m, self.scenario.base)

    @property
    def start(self) -> Motion:
        """On the base."""
        start = self.scenario.start
        return Motion((start.x_m, start.y_m, 0.5325), yaw_rad=start.yaw_rad)

    def plan(
        self, start: Motion, goals: list[Goal], previous: Path | None = None, style: FlightStyle = CONTEST
    ) -> Path | Refusal:
        """A plan with all gates and obstacles known."""
        arena = self.scenario.arena
        return plan(start, goals, obstacles=self.obstacles, arena=arena, style=style, previous=previous)


def _discs(solid: Solid) -> list[Vec3]:
    """Discs along the longer side of an upright box."""
    x_m, y_m, _ = solid.centre_arena_m
    c, s = solid.turn
    along_m, half_m, _ = solid.half_extents_m
    if along_m < half_m:
        along_m, half_m, c, s = half_m, along_m, -s, c
    count = max(int(along_m / 0.08), 1)
    step_m = 2 * along_m / count
    places = [(i + 0.5) * step_m - along_m for i in range(count)]
    return [(x_m + c * at_m, y_m + s * at_m, hypot(half_m, step_m / 2)) for at_m in places]


class Sampled:
    """A path, sampled densely."""

    def __init__(self, path: Path) -> None:
        motions = [path.at(index * STEP_S) for index in range(int(path.duration_s / STEP_S) + 1)]
        self.positions = np.array([motion.position_m for motion in motions])
        self.velocities = np.array([motion.velocity_m_s for motion in motions])
        self.yaws = np.array([motion.yaw_rad for motion in motions])
        self.yaw_rates = np.array([motion.yaw_rate_rad_s for motion in motions])

    def level_velocities(self) -> np.ndarray:
        """In axes turned with the yaw, shape (n, 3)."""
        c, s = np.cos(self.yaws), np.sin(self.yaws)
        vx, vy, vz = self.velocities.T
        return np.stack((c * vx + s * vy, c * vy - s * vx, vz), axis=1)

    def offsets(self, gate: PathGate) -> np.ndarray:
        """From a gate, along and across it and up, shape (n, 3)."""
        away = self.positions - np.array(gate.centre_m)
        c, s = cos(gate.yaw_rad), sin(gate.yaw_rad)
        return np.stack(
            (c * away[:, 0] + s * away[:, 1], c * away[:, 1] - s * away[:, 0], away[:, 2]), axis=1
        )


def touching(path: Sampled, gate: PathGate) -> list[float]:
    """Times at which the drone's box, with a little room, is where a gate's bars are."""
    along, across, up = np.abs(path.offsets(gate)).T
    turn = path.yaws - gate.yaw_rad
    reach = 0.125 * (np.abs(np.cos(turn)) + np.abs(np.sin(turn)))
    half_height = 0.0225 + 0.03  # its box reaches higher while it tilts
    near = along < 0.01 + reach
    through = (across + reach < 0.19 - 0.02) & (up + half_height < 0.09)
    beside = (across - reach > 0.21 + 0.02) | (up - half_height > 0.11 + 0.02)
    return [float(index * STEP_S) for index in np.flatnonzero(near & ~through & ~beside)]


def crossed(path: Sampled, gates: tuple[PathGate, ...]) -> list[int]:
    """The gates that a path goes through, in order."""
    found: list[tuple[int, int]] = []
    for number, gate in enumerate(gates):
        along, across, up = path.offsets(gate).T
        width_m, height_m = gate.shape.opening_m
        for index in np.flatnonzero(np.diff(np.sign(along)) != 0):
            if abs(across[index]) < width_m / 2 and abs(up[index]) < height_m / 2:
                found.append((int(index), number))
    return [number for _, number in sorted(found)]


def least_margin(path: Sampled, arena: Arena) -> float:
    """The least distance from the sides, metres."""
    x, y, _ = np.abs(path.positions).T
    return float(min((arena.length_x_m / 2 - x).min(), (arena.width_y_m / 2 - y).min()))


def fly(
    layout: Layout, *, replan_s: float, response: ResponseDelay | None = None
) -> tuple[RefereeReport, float, float]:
    """Fly a layout in lockstep, planning again all the time.

    Returns:
        The report, the largest distance from the path, and for how long commands were limited to the box.
    """
    flight = FlightPlan(layout.scenario, response=response)
    vehicle = LockstepVehicle(flight)
    drone, limits, kept_in_box = vehicle.drone, VelocityLimits(box=flight.box), 0
    follower, sent = PathFollower(), None
    asyncio.run(drone.ready())
    asyncio.run(drone.motors_on())
    state = drone.next_state()
    goals = layout.goals
    path = layout.plan(Motion((state.x, state.y, state.z), yaw_rad=state.yaw), goals)
    assert isinstance(path, Path)
    began_s = planned_s = state.time_us * 1e-6
    farthest_m = 0.0
    while not (follower.finished and follower.error_m < 0.05):
        now_s = state.time_us * 1e-6
        assert now_s - began_s < 100.0
        follower.observe(state, now_s, sent)
        limited = limits.limit(follower.command(path, state, now_s), state)
        sent, kept_in_box = limited.command, kept_in_box + limited.kept_in_box
        drone.command(sent)
        farthest_m = max(farthest_m, follower.error_m)
        if now_s - planned_s >= replan_s and follower.progress_s < path.duration_s - 1.0:
            goals = goals_left(goals, path, follower.progress_s + follower.lead_s)
            planned_s = now_s
            style = CONTEST.adapted(follower.estimate.response)
            again = layout.plan(follower.reference(), goals, path, style)
            path = path if isinstance(again, Refusal) else follower.continued(again)
        state = drone.next_state()
    asyncio.run(drone.motors_off())
    drone.settle()
    return vehicle.simulation.referee.report(), farthest_m, kept_in_box * 0.05


def goals_left(goals: list[Goal], path: Path, time_s: float) -> list[Goal]:
    """The goals without the gates that the drone has crossed and left behind on a path at a time."""
    behind = []
    for crossing in path.crossings:
        normal, centre_m = (cos(crossing.heading_rad), sin(crossing.heading_rad)), crossing.gate.centre_m
        for at_s in np.arange(crossing.time_s, time_s, STEP_S):
            offset = np.subtract(path.position_at_m(float(at_s))[:2], centre_m[:2])
            if offset @ normal > LEFT_M:
                behind.append(crossing.gate)
                break
    return [goal for goal in goals if goal not in behind]


def base_distances(path: Sampled, scenario: Scenario) -> np.ndarray:
    """From the base's centre, in plan, shape (n,)."""
    base = scenario.base
    return np.array([hypot(x - base.x_m, y - base.y_m) for x, y, _ in path.positions])
