import asyncio

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from firmware_py.parameters import DECLARATIONS, Parameters
from sitl import parameter_file
from sitl.parameter_file import (
    ParameterFileError,
    ParameterKeeper,
    load_parameters,
    open_parameters,
    save_parameters,
)
from sitl.server_settings import ServerSettings


@pytest.fixture
def path(tmp_path):
    return tmp_path / "drone.params"


def keep(path, parameters):
    save_parameters(path, parameters.changed(), parameters)


def test_what_changed_is_written_as_ground_stations_do_and_read_again(path):
    parameters = Parameters({"MIS_TAKEOFF_ALT": 1.5, "COM_OBL_RC_ACT": 4, "BAT_LOW_THR": 0.20000000298023224})
    keep(path, parameters)
    lines = [line for line in path.read_text().splitlines() if not line.startswith("#")]
    assert lines == [
        "1\t1\tBAT_LOW_THR\t0.2\t9",
        "1\t1\tCOM_OBL_RC_ACT\t4\t6",
        "1\t1\tMIS_TAKEOFF_ALT\t1.5\t9",
    ]
    loaded = load_parameters(path, Parameters())
    assert loaded.values == {"BAT_LOW_THR": 0.2, "COM_OBL_RC_ACT": 4, "MIS_TAKEOFF_ALT": 1.5}
    assert Parameters(loaded.values).hash() == parameters.hash()


def test_the_system_id_is_written_first_but_not_kept(path):
    parameters = Parameters({"MAV_SYS_ID": 3, "MIS_TAKEOFF_ALT": 1.5})
    save_parameters(path, parameters.changed(), parameters, system_id=3)
    assert path.read_text().splitlines()[-1] == "3\t1\tMIS_TAKEOFF_ALT\t1.5\t9"
    assert "MAV_SYS_ID" not in load_parameters(path, Parameters()).values


def test_a_file_that_is_not_there_is_empty_but_its_folder_must_be(path):
    assert load_parameters(path, Parameters()).values == {}
    with pytest.raises(ParameterFileError, match="there is no folder"):
        load_parameters(path.parent / "nowhere" / "a.params", Parameters())


def test_mavproxys_form_comments_and_empty_lines(path):
    path.write_text("# saved\n\nMIS_TAKEOFF_ALT  4.000000  # high\nCOM_OBL_RC_ACT   5\n")
    assert load_parameters(path, Parameters()).values == {"MIS_TAKEOFF_ALT": 4.0, "COM_OBL_RC_ACT": 5}


def test_what_this_drone_cannot_set_is_left_out_and_named(path):
    path.write_text("1 1 EKF2_EN 1 6\n1 1 SYS_AUTOSTART 10040 6\n1 1 MAV_TYPE 2 6\n1 1 RTL_RETURN_ALT 20 9\n")
    loaded = load_parameters(path, Parameters())
    assert loaded.values == {"RTL_RETURN_ALT": 20.0}
    assert loaded.unknown == ["EKF2_EN", "SYS_AUTOSTART"]
    assert loaded.notice().endswith("cannot set them: EKF2_EN, SYS_AUTOSTART")
    loaded.unknown = list("ABCDEFG")
    assert loaded.notice().endswith("A, B, C, D, E and 2 more")
    assert load_parameters(path.parent / "none.params", Parameters()).notice() == ""


@pytest.mark.parametrize(
    ("line", "complaint"),
    [
        ("1 1 MIS_TAKEOFF_ALT high 9", "line 2: MIS_TAKEOFF_ALT: high is not a number"),
        ("1 1 MIS_TAKEOFF_ALT -3 9", "line 2: MIS_TAKEOFF_ALT: -3 is outside 0 to 10000 m"),
        ("MIS_TAKEOFF_ALT nan", "line 2: MIS_TAKEOFF_ALT: nan is not a finite number"),
        ("MIS_TAKEOFF_ALT", "line 2: MIS_TAKEOFF_ALT: must be `vehicle component NAME value type`"),
        ("COM_OBL_RC_ACT 2.5", "line 2: COM_OBL_RC_ACT: 2.5 is not a whole number"),
    ],
)
def test_a_wrong_line_is_named(path, line, complaint):
    path.write_text(f"# first\n{line}\n")
    with pytest.raises(ParameterFileError) as refused:
        load_parameters(path, Parameters())
    assert str(refused.value).startswith(f"{path}: {complaint}")


def test_what_is_no_text_or_no_file_is_refused(path):
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ParameterFileError, match="is UTF-16 text, or no text; save it as UTF-8"):
        load_parameters(path, Parameters())
    with pytest.raises(ParameterFileError, match="cannot be read"):
        load_parameters(path.parent, Parameters())


def test_a_file_that_cannot_be_written_leaves_what_was_there(path):
    path.mkdir()
    with pytest.raises(ParameterFileError, match=r"cannot be read \(Is a directory\)"):
        keep(path, Parameters({"MIS_TAKEOFF_ALT": 1.5}))
    assert [each.name for each in path.parent.iterdir()] == [path.name]


CHANGEABLE = [each for each in DECLARATIONS if not each.constant and each.name != "MAV_SYS_ID"]


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.dictionaries(
        st.sampled_from([each.name for each in CHANGEABLE]), st.floats(0.0, 1.0, width=32), max_size=20
    )
)
def test_every_value_survives_the_file_bit_by_bit(path, shares):
    parameters = Parameters()
    for name, share in shares.items():
        declared = parameters.declaration(name)
        value = declared.minimum + share * (declared.maximum - declared.minimum)
        if declared.choices:
            value = sorted(declared.choices)[int(share * (len(declared.choices) - 1))]
        parameters.set(name, round(value) if declared.kind == "int32" else value)
    keep(path, parameters)
    assert Parameters(load_parameters(path, Parameters()).values).hash() == parameters.hash()


async def test_changes_are_saved_a_moment_later_and_the_last_at_the_end(path, monkeypatch):
    monkeypatch.setattr(parameter_file, "SAVE_DELAY_S", 0.0)
    parameters, notices = Parameters(), []
    keeper = ParameterKeeper(parameters, path, notices.append)
    keeper.start()
    await asyncio.sleep(0)
    assert not path.exists()
    parameters.set("MAV_SYS_ID", 2)
    await asyncio.sleep(0)
    assert not path.exists()
    parameters.set("MIS_TAKEOFF_ALT", 1.5)
    async with asyncio.timeout(10):
        while not path.exists():  # noqa: ASYNC110  # a thread makes it
            await asyncio.sleep(0.001)
    monkeypatch.setattr(parameter_file, "SAVE_DELAY_S", 60.0)
    parameters.set("MIS_TAKEOFF_ALT", 3.0)
    await asyncio.sleep(0)
    await keeper.close()
    assert load_parameters(path, Parameters()).values == {"MIS_TAKEOFF_ALT": 3.0}
    assert notices == []


async def test_saving_is_done_on_request_and_a_failure_is_said(path):
    parameters, notices = Parameters(), []
    assert not parameters.save()
    path.mkdir()
    keeper = ParameterKeeper(parameters, path, notices.append)
    keeper.start()
    await asyncio.sleep(0)
    assert parameters.save()
    await keeper.close()
    assert notices == [f"parameters are not saved: {path}: cannot be read (Is a directory)"]


async def test_after_a_failure_the_next_save_has_all_that_was_set(path, monkeypatch):
    monkeypatch.setattr(parameter_file, "SAVE_DELAY_S", 0.0)
    path.write_text("MIS_TAKEOFF_ALT 4\n")
    parameters, failed = Parameters(), asyncio.Event()
    loop = asyncio.get_running_loop()
    keeper = open_parameters(parameters, path, lambda _: loop.call_soon_threadsafe(failed.set))
    keeper.start()
    path.write_text("no parameters\n\0")
    parameters.set("MIS_TAKEOFF_ALT", 6.0)
    async with asyncio.timeout(10):
        await failed.wait()
    path.write_text("MIS_TAKEOFF_ALT 4\n")
    parameters.set("RTL_RETURN_ALT", 20.0)
    await keeper.close()
    assert path.read_text() == "MIS_TAKEOFF_ALT 6\nRTL_RETURN_ALT\t20\n"


EXPORT = (
    "\ufeff# Onboard parameters of my drone\r\n"
    "1\t1\tCAL_ACC0_XOFF\t0.031\t9\r\n"
    "1\t1\tMPC_XY_CRUISE\t4.000000000000000000\t9\t# slow\r\n"
    "\r\n"
    "2\t1\tMPC_XY_CRUISE\t7\t9\r\n"
    "1\t100\tMPC_XY_CRUISE\t9\t9\r\n"
    "1\t1\tMAV_SYS_ID\t7\t6\r\n"
    "1\t1\tRTL_RETURN_ALT\t20\t9"
).encode()


def test_a_real_drones_export_keeps_all_lines_but_the_values_that_changed(path):
    path.write_bytes(EXPORT)
    parameters = Parameters(load_parameters(path, Parameters()).values)
    assert parameters.changed() == {"MPC_XY_CRUISE": 4.0, "RTL_RETURN_ALT": 20.0}
    keep(path, parameters)
    assert path.read_bytes() == EXPORT
    parameters.set("MPC_XY_CRUISE", 2.5)
    parameters.set("RTL_RETURN_ALT", parameters.declaration("RTL_RETURN_ALT").default)
    parameters.set("COM_OBL_RC_ACT", 4)
    keep(path, parameters)
    wanted = EXPORT.replace(b"4.000000000000000000", b"2.5").replace(b"ALT\t20\t9", b"ALT\t30\t9\r\n")
    assert path.read_bytes() == wanted + b"1\t1\tCOM_OBL_RC_ACT\t4\t6\r\n"
    assert load_parameters(path, Parameters()).values == {
        "MPC_XY_CRUISE": 2.5,
        "RTL_RETURN_ALT": 30.0,
        "COM_OBL_RC_ACT": 4,
    }


def test_lines_of_other_vehicles_are_named_and_not_those_of_this_one(path):
    path.write_bytes(EXPORT)
    loaded = load_parameters(path, Parameters(), system_id=2)
    assert loaded.values == {"MPC_XY_CRUISE": 7.0}
    assert loaded.notice() == (
        "lines of other vehicles and components left out: 1 1, 1 100; this drone is 2 1, by --instance 1"
    )


async def test_what_a_user_edits_meanwhile_stays(path):
    path.write_text("MIS_TAKEOFF_ALT 4\nRTL_RETURN_ALT 20\n")
    parameters = Parameters()
    keeper = open_parameters(parameters, path, pytest.fail)
    keeper.start()
    await asyncio.sleep(0)
    path.write_text("MIS_TAKEOFF_ALT 9 # by hand\nRTL_RETURN_ALT 20\n")
    parameters.set("RTL_RETURN_ALT", 25.0)
    await keeper.close()
    assert path.read_text() == "MIS_TAKEOFF_ALT 9 # by hand\nRTL_RETURN_ALT 25\n"


async def test_what_could_not_be_saved_is_saved_at_the_end(path, monkeypatch):
    monkeypatch.setattr("sitl.parameter_file.SAVE_DELAY_S", 0.0)
    parameters, failed = Parameters(), asyncio.Event()
    loop = asyncio.get_running_loop()
    keeper = open_parameters(parameters, path, lambda _: loop.call_soon_threadsafe(failed.set))
    keeper.start()
    path.write_text("a line that is not understood\n")
    parameters.set("RTL_RETURN_ALT", 25.0)
    await failed.wait()
    path.write_text("RTL_RETURN_ALT 20\n")
    await keeper.close()
    assert path.read_text() == "RTL_RETURN_ALT 25\n"


def test_opening_takes_over_what_is_there_and_says_what_is_not(path):
    path.write_text("RTL_RETURN_ALT 20\nEKF2_EN 1\n")
    parameters, notices = Parameters(), []
    open_parameters(parameters, path, notices.append)
    assert parameters.changed() == {"RTL_RETURN_ALT": 20.0}
    assert notices == [f"{path}: parameters left out, as this drone cannot set them: EKF2_EN"]


def test_each_drone_of_a_fleet_has_its_own_file(path):
    settings = ServerSettings(parameters=path)
    assert [settings.shifted(by).parameters.name for by in (0, 1, 3)] == [
        "drone.params",
        "drone-2.params",
        "drone-4.params",
    ]
    assert ServerSettings().shifted(1).parameters is None
