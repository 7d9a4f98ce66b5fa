"""ULog's messages as bytes (file format version 1, PX4's developer guide, "ULog File Format").

Each is a header (length of the content, one letter for the kind) and its content, little-endian. A topic's
sample is packed by one call of a `Struct`.
"""

from __future__ import annotations

from struct import Struct, pack

from firmware_py.parameters import Parameter

_MAGIC = b"ULog\x01\x12\x35"
_VERSION = 1
_DEFAULTS_INCLUDED = 1  # compatible flag: there are messages about default values
_SYSTEM_AND_SETUP_DEFAULT = 3
_MAX_TEXT = 127

_CODES = {
    "uint64_t": "Q",
    "int64_t": "q",
    "uint32_t": "I",
    "int32_t": "i",
    "uint16_t": "H",
    "int16_t": "h",
    "uint8_t": "B",
    "int8_t": "b",
    "bool": "?",
    "float": "f",
    "double": "d",
}


def _message(kind: bytes, content: bytes) -> bytes:
    return pack("<Hc", len(content), kind) + content


def file_header(start_us: int) -> bytes:
    """The first bytes of a log that begins at a vehicle time, and the flags, which must follow."""
    flags = bytes((_DEFAULTS_INCLUDED, *[0] * 7)) + bytes(8) + bytes(3 * 8)
    return _MAGIC + pack("<BQ", _VERSION, start_us) + _message(b"B", flags)


def text_information(key: str, value: str) -> bytes:
    """A fact about the vehicle as text."""
    data = value.encode()
    return _keyed(b"I", f"char[{len(data)}] {key}", data)


def number_information(key: str, value: int, type_name: str = "uint32_t") -> bytes:
    """A fact about the vehicle as a number."""
    return _keyed(b"I", f"{type_name} {key}", pack("<" + _CODES[type_name], value))


def parameter(declared: Parameter, value: float) -> bytes:
    """A parameter's value: at the start, or as it changes."""
    key, data = _typed(declared, value)
    return _keyed(b"P", key, data)


def parameter_default(declared: Parameter) -> bytes:
    """A parameter's default, if its value differs."""
    key, data = _typed(declared, declared.default)
    return _keyed(b"Q", key, data, bytes((_SYSTEM_AND_SETUP_DEFAULT,)))


def logged_text(time_us: int, severity: int, text: str) -> bytes:
    """A status text; the level is a digit, as in the Linux kernel and MAV_SEVERITY."""
    level = ord("0") + min(max(severity, 0), 7)
    return _message(b"L", pack("<BQ", level, time_us) + text.encode("ascii", "replace")[:_MAX_TEXT])


def _typed(declared: Parameter, value: float) -> tuple[str, bytes]:
    if declared.kind == "int32":
        return f"int32_t {declared.name}", pack("<i", int(value))
    return f"float {declared.name}", pack("<f", value)


def _keyed(kind: bytes, key: str, data: bytes, before: bytes = b"") -> bytes:
    name = key.encode()
    return _message(kind, before + bytes((len(name),)) + name + data)


class Topic:
    """A kind of data with its layout.

    Args:
        name: PX4's name of the topic.
        fields: types and names as PX4's message files have them, `float[4] q; bool landed`. The first is
            `uint64_t timestamp`; nothing is padded.
        number: of the topic in the log.

    Attributes:
        name: see above.
        header: of every sample.
        values: packs one sample after the header.
    """

    def __init__(self, name: str, fields: str, number: int) -> None:
        self.name = name
        self._fields = [" ".join(each.split()) for each in fields.split(";") if each.strip()]
        self._number = number
        self.values = Struct("<" + "".join(map(_code, self._fields)))
        self.header = pack("<HcH", self.values.size + 2, b"D", number)

    def definition(self) -> bytes:
        """The message with the layout of samples."""
        text = self.name + ":" + "".join(each + ";" for each in self._fields)
        return _message(b"F", text.encode())

    def subscription(self) -> bytes:
        """The message with the topic's number."""
        return _message(b"A", pack("<BH", 0, self._number) + self.name.encode())


def _code(declaration: str) -> str:
    type_name = declaration.split(maxsplit=1)[0]
    if not type_name.endswith("]"):
        return _CODES[type_name]
    type_name, _, count = type_name[:-1].partition("[")
    return count + _CODES[type_name]
