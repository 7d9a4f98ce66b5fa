"""A walk with the simulated drone in the hands: what its flow, its range finder and its estimate show."""

from math import cos, pi, sin

import pytest

from framerunner.commands import with_sensors
from framerunner.doctor.listen import SYSTEM_ID
from framerunner.doctor.walk import STAND_S, WALK_SUBJECTS, WalkRecord, examine_walk, walk
from framerunner.geometry.rotations import quaternion_from_yaw
from framerunner.wire.dialect import mavlink
from framerunner.wire.session.client import VehicleClient
from offboard.safety.check import Outcome
from scenarios.loader import load_scenario
from sitl.simulation import Simulation
from tests.framerunner.preflight.bench import BenchLink

READY_S, WALK_S = 8.0, 30.0
HEIGHT_M, RADIUS_M = 1.0, 1.2


class HandHeld(Simulation):
    """A drone that somebody carries along a circle after some time, and puts back."""

    def __init__(self, scenario, seed, height_m=HEIGHT_M, missed_m=0.0):
        self.height_m, self.missed_m = height_m, missed_m
        super().__init__(scenario, seed=seed)

    def place(self, time_s):
        """North, east and down from the mark."""
        share = min(max((time_s - READY_S - STAND_S - 1.0) / (WALK_S - 4.0), 0.0), 1.0)
        smooth = share - sin(2 * pi * share) / (2 * pi)
        lifted = 0.5 - 0.5 * cos(min(share, 1.0 - share, 0.1) / 0.1 * pi)
        angle = 2 * pi * smooth
        north_m = RADIUS_M * sin(angle) + self.missed_m * smooth
        return north_m, RADIUS_M * (1.0 - cos(angle)), -self.height_m * lifted

    def _judge(self):
        super()._judge()
        sensors, time_s, step_s = self._sensors, self.time_us * 1e-6, 1e-3
        places = [self.place(time_s + by_s) for by_s in (-step_s, 0.0, step_s)]
        before, now, after = places
        start_m = sensors.position_ned_m
        sensors.position_ned_m = tuple(a + b for a, b in zip(start_m, now, strict=True))
        sensors.velocity_ned_m_s = tuple((b - a) / (2 * step_s) for a, b in zip(before, after, strict=True))
        sensors.attitude = quaternion_from_yaw(0.0)


def walked(suite, seed, **how):
    scenario = with_sensors(load_scenario("first-flight"), suite)
    link = BenchLink(scenario, simulation=HandHeld(scenario, seed, **how))
    record = WalkRecord(SYSTEM_ID)
    client = VehicleClient(link, record, lambda: link.simulation.time_us * 1e-6)
    client.find()
    client.run(READY_S - client.clock())
    walk(client, record, WALK_S)
    assert {message.get_type() for message in link.sent} <= {"HEARTBEAT", "COMMAND_LONG"}
    assert all(
        message.command == mavlink.MAV_CMD_SET_MESSAGE_INTERVAL
        for message in link.sent
        if message.get_type() == "COMMAND_LONG"
    )
    return {check.name: check for check in examine_walk(record)}


def test_a_floor_that_is_seen_well_is_good_enough():
    found = walked("flow", 11)
    assert {check.outcome for check in found.values()} == {Outcome.PASS}
    assert tuple(found) == WALK_SUBJECTS
    assert "in 0% of" in found["flow"].value
    assert float(found["walk"].value.split()[1]) == pytest.approx(2 * pi * RADIUS_M, abs=4.0)


def test_a_drone_that_comes_back_elsewhere_by_its_estimate_has_drifted():
    found = walked("flow", 12, missed_m=2.5)  # put down 2.5 m beside its mark, it reports just that
    drift = found["drift"]
    assert drift.outcome is Outcome.FAIL
    assert float(drift.value.split()[0]) == pytest.approx(250.0, abs=60.0)
    assert found["flow"].outcome is found["range"].outcome is Outcome.PASS


def test_a_range_finder_that_does_not_reach_the_floor_is_named():
    found = walked("flow-cheap", 13, height_m=4.6)  # it measures to 4 m, and without it there is no flow
    assert found["range"].outcome is found["flow"].outcome is Outcome.FAIL
    assert int(found["flow"].value.split("too low in ")[1].split("%")[0]) > 60


def test_a_drone_without_flow_is_told_so():
    found = walked("mocap", 14)
    assert found["flow"].outcome is Outcome.FAIL
    assert found["flow"].value == "0 samples a second are received"
