"""What a flight in lockstep costs, part by part, as ratios measured in one run on one core.

    python -m benchmarks.lockstep [SCENARIO] [--mission NAME] [--json]

Absolute times differ from machine to machine and from minute to minute; the ratios to one `run()` of JSBSim
with this drone's model, measured beside them, do not. Processor time is counted, so that other programs on
the machine have little effect.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from itertools import pairwise
from math import pi, remainder

from benchmarks.peers.job import SINGLE_THREADS, Stopwatch, pin_to_one_core

os.environ.update(SINGLE_THREADS)  # before NumPy is imported

import cv2

from firmware_py.status import FlightMode
from framerunner.flying.detector import plan_detector
from framerunner.flying.lockstep import fly_lockstep
from framerunner.flying.plan import FlightPlan
from framerunner.geometry.solids import Solid
from framerunner.geometry.vectors import Quaternion, Vec3
from offboard.app import Moment
from offboard.drone import DroneState
from offboard.mission import MissionError, load_mission
from scenarios.loader import load_scenario
from scenarios.models import Scenario, ScenarioError
from sitl.camera import ExposureMotion, SimulatedCamera
from sitl.simulation import Simulation
from sitl.world import PHYSICS_RATE_HZ, STEPS_PER_CONTROL
from vision.types import Image

REPEATS = 5
Pose = tuple[Vec3, Quaternion, Sequence[Solid], ExposureMotion]
"""Of the camera: what `SimulatedCamera.render` needs."""


@dataclass(frozen=True, slots=True)
class Parts:
    """What the parts of a flight cost: processor time, seconds."""

    scenario: str
    mission: str
    vision: str  # what the mission has found in images: boxes, or gates for its map
    image_rate_hz: float  # the camera's
    images_per_s: float  # painted and searched: a mission with a map leaves out those that it does not need
    simulated_s: float  # length of the whole flight
    raw_s: float  # one `run()` of JSBSim with this drone's model
    step_s: float  # one step of physics with autopilot, referee and the rest of a control tick
    render_s: float  # one of them painted, the mean over the flight
    detect_s: float  # the same searched
    flight_s: float  # the whole flight with everything
    flight_wall_s: float  # the same by the wall clock


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.lockstep", description=__doc__.partition("\n")[0]
    )
    parser.add_argument("scenario", nargs="?", default="test-case-1", metavar="SCENARIO", help="name or file")
    parser.add_argument("--mission", default="frame_challenge", metavar="NAME", help="name or file")
    parser.add_argument("--json", action="store_true", help="print what was measured as one line")
    options = parser.parse_args()
    try:
        plan = FlightPlan(load_scenario(options.scenario), load_mission(options.mission))
    except (ScenarioError, MissionError) as error:
        parser.error(str(error))
    parts = measure(plan)
    if options.json:
        print(json.dumps(asdict(parts)))
        return
    from rich.console import Console

    from benchmarks.report import part_rows, show_parts

    flight = (
        f"{parts.scenario}, {parts.mission}, {parts.simulated_s:.1f} s of flight, "
        f"camera {parts.image_rate_hz:g} Hz, {parts.images_per_s:.1f} images a second used, one core"
    )
    by_wall = f"{parts.simulated_s / parts.flight_wall_s:.0f} x real time by the wall clock"
    console = Console(width=None if sys.stdout.isatty() else 130)
    show_parts(console, part_rows(asdict(parts), PHYSICS_RATE_HZ), f"{flight}; {by_wall}")


def measure(plan: FlightPlan) -> Parts:
    """Measure all parts, one after another."""
    pin_to_one_core()
    cv2.setNumThreads(1)
    scenario = plan.scenario
    simulation = hovering(scenario)
    raw_s = best(simulation.world.dynamics.run, 20_000)
    step_s = best(simulation.tick, 5_000) / STEPS_PER_CONTROL
    images: list[Image] = []
    poses: list[Pose] = []
    flight_s, wall_s, simulated_s = fly(plan, images, poses)
    searched, camera = len(poses), SimulatedCamera(scenario)
    render_s = best(lambda: [camera.render(*pose) for pose in poses], 1) / len(poses)
    detect = plan_detector(plan)
    detect_s = best(lambda: [detect(image, 0) for image in images], 1) / len(images)
    mission = plan.chart
    return Parts(
        scenario.name,
        mission.name,
        mission.vision,
        scenario.camera.rate_hz,
        searched / simulated_s,
        simulated_s,
        raw_s,
        step_s,
        render_s,
        detect_s,
        flight_s,
        wall_s,
    )


def hovering(scenario: Scenario) -> Simulation:
    """A simulation of a drone that hovers in hold, far from all solids."""
    simulation = Simulation(scenario)
    while not simulation.autopilot.status.ready:
        simulation.tick()
    simulation.autopilot.set_mode(FlightMode.TAKEOFF)
    simulation.autopilot.arm()
    for _ in range(2500):
        simulation.tick()
    return simulation


def fly(plan: FlightPlan, images: list[Image], poses: list[Pose]) -> tuple[float, float, float]:
    """Fly the plan; processor, wall and simulated time, seconds.

    The first flight warms up. It takes all images of the camera, the others only those that are searched:
    these are kept, and where the camera was and how it moved then, as telemetry tells.
    """
    moments: list[Moment] = []
    taken: dict[int, Image] = {}
    fly_lockstep(plan, observers=(moments.append,), on_image=taken.__setitem__)
    last_us = None
    for before, moment in pairwise(moments):
        time_us = moment.detections.time_us
        if time_us in taken and time_us != last_us:
            last_us = time_us
            images.append(taken[time_us])
            poses.append(_pose(before.state, moment.state))
    timed = [timed_flight(plan) for _ in range(REPEATS)]
    simulated_s = moments[-1].state.time_us / 1e6
    return min(cpu_s for cpu_s, _ in timed), min(wall_s for _, wall_s in timed), simulated_s


def _pose(before: DroneState, state: DroneState) -> Pose:
    """Pose and motion at a tick; of the turn only that of the heading, since the tick before."""
    turn_rad_s = remainder(state.yaw - before.yaw, 2 * pi) / max((state.time_us - before.time_us) / 1e6, 1e-3)
    motion = ExposureMotion(state.time_us, state.velocity_arena_m_s, (0.0, 0.0, -turn_rad_s))
    return (state.x, state.y, state.z), state.attitude_arena, (), motion


def timed_flight(plan: FlightPlan) -> tuple[float, float]:
    stopwatch = Stopwatch()
    fly_lockstep(plan)
    return stopwatch.read()


def best(work: Callable[[], object], times: int) -> float:
    """Processor time of one call, the minimum of several rounds, seconds."""
    rounds = []
    for _ in range(REPEATS):
        stopwatch = Stopwatch()
        for _ in range(times):
            work()
        rounds.append(stopwatch.read()[0] / times)
    return min(rounds)


if __name__ == "__main__":
    main()
