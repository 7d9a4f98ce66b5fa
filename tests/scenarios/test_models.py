import pytest
from pydantic import ValidationError

from framerunner.files.yaml_file import field_path
from framerunner.geometry.gate_shape import GateShape
from scenarios.models import (
    Base,
    Decoy,
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


def test_bars_are_square_unless_a_depth_is_given():
    square = Gate(colour="red", x_m=0, y_m=0, z_m=1, bar_m=0.04)
    flat = Gate(colour="red", x_m=0, y_m=0, z_m=1, outer_width_m=1.0, depth_m=0.005)
    assert square.shape == GateShape(0.42, 0.22, 0.04, 0.04)
    assert "depth_m" not in square.model_dump()
    assert flat.hull.half_extents_m == (0.0025, 0.5, 0.11)
    assert Gate(**flat.model_dump()) == flat


def test_each_colour_has_a_shape():
    gate, x_m = Gate(colour="red", x_m=0, y_m=0, z_m=1, outer_width_m=1.0), (1, 2)
    decoys = [Decoy(colour="cyan", x_m=x, y_m=1, z_m=1, outer_width_m=x / 2) for x in x_m]
    shapes = Scenario(name="a", frames=(gate,), decoys=tuple(decoys)).gate_shapes
    assert {colour: shape.outer_width_m for colour, shape in shapes.items()} == {"red": 1.0, "cyan": 0.5}


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
