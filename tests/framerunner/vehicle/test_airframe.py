"""Airframe files: declared values, and the messages of refused ones."""

import pytest
import yaml

from framerunner.vehicle.airframe import Airframe, AirframeError, load_airframe


def declared(name, **changes):
    return load_airframe(name).model_dump(mode="json") | changes


@pytest.mark.parametrize("name", ["abejorro", "racer-3in", "x500"])
def test_an_airframe_written_and_read_is_the_same(name, tmp_path):
    path = tmp_path / "copy.yaml"
    path.write_text(yaml.safe_dump(declared(name)))
    assert load_airframe(str(path)) == load_airframe(name)


def test_the_x500_has_its_published_figures():
    x500 = load_airframe("x500")
    assert x500.motor.thrust_n_s2 == 8.54858e-6
    assert x500.motor.torque_nm_s2 / x500.motor.thrust_n_s2 == pytest.approx(0.016, rel=1e-4)
    assert [(r.position_frd_m[:2], r.spin) for r in x500.rotors] == [
        ((0.174, 0.174), "ccw"),
        ((-0.174, -0.174), "ccw"),
        ((0.174, -0.174), "cw"),
        ((-0.174, 0.174), "cw"),
    ]
    assert x500.full_thrust_n / x500.weight_n == pytest.approx(1.69, abs=0.01)
    assert x500.parameters["MPC_THR_HOVER"] == pytest.approx(x500.weight_n / x500.full_thrust_n, abs=0.01)


@pytest.mark.parametrize("name", ["mpc_thr_hover", "MPC THR", "A_NAME_OF_SEVENTEE", "", "9LIVES"])
def test_parameter_names_must_be_valid_for_px4(name, tmp_path):
    path = tmp_path / "odd.yaml"
    path.write_text(yaml.safe_dump(declared("x500", parameters={name: 1.0})))
    with pytest.raises(AirframeError, match=rf"odd\.yaml:\d+: parameters\.{name} is .*capital letters"):
        load_airframe(str(path))


def test_an_unknown_weight_is_refused(tmp_path):
    path = tmp_path / "odd.yaml"
    path.write_text(yaml.safe_dump(declared("x500", stabiliser={"tilt": 1.0})))
    with pytest.raises(AirframeError, match=r"stabiliser\.tilt"):
        load_airframe(str(path))


def test_an_airframe_too_heavy_for_its_rotors_is_refused():
    with pytest.raises(ValueError, match="cannot carry"):
        Airframe.model_validate(declared("x500", mass_kg=4.0))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[" * 5000, "nested deeper than"),
        ("mass_kg: " + "9" * 5000, "is missing"),
        ("name: x\nname: y", "name is given twice, first on line 1"),
    ],
)
def test_what_cannot_be_read_is_refused_in_one_line(tmp_path, text, words):
    path = tmp_path / "odd.yaml"
    path.write_text(text)
    with pytest.raises(AirframeError, match=rf"odd\.yaml:\d[\d:]*: [^\n]*{words}[^\n]*$"):
        load_airframe(str(path))
