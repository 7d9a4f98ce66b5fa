"""The same app flies any airframe: it is told of none, and learns in flight how each follows commands."""

from __future__ import annotations

import asyncio
from math import cos, sin

import pytest

from benchmarks.airframes import drawn_airframe
from framerunner.flying.lockstep import LockstepVehicle
from framerunner.flying.plan import FlightPlan
from framerunner.vehicle.airframe import Airframe, load_airframe
from offboard.drone import DroneState, VelocityFluCommand
from offboard.navigation.following import PathFollower
from offboard.navigation.goals import CONTEST, Goal, Motion, Point
from offboard.navigation.path import Crossing, Path
from tests.offboard.navigation.flown_layouts import Layout, goals_left

AIRFRAMES = [load_airframe(name) for name in ("abejorro", "racer-3in", "x500")]
AIRFRAMES += [drawn_airframe(seed) for seed in (611, 612, 613)]
LAYOUTS = (300, 301)
TAKE_OFF_M = 0.4
OFF_M = 0.05  # from an opening's centre; at 0.065 the drone touches


@pytest.mark.parametrize("airframe", AIRFRAMES, ids=lambda airframe: airframe.name)
def test_an_airframe_comes_through_openings(airframe: Airframe):
    off_m = [each for seed in LAYOUTS for each in offsets(Layout.random(seed), airframe)]
    assert len(off_m) == 3 * len(LAYOUTS)
    assert max(off_m) < OFF_M


def offsets(layout: Layout, airframe: Airframe) -> list[float]:
    """Fly through the places of a layout's gates, where none stand, since not all airframes fit through them.

    Returns:
        Distances across from their centres.
    """
    scenario = layout.scenario.model_copy(update={"airframe": airframe.name})
    flight = FlightPlan(scenario.model_copy(update={"frames": ()}))
    flight.__dict__["airframe"] = airframe  # a cached property
    drone = LockstepVehicle(flight).drone
    asyncio.run(drone.ready())
    asyncio.run(drone.motors_on())
    base = layout.scenario.base
    goals: list[Goal] = [*layout.gates, Point((base.x_m, base.y_m, 1.5))]
    follower, state, found = PathFollower(), drone.next_state(), []
    ground_m = state.z
    while state.z < ground_m + TAKE_OFF_M:
        drone.command(VelocityFluCommand(up_m_s=0.5))
        state = drone.next_state()
    path = layout.plan(Motion((state.x, state.y, state.z), yaw_rad=state.yaw), goals)
    assert isinstance(path, Path)
    planned_s = began_s = state.time_us * 1e-6
    while not (follower.finished and follower.error_m < 0.1):
        now_s = state.time_us * 1e-6
        assert now_s - began_s < 100.0
        drone.command(follower.command(path, state, now_s))
        before, state = state, drone.next_state()
        found += [
            offset for crossing in path.crossings if (offset := _across(crossing, before, state)) is not None
        ]
        if now_s - planned_s >= 0.8 and follower.progress_s < path.duration_s - 1.0:
            planned_s, goals = now_s, goals_left(goals, path, follower.progress_s + follower.lead_s)
            reference = follower.reference()
            assert reference is not None
            again = layout.plan(reference, goals, path, CONTEST.adapted(follower.estimate.response))
            path = follower.continued(again) if isinstance(again, Path) else path
    return found


def _across(crossing: Crossing, before: DroneState, after: DroneState) -> float | None:
    """How far from a gate's centre its plane was crossed forward between two states; None if it was not."""
    (x, y, z), heading = crossing.gate.centre_m, crossing.heading_rad
    c, s = cos(heading), sin(heading)
    along = [c * (state.x - x) + s * (state.y - y) for state in (before, after)]
    if not along[0] < 0.0 <= along[1]:
        return None
    share = -along[0] / (along[1] - along[0])
    left, up = (
        (1.0 - share) * a + share * b
        for a, b in zip(*((c * (at.y - y) - s * (at.x - x), at.z - z) for at in (before, after)), strict=True)
    )
    away = (left * left + up * up) ** 0.5
    return away if away < 0.5 else None
