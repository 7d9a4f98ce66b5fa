"""docs/px4-compatibility.md lists all messages and commands."""

import re
from pathlib import Path

import pytest

from firmware_py.mavlink.camera.model import CAMERA_COMPONENT_ID, FixedCamera
from firmware_py.mavlink.node import MavlinkNode, NodeOptions
from firmware_py.mavlink.telemetry.profiles import GROUND, ONBOARD
from framerunner.wire.dialect import AUTOPILOT_COMPONENT_ID, mavlink

PAGE = (Path(__file__).parents[3] / "docs" / "px4-compatibility.md").read_text(encoding="utf-8")
NAMED = set(re.findall(r"[A-Z][A-Z0-9_]{3,}", PAGE))
COMMAND_NAMES = {
    number: name.removeprefix("MAV_CMD_")
    for name, number in vars(mavlink).items()
    if name.startswith("MAV_CMD_") and not name.endswith("ENUM_END")
}


@pytest.fixture(scope="module")
def node(airframe):
    from tests.firmware_py.mavlink.conftest import FakeAutopilot

    camera = FixedCamera(320, 240, 1.57, 10.0)
    return MavlinkNode(FakeAutopilot(airframe), (ONBOARD, GROUND), NodeOptions(camera=camera, shell=True))


def test_every_message_that_is_handled_or_sent_is_on_the_page(node):
    ids = {
        message_id
        for service in node.services
        for message_id in (*service.sources, *service.replies, *service.handlers)
    }
    assert len(ids) >= 80
    ids |= set(ONBOARD.rates_hz) | set(GROUND.rates_hz)
    names = {mavlink.mavlink_map[number].msgname for number in ids if number in mavlink.mavlink_map}
    assert names - NAMED - {"COMMAND_LONG", "COMMAND_INT"} == set()


def test_every_command_is_on_the_page(node):
    requests = {name for name in COMMAND_NAMES.values() if name.startswith("REQUEST_")}
    by_component = {AUTOPILOT_COMPONENT_ID: set(), CAMERA_COMPONENT_ID: set()}
    for service in node.services:
        by_component[service.component_id] |= {COMMAND_NAMES[number] for number in service.commands}
    own, cameras = by_component.values()
    assert len(own) >= 30
    assert len(cameras - requests) > 13
    assert (own | cameras - requests) - NAMED == set()
    assert CAMERA_COMPONENT_ID == 100


def test_every_row_has_its_kind():
    rows = [line for line in PAGE.splitlines() if line.startswith("| ") and not line.startswith("|---")]
    kinds = [row.split("|")[2].strip() for row in rows]
    assert set(kinds) == {"same", "different", "not there", ""}
    assert kinds.count("") == sum(
        row.split("|")[3].strip() == "" for row in rows if row.split("|")[2].strip() == ""
    )
