"""The checks before arming, on a simulated drone in simulated time."""

from dataclasses import replace

import pytest

from firmware_py.missions.items import PlanType
from framerunner.doctor.listen import listen
from framerunner.errors import SettingError
from framerunner.preflight.check_names import CHECK_NAMES
from framerunner.preflight.kept import KeptState, check_vehicle, load_kept, restore
from framerunner.preflight.link import open_client
from framerunner.preflight.prepare import own_simulator_id
from framerunner.preflight.run import NotArmedError, PreflightSettings, run_preflight
from framerunner.vehicle.geodesy import GeodeticPoint
from framerunner.wire.dialect import mavlink
from framerunner.wire.session.fence import FenceItem, download_fence, is_same_fence, upload_fence
from framerunner.wire.session.session import ParameterValue, VehicleError
from offboard.safety.check import Outcome

FAILING = ["COM_OBL_RC_ACT", "NAV_RCL_ACT", "COM_LOW_BAT_ACT", "GF_MAX_VER_DIST", "GF_MAX_HOR_DIST"]


def settings(tmp_path, **changed):
    return PreflightSettings("udpin://bench", folder=tmp_path, **changed)


def outcomes(report):
    return {check.name: check.outcome for check in report.checks}


def uid_of(link):
    with open_client(link.url) as client:
        return client.identity()[0]


def names_sent(link, kind):
    return [message.param_id for message in link.sent if message.get_type() == kind]


async def test_each_check_is_told_and_a_failing_one_prevents_arming(link, plan, tmp_path):
    report = await run_preflight(plan, settings(tmp_path))
    found = outcomes(report)
    assert [name for name, outcome in found.items() if outcome is Outcome.FAIL] == FAILING
    assert {"fence", "battery", "estimator", "link loss", "link latency", "caps", "position"} <= found.keys()
    assert not report.may_arm
    with pytest.raises(NotArmedError, match=r"5 checks have failed .*--accept NAME"):
        report.require()
    assert names_sent(link, "PARAM_SET") == []
    assert load_kept(report.kept) == KeptState(uid_of(link), (), ())  # there was no fence
    line = next(check.line for check in report.checks if check.name == "NAV_RCL_ACT")
    assert line.startswith("FAIL     NAV_RCL_ACT: 2 (return) (allowed: 3 (land)); set it to 3 (land)")


async def test_a_drone_that_knows_no_place_is_told_where_it_stands(link, plan, tmp_path):
    await run_preflight(plan, settings(tmp_path))
    assert not [message for message in link.sent if message.get_type() == "ODOMETRY"]
    alone = plan.scenario.model_copy(update={"sensors": "vio"})
    await run_preflight(replace(plan, scenario=alone), settings(tmp_path))
    start = plan.start_pose
    told = [message for message in link.sent if message.get_type() == "ODOMETRY"]
    assert told
    for message in told:
        assert (message.x, message.y) == pytest.approx((start[0], -start[1]), abs=1e-3)


async def test_the_fence_is_on_the_vehicle_and_read_back(link, plan, tmp_path):
    report = await run_preflight(plan, settings(tmp_path))
    assert outcomes(report)["fence"] is Outcome.PASS
    autopilot, start = link.simulation.autopilot, plan.scenario.start
    items = autopilot.missions.plan(PlanType.FENCE).items
    assert [item.command for item in items] == [mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION] * 4
    places = [autopilot.local_position(GeodeticPoint(item.x, item.y, 0.0)) for item in items]
    wanted = [(x - start.x_m, start.y_m - y) for x, y in report.fence.corners_arena_m]  # x points north
    assert [place[:2] for place in places] == [pytest.approx(corner, abs=0.02) for corner in wanted]
    for _ in range(500):
        link.simulation.tick()
    assert link.simulation.autopilot.status.ready  # the drone stands within it


async def test_another_fence_that_is_read_back_fails(link, plan, tmp_path, monkeypatch):
    monkeypatch.setattr("framerunner.preflight.run.download_fence", lambda session: ())
    report = await run_preflight(plan, settings(tmp_path))
    assert outcomes(report)["fence"] is Outcome.FAIL


async def test_parameters_are_set_and_returned(link, plan, tmp_path):
    before = {name: link.simulation.autopilot.parameters.value(name) for name in FAILING}
    report = await run_preflight(plan, settings(tmp_path, set_parameters=True))
    assert report.may_arm, [check.line for check in report.checks]
    assert [change.name for change in report.changes] == FAILING
    assert names_sent(link, "PARAM_SET") == FAILING
    assert link.simulation.autopilot.parameters.value("NAV_RCL_ACT") == 3
    kept = load_kept(report.kept)
    assert {each.name: each.value for each in kept.parameters} == before
    with open_client(link.url) as client:
        restore(client, kept, lambda line: None)
    assert {name: link.simulation.autopilot.parameters.value(name) for name in FAILING} == before


async def test_old_values_that_are_kept_are_not_overwritten(link, plan, tmp_path):
    first = await run_preflight(plan, settings(tmp_path, set_parameters=True))
    link.simulation.autopilot.parameters.set("NAV_RCL_ACT", 1)
    second = await run_preflight(plan, settings(tmp_path, set_parameters=True))
    third = await run_preflight(plan, settings(tmp_path, set_parameters=True))
    assert [first.kept.name, second.kept.name] == ["parameters-before.params", "parameters-before-2.params"]
    assert [each.name for each in load_kept(second.kept).parameters] == ["NAV_RCL_ACT"]
    assert load_kept(second.kept).fence is None  # this program's own, which the first check left
    assert (third.kept, third.changes) == (None, ())


async def test_where_the_old_values_are_is_told_even_if_setting_fails(link, plan, tmp_path, capsys):
    link.lost = lambda message: message.get_type() == "PARAM_SET"
    with pytest.raises(VehicleError, match="did not answer"):
        await run_preflight(plan, settings(tmp_path, set_parameters=True))
    kept = tmp_path / "parameters-before.params"
    assert f"--restore-parameters {kept}" in capsys.readouterr().err
    assert [each.name for each in load_kept(kept).parameters] == FAILING


async def test_nothing_is_set_if_the_old_values_cannot_be_kept(link, plan, tmp_path):
    nowhere = settings(tmp_path / "nowhere", set_parameters=True)
    with pytest.raises(SettingError, match="nothing was set"):
        await run_preflight(plan, nowhere)
    assert names_sent(link, "PARAM_SET") == []


async def test_lost_requests_are_repeated(link, plan, tmp_path):
    kinds = ("PARAM_REQUEST_READ", "PARAM_SET", "MISSION_COUNT", "MISSION_ITEM_INT", "MISSION_REQUEST_INT")
    counts = dict.fromkeys(kinds, 0)

    def every_third(message):
        kind = message.get_type()
        if kind not in counts:
            return False
        counts[kind] += 1
        return counts[kind] % 3 == 1

    link.lost = every_third
    report = await run_preflight(plan, settings(tmp_path, set_parameters=True))
    assert report.may_arm, [check.line for check in report.checks]


async def test_a_failure_is_accepted_by_its_name_only(link, plan, tmp_path):
    report = await run_preflight(plan, settings(tmp_path, accepted=("NAV_RCL_ACT",)))
    assert outcomes(report)["NAV_RCL_ACT"] is Outcome.ACCEPTED
    assert outcomes(report)["COM_OBL_RC_ACT"] is Outcome.FAIL


async def test_a_name_that_is_no_checks_is_found_before_anything_is_sent(link, plan, tmp_path):
    line = r"^--accept 'batery': there is no such check; use battery; the checks are armed, .*and all accepts"
    with pytest.raises(SettingError, match=line):
        await run_preflight(plan, settings(tmp_path, accepted=("COM_OBL_RC_ACT", "batery")))
    assert link.sent == []


async def test_each_check_that_is_told_can_be_accepted(link, plan, tmp_path):
    report = await run_preflight(plan, settings(tmp_path))
    assert {check.name for check in report.checks} <= CHECK_NAMES
    await run_preflight(plan, settings(tmp_path, accepted=("camera delay", "GUID_OPTIONS", "all")))


async def test_an_armed_vehicle_is_left_alone(link, plan, tmp_path):
    while not link.simulation.autopilot.status.ready:
        link.receive(0.1)
    link.simulation.autopilot.parameters.set("COM_DISARM_PRFLT", -1)
    link.simulation.autopilot.arm()
    report = await run_preflight(plan, settings(tmp_path, set_parameters=True))
    found = outcomes(report)
    assert (found["armed"], found["fence"]) == (Outcome.FAIL, Outcome.FAIL)
    assert names_sent(link, "PARAM_SET") == []
    assert not any(message.get_type() == "MISSION_COUNT" for message in link.sent)
    beats = [message.type for message in link.sent if message.get_type() == "HEARTBEAT"]
    assert beats
    assert mavlink.MAV_TYPE_GCS not in beats  # it would take the end of the checks for a lost ground station


async def test_nothing_that_is_sent_arms(link, plan, tmp_path):
    await run_preflight(plan, settings(tmp_path, set_parameters=True))
    commands = {message.command for message in link.sent if message.get_type().startswith("COMMAND_")}
    allowed = {mavlink.MAV_CMD_REQUEST_MESSAGE, mavlink.MAV_CMD_RUN_PREARM_CHECKS}
    assert commands <= allowed
    assert not link.simulation.autopilot.status.armed


def test_integers_survive_the_wire(link):
    with open_client(link.url) as client:
        for value in (0, 1, 3):
            kept = ParameterValue("NAV_DLL_ACT", value, mavlink.MAV_PARAM_TYPE_INT32)
            client.set_parameter(kept)
            assert client.read_parameters(["NAV_DLL_ACT"]) == {"NAV_DLL_ACT": kept}


def test_a_parameter_that_is_not_there_is_left_out(link):
    with open_client(link.url) as client:
        assert client.read_parameters(["NO_SUCH"]) == {}


@pytest.mark.parametrize(
    "text",
    [
        "# fence-items\t2\n# fence-item\t5001\t0\t3\t0\t0\t0\t1\t1\t0\n",
        "# fence-items\tmany\n",
        "",
        "# only a comment\n",
        "1 1 NAME 2 9\n",
        "1\t1\tNAME\tnan\t9\n",
        "1\t1\tNAME\t1.5\t6\n",
        "1\t1\tNAME\t1e300\t9\n",
        "1\t1\tNAME\t99999999999\t6\n",
        "1\t1\tNAME\t1\t99\n",
        "1\t1\tNAME\0\t1\t6\n",
        "# fence-items\t1\n# fence-item\t5001\t0\t1e300\t0\t0\t0\t1\t1\t0\n",
        "# fence-items\t1\n# fence-item\t5001\t0\t3\t0\t0\t0\t99999999999\t1\t0\n",
        "# fence-items\t1001\n" + "# fence-item\t5001\t0\t3\t0\t0\t0\t1\t1\t0\n" * 1001,
        "1\t1\tNAME\t1\t6\n" * 100_000,
    ],
    ids=range(15),
)
def test_a_file_that_cannot_be_returned_is_refused_in_a_line(tmp_path, text):
    path = tmp_path / "old.params"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(SettingError, match=r"--restore-parameters .*old.params"):
        load_kept(path)


def test_a_file_of_qgroundcontrol_is_read(tmp_path):
    path = tmp_path / "old.params"
    path.write_text("# Vehicle-Id Component-Id Name Value Type\n1\t1\tGF_ACTION\t2\t6\n", encoding="utf-8")
    kept = load_kept(path)
    assert kept == KeptState("", (ParameterValue("GF_ACTION", 2.0, 6),))
    with pytest.raises(SettingError, match=r"does not say of which vehicle .* add --any-vehicle"):
        check_vehicle(kept, path, "0a0b")


OLD_FENCE = (
    FenceItem(mavlink.MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION, 0, (40.0, 0.0, 0.0, 0.0), 473979710, 85461640),
    *(
        FenceItem(mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_EXCLUSION, 0, (3.0, 0.0, 0.0, 0.0), x, y)
        for x, y in ((473970000, 85460000), (473971000, 85460000), (473970000, 85461000))
    ),
)


@pytest.fixture
def client(link):
    with open_client(link.url) as client:
        listen(client, 3.0)
        yield client


async def test_the_old_fence_is_kept_and_returned(link, client, plan, tmp_path):
    upload_fence(client, OLD_FENCE)
    report = await run_preflight(plan, settings(tmp_path))
    assert outcomes(report)["fence"] is Outcome.PASS
    again = await run_preflight(plan, settings(tmp_path))
    assert again.kept is None  # the flight's fence is there already; the file of the first check stays
    kept = load_kept(report.kept)
    assert is_same_fence(kept.fence, OLD_FENCE)
    told = []
    restore(client, kept, told.append)
    assert told == ["the fence has 4 items, as before"]
    assert is_same_fence(download_fence(client), OLD_FENCE)
    restore(client, KeptState("", (), ()), told.append)
    assert (download_fence(client), told[-1]) == ((), "there is no fence, as before")


async def test_a_fence_that_cannot_be_kept_is_not_replaced(link, client, plan, tmp_path):
    upload_fence(client, OLD_FENCE)
    link.lost = lambda message: message.get_type() == "MISSION_REQUEST_INT"
    report = await run_preflight(plan, settings(tmp_path))
    assert outcomes(report)["fence"] is Outcome.FAIL
    link.lost = lambda message: False
    assert is_same_fence(download_fence(client), OLD_FENCE)


async def test_values_of_another_vehicle_are_not_returned(link, plan, tmp_path):
    report = await run_preflight(plan, settings(tmp_path, set_parameters=True))
    kept = load_kept(report.kept)
    assert kept.uid == uid_of(link) != ""
    check_vehicle(kept, report.kept, uid_of(link))
    with pytest.raises(SettingError, match=f"number {kept.uid}, but the one on the link has 0a0b; connect"):
        check_vehicle(kept, report.kept, "0a0b")
    with pytest.raises(SettingError, match="the one on the link reports no number"):
        check_vehicle(kept, report.kept, "")


@pytest.mark.parametrize("later_s", [0.0, 0.3, 20.0])
async def test_two_vehicles_with_the_same_id_are_refused(link, plan, tmp_path, later_s):
    link.add_vehicle(plan.scenario, later_s)
    report = await run_preflight(plan, settings(tmp_path))
    check = next(each for each in report.checks if each.name == "one vehicle")
    assert check.outcome is Outcome.FAIL
    assert check.value.startswith("two vehicles have this system id")
    assert not report.may_arm


@pytest.mark.parametrize("later_s", [0.0, 0.3, 20.0])
async def test_a_simulated_drone_beside_another_vehicle_with_its_id_is_no_simulation(link, plan, later_s):
    assert await own_simulator_id("udpin://127.0.0.1:14599", None) == 1
    link.add_vehicle(plan.scenario, later_s)
    assert await own_simulator_id("udpin://127.0.0.1:14599", None) is None


@pytest.mark.parametrize("lost", [0.0, 0.05, 0.3])
async def test_one_vehicle_whose_packets_are_lost_is_one(link, plan, tmp_path, lost):
    link.lose(lost)
    report = await run_preflight(plan, settings(tmp_path))
    assert "one vehicle" not in outcomes(report)
