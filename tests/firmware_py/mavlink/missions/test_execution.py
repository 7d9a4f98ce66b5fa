from math import nan, radians

import pytest

from firmware_py.mavlink.camera.model import FixedCamera
from firmware_py.missions.flight import IssuedCommand
from firmware_py.status import CommandResult

START, ARM, SET_HOME = 2000, 400, 179
CAMERA = {"camera": FixedCamera(320, 240, radians(90.0), 10.0)}


def order(autopilot, peer, command, *params):
    """Issue a command of the mission, and let the node pass it on."""
    issued = [IssuedCommand(command, (*params, *[0.0] * (7 - len(params))))]
    autopilot.take_issued_commands = lambda: [issued.pop()] if issued else []
    return peer.advance(0.01)


def test_a_missions_picture_is_taken_by_the_camera(autopilot, make_peer):
    received = order(autopilot, make_peer(autopilot, node_options=CAMERA), START, 0.0, 0.0, 1.0, 1.0)
    assert [m.image_index for on, m in received if m.get_type() == "CAMERA_IMAGE_CAPTURED"] == [0, 0]
    assert autopilot.texts == []


@pytest.mark.parametrize(("first", "call"), [(1.0, ("arm", False)), (0.0, ("disarm", False))])
def test_arming_is_the_autopilots(autopilot, peer, first, call):
    order(autopilot, peer, ARM, first)
    assert autopilot.calls == [call]


@pytest.mark.parametrize(
    ("params", "place"), [((1.0,), None), ((0.0, 0, 0, 0, 47.0, 8.0, 500.0), (47.0, 8.0, 500.0))]
)
def test_home_is_here_or_there(autopilot, peer, params, place):
    homes = []
    autopilot.set_home = lambda point: homes.append(point) or CommandResult.ACCEPTED
    order(autopilot, peer, SET_HOME, *params)
    (home,) = homes
    assert (home and (home.latitude_deg, home.longitude_deg, home.altitude_m)) == place


@pytest.mark.parametrize(
    ("command", "params", "why"),
    [(START, (0.0, 0.0, 1.0), "unsupported"), (SET_HOME, (0.0, 0, 0, 0, nan, 8.0, 500.0), "denied")],
)
def test_a_command_that_fails_is_reported(autopilot, make_peer, command, params, why):
    peer = make_peer(autopilot)
    peer.meet_ground_station()
    received = order(autopilot, peer, command, *params)
    received += peer.advance(0.01)
    texts = [m.text for on, m in received if m.get_type() == "STATUSTEXT"]
    assert [text.strip() for text in texts] == [f"Mission command {command} not done: {why}"]
