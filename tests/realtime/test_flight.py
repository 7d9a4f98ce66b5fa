"""One whole flight as a user starts it, in real time over UDP and MAVSDK, and everything it leaves behind."""

import json

import cv2
import pytest
from pymavlink import mavutil

from framerunner.lockstep import fly_lockstep
from offboard.mission import load_mission
from scenarios.loader import load_scenario
from tests.processes import ports_are_free, program

pytestmark = pytest.mark.realtime

FIELDS = {
    *("scenario", "mission", "seed", "verdict", "reason", "frames_crossed", "crossing_times_s"),
    *("crossing_offsets_m", "contacts", "outside_s", "try_time_s", "penalty_s", "total_time_s"),
    *("landed_on_base", "landing_error_m", "path_length_m", "wall_time_s", "real_time_factor"),
}


def messages(path):
    """How many messages of each type a tlog holds."""
    log = mavutil.mavlink_connection(str(path))
    counts = {}
    while (message := log.recv_match()) is not None:
        counts[message.get_type()] = counts.get(message.get_type(), 0) + 1
    return counts


def images(path):
    """How many images of the camera's size a video holds."""
    video = cv2.VideoCapture(str(path))
    count = 0
    while (image := video.read()[1]) is not None:
        assert image.shape == (240, 320, 3)
        count += 1
    return count


def test_test_case_3_is_flown_in_real_time(tmp_path, instance):
    with program(tmp_path, "fly", "test-case-3", "--instance", str(instance)) as flight:
        code = flight.process.wait(240.0)
        assert code == 0, flight.err + flight.out
    assert ports_are_free(instance)
    (folder,) = (tmp_path / "runs").iterdir()

    result = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    assert FIELDS - result.keys() == set()
    assert result["verdict"] in ("clean", "completed")
    assert result["frames_crossed"] == ["red", "green", "blue"]
    assert result["landed_on_base"] is True
    assert result["landing_error_m"] < 0.25
    assert result["judged_by"] == "truth"
    assert result["real_time_factor"] == pytest.approx(1.0, abs=0.1)
    assert result["try_time_s"] == pytest.approx(result["wall_time_s"], rel=0.1)

    track = folder / "track.png"
    assert track.stat().st_size > 10_000
    assert cv2.imread(str(track)) is not None
    counts = messages(folder / "flight.tlog")
    assert counts["HEARTBEAT"] > result["try_time_s"]
    assert counts["ATTITUDE"] > 20 * result["try_time_s"]
    assert counts["SET_POSITION_TARGET_LOCAL_NED"] > 15 * result["try_time_s"]
    assert images(folder / "video.avi") > 8 * result["try_time_s"]

    lockstep = fly_lockstep(load_scenario("test-case-3"), load_mission("frame_challenge")).result
    assert (result["verdict"], tuple(result["crossing_sides"])) == (
        lockstep["verdict"],
        lockstep["crossing_sides"],
    )
    assert result["try_time_s"] == pytest.approx(lockstep["try_time_s"], rel=0.05)
