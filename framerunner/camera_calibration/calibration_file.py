"""Calibrations as YAML files; those of ROS and OpenCV are read, too."""

from __future__ import annotations

from codecs import BOM_UTF8
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import yaml

from framerunner.camera_calibration.foreign_calibration import foreign_format, read_foreign
from framerunner.errors import SettingError, write_advice
from framerunner.files.text_file import TextError, decode_text, replace_file
from framerunner.files.yaml_file import FileKind
from framerunner.files.yaml_text import MapNode, compose
from framerunner.wire.finite_json import finite
from vision.calibration.model import Calibration, CalibrationError

_FILES = FileKind("calibration", Calibration, CalibrationError, folder="")
_DECIMALS = 6
_ABOUT = ("rms_px", "images", "made_on")  # how the lens was calibrated: not true of another calibration
_HEAD = """\
# A camera's calibration, by OpenCV's conventions: pixels, whole numbers at pixel centres;
# distortion: k1, k2, p1, p2, k3.
"""


def load_calibration(path: Path, *, to_write: bool = False) -> Calibration:
    """Read a file of this program, of ROS (camera_info) or of OpenCV (FileStorage).

    Args:
        path: of the file.
        to_write: it will be written to, which is refused for files of other programs.

    Raises:
        CalibrationError: it cannot be read, is not a valid calibration, or cannot be written to; the message
            names file, line, field, value and what to do.
    """
    data = _FILES.read(path)
    try:
        text = decode_text(data)
    except TextError as error:
        raise CalibrationError(f"{path}: {error}") from None
    kind = foreign_format(text)
    if kind and to_write:
        raise CalibrationError(
            f"{path}: is a file of {kind}, which is only read; make one to write to with `framerunner camera "
            f"calibrate {path} --out camera.yaml`"
        )
    return read_foreign(text, str(path)) if kind else _FILES.parse(data, str(path))


def save_calibration(calibration: Calibration, path: Path) -> None:
    """Write a file, completely or not at all: one that was there before is kept if the disk is full.

    Of a calibration that is there, the fields that the new one sets are replaced; others and comments stay.

    Raises:
        CalibrationError: something else is there.
        SettingError: it cannot be written.
    """
    try:
        replace_file(
            path, _updated(path, calibration) if path.exists() else _HEAD + _yaml(_content(calibration))
        )
    except OSError as error:
        message = f"{path}: cannot be written to ({error.strerror}); {write_advice(error)}"
        raise SettingError(message) from error


def _content(calibration: Calibration) -> dict[str, Any]:
    content: dict[str, Any] = finite(calibration.model_dump(mode="json", exclude_none=True), _DECIMALS)
    return content


def _yaml(content: Mapping[str, Any]) -> str:
    """The fields one below the other, each with its lists in one line."""
    return "".join(
        yaml.safe_dump(
            {key: value}, sort_keys=False, default_flow_style=None if type(value) in (list, dict) else False
        )
        for key, value in content.items()
    )


def _updated(path: Path, calibration: Calibration) -> bytes:
    """The content of a file with the fields that a calibration sets."""
    old = load_calibration(path, to_write=True)
    before, data = _content(old), path.read_bytes()
    text = decode_text(data)
    left = {key: value for key, value in _content(calibration).items() if key in calibration.model_fields_set}
    for key, start, end in reversed(list(_entries(text))):
        if key in left:
            value = left.pop(key)
            if value != before.get(key):
                text = text[:start] + _yaml({key: value}).rstrip("\n") + text[end:]
        elif key in _ABOUT:
            text = text[:start] + text[end:].partition("\n")[2]
    text = text.rstrip("\n") + "\n" + _yaml(left)
    mark, newline = "\ufeff" * data.startswith(BOM_UTF8), "\r\n" if b"\r\n" in data else "\n"
    updated = (mark + text.replace("\n", newline)).encode()
    wanted = old.model_copy(
        update=dict.fromkeys(_ABOUT)
        | {key: getattr(calibration, key) for key in calibration.model_fields_set}
    )
    try:
        is_right = _content(_FILES.parse(updated, "")) == _content(wanted)
    except CalibrationError:
        is_right = False
    if not is_right:  # YAML has many forms
        raise CalibrationError(
            f"{path}: its values cannot be replaced; write one field a line, or name another file"
        )
    return updated


def _entries(text: str) -> Iterator[tuple[str, int, int]]:
    """The fields, each with the offsets at which it begins and ends."""
    root = compose(text)
    assert isinstance(root, MapNode)
    for key, node in root.key_nodes.items():
        yield key, node.start, root.items[key].end
