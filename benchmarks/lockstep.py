"""What a flight in lockstep costs, part by part, as ratios measured in one run on one core.

    python benchmarks/lockstep.py [SCENARIO] [--json]

Absolute times differ from machine to machine and from minute to minute; the ratios to one `run()` of JSBSim
with this drone's model, measured beside them, do not. Processor time is counted, so that other programs on
the machine disturb little.
"""

from __future__ import annotations

import json
import os
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass

os.environ.update({"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"})  # before NumPy is imported
if hasattr(os, "sched_setaffinity"):
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})

import cv2

from firmware_py.status import FlightMode
from framerunner.flying.lockstep import fly_lockstep
from framerunner.flying.plan import FlightPlan
from geometry.rotations import quaternion_from_yaw
from offboard.app import Moment
from offboard.mission import load_mission
from scenarios.loader import load_scenario
from scenarios.models import Scenario
from sitl.camera import Camera
from sitl.simulation import Simulation
from sitl.world import PHYSICS_RATE_HZ, STEPS_PER_CONTROL
from vision.detector import detect
from vision.types import Image

REPEATS = 5
Pose = tuple[tuple[float, float, float], tuple[float, float, float, float]]


@dataclass(frozen=True, slots=True)
class Parts:
    """What the parts of a flight cost: processor time, seconds.

    Attributes:
        scenario: its name.
        image_rate_hz: of the camera.
        simulated_s: length of the whole flight.
        raw_s: one `run()` of JSBSim with this drone's model.
        step_s: one step of physics with the autopilot, the referee and all else of a control tick.
        render_s: one image painted, the mean over the flight.
        detect_s: the same image searched for frames.
        flight_s: the whole flight with everything.
        flight_wall_s: the same by the wall clock.
    """

    scenario: str
    image_rate_hz: float
    simulated_s: float
    raw_s: float
    step_s: float
    render_s: float
    detect_s: float
    flight_s: float
    flight_wall_s: float


def main() -> None:
    """Measure and print."""
    words = sys.argv[1:]
    scenario = load_scenario(next((word for word in words if word != "--json"), "test-case-1"))
    parts = measure(scenario)
    if "--json" in words:
        print(json.dumps(asdict(parts)))
        return
    flight_s, raw_s = parts.simulated_s, parts.raw_s
    by_wall = f"{flight_s / parts.flight_s:.0f} x real time, by the wall {flight_s / parts.flight_wall_s:.0f}"
    rows = [
        ("JSBSim run()", raw_s, f"{1 / raw_s / PHYSICS_RATE_HZ:.0f} x real time"),
        (
            "physics, autopilot, referee: a step",
            parts.step_s,
            f"{1 / parts.step_s / PHYSICS_RATE_HZ:.0f} x real time",
        ),
        ("an image: render", parts.render_s, ""),
        ("an image: detect", parts.detect_s, ""),
        ("the whole flight", parts.flight_s, by_wall),
    ]
    print(f"{parts.scenario}, camera {parts.image_rate_hz:g} Hz, {flight_s:.1f} s simulated, one core\n")
    for name, cost_s, note in rows:
        print(f"{name:37s}{cost_s * 1e6:12.1f} us {cost_s / raw_s:12.1f} run()s   {note}")


def measure(scenario: Scenario) -> Parts:
    """Measure all parts, one after another."""
    cv2.setNumThreads(1)
    simulation = hovering(scenario)
    raw_s = best(simulation.world._dynamics.run, 20_000)
    step_s = best(simulation.tick, 5_000) / STEPS_PER_CONTROL
    images: list[Image] = []
    poses: list[Pose] = []
    flown_s, wall_s, flight_s = fly(scenario, images, poses)
    camera = Camera(scenario)
    render_s = best(lambda: [camera.render(*pose) for pose in poses], 1) / len(poses)
    detect_s = best(lambda: [detect(image) for image in images], 1) / len(images)
    return Parts(
        scenario.name,
        scenario.camera.rate_hz,
        flight_s,
        raw_s,
        step_s,
        render_s,
        detect_s,
        flown_s,
        wall_s,
    )


def hovering(scenario: Scenario) -> Simulation:
    """A simulation in the air, away from everything, in hold."""
    simulation = Simulation(scenario)
    while not simulation.autopilot.status.ready:
        simulation.tick()
    simulation.autopilot.set_mode(FlightMode.TAKEOFF)
    simulation.autopilot.arm()
    for _ in range(2500):
        simulation.tick()
    return simulation


def fly(scenario: Scenario, images: list[Image], poses: list[Pose]) -> tuple[float, float, float]:
    """Fly the challenge; processor, wall and simulated time, seconds. The first flight warms up."""
    plan = FlightPlan(scenario, load_mission("frame_challenge"))
    moments: list[Moment] = []
    fly_lockstep(plan, observers=(moments.append,), on_image=lambda _time_us, image: images.append(image))
    for moment in moments[:: max(1, len(moments) // 500)]:
        state = moment.state
        poses.append(((state.x, state.y, state.z), quaternion_from_yaw(state.yaw)))
    simulated_s = moments[-1].state.time_us / 1e6
    timed = [timed_flight(plan) for _ in range(REPEATS)]
    return min(cpu_s for cpu_s, _ in timed), min(wall_s for _, wall_s in timed), simulated_s


def timed_flight(plan: FlightPlan) -> tuple[float, float]:
    wall_s, cpu_s = time.perf_counter(), time.process_time()
    fly_lockstep(plan)
    return time.process_time() - cpu_s, time.perf_counter() - wall_s


def best(work: Callable[[], object], times: int) -> float:
    """Processor time of one call, the best of several rounds, seconds."""
    rounds = []
    for _ in range(REPEATS):
        started_s = time.process_time()
        for _ in range(times):
            work()
        rounds.append((time.process_time() - started_s) / times)
    return min(rounds)


if __name__ == "__main__":
    main()
