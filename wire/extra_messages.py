"""Messages of MAVLink's `common` that pymavlink's dialects have left out: events, metadata, links, motors.

Their classes are made from the fields as the definition lists them; order on the wire and the extra byte of
the checksum follow from these (https://mavlink.io/en/guide/serialization.html).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from struct import Struct
from typing import Any

_CODES = {
    "char": "s",
    "uint8_t": "B",
    "uint16_t": "H",
    "int16_t": "h",
    "uint32_t": "I",
    "int32_t": "i",
    "float": "f",
    "uint64_t": "Q",
}
_SIZES = {
    "char": 1,
    "uint8_t": 1,
    "uint16_t": 2,
    "int16_t": 2,
    "uint32_t": 4,
    "int32_t": 4,
    "float": 4,
    "uint64_t": 8,
}


@dataclass(frozen=True, slots=True)
class _Field:
    kind: str
    name: str
    length: int = 0  # of an array

    @property
    def code(self) -> str:
        return f"{self.length or ''}{_CODES[self.kind]}"


_TARGET = (_Field("uint8_t", "target_system"), _Field("uint8_t", "target_component"))

_DEFINITIONS: dict[str, tuple[int, tuple[_Field, ...]]] = {
    "LINK_NODE_STATUS": (
        8,
        (
            _Field("uint64_t", "timestamp"),
            _Field("uint8_t", "tx_buf"),
            _Field("uint8_t", "rx_buf"),
            _Field("uint32_t", "tx_rate"),
            _Field("uint32_t", "rx_rate"),
            _Field("uint16_t", "rx_parse_err"),
            _Field("uint16_t", "tx_overflows"),
            _Field("uint16_t", "rx_overflows"),
            _Field("uint32_t", "messages_sent"),
            _Field("uint32_t", "messages_received"),
            _Field("uint32_t", "messages_lost"),
        ),
    ),
    "ESC_INFO": (
        290,
        (
            _Field("uint8_t", "index"),
            _Field("uint64_t", "time_usec"),
            _Field("uint16_t", "counter"),
            _Field("uint8_t", "count"),
            _Field("uint8_t", "connection_type"),
            _Field("uint8_t", "info"),
            _Field("uint16_t", "failure_flags", 4),
            _Field("uint32_t", "error_count", 4),
            _Field("int16_t", "temperature", 4),
        ),
    ),
    "ESC_STATUS": (
        291,
        (
            _Field("uint8_t", "index"),
            _Field("uint64_t", "time_usec"),
            _Field("int32_t", "rpm", 4),
            _Field("float", "voltage", 4),
            _Field("float", "current", 4),
        ),
    ),
    "PROTOCOL_VERSION": (
        300,
        (
            _Field("uint16_t", "version"),
            _Field("uint16_t", "min_version"),
            _Field("uint16_t", "max_version"),
            _Field("uint8_t", "spec_version_hash", 8),
            _Field("uint8_t", "library_version_hash", 8),
        ),
    ),
    "TIME_ESTIMATE_TO_TARGET": (
        380,
        (
            _Field("int32_t", "safe_return"),
            _Field("int32_t", "land"),
            _Field("int32_t", "mission_next_item"),
            _Field("int32_t", "mission_end"),
            _Field("int32_t", "commanded_action"),
        ),
    ),
    "COMPONENT_INFORMATION": (
        395,
        (
            _Field("uint32_t", "time_boot_ms"),
            _Field("uint32_t", "general_metadata_file_crc"),
            _Field("char", "general_metadata_uri", 100),
            _Field("uint32_t", "peripherals_metadata_file_crc"),
            _Field("char", "peripherals_metadata_uri", 100),
        ),
    ),
    "COMPONENT_METADATA": (
        397,
        (_Field("uint32_t", "time_boot_ms"), _Field("uint32_t", "file_crc"), _Field("char", "uri", 100)),
    ),
    "EVENT": (
        410,
        (
            _Field("uint8_t", "destination_component"),
            _Field("uint8_t", "destination_system"),
            _Field("uint32_t", "id"),
            _Field("uint32_t", "event_time_boot_ms"),
            _Field("uint16_t", "sequence"),
            _Field("uint8_t", "log_levels"),
            _Field("uint8_t", "arguments", 40),
        ),
    ),
    "CURRENT_EVENT_SEQUENCE": (411, (_Field("uint16_t", "sequence"), _Field("uint8_t", "flags"))),
    "REQUEST_EVENT": (
        412,
        (*_TARGET, _Field("uint16_t", "first_sequence"), _Field("uint16_t", "last_sequence")),
    ),
    "RESPONSE_EVENT_ERROR": (
        413,
        (
            *_TARGET,
            _Field("uint16_t", "sequence"),
            _Field("uint16_t", "sequence_oldest_available"),
            _Field("uint8_t", "reason"),
        ),
    ),
}


def complete(dialect: Any) -> None:  # noqa: ANN401  # pymavlink has no types
    """Add to a dialect what it lacks, as `MAVLink_event_message` and `MAVLINK_MSG_ID_EVENT`, and so on.

    Args:
        dialect: a dialect module of pymavlink.
    """
    for name, (number, fields) in _DEFINITIONS.items():
        if number in dialect.mavlink_map:
            continue
        made = _message_class(dialect, number, name, fields)
        dialect.mavlink_map[number] = made
        setattr(dialect, made.__name__, made)
        setattr(dialect, f"MAVLINK_MSG_ID_{name}", number)


def _message_class(dialect: Any, number: int, name: str, fields: tuple[_Field, ...]) -> type:  # noqa: ANN401
    wire = sorted(fields, key=lambda field: -_SIZES[field.kind])  # stable, as MAVLink sorts
    declared = [field.name for field in fields]
    ordered = [field.name for field in wire]

    def __init__(self: Any, *values: object) -> None:  # noqa: ANN401, N807
        dialect.MAVLink_message.__init__(self, number, name)
        self._fieldnames = declared
        self._instance_field = None
        self._instance_offset = -1
        for field, value in zip(declared, values, strict=True):
            setattr(self, field, _text(value) if isinstance(value, bytes) else value)

    def pack(self: Any, mav: Any, force_mavlink1: bool = False) -> bytes:  # noqa: ANN401
        payload = self.unpacker.pack(*_flat(getattr(self, field) for field in ordered))
        return bytes(self._pack(mav, self.crc_extra, payload, force_mavlink1=force_mavlink1))

    attributes = {
        "__init__": __init__,
        "__doc__": f"{name} ({number}): {', '.join(declared)}.",
        "pack": pack,
        "id": number,
        "msgname": name,
        "name": name,
        "fieldnames": declared,
        "ordered_fieldnames": ordered,
        "fieldtypes": [field.kind for field in fields],
        "fielddisplays_by_name": {},
        "fieldenums_by_name": {},
        "fieldunits_by_name": {},
        "native_format": bytearray(("<" + "".join(_CODES[field.kind] for field in wire)).encode()),
        "orders": [ordered.index(each) for each in declared],
        "lengths": [1 if field.kind == "char" else field.length or 1 for field in wire],
        "array_lengths": [field.length for field in wire],
        "crc_extra": _crc_extra(dialect.x25crc(), name, wire),
        "unpacker": Struct("<" + "".join(field.code for field in wire)),
        "instance_field": None,
        "instance_offset": -1,
    }
    return type(f"MAVLink_{name.lower()}_message", (dialect.MAVLink_message,), attributes)


def _crc_extra(crc: Any, name: str, fields: list[_Field]) -> int:  # noqa: ANN401
    """The byte by which both ends know that they mean the same fields, given in their order on the wire."""
    crc.accumulate(f"{name} ".encode())
    for field in fields:
        crc.accumulate(f"{field.kind} {field.name} ".encode())
        if field.length:
            crc.accumulate(bytes((field.length,)))
    return int(crc.crc & 0xFF ^ crc.crc >> 8)


def _text(value: bytes) -> str:
    return value.split(b"\0", 1)[0].decode("ascii", "replace")


def _flat(values: Iterable[object]) -> list[object]:
    flat: list[object] = []
    for value in values:
        if isinstance(value, str):
            flat.append(value.encode())
        elif isinstance(value, list | tuple):
            flat += value
        else:
            flat.append(value)
    return flat
