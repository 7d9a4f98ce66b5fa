"""Labelling one's own pictures: the folder, its labels.json, and what the corners of a gate say."""

from __future__ import annotations

from dataclasses import dataclass
from math import acos, degrees, hypot, inf
from pathlib import Path

import cv2
import numpy as np
from pydantic import BaseModel

from framerunner.errors import SettingError, write_advice
from framerunner.files.text_file import replace_file
from framerunner.vision_evaluation.backgrounds import ENDINGS
from framerunner.vision_evaluation.openings import Corners
from framerunner.vision_evaluation.own_pictures import (
    FILE,
    LabelledGate,
    LabelledPicture,
    OwnPictures,
    PictureLabels,
    given_corners,
)
from vision.calibration.lens import Lens
from vision.calibration.model import Calibration
from vision.gate_model import GateModel, rectangle
from vision.gate_pose import as_seen, find_poses
from vision.types import Image

_PLACES_OF_A_SIDE = 8  # at which a line is drawn that the lens bends


class ShownGate(BaseModel):
    """What the four corners of a gate say of it, for the page.

    Attributes:
        problem: why they are no gate's, in a line; "" if they are. Then the others are empty.
        distance_m: from the camera to the centre of the opening.
        angle_deg: between the line of sight and the gate's normal.
        error_px: root mean square of the distances between the corners and those of the pose.
        outlines: of the bars' outer and inner edges in the gate's middle plane, column and row.
    """

    problem: str = ""
    distance_m: float | None = None
    angle_deg: float | None = None
    error_px: float | None = None
    outlines: list[list[tuple[float, float]]] = []


@dataclass(frozen=True, slots=True)
class Head:
    """What labels.json says of all pictures: camera and gates; its pictures are kept beside it."""

    labels: PictureLabels
    calibration: Calibration | None


class LabelSession:
    """A folder of pictures that are being labelled; each change is written at once.

    Args:
        folder: with the pictures.
        new: what labels.json begins with if there is none; its pictures do not matter.

    Attributes:
        pictures: names of the files, in order.
        head: what holds for all pictures.

    Raises:
        SettingError: it is no folder, or has no pictures, or its labels.json cannot be used; or it has none,
            and `new` is None.
    """

    def __init__(self, folder: Path, new: Head | None) -> None:
        if not folder.is_dir():
            raise SettingError(f"{folder}: is no folder; give one with pictures")
        self._folder = folder
        names = [path.name for path in sorted(folder.iterdir())]
        self._labelled: dict[str, LabelledPicture] = {}
        if (folder / FILE).exists():
            own = OwnPictures.of_folder(folder)
            if new is not None:
                raise SettingError(
                    f"{folder / FILE}: says what camera and gates are; leave out the options that say so, too"
                )
            self.head = Head(own.labels, own.calibration)
            self._labelled = {picture.image: picture for picture in own.labels.images}
            names += [name for name in self._labelled if name not in names]
        elif new is None:
            raise SettingError(
                f"{folder}: has no {FILE} yet; say what the camera is, with --calibration or --focal-px"
            )
        else:
            self.head = new
        self.pictures = [name for name in names if Path(name).suffix.lower() in ENDINGS]
        if not self.pictures:
            raise SettingError(f"{folder}: has no pictures; give a folder with some, such as .png or .jpg")

    def gates(self, number: int) -> tuple[LabelledGate, ...] | None:
        """What is labelled in a picture; None if it was not labelled yet."""
        picture = self._labelled.get(self.pictures[number])
        return None if picture is None else picture.frames

    def image(self, number: int) -> Image:
        """A picture as a detector gets it.

        Raises:
            SettingError: it cannot be read.
        """
        path = self._folder / self.pictures[number]
        image = cv2.imread(str(path), cv2.IMREAD_COLOR)
        if image is None:
            raise SettingError(f"{path}: is no picture that can be read; remove it")
        return np.asarray(image, np.uint8)

    def shown(self, number: int, gates: tuple[LabelledGate, ...]) -> list[ShownGate]:
        """What the corners of these gates say.

        Raises:
            SettingError: the picture cannot be read.
            CalibrationError: it has another size than those of the calibration.
        """
        if not gates:
            return []
        height, width = self.image(number).shape[:2]
        head = self.head
        calibration = head.calibration or Calibration.ideal(width, height, head.labels.focal_px or 0.0)
        lens = Lens(calibration)
        lens.check_size(width, height)
        return [self._shown(gate, lens) for gate in gates]

    def keep(self, number: int, gates: tuple[LabelledGate, ...]) -> list[ShownGate]:
        """Write the gates of a picture, without those whose corners are no gate's; what they say.

        Raises:
            SettingError, CalibrationError: the picture cannot be used, or the file not be written.
        """
        shown = self.shown(number, gates)
        good = tuple(gate for gate, one in zip(gates, shown, strict=True) if not one.problem)
        name = self.pictures[number]
        kept = self._labelled | {name: LabelledPicture(image=name, frames=good)}
        images = tuple(kept[each] for each in self.pictures if each in kept)
        labels = self.head.labels.model_copy(update={"images": images})
        try:
            replace_file(self._folder / FILE, labels.as_text())
        except OSError as error:
            message = f"{self._folder / FILE}: cannot be written ({error.strerror}); {write_advice(error)}"
            raise SettingError(message) from error
        self._labelled = kept
        return shown

    def _shown(self, gate: LabelledGate, lens: Lens) -> ShownGate:
        labels = self.head.labels
        shape, of_opening = labels.shape.gate, labels.corners_of == "opening"
        given = given_corners(gate.corners, lens)
        poses = find_poses(given, GateModel.of_corners(shape, lens.focal_px, of_opening=of_opening), inf)
        if not poses:
            return ShownGate(problem="no upright frame looks so; move its corners, or click them again")
        pose = as_seen(poses[0])
        distance_m = hypot(*pose.position_flu_m)
        along = -sum(a * b for a, b in zip(pose.position_flu_m, pose.normal_flu, strict=True)) / distance_m
        outlines = []
        for size_m in ((shape.outer_width_m, shape.outer_height_m), shape.opening_m):
            flat = poses[0].project(rectangle(*size_m), lens.focal_px)
            if flat is not None:
                outlines.append(_drawn(tuple((x, y) for x, y in flat.tolist()), lens))
        return ShownGate(
            distance_m=distance_m,
            angle_deg=degrees(acos(max(-1.0, min(1.0, along)))),
            error_px=pose.error_px,
            outlines=outlines,
        )


def _drawn(corners: Corners, lens: Lens) -> list[tuple[float, float]]:
    """A closed line through corners of an ideal camera's image, as the lens bends it: column and row."""
    ring = np.array([*corners, corners[0]])
    shares = np.linspace(0.0, 1.0, _PLACES_OF_A_SIDE, endpoint=False)[None, :, None]
    places = (ring[:-1, None] + shares * np.diff(ring, axis=0)[:, None]).reshape(-1, 2)
    columns, rows = lens.size_px
    seen = lens.all_seen(places) + np.array([(columns - 1) / 2, (rows - 1) / 2])
    return [(x, y) for x, y in seen.tolist()]
