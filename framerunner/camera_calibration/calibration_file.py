"""Calibrations as YAML files; those of ROS (camera_info) and OpenCV (FileStorage) are read, too.

Those of OpenCV are YAML, XML or JSON. They all have its conventions: whole numbers are pixel centres, and the
distortion is k1, k2, p1, p2, k3.
"""

from __future__ import annotations

import re
from codecs import BOM_UTF8
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias

import cv2
import yaml
from pydantic import ValidationError

from framerunner.errors import SettingError, write_advice
from framerunner.files.text_file import TextError, decode_text, replace_file
from framerunner.files.yaml_file import FileKind
from framerunner.files.yaml_text import MapNode, Value, YamlError, compose, read_yaml
from framerunner.wire.finite_json import finite
from vision.calibration.model import Calibration, CalibrationError

_Field: TypeAlias = "str | Sequence[float]"  # a matrix row by row; a number is a list of one

_OPENCV = re.compile(r"\s*%YAML:1\.0|.*?(?:opencv[-_]matrix|<opencv_storage>)", re.DOTALL)
_ROS = re.compile(r"^(?:camera_matrix|distortion_model)\s*:", re.MULTILINE)
_NAMES = {
    "image_width": ("imagewidth", "width"),
    "image_height": ("imageheight", "height"),
    "camera_matrix": ("cameramatrix", "intrinsicmatrix", "k", "mtx"),
    "distortion_coefficients": ("distortioncoefficients", "distcoeffs", "distortion", "d", "dist"),
}
_LENSES = ("plumb_bob", "rational_polynomial", "brown-conrady")
_COEFFICIENTS = 5
_RADIAL = 4  # without k3


def foreign_format(text: str) -> str:
    """Name of the format if a text is a calibration of another program, else empty."""
    if _OPENCV.match(text):
        return "OpenCV's FileStorage"
    return "ROS's camera_info" if _ROS.search(text) else ""


def read_foreign(text: str, source: str) -> Calibration:
    """The calibration in a text of which `foreign_format` knows the format.

    Args:
        text: of the file.
        source: its name in messages.

    Raises:
        CalibrationError: it is not readable, something is missing, or the lens is of another kind.
    """
    kind = foreign_format(text)
    try:
        fields = _opencv_fields(text) if _OPENCV.match(text) else _ros_fields(text)
        return _calibration(fields)
    except ValidationError as error:
        fault = error.errors(include_url=False)[0]
        where = ".".join(map(str, fault["loc"]))
        raise CalibrationError(
            f"{source}: {kind}: {where}: {fault['msg']} (got {fault['input']!r:.60})"
        ) from None
    except YamlError as error:
        raise CalibrationError(f"{source}:{error.place.line}: {kind}: {error}") from None
    except (cv2.error, SystemError):  # SystemError: of its constructor
        raise CalibrationError(f"{source}: {kind}: cannot be read; it is damaged") from None
    except (ValueError, TypeError, AttributeError, OverflowError) as error:
        reason = str(error).strip().splitlines() or ["it is damaged"]
        raise CalibrationError(f"{source}: {kind}: {reason[0]:.200}") from None


def _opencv_fields(text: str) -> dict[str, _Field]:
    storage = cv2.FileStorage(text, cv2.FILE_STORAGE_READ | cv2.FILE_STORAGE_MEMORY)
    try:
        root = storage.root()
        found: dict[str, _Field] = {}
        for name in root.keys():  # noqa: SIM118 - OpenCV's node is no mapping
            node = root.getNode(name)
            if node.isInt() or node.isReal():
                found[name] = [node.real()]
            elif node.isString():
                found[name] = node.string()
            elif node.isSeq():
                found[name] = [node.at(number).real() for number in range(node.size())]
            elif node.isMap() and node.mat() is not None:
                found[name] = [float(each) for each in node.mat().ravel()]
        return found
    finally:
        storage.release()


def _number(name: str, value: Value) -> float:
    if not isinstance(value, int | float):
        raise ValueError(f"{name} has {value!r:.40}; must be numbers")
    return float(value)


def _ros_fields(text: str) -> dict[str, _Field]:
    found: dict[str, _Field] = {}
    fields = read_yaml(text)
    for name, value in fields.items() if isinstance(fields, dict) else ():
        data = value.get("data") if isinstance(value, dict) else None
        if isinstance(data, tuple):
            found[name] = [_number(name, each) for each in data]
        elif isinstance(value, int | float):
            found[name] = [float(value)]
        elif isinstance(value, str):
            found[name] = value
    return found


def _calibration(fields: Mapping[str, _Field]) -> Calibration:
    plain = {re.sub(r"[^a-z]", "", name.lower()): value for name, value in fields.items()}

    def numbers(name: str) -> Sequence[float]:
        value = next((plain[each] for each in _NAMES[name] if each in plain), ())
        if not value:
            raise ValueError(f"{name} is missing; add it")
        if isinstance(value, str):
            raise ValueError(f"{name} is '{value}'; must be a number")
        return value

    is_fisheye = plain.get("fisheyemodel", [0.0]) != [0.0]
    lens = "fisheye" if is_fisheye else fields.get("distortion_model", _LENSES[0])
    if lens not in _LENSES:
        raise ValueError(f"the lens is {lens}; only plumb_bob or rational_polynomial is understood")
    size = plain.get("imagesize")
    if not isinstance(size, list) or len(size) != 2:
        size = [numbers("image_width")[0], numbers("image_height")[0]]
    matrix, distortion = numbers("camera_matrix"), numbers("distortion_coefficients")
    if len(matrix) != 9 or [matrix[each] for each in (1, 3, 6, 7, 8)] != [0, 0, 0, 0, 1]:
        raise ValueError("camera_matrix: must be fx 0 cx, 0 fy cy, 0 0 1")
    if len(distortion) < _RADIAL or any(distortion[_COEFFICIENTS:]):
        raise ValueError(
            f"distortion_coefficients: has {len(distortion)}; must be k1, k2, p1, p2, k3, and all others 0"
        )
    return Calibration.model_validate(
        {
            "width_px": size[0],
            "height_px": size[1],
            "fx_px": matrix[0],
            "fy_px": matrix[4],
            "cx_px": matrix[2],
            "cy_px": matrix[5],
            "distortion": (*distortion[:_COEFFICIENTS], 0.0)[:_COEFFICIENTS],
        }
    )


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
