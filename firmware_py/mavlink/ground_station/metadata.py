"""Component metadata: files with the names, units and texts of parameters and events for ground stations.

The formats are MAVLink's (https://mavlink.io/en/services/component_information.html), in the versions that
PX4 writes and ground stations read. They are made from the declarations at the first request, which takes
some hundredths of a second. COMPONENT_METADATA and the older COMPONENT_INFORMATION contain their addresses.
"""

from __future__ import annotations

import json
import lzma
from collections.abc import Iterator, Mapping
from functools import lru_cache
from zlib import crc32

from firmware_py.autopilot import Autopilot
from firmware_py.mavlink.ground_station.event_definitions import (
    COMPONENT,
    NAMESPACE,
    EventKind,
    all_kinds,
    enums,
    navigation_mode_groups,
)
from firmware_py.mavlink.service import AutopilotService
from firmware_py.parameters import DECLARATIONS, Parameter, Parameters
from framerunner.wire.dialect import Message, boot_ms, mavlink
from framerunner.wire.exchange import Exchange
from framerunner.wire.link import Link

FOLDER = "etc/extras"
GENERAL_FILE = f"{FOLDER}/component_general.json.xz"
PARAMETERS_FILE = f"{FOLDER}/parameters.json.xz"
EVENTS_FILE = f"{FOLDER}/all_events.json.xz"
FILES = (GENERAL_FILE, PARAMETERS_FILE, EVENTS_FILE)

_TYPE_PARAMETER, _TYPE_EVENTS = 1, 4  # COMP_METADATA_TYPE
_VENDOR = "framerunner"
_COMPRESSION = [{"id": lzma.FILTER_LZMA2, "preset": 6, "dict_size": 1 << 18}]  # unpacked in little memory


class ExtraFiles(Mapping[str, bytes]):
    """All files by their path on the vehicle, such as `etc/extras/parameters.json.xz`; made when first read.

    Args:
        parameters: of the vehicle, for its defaults; by default those that are declared.
    """

    def __init__(self, parameters: Parameters | None = None) -> None:
        self._parameters = parameters

    def __getitem__(self, path: str) -> bytes:
        if path not in FILES:
            raise KeyError(path)
        vehicle = DECLARATIONS if self._parameters is None else self._parameters.declarations
        pairs = zip(vehicle, DECLARATIONS, strict=True)
        own = tuple((each.name, each.default) for each, plain in pairs if each.default != plain.default)
        return _files(own)[path]

    def __iter__(self) -> Iterator[str]:
        return iter(FILES)

    def __len__(self) -> int:
        return len(FILES)


def file_crc(content: bytes) -> int:
    """MAVLink's CRC-32 of a file: zlib's without its first and last inversion."""
    return crc32(content, 0xFFFFFFFF) ^ 0xFFFFFFFF


@lru_cache(maxsize=4)
def _files(own_defaults: tuple[tuple[str, float], ...]) -> dict[str, bytes]:
    declarations = Parameters(defaults=dict(own_defaults)).declarations
    files = {
        PARAMETERS_FILE: _compressed(parameters_json(declarations)),
        EVENTS_FILE: _compressed(events_json()),
    }
    general = {
        "version": 1,
        "vendorName": _VENDOR,
        "metadataTypes": [
            {"type": number, "uri": f"mftp://{path}", "fileCrc": file_crc(files[path])}
            for number, path in ((_TYPE_PARAMETER, PARAMETERS_FILE), (_TYPE_EVENTS, EVENTS_FILE))
        ],
    }
    return {GENERAL_FILE: _compressed(general), **files}


def _compressed(content: object) -> bytes:
    text = json.dumps(content, ensure_ascii=False, separators=(",", ":"), sort_keys=True)
    return lzma.compress(text.encode(), lzma.FORMAT_XZ, lzma.CHECK_CRC32, filters=_COMPRESSION)


def parameters_json(declarations: tuple[Parameter, ...]) -> dict[str, object]:
    """`parameters.json`, version 1 as PX4 writes it."""
    return {"version": 1, "parameters": [_parameter(declared) for declared in declarations]}


def _parameter(declared: Parameter) -> dict[str, object]:
    number = int if declared.kind == "int32" else float
    described: dict[str, object] = {
        "name": declared.name,
        "type": "Int32" if declared.kind == "int32" else "Float",
        "shortDesc": declared.description,
        "longDesc": declared.details or f"{declared.description}.",
        "group": declared.group,
        "category": declared.category,
        "default": number(declared.default),
        "min": number(declared.minimum),
        "max": number(declared.maximum),
    }
    if declared.unit:
        described["units"] = declared.unit
    if declared.decimals is not None:
        described["decimalPlaces"] = declared.decimals
    if declared.increment is not None:
        described["increment"] = declared.increment
    if declared.choices:
        described["values"] = [
            {"value": value, "description": text} for value, text in sorted(declared.choices.items())
        ]
    if declared.bits:
        described["bitmask"] = [
            {"index": place, "description": text} for place, text in sorted(declared.bits.items())
        ]
    if declared.reboot_required:
        described["rebootRequired"] = True
    if declared.constant:
        described["readOnly"] = True
    return described


def events_json() -> dict[str, object]:
    """`all_events.json` in libevents' format, version 2."""
    groups: dict[str, dict[str, dict[str, object]]] = {}
    for kind in all_kinds():
        groups.setdefault(kind.group, {"events": {}})["events"][str(kind.sub_id)] = _event(kind)
    return {
        "version": 2,
        "components": {
            str(COMPONENT): {
                "namespace": NAMESPACE,
                "enums": enums(),
                "event_groups": groups,
                "navigation_mode_groups": navigation_mode_groups(),
                "supported_protocols": ["health_and_arming_check"],
            }
        },
    }


def _event(kind: EventKind) -> dict[str, object]:
    described: dict[str, object] = {"name": kind.name, "message": kind.message}
    if kind.summary:
        described["type"] = "summary"
    if kind.arguments:
        described["arguments"] = [{"type": each, "name": name} for each, name in kind.arguments]
    return described


class MetadataService(AutopilotService):
    """Sends the address of the general file, which has the addresses of the others."""

    def __init__(self, autopilot: Autopilot, exchange: Exchange) -> None:
        super().__init__(autopilot, exchange)
        self.replies = {
            mavlink.MAVLINK_MSG_ID_COMPONENT_METADATA: self._component_metadata,
            mavlink.MAVLINK_MSG_ID_COMPONENT_INFORMATION: self._component_information,
        }

    def _component_metadata(self, _link: Link, _index: int) -> list[Message]:
        return [mavlink.MAVLink_component_metadata_message(*self._general_file())]

    def _component_information(self, _link: Link, _index: int) -> list[Message]:
        return [mavlink.MAVLink_component_information_message(*self._general_file(), 0, b"")]

    def _general_file(self) -> tuple[int, int, bytes]:
        """Time, checksum and address, which both messages contain."""
        crc = file_crc(ExtraFiles(self._autopilot.parameters)[GENERAL_FILE])
        return boot_ms(self._exchange.time_us), crc, f"mftp://{GENERAL_FILE}".encode()
