"""`framerunner mocap` as a program: a simulated drone that has no other position than its poses."""

import socket

import pytest

from tests.processes import program, simulator

pytestmark = pytest.mark.realtime


def test_a_simulators_true_poses_become_its_position(tmp_path, instance):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    folders = [tmp_path / name for name in ("sim", "mocap")]
    for folder in folders:
        folder.mkdir()
    link = ("--link", f"udpout://127.0.0.1:{port}", "--video-rtp", "off")
    with (
        simulator(folders[0], instance, "--sensors", "external", *link),
        program(
            folders[1], "mocap", "sitl", "--drone", f"udpin://127.0.0.1:{port}", "--seconds", "12"
        ) as mocap,
    ):
        assert mocap.process.wait(40.0) == 0, mocap.out + mocap.err
    assert "the vehicle uses the poses" in " ".join(mocap.out.split())
    assert "MISSING" not in mocap.out
