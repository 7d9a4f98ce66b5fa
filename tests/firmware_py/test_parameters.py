from importlib import resources
from math import inf, nan
from pathlib import Path

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from firmware_py.parameters import DECLARATIONS, Parameter, ParameterError, Parameters
from firmware_py.parameters.reference import reference_page


def test_declarations_are_sorted_by_name_without_doubles():
    names = [declared.name for declared in DECLARATIONS]
    assert names == sorted(set(names))


def test_no_name_is_declared_twice_in_the_file():
    text = resources.files("firmware_py.parameters").joinpath("declarations.yaml").read_text(encoding="utf-8")
    groups = yaml.compose(text, yaml.SafeLoader).value
    names = [name.value for _, rows in groups for name, _ in rows.value]
    headings = [heading.value for heading, _ in groups]
    assert sorted(names) == [each.name for each in DECLARATIONS]
    assert len(set(headings)) == len(headings)


def test_each_declaration_has_a_description_and_a_unit_when_it_is_a_quantity():
    assert [each.name for each in DECLARATIONS if not each.description] == []
    assert [each.name for each in DECLARATIONS if not each.unit and each.kind != "int32"] == []


def test_starts_from_defaults_and_takes_given_values():
    parameters = Parameters({"MIS_TAKEOFF_ALT": 1.5})
    assert parameters.value("MIS_TAKEOFF_ALT") == 1.5
    assert parameters.value("COM_OF_LOSS_T") == 1.0
    assert parameters.integer("COM_OBL_RC_ACT") == 0


def test_set_counts_and_reports_only_changes():
    parameters = Parameters()
    heard = []
    parameters.on_change(lambda name, value: heard.append((name, value)))
    parameters.set("COM_OF_LOSS_T", 0.5)
    parameters.set("COM_OF_LOSS_T", 0.5)
    assert parameters.version == 1
    assert heard == [("COM_OF_LOSS_T", 0.5)]


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("COM_OF_LOSS_T", nan, "COM_OF_LOSS_T: nan is not a finite number"),
        ("COM_OF_LOSS_T", inf, "COM_OF_LOSS_T: inf is not a finite number"),
        ("COM_OF_LOSS_T", -500.0, "COM_OF_LOSS_T: -500 is outside 0 to 60 s"),
        ("COM_OBL_RC_ACT", 4.5, "COM_OBL_RC_ACT: 4.5 is not a whole number"),
        ("COM_OBL_RC_ACT", 8, "COM_OBL_RC_ACT: 8 is outside 0 to 7"),
        (
            "COM_LOW_BAT_ACT",
            1,
            "COM_LOW_BAT_ACT: there is no choice 1; there are 0 Warning, 2 Land mode, "
            "3 Return at critical level, land at emergency level",
        ),
        ("SYS_AUTOSTART", 10040, "SYS_AUTOSTART: is 4001 and cannot be changed"),
        ("NO_SUCH", 1.0, "NO_SUCH: there is no such parameter"),
    ],
)
def test_a_bad_value_is_refused_in_one_line_and_changes_nothing(name, value, message):
    parameters = Parameters()
    before = [parameters.value(declared.name) for declared in DECLARATIONS]
    with pytest.raises(ParameterError) as refused:
        parameters.set(name, value)
    assert str(refused.value) == message
    assert [parameters.value(declared.name) for declared in DECLARATIONS] == before
    assert parameters.version == 0


@given(st.sampled_from(DECLARATIONS), st.floats())
def test_whatever_is_set_stays_in_range(declared, value):
    parameters = Parameters()
    try:
        parameters.set(declared.name, value)
    except ParameterError:
        assert parameters.value(declared.name) == declared.default
    assert declared.minimum <= parameters.value(declared.name) <= declared.maximum


def test_a_declaration_must_be_consistent():
    with pytest.raises(ValidationError, match="outside"):
        Parameter(name="A", kind="float", default=3, minimum=0, maximum=2, description="x")
    with pytest.raises(ValidationError, match="whole"):
        Parameter(name="A", kind="int32", default=1, minimum=0.5, maximum=2, description="x")
    with pytest.raises(ValidationError, match="name"):
        Parameter(name="MUCH_TOO_LONG_A_NAME", kind="float", default=1, minimum=0, maximum=2, description="x")


def test_hash_follows_values():
    one, other = Parameters(), Parameters()
    assert one.hash() == other.hash()
    other.set("MIS_TAKEOFF_ALT", 2.0)
    assert one.hash() != other.hash()


def test_hash_is_the_plain_crc_over_names_and_bytes():
    declared = Parameter(name="AB", kind="int32", default=1, minimum=0, maximum=2, description="x")
    crc = 0
    for byte in b"AB\x01\x00\x00\x00":
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0xEDB88320 if crc & 1 else 0)
    assert Parameters(declarations=(declared,)).hash() == crc


def test_what_qgroundcontrol_insists_on_is_there_with_px4_s_values():
    """The facts of its page Sensors, and of its list of parameters of every vehicle."""
    defaults = {declared.name: declared.default for declared in DECLARATIONS}
    for number, device in enumerate((197388, 0, 0, 0)):
        assert (defaults[f"CAL_MAG{number}_ID"], defaults[f"CAL_MAG{number}_ROT"]) == (device, -1)
    names = ("SENS_BOARD_ROT", "SENS_BOARD_X_OFF", "SENS_BOARD_Y_OFF", "SENS_BOARD_Z_OFF", "SENS_DPRES_OFF")
    assert [defaults[name] for name in names] == [0, 1e-6, 0.0, 0.0, 0.001]
    assert (defaults["TRIG_MODE"], defaults["SYS_PARAM_VER"]) == (0, 1)
    assert "UAVCAN_ENABLE" not in defaults  # PX4's SITL has none either


def test_a_vehicles_own_defaults_do_not_count_as_changes():
    parameters = Parameters({"NAV_DLL_ACT": 3}, defaults={"MPC_THR_HOVER": 0.6, "SYS_AUTOSTART": 10040})
    assert parameters.value("MPC_THR_HOVER") == 0.6
    assert parameters.integer("SYS_AUTOSTART") == 10040
    assert parameters.declaration("SYS_AUTOSTART").constant
    assert parameters.changed() == {"NAV_DLL_ACT": 3}
    assert Parameters().value("MPC_THR_HOVER") == 0.5


@pytest.mark.parametrize("defaults", [{"MPC_THR_HOVER": 7.0}, {"NO_SUCH": 1.0}, {"SYS_AUTOSTART": nan}])
def test_an_invalid_default_is_refused(defaults):
    with pytest.raises(ParameterError, match=next(iter(defaults))):
        Parameters(defaults=defaults)


def test_a_default_received_in_four_bytes_is_the_default():
    parameters = Parameters({"MPC_LAND_SPEED": 1.0})
    parameters.set("MPC_LAND_SPEED", 0.699999988079071)  # 0.7 as MAVLink carries it
    assert parameters.value("MPC_LAND_SPEED") == 0.7
    assert parameters.changed() == {}
    parameters.set("MPC_LAND_SPEED", 0.699999988079071)
    assert parameters.version == 2


def test_reset_reports_each_change():
    parameters = Parameters({"MIS_TAKEOFF_ALT": 1.5, "COM_OBL_RC_ACT": 4})
    heard = []
    parameters.on_change(lambda name, value: heard.append((name, value)))
    parameters.reset()
    assert heard == [("COM_OBL_RC_ACT", 0), ("MIS_TAKEOFF_ALT", 2.5)]
    assert parameters.changed() == {}


def test_choices_and_bits_must_be_consistent():
    with pytest.raises(ValidationError, match="none of its choices"):
        Parameter(
            name="A", kind="int32", default=1, minimum=0, maximum=2, description="x", choices={0: "a", 2: "b"}
        )
    with pytest.raises(ValidationError, match="only an int32"):
        Parameter(name="A", kind="float", default=1, minimum=0, maximum=2, description="x", bits={0: "a"})


def test_each_declaration_is_well_written():
    for declared in DECLARATIONS:
        name = declared.name
        assert declared.description[0].isupper() or declared.description[0].isdigit(), name
        assert not declared.description.endswith("."), name
        assert not declared.details or declared.details.endswith("."), name
        if declared.choices:
            limits = (declared.minimum, declared.maximum)
            assert limits == (min(declared.choices), max(declared.choices)), name
        if declared.bits:
            assert declared.maximum == sum(1 << place for place in declared.bits), name


ROOT = Path(__file__).parents[2]


def test_every_parameter_that_can_be_changed_is_used():
    code = "".join(
        path.read_text(encoding="utf-8")
        for room in ("firmware_py", "sitl")
        for path in (ROOT / room).rglob("*.py")
        if path.parent.name != "parameters"
    )
    unused = {each.name for each in DECLARATIONS if not each.constant and f'"{each.name}"' not in code}
    assert unused == set()


def test_the_reference_page_is_made_from_the_declarations():
    page = ROOT / "docs" / "parameters.md"
    assert page.read_text(encoding="utf-8") == reference_page(), "run `make parameters`"


def test_the_reference_page_has_every_parameter():
    rows = [line for line in reference_page().splitlines() if line.startswith("| `")]
    assert sorted(row.split("`")[1] for row in rows) == [declared.name for declared in DECLARATIONS]
