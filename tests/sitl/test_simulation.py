"""World, autopilot and referee in one simulation."""

import pytest

from firmware_py.status import CommandResult, FlightMode
from scenarios.loader import load_scenario
from sitl.simulation import Simulation
from sitl.world import CONTROL_PERIOD_US


@pytest.fixture
def simulation():
    return Simulation(load_scenario("test-case-1"))


def run(simulation, seconds):
    for _ in range(round(seconds * 1e6) // CONTROL_PERIOD_US):
        simulation.tick()


def hop(simulation, *, fly=False):
    """Arm, stay on the base or fly for two seconds, disarm."""
    assert simulation.autopilot.arm() is CommandResult.ACCEPTED
    if fly:
        assert simulation.autopilot.takeoff() is CommandResult.ACCEPTED
    run(simulation, 2.0)
    assert simulation.truth.motors_on
    assert simulation.autopilot.disarm(force=True) is CommandResult.ACCEPTED
    run(simulation, 3.0)


def test_it_stands_where_the_scenario_says_and_time_is_whole_ticks(simulation):
    assert simulation.time_us == 0
    run(simulation, 2.0)
    assert simulation.time_us == 2_000_000
    assert simulation.truth.time_us == 2_000_000
    assert simulation.truth.position_arena_m[:2] == pytest.approx((-3.0, -3.0), abs=0.01)
    assert not simulation.truth.motors_on
    assert simulation.autopilot.status.ready


def test_the_referee_counts_from_motors_on_to_motors_off(simulation):
    run(simulation, 2.0)
    assert simulation.referee.snapshot().try_time_s == 0.0
    hop(simulation)
    snapshot = simulation.referee.snapshot()
    assert snapshot.settled
    assert snapshot.try_time_s == pytest.approx(2.0, abs=0.02)


@pytest.mark.parametrize("fly", [False, True], ids=["stood", "flew"])
def test_motors_on_again_begin_a_new_try(simulation, fly):
    run(simulation, 2.0)
    hop(simulation, fly=fly)
    assert simulation.referee.over is fly  # a try that did not leave the base was none
    assert simulation.referee.snapshot().try_time_s == pytest.approx(2.0, abs=0.02)  # stays until then
    run(simulation, 1.0)
    assert simulation.autopilot.arm(force=True) is CommandResult.ACCEPTED
    run(simulation, 0.5)
    snapshot = simulation.referee.snapshot()
    assert snapshot.try_time_s == pytest.approx(0.5, abs=0.02)
    assert snapshot.motors_on
    assert not snapshot.over


def test_a_drone_that_turns_too_fast_has_crashed_until_the_next_try(simulation):
    run(simulation, 2.0)
    assert simulation.autopilot.arm() is CommandResult.ACCEPTED
    assert simulation.autopilot.takeoff() is CommandResult.ACCEPTED
    run(simulation, 3.0)
    simulation.world.dynamics.push((0.0, 0.0, 0.0), (0.0, 0.0, 500.0))
    run(simulation, 0.01)
    simulation.world.dynamics.push((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    run(simulation, 2.0)
    report = simulation.referee.report()
    assert report.verdict == "crashed"
    assert "the drone turned faster than 100 rad/s" in report.reason
    simulation.autopilot.disarm(force=True)
    run(simulation, 3.0)
    simulation.autopilot.arm(force=True)
    run(simulation, 0.1)
    assert simulation.truth.crash == ""
    assert not simulation.referee.over


def test_it_takes_off_and_the_truth_agrees_with_the_estimate(simulation):
    run(simulation, 2.0)
    assert simulation.autopilot.arm() is CommandResult.ACCEPTED
    assert simulation.autopilot.takeoff() is CommandResult.ACCEPTED
    run(simulation, 6.0)
    x_m, y_m, z_m = simulation.truth.position_arena_m
    velocity_m_s = simulation.truth.velocity_arena_m_s
    north_m_s, east_m_s, down_m_s = simulation.autopilot.state.velocity_ned_m_s
    assert simulation.autopilot.status.mode in (FlightMode.TAKEOFF, FlightMode.HOLD)
    assert z_m > 2.0
    assert (x_m, y_m) == pytest.approx((-3.0, -3.0), abs=0.1)
    assert (north_m_s, -east_m_s, -down_m_s) == pytest.approx(velocity_m_s, abs=0.05)


def test_two_runs_are_equal_to_the_last_bit():
    ends = []
    for _ in range(2):
        simulation = Simulation(load_scenario("test-case-1"))
        run(simulation, 1.0)
        simulation.autopilot.arm()
        simulation.autopilot.takeoff()
        run(simulation, 2.0)
        truth = simulation.truth
        ends.append((truth.position_arena_m, truth.velocity_arena_m_s, truth.attitude_arena))
    assert ends[0] == ends[1]
