"""Calibrations as YAML files."""

from __future__ import annotations

from pathlib import Path

import yaml

from errors import SettingError, write_advice
from scenarios.yaml_file import FileKind
from vision.calibration.model import Calibration, CalibrationError
from wire.finite_json import finite

_FILES = FileKind("calibration", Calibration, CalibrationError, folder="")
_DECIMALS = 6
_HEAD = """\
# A camera's calibration, by OpenCV's conventions: pixels, whole numbers at pixel centres;
# distortion: k1, k2, p1, p2, k3.
"""


def load_calibration(path: Path) -> Calibration:
    """Read a file.

    Raises:
        CalibrationError: it cannot be read or is not a valid calibration; the message names file, line,
            field, value and what to do.
    """
    return _FILES.load_path(path)


def save_calibration(calibration: Calibration, path: Path) -> None:
    """Write a file, completely or not at all: one that was there before is kept if the disk is full.

    Raises:
        SettingError: it cannot be written.
    """
    content = finite(calibration.model_dump(mode="json", exclude_none=True), _DECIMALS)
    text = _HEAD + yaml.safe_dump(content, sort_keys=False, default_flow_style=None)
    file = path.resolve()  # a link stays one
    part = file.with_name(f".{file.name}.part")
    try:
        try:
            part.write_text(text, encoding="utf-8")
            part.replace(file)
        except OSError:
            part.unlink(missing_ok=True)
            raise
    except OSError as error:
        message = f"{path}: cannot be written to ({error.strerror}); {write_advice(error)}"
        raise SettingError(message) from error
