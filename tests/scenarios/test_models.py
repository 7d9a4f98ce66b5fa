import pytest
from pydantic import ValidationError

from framerunner.files.yaml_file import field_path
from scenarios.models import (
    Base,
    Gate,
    Scenario,
    StartPose,
    ground_height,
    is_over_base,
    start_position,
)


def test_the_opening_excludes_the_bars():
    gate = Gate(colour="red", x_m=0, y_m=0, z_m=1)
    assert gate.opening_m == pytest.approx((0.38, 0.18))


def test_a_refusal_names_field_and_value_in_python_too():
    with pytest.raises(ValidationError, match=r"bar_m 0\.2 leaves no opening"):
        Gate(colour="red", x_m=0, y_m=0, z_m=1, bar_m=0.2)


def test_field_path():
    assert field_path(("frames", 1, "x_m")) == "frames[1].x_m"
    assert field_path(()) == ""


def test_the_start_is_on_the_base_when_over_it():
    on_base = Scenario(name="a", base=Base(x_m=1, y_m=1), start=StartPose(x_m=1.25, y_m=0.75))
    beside = Scenario(name="a", base=Base(x_m=1, y_m=1), start=StartPose(x_m=1.26, y_m=1))
    assert start_position(on_base) == (1.25, 0.75, 0.51)
    assert start_position(beside) == (1.26, 1, 0.0)
    assert ground_height(beside, 1, 1) == 0.51
    assert not is_over_base(beside.base, 1, 1.3)
