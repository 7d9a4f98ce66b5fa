"""Labels of the data set "Race Against the Machine" (tii-racing/drone-racing-dataset) as ours.

A text file for each picture has a line for each gate: `0 cx cy w h`, then `x y visibility` of the corners of
its opening: upper left, upper right, lower right, lower left. All are shares of the picture's width and
height; visibility is 2 inside the picture and 0 outside it.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from pathlib import Path

import cv2
import numpy as np
from pydantic import BaseModel, ValidationError

from framerunner.camera_calibration.calibration_file import load_calibration
from framerunner.errors import SettingError
from framerunner.files.text_file import TextError, read_text
from framerunner.vision_evaluation.backgrounds import ENDINGS
from framerunner.vision_evaluation.openings import outline_of
from framerunner.vision_evaluation.own_pictures import (
    LabelColour,
    LabelledGate,
    LabelledPicture,
    PictureLabels,
    PictureShape,
    keep_calibration,
)
from vision.calibration.model import Calibration

_NUMBERS = 17  # in a line
_VISIBLE = 2

Place = tuple[float, float]


class _Matrices(BaseModel):
    """A calibration of theirs."""

    mtx: tuple[tuple[float, float, float], tuple[float, float, float], tuple[float, float, float]]
    dist: tuple[tuple[float, float, float, float, float]]


@dataclass(frozen=True, slots=True)
class ConvertedLabels:
    """What was made of a folder.

    Attributes:
        labels: of the pictures that have a text file.
        unlabelled: how many pictures have none, and are left out.
    """

    labels: PictureLabels
    unlabelled: int


def convert(folder: Path, shape: PictureShape, colour: LabelColour, calibration: Path) -> ConvertedLabels:
    """Read the labels of all pictures in a folder and the folders in it.

    Their calibration is written to the folder as `camera.yaml`, unless it is there already.

    Args:
        folder: of one flight, for example.
        shape: of the gates.
        colour: by which a detector calls them.
        calibration: a file of ours, or one of theirs with `mtx` and `dist`.

    Raises:
        SettingError: a file cannot be read, or is none of these.
        CalibrationError: the calibration is none.
    """
    found = sorted(path for path in folder.rglob("*") if path.suffix.lower() in ENDINGS)
    pictures = {path.stem: path for path in found}
    if len(pictures) < len(found):
        name = next(path.stem for path in found if pictures[path.stem] != path)
        raise SettingError(f"{folder}: has several pictures {name}; give the folder of one flight")
    texts = {path.stem: path for path in sorted(folder.rglob("*.txt")) if path.stem in pictures}
    if not texts:
        raise SettingError(
            f"{folder}: has no pictures with a text file of the same name; give another folder"
        )
    images = [
        LabelledPicture(
            image=pictures[name].relative_to(folder).as_posix(),
            frames=_gates(texts[name], _size_px(pictures[name]), shape, colour),
        )
        for name in texts
    ]
    labels = PictureLabels(
        calibration=_calibration(calibration, folder, _size_px(pictures[next(iter(texts))])),
        shape=shape,
        corners_of="opening",
        images=tuple(images),
    )
    return ConvertedLabels(labels, len(pictures) - len(texts))


def _size_px(path: Path) -> tuple[int, int]:
    """Columns and rows of a picture."""
    image = cv2.imread(str(path), cv2.IMREAD_COLOR)
    if image is None:
        raise SettingError(f"{path}: is no picture that can be read; remove it")
    return (image.shape[1], image.shape[0])


def _text(path: Path) -> str:
    try:
        return read_text(path)
    except TextError as error:
        raise SettingError(f"{path}: {error}") from error


def _gates(
    path: Path, size_px: tuple[int, int], shape: PictureShape, colour: LabelColour
) -> tuple[LabelledGate, ...]:
    """The gates of one picture; of two that overlap, the smaller one is not whole."""
    gates = []
    for number, line in enumerate(_text(path).splitlines(), 1):
        if line.strip():
            try:
                gates.append(_gate(line, size_px, shape, colour))
            except ValueError as error:
                raise SettingError(
                    f"{path}:{number}: {error}; a line is `0 cx cy w h` and `x y visibility` of four corners"
                ) from error
    hidden = set()
    for (i, one), (j, other) in combinations(enumerate(gates), 2):
        first, second = (np.array(outline_of(gate.corners, shape.gate), np.float32) for gate in (one, other))
        if cv2.intersectConvexConvex(first, second)[0] > 0.0:
            hidden.add(i if cv2.contourArea(first) < cv2.contourArea(second) else j)
    return tuple(
        gate.model_copy(update={"whole": gate.whole and number not in hidden})
        for number, gate in enumerate(gates)
    )


def _gate(line: str, size_px: tuple[int, int], shape: PictureShape, colour: LabelColour) -> LabelledGate:
    """One gate; with a corner outside the picture, whose place may not be told, the corners of its box."""
    numbers = [float(word) for word in line.split()]
    if len(numbers) != _NUMBERS:
        raise ValueError(f"has {len(numbers)} numbers, not {_NUMBERS}")
    _, middle_x, middle_y, width, height, *rest = numbers
    keypoints = np.array(rest).reshape(4, 3)
    whole = bool((keypoints[:, 2] == _VISIBLE).all())
    sides = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    box = np.array((middle_x, middle_y)) + sides / 2 * np.array((width, height))
    shares = keypoints[:, :2] if whole else box
    corners: list[Place] = [(x, y) for x, y in (shares * size_px - 0.5).tolist()]  # of pixels' middles
    if whole:
        outline = np.array(outline_of(corners, shape.gate))
        whole = bool((outline >= 0.0).all() and (outline <= np.array(size_px) - 1.0).all())
    return LabelledGate.model_validate({"colour": colour, "corners": corners, "whole": whole})


def _calibration(path: Path, folder: Path, size_px: tuple[int, int]) -> str:
    """Name of a calibration in the folder: this one, or a file that is made of it."""
    if path.suffix.lower() == ".json":
        calibration = _of_matrices(_text(path), path, size_px)
    else:
        calibration = load_calibration(path)
    return keep_calibration(calibration, folder, str(path))


def _of_matrices(text: str, path: Path, size_px: tuple[int, int]) -> Calibration:
    try:
        given = _Matrices.model_validate_json(text)
        ((fx, _, cx), (_, fy, cy), _), (distortion,) = given.mtx, given.dist
        return Calibration(
            width_px=size_px[0],
            height_px=size_px[1],
            fx_px=fx,
            fy_px=fy,
            cx_px=cx,
            cy_px=cy,
            distortion=distortion,
        )
    except ValidationError as error:
        fault = error.errors(include_url=False)[0]
        where = ".".join(map(str, fault["loc"])) or "the whole"
        raise SettingError(
            f"{path}: {where}: {fault['msg']}; give a calibration with mtx and dist"
        ) from error
