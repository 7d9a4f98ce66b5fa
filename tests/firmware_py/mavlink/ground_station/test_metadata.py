"""The metadata files, against the rules of MAVLink's and libevents' published schemas."""

import json
import lzma
import re
from zlib import crc32

import pytest

from firmware_py.mavlink.ground_station.metadata import (
    EVENTS_FILE,
    FILES,
    GENERAL_FILE,
    PARAMETERS_FILE,
    ExtraFiles,
    file_crc,
)
from firmware_py.parameters import DECLARATIONS, Parameters

BASIC_TYPES = {"uint8_t", "uint16_t", "uint32_t", "int32_t", "float"}
PARAMETER_KEYS = {
    "name": str,
    "type": str,
    "shortDesc": str,
    "longDesc": str,
    "units": str,
    "default": (int, float),
    "decimalPlaces": int,
    "min": (int, float),
    "max": (int, float),
    "increment": (int, float),
    "rebootRequired": bool,
    "group": str,
    "category": str,
    "values": list,
    "bitmask": list,
    "readOnly": bool,
}


def content(path, parameters=None):
    return json.loads(lzma.decompress(ExtraFiles(parameters)[path]))


def test_the_general_file_names_the_others_with_their_checksums():
    general = content(GENERAL_FILE)
    assert set(general) == {"version", "vendorName", "metadataTypes"}
    assert general["version"] == 1
    assert general["metadataTypes"] == [
        {"type": 1, "uri": f"mftp://{PARAMETERS_FILE}", "fileCrc": file_crc(ExtraFiles()[PARAMETERS_FILE])},
        {"type": 4, "uri": f"mftp://{EVENTS_FILE}", "fileCrc": file_crc(ExtraFiles()[EVENTS_FILE])},
    ]


def test_the_checksum_is_mavlinks():
    crc = 0
    for byte in b"framerunner":
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0xEDB88320 if crc & 1 else 0)
    assert file_crc(b"framerunner") == crc != crc32(b"framerunner")


def test_parameters_keep_to_the_schema():
    described = content(PARAMETERS_FILE)
    assert set(described) == {"version", "parameters"}
    assert described["version"] == 1
    assert [each["name"] for each in described["parameters"]] == [each.name for each in DECLARATIONS]
    for each in described["parameters"]:
        for key, value in each.items():
            assert isinstance(value, PARAMETER_KEYS[key]), (each["name"], key)
        assert re.fullmatch(r"[A-Z][A-Z0-9_]{0,15}", each["name"])
        assert each["type"] in ("Int32", "Float")
        assert each["min"] <= each["default"] <= each["max"]
        assert all(set(choice) == {"value", "description"} for choice in each.get("values", []))
        assert all(set(bit) == {"index", "description"} for bit in each.get("bitmask", []))
        assert "\n" not in each["shortDesc"]


def test_parameters_carry_this_vehicles_defaults():
    parameters = Parameters(defaults={"MPC_THR_HOVER": 0.6})
    found = {each["name"]: each for each in content(PARAMETERS_FILE, parameters)["parameters"]}
    assert found["MPC_THR_HOVER"]["default"] == 0.6
    assert (
        found["MIS_TAKEOFF_ALT"] | {"units": "m", "decimalPlaces": 1, "increment": 0.5}
        == found["MIS_TAKEOFF_ALT"]
    )
    assert found["SYS_AUTOSTART"]["readOnly"] is True
    assert {"index": 1, "description": "In offboard mode"} in found["COM_RC_OVERRIDE"]["bitmask"]


@pytest.fixture(scope="module")
def component():
    described = content(EVENTS_FILE)
    assert set(described) == {"version", "components"}
    assert described["version"] == 2
    assert list(described["components"]) == ["1"]
    return described["components"]["1"]


def test_events_keep_to_the_schema(component):
    assert set(component) == {
        "namespace",
        "enums",
        "event_groups",
        "navigation_mode_groups",
        "supported_protocols",
    }
    assert component["supported_protocols"] == ["health_and_arming_check"]
    assert set(component["event_groups"]) == {"default", "arming_check", "health"}
    numbers = [number for group in component["event_groups"].values() for number in group["events"]]
    assert len(numbers) == len(set(numbers))
    for group in component["event_groups"].values():
        for number, event in group["events"].items():
            assert 0 <= int(number) < 1 << 24
            assert set(event) <= {"name", "message", "description", "type", "arguments"}
            assert re.fullmatch(r"[a-zA-Z][a-zA-Z0-9_]*", event["name"])
            assert re.fullmatch(r"[^\n]{1,120}", event["message"])
            assert event.get("type", "summary") == "summary"
            for argument in event.get("arguments", []):
                assert set(argument) == {"type", "name"}
                assert argument["type"] in BASIC_TYPES | set(component["enums"])


def test_enumerations_keep_to_the_schema(component):
    for name, enum in component["enums"].items():
        assert re.fullmatch(r"[a-zA-Z][a-zA-Z0-9_]*_t", name)
        assert enum["type"] in BASIC_TYPES
        for value, entry in enum["entries"].items():
            assert re.fullmatch(r"[0-9]+", value)
            assert set(entry) == {"name", "description"}
            assert re.fullmatch(r"[a-z][a-z0-9_]*", entry["name"])
            assert not enum.get("is_bitfield") or int(value).bit_count() == 1


def test_a_health_report_can_be_distinguished(component):
    # What libevents looks for: one summary at the beginning, one at the end, two arguments in between.
    for group, arguments in (("arming_check", 5), ("health", 4)):
        summaries = [
            event
            for event in component["event_groups"][group]["events"].values()
            if event.get("type") == "summary"
        ]
        assert [len(event["arguments"]) for event in summaries] == [arguments]
    for event in component["event_groups"]["arming_check"]["events"].values():
        if "type" not in event:
            assert [each["type"] for each in event["arguments"]] == ["navigation_mode_group_t", "uint8_t"]


def test_files_are_the_same_bytes_each_time_and_made_when_read():
    assert set(ExtraFiles()) == set(FILES)
    again = ExtraFiles(Parameters())
    assert len(again) == len(FILES)
    assert {path: again[path] for path in again} == ExtraFiles()
    with pytest.raises(KeyError):
        again["etc/passwd"]


@pytest.mark.parametrize(
    ("message_id", "uri", "crc"),
    [(397, "uri", "file_crc"), (395, "general_metadata_uri", "general_metadata_file_crc")],
)
def test_clients_receive_the_addresses_of_the_files(autopilot, peer, message_id, uri, crc):
    answers = peer.ask(peer.long(512, message_id))
    (told,) = [each for each in answers if each.get_msgId() == message_id]
    assert getattr(told, uri) == f"mftp://{GENERAL_FILE}"
    assert getattr(told, crc) == file_crc(ExtraFiles(autopilot.parameters)[GENERAL_FILE])
    assert [each.result for each in answers if each.get_type() == "COMMAND_ACK"] == [0]
