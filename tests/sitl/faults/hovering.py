"""A hovering flight with a fault, and what came of it."""

from dataclasses import dataclass, field
from math import acos, degrees, dist, hypot, isfinite

from scenarios.faults.declaration import Fault
from scenarios.loader import load_scenario
from sitl.simulation import Simulation

FAULT_AT_S = 9.0  # it hovers by then
READY_LIMIT_US = 30_000_000


@dataclass
class Hover:
    """One flight: how far it moved, its failsafes with their times since the fault, its landing."""

    failsafes: list = field(default_factory=list)
    moved_m: float = 0.0
    end_moved_m: float = 0.0
    tilt_deg: float = 0.0
    touchdown_m_s: float = 0.0
    armed: bool = True
    stopped: bool = False
    at_rest: bool = False
    finite: bool = True
    healthy: frozenset = frozenset()
    relied_on: frozenset = frozenset()
    state: tuple = ()


def hover(
    fault: Fault | None,
    sensors,
    airframe,
    *,
    after_s=20.0,
    seed=1,
    height_m=1.5,
    scenario="open-field",
    **changes,
):
    """Take off, hover, let the fault come, and fly on for a time, or until the drone is disarmed at rest."""
    faults = () if fault is None else (fault.model_copy(update={"at_s": FAULT_AT_S}),)
    changed = {"sensors": sensors, "airframe": airframe, "faults": faults, "try_limit_s": 600.0, **changes}
    simulation = Simulation(load_scenario(scenario).model_copy(update=changed), seed=seed)
    autopilot, seen = simulation.autopilot, Hover()
    while not autopilot.status.ready:
        simulation.tick()
        assert simulation.time_us < READY_LIMIT_US, autopilot.status.not_ready
    autopilot.parameters.set("MIS_TAKEOFF_ALT", height_m)
    assert autopilot.arm().name == "ACCEPTED"
    assert autopilot.takeoff().name == "ACCEPTED"
    fault_us = simulation.time_us + round(FAULT_AT_S * 1e6)
    place = None
    falling_m_s = 0.0
    while simulation.time_us < fault_us + after_s * 1e6:
        simulation.tick()
        seen.finite &= all(map(isfinite, autopilot.output.speeds_rad_s))
        truth = simulation.truth
        if simulation.time_us < fault_us:
            place = truth.position_arena_m
            continue
        seen.end_moved_m = dist(place, truth.position_arena_m)
        seen.moved_m = max(seen.moved_m, seen.end_moved_m)
        if not truth.contacts:
            falling_m_s = -truth.velocity_arena_m_s[2]
            _, x, y, _ = truth.attitude_arena
            seen.tilt_deg = max(seen.tilt_deg, degrees(acos(1 - 2 * (x * x + y * y))))
        else:
            seen.touchdown_m_s = max(seen.touchdown_m_s, falling_m_s)
            falling_m_s = 0.0
        speed_m_s = hypot(*truth.velocity_arena_m_s)
        seen.at_rest = bool(truth.contacts) and speed_m_s < 0.05
        if not truth.motors_on and seen.at_rest:
            break
    seen.failsafes = [((time_us - fault_us) / 1e6, text) for time_us, text in autopilot.flight.failsafes]
    seen.armed = autopilot.status.armed
    seen.stopped = set(autopilot.output.speeds_rad_s) == {0.0}
    report = autopilot.estimator.report()
    seen.healthy, seen.relied_on = report.healthy, report.relied_on
    seen.state = (simulation.truth.position_arena_m, simulation.truth.attitude_arena)
    return seen
