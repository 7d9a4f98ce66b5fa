"""PX4's parameters for our airframes and sensors."""

import pytest

from framerunner.cli import run
from framerunner.preflight.kept import load_kept
from framerunner.vehicle.airframe import load_airframe
from sitl.px4.parameters import airframe_parameters, suite_parameters
from sitl.sensors.suite import load_suite


def test_the_x500_is_px4s_own():
    values = airframe_parameters(load_airframe("x500"))
    assert values["CA_ROTOR_COUNT"] == 4
    places = [(values[f"CA_ROTOR{n}_PX"], values[f"CA_ROTOR{n}_PY"]) for n in range(4)]
    assert places == [(0.174, 0.174), (-0.174, -0.174), (0.174, -0.174), (-0.174, 0.174)]
    assert [values[f"CA_ROTOR{n}_KM"] > 0 for n in range(4)] == [True, True, False, False]  # ccw is positive
    assert values["MPC_THR_HOVER"] == pytest.approx(0.592, abs=0.001)
    assert values["MC_ROLLRATE_P"] == pytest.approx(0.15, rel=0.6)  # PX4's default, for such drones


def test_a_small_strong_drone_gets_small_gains_and_a_low_least_thrust():
    values = airframe_parameters(load_airframe("abejorro"))
    assert values["MC_ROLLRATE_P"] < 0.02
    assert values["MPC_THR_MIN"] < values["MPC_THR_HOVER"]
    assert values["COM_OBL_RC_ACT"] == 5  # of the airframe's file


@pytest.mark.parametrize(("suite", "gps", "compass"), [("mocap", False, False), ("outdoor", True, True)])
def test_the_estimator_uses_the_sensors_that_there_are(suite, gps, compass):
    values = suite_parameters(load_suite(suite))
    assert values.get("SYS_HAS_GPS", 1) == gps
    assert values.get("SYS_HAS_MAG", 1) == compass
    assert ("EKF2_EV_CTRL" in values) is not gps


def test_the_command_prints_them(capsys):
    assert run(["px4", "params", "x500"]) == 0
    assert "CA_ROTOR0_PX 0.174\n" in capsys.readouterr().out
    assert run(["px4", "params", "x500", "--env"]) == 0
    assert "PX4_PARAM_CA_ROTOR0_PX=0.174\n" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("suite", "wanted"),
    [
        (
            "flow",
            {"EKF2_OF_CTRL": 1, "EKF2_RNG_CTRL": 1, "EKF2_HGT_REF": 0, "EKF2_EV_CTRL": 0, "SYS_HAS_GPS": 0},
        ),
        ("mocap", {"EKF2_EV_CTRL": 15, "EKF2_HGT_REF": 3, "EKF2_TAU_POS": 0.1, "EKF2_RNG_CTRL": 0}),
    ],
)
def test_those_of_a_real_drone_are_a_file_that_preflight_reads(suite, wanted, capsys, tmp_path):
    assert run(["px4", "params", "--real", "--sensors", suite]) == 0
    file = tmp_path / "position.params"
    file.write_text(capsys.readouterr().out)
    read = load_kept(file)
    values = {each.name: each.value for each in read.parameters}
    assert {name: values.get(name) for name in wanted} == wanted
    assert not {"SIM_BAT_ENABLE", "CA_ROTOR_COUNT", "EKF2_MULTI_IMU"} & values.keys()
    kinds = {each.name: each.kind for each in read.parameters}
    assert kinds["SYS_HAS_GPS"] == 6


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["px4", "params", "--real", "--sensors", "outdoor"], "--sensors outdoor: a real drone indoors has"),
        (["sim", "--px4", "here"], "--px4 here: is for PX4; add --autopilot px4"),
        (["sim", "--autopilot", "px4", "--px4", "/no/px4"], "--px4 /no/px4: has no bin/px4"),
        (["sim", "--autopilot", "px4", "--count", "2"], "--count: PX4 flies one drone"),
        (
            ["sim", "--autopilot", "px4", "--ground-remote", "10.0.0.2"],
            "--ground-remote: MAVLink is PX4's own",
        ),
        (["sim", "--autopilot", "px4", "--monitor"], "--monitor: run framerunner monitor"),
        (["fly", "--px4", "/no/px4"], "--px4 /no/px4: has no bin/px4"),
        (["fly", "--px4", "here", "--lockstep"], "leave out --lockstep"),
    ],
)
def test_options_that_do_not_go_together(options, message, capsys):
    assert run(options) == 2
    assert message in capsys.readouterr().err
