"""`make messages`: pymavlink's generator makes `framerunner/wire/extra_messages.py` of the XML beside it."""

from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path
from tempfile import TemporaryDirectory

from pymavlink.generator.mavgen import Opts, mavgen

WIRE = Path(__file__).parents[3] / "framerunner" / "wire"
DEFINITIONS = WIRE / "extra_messages.xml"
MODULE = WIRE / "extra_messages.py"

# The generator writes a whole dialect. Its base classes are replaced by those of pymavlink's own dialect.
HEADER = '''"""Messages and enums that pymavlink's dialects lack, generated from XML by `make messages`."""

import struct
from typing import Dict, Sequence, Type

from pymavlink.dialects.v20.development import (
    Enum,
    EnumEntry,
    MAVLink_message,
    enums,
    mavlink_msg_deprecated_name_property,
)
'''
FIRST = "\nenums: Dict[str, Enum] = {}\n"
END = "\n\n\nclass MAVError("


def generate() -> str:
    """The module's text."""
    with TemporaryDirectory() as folder, redirect_stdout(StringIO()):
        whole = Path(folder) / "dialect.py"
        assert mavgen(Opts(str(whole), "2.0", "Python3", validate=False), [str(DEFINITIONS)])
        text = whole.read_text(encoding="utf-8")
    return HEADER + text.partition(FIRST)[2].partition(END)[0] + "\n"


if __name__ == "__main__":
    MODULE.write_text(generate(), encoding="utf-8")
