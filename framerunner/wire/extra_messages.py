"""Messages and enums that pymavlink's dialects lack, made of their definitions in `extra_messages.xml`.

pymavlink's generator would write a class for each; here one function makes them all when they are loaded.
"""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

from pymavlink.generator.mavgen_python import mavfmt
from pymavlink.generator.mavparse import MAVXML, PROTOCOL_2_0

_DEFINITIONS = Path(__file__).with_name("extra_messages.xml")


def add_to(dialect: Any) -> None:  # noqa: ANN401 - a module that was made by pymavlink
    """Add what a dialect lacks: classes and numbers of messages, enums and their values."""
    names = vars(dialect)
    definitions = MAVXML(str(_DEFINITIONS), PROTOCOL_2_0)
    for enum in definitions.enum:
        made = dialect.enums.setdefault(enum.name, dialect.Enum())
        made.bitmask = bool(enum.bitmask)
        for entry in enum.entry:
            made.setdefault(entry.value, dialect.EnumEntry(entry.name, entry.description))
            names.setdefault(entry.name, entry.value)
    for message in definitions.message:
        made = _message_class(message, dialect)
        dialect.mavlink_map.setdefault(message.id, made)
        names.setdefault(made.__name__, made)
        names.setdefault(f"MAVLINK_MSG_ID_{message.name}", message.id)


def _message_class(definition: Any, dialect: Any) -> Any:  # noqa: ANN401
    """The class of a message, as pymavlink's generator writes it."""
    fields, ordered = definition.fields, definition.ordered_fields
    instance = next((field for field in fields if field.instance), None)

    def init(self: Any, *values: Any, **named: Any) -> None:  # noqa: ANN401
        dialect.MAVLink_message.__init__(self, self.id, self.msgname)
        self._fieldnames = self.fieldnames
        self._instance_field, self._instance_offset = self.instance_field, self.instance_offset
        given = {field.name: value for field, value in zip(fields, values, strict=False)} | named
        for field in fields:
            value = given[field.name]
            if field.type == "char":
                setattr(self, f"_{field.name}_raw", value)
                setattr(self, field.name, value.split(b"\0", 1)[0].decode("ascii", "replace"))
            else:
                setattr(self, field.name, value)

    def pack(self: Any, mav: Any, force_mavlink1: bool = False) -> Any:  # noqa: ANN401
        values: list[Any] = []
        for field in ordered:
            if field.type == "char":
                values.append(getattr(self, f"_{field.name}_raw"))
            else:
                value = getattr(self, field.name)
                values += value if field.array_length else [value]
        return self._pack(mav, self.crc_extra, self.unpacker.pack(*values), force_mavlink1)

    kind = type(f"MAVLink_{definition.name_lower}_message", (dialect.MAVLink_message,), {})
    attributes = {
        "__init__": init,
        "__doc__": definition.description,
        "pack": pack,
        "id": definition.id,
        "msgname": definition.name,
        "name": dialect.mavlink_msg_deprecated_name_property(),
        "fieldnames": [field.name for field in fields],
        "ordered_fieldnames": [field.name for field in ordered],
        "fieldtypes": [field.type for field in fields],
        "orders": [ordered.index(field) for field in fields],
        "lengths": [1 if field.type == "char" else max(1, field.array_length) for field in ordered],
        "array_lengths": [field.array_length for field in ordered],
        "crc_extra": definition.crc_extra,
        "unpacker": struct.Struct("<" + "".join(map(mavfmt, ordered))),
        "instance_field": None if instance is None else instance.name,
        "instance_offset": -1 if instance is None else instance.wire_offset,
    }
    for name, value in attributes.items():
        setattr(kind, name, value)
    return kind
