"""Without GPS, motion capture and flow nothing is armed; 30 s without them end in a controlled landing."""

from pathlib import Path

import pytest
import yaml

import sitl.sensors
from firmware_py.status import CommandResult, FlightMode
from firmware_py.types import ManualInput
from scenarios.air import Wind
from scenarios.faults.declaration import parse_fault
from scenarios.loader import load_scenario
from sitl.simulation import Simulation
from tests.sitl.faults.hovering import hover

LOST = "Failsafe activated: position lost, descending"


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize(
    ("fault", "sensors", "airframe", "scenario", "wind_m_s"),
    [
        ("external_pose off at 0 s for 30 s", "mocap", "abejorro", "empty", 0.0),
        ("external_pose off at 0 s for 30 s", "mocap", "racer-3in", "empty", 2.0),
        ("gps off at 0 s for 30 s", "outdoor", "x500", "open-field", 0.0),
        ("gps off at 0 s for 30 s", "outdoor", "x500", "open-field", 5.0),
    ],
)
def test_30_s_without_a_position_end_in_a_controlled_landing(
    fault, sensors, airframe, scenario, wind_m_s, seed
):
    wind = Wind(speed_m_s=wind_m_s, turbulence_m_s=0.2 * wind_m_s)
    seen = hover(parse_fault(fault), sensors, airframe, scenario=scenario, wind=wind, seed=seed, after_s=30.0)
    assert [text for _, text in seen.failsafes] == [LOST]
    assert 5.0 < seen.failsafes[0][0] <= 6.0
    assert not seen.armed
    assert seen.at_rest
    assert seen.finite
    assert seen.tilt_deg < 30.0
    assert seen.touchdown_m_s < 1.5
    assert seen.moved_m < 8.0


def test_what_cannot_measure_its_motion_is_armed_only_in_modes_that_need_no_position(tmp_path):
    suite = yaml.safe_load((Path(sitl.sensors.__file__).parent / "suites" / "flow.yaml").read_text())
    del suite["optical_flow"]
    (tmp_path / "blind.yaml").write_text(yaml.safe_dump(suite))
    scenario = load_scenario("open-field").model_copy(update={"sensors": str(tmp_path / "blind.yaml")})
    simulation = Simulation(scenario, seed=1)
    for _ in range(500):
        simulation.tick()
    autopilot = simulation.autopilot
    assert autopilot.status.not_ready == "Arming denied: no position estimate"
    assert autopilot.arm() is CommandResult.TEMPORARILY_REJECTED
    autopilot.manual_input(ManualInput(simulation.time_us))
    autopilot.set_mode(FlightMode.POSITION)
    assert autopilot.arm() is CommandResult.TEMPORARILY_REJECTED
    autopilot.set_mode(FlightMode.ALTITUDE)
    assert autopilot.arm() is CommandResult.ACCEPTED
