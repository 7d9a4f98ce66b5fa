"""The navigator flies the paper's test case 1 with a kinematic drone, in simulated time."""

from __future__ import annotations

from math import hypot

import pytest

from offboard.app import Moment, fly_mission
from offboard.mission import load_mission
from tests.offboard.fakes import START_1, TEST_CASE_1, GeometricPerception, KinematicDrone, Target, crossings
from vision.types import Detections


async def fly(mission, targets=TEST_CASE_1, limit_s=180.0):
    drone = KinematicDrone(*START_1)
    moments: list[Moment] = []
    perception = GeometricPerception(drone, targets)
    flight = fly_mission(drone, perception, mission, limit_s=limit_s, observer=moments.append)
    outcome = await flight
    return drone, moments, outcome


async def test_flies_test_case_1_to_its_end():
    drone, moments, outcome = await fly(load_mission("frame_challenge"))
    assert (outcome.ended, outcome.reason, outcome.mission_state) == ("finished", "", "landing.stop")
    assert 70 < outcome.flight_time_s < 115  # the paper's flight: 85 s, a faithful reproduction: 92 s
    for target in TEST_CASE_1.values():
        assert min(crossings(drone.path, target)) < 0.05
    assert hypot(drone.x - drone.start[0], drone.y - drone.start[1]) < 0.06
    assert drone.calls == ["connect", "ready", "motors_on", "motors_off", "close"]
    states = list(dict.fromkeys(moment.mission_state for moment in moments))
    assert states.index("red.crossing") < states.index("green.crossing") < states.index("blue.crossing")


async def test_soft_landing_lets_the_vehicle_land():
    drone, _, outcome = await fly(load_mission("soft_landing"))
    assert (outcome.ended, outcome.mission_state) == ("finished", "landing.touch_down")
    assert drone.calls == ["connect", "ready", "motors_on", "land", "close"]


@pytest.mark.parametrize("lag_s", [0.2, 0.7, 0.9])
async def test_careful_crossing_takes_late_vehicles_through_the_middle(lag_s):
    drone = KinematicDrone(*START_1, lag_s=lag_s)
    perception = GeometricPerception(drone, TEST_CASE_1)
    outcome = await fly_mission(drone, perception, load_mission("careful_crossing"))
    assert (outcome.ended, outcome.mission_state) == ("finished", "landing.touch_down")
    for target in TEST_CASE_1.values():
        assert min(crossings(drone.path, target)) < 0.05
    assert drone.calls[-2:] == ["land", "close"]


class GoingBlind(GeometricPerception):
    """Sees nothing any more from some tick on."""

    blind = False

    def latest(self, time_us):
        return Detections() if self.blind else super().latest(time_us)


@pytest.mark.parametrize("mission", ["frame_challenge", "careful_crossing"])
@pytest.mark.parametrize("state", ["red.frame_visible", "red.shift_left", "red.shift_right"])
async def test_a_gate_lost_from_view_is_not_climbed_after(mission, state):
    drone = KinematicDrone(*START_1)
    perception, moments = GoingBlind(drone, TEST_CASE_1), []

    def observe(moment):
        if moment.mission_state == state and not perception.blind:
            perception.blind, drone.rates[2] = True, 0.3
        if perception.blind:
            moments.append(moment)

    await fly_mission(drone, perception, load_mission(mission), limit_s=60.0, observer=observe)
    after = [each for each in moments if each.flight_time_s - moments[0].flight_time_s > 2.0]
    assert {each.mission_state for each in after} <= {"red.lost", "red.go_to_center", "red.turning"}
    search_m = 2.0
    assert max(each.state.z for each in moments) < max(moments[0].state.z, search_m) + 0.6


async def test_turns_for_ever_at_the_centre_when_a_gate_is_never_seen():
    far = {**TEST_CASE_1, "red": Target(0, 300, 1, 0)}
    drone, moments, outcome = await fly(load_mission("frame_challenge"), far, limit_s=60.0)
    assert (outcome.ended, outcome.mission_state) == ("timed out", "red.turning")
    assert "60 s" in outcome.reason
    assert drone.calls[-2:] == ["hold", "close"]
    assert moments[-1].flight_time_s == pytest.approx(60.0, abs=0.1)


async def test_two_flights_are_alike_to_the_last_bit():
    first, _, _ = await fly(load_mission("frame_challenge"))
    second, _, _ = await fly(load_mission("frame_challenge"))
    assert first.commands == second.commands
    assert first.path == second.path
