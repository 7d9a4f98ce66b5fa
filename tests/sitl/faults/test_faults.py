"""When faults begin and end, and which MAVLink can inject."""

import pytest

from scenarios.faults.declaration import FaultError, parse_fault
from scenarios.loader import load_scenario
from sitl.simulation import Simulation

GYROSCOPE, MAGNETOMETER, GPS, AIRSPEED, BATTERY, MOTOR, SERVO = 0, 2, 4, 8, 100, 101, 102
OK, OFF, STUCK, GARBAGE, WRONG, SLOW, DELAYED, INTERMITTENT = range(8)


def simulation(*faults, **changes):
    changes["faults"] = tuple(map(parse_fault, faults))
    return Simulation(load_scenario("empty").model_copy(update=changes))


def run(simulated, seconds):
    end_us = simulated.time_us + round(seconds * 1e6)
    while simulated.time_us < end_us:
        simulated.tick()


def active(simulated):
    return [str(fault) for fault in simulated.faults.active]


def test_times_count_from_arming_in_every_try():
    simulated = simulation("gps noisy 0.1 at 1 s for 0.5 s", "battery sag 0.02 at 0 s")
    run(simulated, 3.0)
    assert active(simulated) == []
    for _ in range(2):
        assert simulated.autopilot.arm().name == "ACCEPTED"
        armed_us = simulated.time_us
        run(simulated, 0.9)
        assert active(simulated) == ["battery sag 0.02 at 0 s"]
        run(simulated, 0.2)
        assert len(active(simulated)) == 2
        run(simulated, 0.6)
        assert active(simulated) == ["battery sag 0.02 at 0 s"]
        assert [begun.time_us - armed_us for begun in simulated.faults.begun] == [4000, 1_004_000]
        assert [begun.ended_us for begun in simulated.faults.begun] == [None, armed_us + 1_504_000]
        assert simulated.autopilot.disarm(force=True).name == "ACCEPTED"
        run(simulated, 2.0)
        assert active(simulated) == []
        assert simulated.battery.sag == 0.0


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        ("magnetometer off at 1 s", "have no magnetometer"),
        ("barometer off at 1 s", "the sensors ideal have no barometer"),
        ("motor 5 off at 1 s", "the drone has 4 motors"),
    ],
)
def test_a_part_that_the_drone_does_not_have_cannot_fail(fault, words):
    with pytest.raises(FaultError, match=words) as caught:
        simulation(fault)
    assert "\n" not in str(caught.value)


def test_poses_that_come_over_mavlink_cannot_fail_here():
    with pytest.raises(FaultError, match="the sensors external have no external_pose"):
        simulation("external pose off at 1 s", sensors="external")


def thrust_shares(simulated):
    """Speed of each motor over that of the fastest, after it was commanded to turn fast."""
    simulated.world.dynamics.command_motors((1000.0, 1000.0, 1000.0, 1000.0))
    for _ in range(200):
        simulated.world.dynamics.run()
    speeds = simulated.world.dynamics.motor_speeds_rad_s()
    return [round(speed / max(speeds), 3) for speed in speeds]


def test_motors_fail_and_are_repaired():
    simulated = simulation()
    inject = simulated.faults.inject
    assert inject(MOTOR, OFF, 2) == "motor 2 off"
    assert inject(MOTOR, SLOW, 4) == "motor 4 weak 0.2"
    assert thrust_shares(simulated) == [1.0, 0.0, 1.0, pytest.approx(0.8**0.5, abs=0.001)]
    assert inject(MOTOR, OK, 2) == "motor repaired"
    assert thrust_shares(simulated) == [1.0, 1.0, 1.0, pytest.approx(0.8**0.5, abs=0.001)]
    assert inject(MOTOR, OK, 0) == "motor repaired"
    assert thrust_shares(simulated) == [1.0] * 4
    assert active(simulated) == []


@pytest.mark.parametrize(
    ("what", "words"),
    [
        ((GPS, OFF, 0), "gps off"),
        ((GPS, STUCK, 1), "gps stuck"),
        ((GPS, GARBAGE, 0), "gps noisy 30 m"),
        ((GPS, WRONG, 0), "gps wrong 5 m"),
        ((GPS, DELAYED, 0), "gps delayed 0.5 s"),
        ((GPS, INTERMITTENT, 0), "gps lossy 0.5"),
        ((GYROSCOPE, OFF, 0), "gyroscope off"),
        ((BATTERY, OFF, 1), "battery monitor off"),
        ((MOTOR, STUCK, 1), "motor 1 stuck"),
    ],
)
def test_mavlink_injects_and_repairs(what, words):
    simulated = simulation()
    assert simulated.faults.inject(*what) == words
    assert len(active(simulated)) == 1
    assert simulated.faults.inject(what[0], OK, what[2]).endswith("repaired")
    assert active(simulated) == []


@pytest.mark.parametrize(
    "what",
    [
        (MOTOR, OFF, 5),
        (MOTOR, GARBAGE, 1),
        (BATTERY, OFF, 2),
        (BATTERY, SLOW, 0),
        (GPS, SLOW, 0),
        (GPS, OFF, 2),
        (GPS, 8, 0),
        (MAGNETOMETER, OFF, 0),  # ideal sensors have none
        (AIRSPEED, OFF, 0),
        (SERVO, OFF, 0),
        (999, OK, 0),
    ],
)
def test_what_cannot_fail_is_refused_and_changes_nothing(what):
    simulated = simulation()
    assert simulated.faults.inject(*what) is None
    assert active(simulated) == []


def test_an_injected_failure_stays_through_tries():
    simulated = simulation()
    run(simulated, 3.0)
    simulated.faults.inject(BATTERY, WRONG, 0)
    simulated.autopilot.arm()
    run(simulated, 0.5)
    simulated.autopilot.disarm(force=True)
    run(simulated, 0.5)
    assert active(simulated) == ["battery monitor wrong -2 V at 0 s"]
