"""Poses as files and streams give them, their axes, and when they were taken."""

import json
import os
import socket
import time
from math import nan, radians
from pathlib import Path
from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from framerunner.geometry.rotations import euler_from_quaternion, quaternion_from_euler, rotation, to_world
from framerunner.mocap.poses import (
    Axes,
    MeasuredPose,
    PoseError,
    in_ned,
    parse_line,
    read_poses,
    with_forward,
)
from framerunner.mocap.sources import (
    MAX_LATE_S,
    FileSource,
    SitlSource,
    SourceClock,
    UdpSource,
    open_source,
)
from framerunner.wire.dialect import mavlink
from framerunner.wire.transports.sockets import UdpSocket
from framerunner.wire.transports.urls import LinkError

LEVEL = (1.0, 0.0, 0.0, 0.0)
CSV = "time_s,x,y,z,qw,qx,qy,qz\n0.0,1,2,3,1,0,0,0\n0.5,1,2,4,1,0,0,0\n"


def line(**changes):
    record = {"time_s": 1.0, "x": 1, "y": 2, "z": 3, "qw": 1, "qx": 0, "qy": 0, "qz": 0}
    return json.dumps(record | changes)


# A body whose nose points along the room's second horizontal axis and up by 20 degrees, one metre along the
# first, two along the second and three up: as each convention has it.
@pytest.mark.parametrize(
    ("axes", "position", "forward"),
    [
        (Axes.NED, (1.0, -2.0, -3.0), (0.0, -0.9397, -0.3420)),
        (Axes.FLU, (1.0, 2.0, 3.0), (0.0, 0.9397, 0.3420)),
        (Axes.YUP, (1.0, 3.0, -2.0), (0.0, 0.3420, -0.9397)),
        (Axes.ENU, (-2.0, 1.0, 3.0), (-0.9397, 0.0, 0.3420)),
    ],
)
def test_one_pose_in_all_axes(axes, position, forward):
    expected = MeasuredPose(0.0, (1.0, -2.0, -3.0), quaternion_from_euler(0.3, radians(20.0), radians(-90.0)))
    w, x, y, z = expected.attitude
    # The same attitude from the convention's body axes to its room's: by hand, not by the tested functions.
    attitude = {
        Axes.NED: (w, x, y, z),
        Axes.FLU: (w, x, -y, -z),
        Axes.YUP: (w, x, -z, y),
        Axes.ENU: None,
    }[axes]
    if attitude is None:  # ENU is FLU turned by a quarter about up
        half = 0.5**0.5
        fw, fx, fy, fz = (w, x, -y, -z)
        attitude = (half * (fw - fz), half * (fx - fy), half * (fx + fy), half * (fw + fz))
    assert to_world(rotation(attitude), 1.0, 0.0, 0.0) == pytest.approx(forward, abs=1e-4)
    found = in_ned(MeasuredPose(0.0, position, attitude, position), axes)
    assert found.position_ned_m == pytest.approx(expected.position_ned_m)
    assert found.velocity_ned_m_s == pytest.approx(expected.position_ned_m)
    assert euler_from_quaternion(found.attitude) == pytest.approx(euler_from_quaternion(expected.attitude))


def test_the_forward_axis_of_a_body_can_be_turned():
    turned = with_forward(MeasuredPose(0.0, (0.0, 0.0, 0.0), LEVEL), 90.0)  # forward is the body's left
    assert euler_from_quaternion(turned.attitude)[2] == pytest.approx(radians(-90.0))


def test_lines_of_a_stream():
    pose = parse_line(line(vx=1, vy=2, vz=3, more="is ignored")).pose(Axes.FLU)
    assert (pose.position_ned_m, pose.velocity_ned_m_s) == ((1.0, -2.0, -3.0), (1.0, -2.0, -3.0))
    assert parse_line(line(frame="ned")).pose(Axes.FLU).position_ned_m == (1.0, 2.0, 3.0)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("nonsense", "line: Invalid JSON"),
        (line(x=None), "x: Input should be a valid number"),
        (line(z=nan), "z: Input should be a finite number"),
        (line(frame="xyz"), "frame: Input should be 'flu', 'ned', 'enu' or 'yup'"),
        (line(qw=0.5), "qw, qx, qy, qz: a quaternion of length 0.5; it must be 1"),
    ],
)
def test_a_line_that_is_no_pose(text, words):
    with pytest.raises(PoseError) as refused:
        parse_line(text).pose(Axes.FLU)
    assert str(refused.value).startswith(words)


def test_files(tmp_path):
    table, lines = tmp_path / "poses.csv", tmp_path / "poses.jsonl"
    table.write_text(CSV)
    lines.write_text(f"{line(time_s=0.0)}\n\n{line(time_s=0.5, z=4)}\n")
    assert read_poses(table, Axes.FLU, None) == read_poses(lines, Axes.FLU, None)
    source = FileSource(table, Axes.FLU, None)
    assert [each.taken_s for each in source.poll(10.0)] == [10.0]
    assert source.poll(10.4) == []
    assert [each.taken_s for each in source.poll(10.6)] == [10.5]
    assert source.ended


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (CSV + "0.5,1,2,3,1,0,0,0\n", "time_s 0.5 must be above 0.5, the one before"),
        (CSV + "1.0,,2,3,1,0,0,0\n", "line 4: x: Input should be a valid number"),
        (CSV + ",1,2,3,1,0,0,0\n", "line 4: time_s: missing"),
        ("x,y\n", "there is no pose in it"),
    ],
)
def test_a_file_with_a_fault_is_refused_in_one_line(tmp_path, text, words):
    path = tmp_path / "poses.csv"
    path.write_text(text)
    with pytest.raises(PoseError) as refused:
        read_poses(path, Axes.FLU, None)
    assert words in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_missing_file_is_refused_in_one_line(tmp_path):
    with pytest.raises(PoseError, match=r"cannot be read .*give a \.csv or \.jsonl file of poses"):
        read_poses(tmp_path / "none.csv", Axes.FLU, None)


def test_a_device_is_no_file_of_poses():
    with pytest.raises(PoseError, match="is not a regular file"):
        read_poses(Path("/dev/zero"), Axes.FLU, None)


def test_jitter_of_arrival_is_removed_from_time_stamps():
    clock = SourceClock()
    jitter = (0.002, 0.0, 0.012, 0.001, 0.030)
    taken = [clock.taken_s(100.0 + 0.02 * n, 5.0 + 0.02 * n + late) for n, late in enumerate(jitter)]
    assert taken[1:] == pytest.approx([5.02, 5.04, 5.06, 5.08])
    assert clock.taken_s(nan, 7.0) == 7.0


class Stamped:
    """Four seconds of poses: when each was taken, its time stamp, and when it arrives, 2 to 10 ms later."""

    def __init__(self, rate_hz, seed):
        random, count = Random(seed), round(4.0 * rate_hz)
        self.taken_s = [10.0 + number / rate_hz for number in range(count)]
        self.stamps_s = [taken_s + 777.0 for taken_s in self.taken_s]
        self.arrivals_s = [taken_s + random.uniform(0.002, 0.01) for taken_s in self.taken_s]

    def sent(self):
        """Arrival, time taken by the stamp, and true time of those that a session sends on."""
        clock, newest_s = SourceClock(), 0.0
        for arrived_s, stamp_s, taken_s in sorted(
            zip(self.arrivals_s, self.stamps_s, self.taken_s, strict=True)
        ):
            found_s = clock.taken_s(stamp_s, arrived_s)
            if found_s is not None and found_s > newest_s:
                newest_s = found_s
                yield arrived_s, found_s, taken_s

    def check(self, changed_s=12.0, error_s=0.015):
        """Poses go on within half a second, never with a wrong time, and then with the right one."""
        sent, before_s = list(self.sent()), self.arrivals_s[0]
        for arrived_s, found_s, taken_s in sent:
            settled = arrived_s < changed_s or arrived_s > changed_s + 0.5
            assert abs(found_s - taken_s) < (error_s if settled else MAX_LATE_S + error_s)
            assert arrived_s - before_s < 0.5
            before_s = arrived_s
        assert sent[-1][2] > self.taken_s[-1] - 0.1


RATES_HZ = st.sampled_from((20.0, 50.0, 100.0))
SEEDS = st.integers(0, 99)
examples = settings(max_examples=20)
ERRORS_S = st.floats(-1e6, 1e6) | st.floats(-2.0, 2.0)


@examples
@given(RATES_HZ, ERRORS_S, SEEDS)
def test_a_step_of_the_sources_clock_is_followed(rate_hz, step_s, seed):
    poses = Stamped(rate_hz, seed)
    first = round(2.0 * rate_hz)
    poses.stamps_s[first:] = [stamp_s + step_s for stamp_s in poses.stamps_s[first:]]
    poses.check()


@examples
@given(RATES_HZ, ERRORS_S, SEEDS)
def test_one_wrong_time_stamp_is_left_out_or_changes_nothing(rate_hz, error_s, seed):
    poses = Stamped(rate_hz, seed)
    wrong = round(2.0 * rate_hz)
    poses.stamps_s[wrong] += error_s
    sent = list(poses.sent())
    assert all(abs(found_s - taken_s) < 0.015 for _, found_s, taken_s in sent if taken_s != 12.0)
    poses.check()


@examples
@given(RATES_HZ, st.floats(-0.02, 0.02), SEEDS)
def test_a_clock_that_runs_fast_or_slowly_is_followed(rate_hz, drift, seed):
    poses = Stamped(rate_hz, seed)
    poses.stamps_s = [stamp_s + drift * number / rate_hz for number, stamp_s in enumerate(poses.stamps_s)]
    poses.check()


@examples
@given(RATES_HZ, st.floats(0.0, 1.5), st.integers(1, 9), SEEDS)
def test_doubled_swapped_and_delayed_poses_keep_their_times(rate_hz, delay_s, every, seed):
    poses = Stamped(rate_hz, seed)
    for number in range(3, len(poses.taken_s) // 2, 10):
        poses.arrivals_s.append(poses.arrivals_s[number + every % 3] + delay_s * every / 9)
        for values in (poses.taken_s, poses.stamps_s):
            values.append(values[number + every % 3])
        poses.arrivals_s[number] += delay_s
    assert all(abs(found_s - taken_s) < 0.015 for _, found_s, taken_s in poses.sent())
    poses.check()


@examples
@given(RATES_HZ, st.floats(0.1, 4.0), st.floats(1.5, 1e3), SEEDS)
def test_poses_that_a_network_held_back_are_not_taken_for_new_ones(rate_hz, stall_s, pace, seed):
    poses = Stamped(rate_hz, seed)
    for number, taken_s in enumerate(poses.taken_s):
        if taken_s >= 12.0:  # after the stall the queue empties at a multiple of the usual pace
            due_s = 12.0 + stall_s + (taken_s - 12.0) / pace
            poses.arrivals_s[number] = max(poses.arrivals_s[number], due_s)
    assert all(found_s - taken_s < 0.05 for _, found_s, taken_s in poses.sent())


def received(name, *lines):
    """What a source of a UDP stream makes of lines, and itself."""
    opened = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    opened.bind(("127.0.0.1", 0))
    source = UdpSource(UdpSocket(opened), "here", Axes.FLU, name)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for each in lines:
            sender.sendto(b"", opened.getsockname())  # an empty datagram hides nothing
            sender.sendto(each.encode(), opened.getsockname())
    found = source.poll(3.0)
    source.close()
    return [each.pose.position_ned_m[0] for each in found], source


def test_a_udp_stream():
    found, source = received(None, line(x=1), f"nonsense\n{line(x=2, time_s=1.02)}")
    assert found == [1.0, 2.0]
    assert source.faults == 1
    assert source.fault.startswith("line: Invalid JSON")


def test_a_pose_with_a_late_time_stamp_is_left_out_and_counted():
    found, source = received(None, line(x=1), line(x=2, time_s=0.4))
    assert (found, source.faults) == ([1.0], 1)
    assert source.fault == "time_s: 0.4 is more than 0.1 s behind its arrival, by the poses before"


def test_one_body_is_followed():
    lines = (line(x=1, name="a"), line(x=2, name="b"), line(x=3, name="a"))
    found, source = received("b", *lines)
    assert (found, source.faults) == ([2.0], 0)
    found, source = received(None, *lines)
    assert found == [1.0, 3.0]
    assert source.fault == "name: b is tracked as well as a; choose one with --body"


SERVER = """
import time


class Turn:
    w, x, y, z = 1.0, 0.0, 0.0, 0.0


class Body:
    name, position, rotation = "drone", (1.0, 2.0, 3.0), Turn


class Server:
    rigidBodies = {"drone": Body}

    def waitForNextFrame(self):
        time.sleep(0.01)


def connect(kind, options):
    if options["hostname"] == "nowhere":
        raise RuntimeError("cannot connect")
    assert (kind, options) == ("optitrack", {"hostname": "10.0.0.5"})
    return Server()
"""


@pytest.fixture
def library(tmp_path, monkeypatch):
    """A stand-in for the library `motioncapture`, whose API this is (version 1.1)."""
    (tmp_path / "motioncapture.py").write_text(SERVER)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setenv("PYTHONPATH", f"{tmp_path}{os.pathsep}{os.getcwd()}")


def polled(source, limit_s=20.0):
    end_s = time.monotonic() + limit_s
    try:
        while time.monotonic() < end_s:
            if found := source.poll(time.monotonic()):
                return found
            time.sleep(0.01)
        return []
    finally:
        source.close()


def test_a_motion_capture_server(library):
    found = polled(open_source("optitrack://10.0.0.5", Axes.YUP, "drone"))
    assert found[0].pose.position_ned_m == (1.0, 3.0, -2.0)


def test_a_server_that_cannot_be_reached_ends_in_one_line(library):
    with pytest.raises(PoseError, match=r"^vicon://nowhere: cannot connect$"):
        polled(open_source("vicon://nowhere", Axes.FLU, None))


def test_a_source_that_is_none():
    with pytest.raises(LinkError, match=r"^bad source 'ftp://x': .*optitrack://"):
        open_source("ftp://x", Axes.FLU, None)
    with pytest.raises(PoseError, match="a stream of poses comes by UDP"):
        open_source("tcpin://127.0.0.1:9870", Axes.FLU, None)


def test_a_simulators_truth():
    source = SitlSource(position_noise_m=0.0, attitude_noise_rad=0.0)

    def state(latitude, altitude):
        return mavlink.MAVLink_hil_state_quaternion_message(
            5_000_000, LEVEL, 0, 0, 0, latitude, 85_000_000, altitude, 100, -200, 300, 0, 0, 0, 0, 0
        )

    source.take(state(470_000_000, 500_000), 1.0)
    source.take(state(470_000_100, 501_000), 1.0)
    first, second = source.poll(1.0)
    assert first.pose.position_ned_m == (0.0, 0.0, 0.0)
    assert second.pose.position_ned_m == pytest.approx((1.113, 0.0, -1.0), abs=1e-3)
    assert second.pose.velocity_ned_m_s == (1.0, -2.0, 3.0)
    assert second.vehicle_time_us == 5_000_000
