"""One's own pictures with labels, as labelled images: the four corners of each gate, as they were clicked."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import acos, degrees, hypot, inf
from pathlib import Path
from typing import Annotated, Literal, Self

import cv2
import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from framerunner.camera_calibration.calibration_file import load_calibration, save_calibration
from framerunner.errors import SettingError
from framerunner.files.text_file import TextError, read_bytes
from framerunner.geometry.gate_shape import BAR_LIMITS_M, SIZE_LIMITS_M, GateShape, GateShapes
from framerunner.vision_evaluation.labelled_images import GateLabel, LabelledImage
from framerunner.vision_evaluation.openings import Corners, outline_of
from framerunner.wire.finite_json import finite
from vision.calibration.lens import Lens
from vision.calibration.model import Calibration
from vision.gate_model import GateModel
from vision.gate_pose import as_seen, find_poses

FILE, CALIBRATION = "labels.json", "camera.yaml"
_MAX_BYTES = 100_000_000
_DIGITS = 6
_Size = Annotated[float, Field(ge=SIZE_LIMITS_M[0], le=SIZE_LIMITS_M[1])]
_Bar = Annotated[float, Field(ge=BAR_LIMITS_M[0], le=BAR_LIMITS_M[1])]
_Pixel = Annotated[float, Field(ge=-100_000, le=100_000)]
_Place = tuple[_Pixel, _Pixel]
LabelColour = Literal["red", "green", "blue", "cyan", "magenta"]


class _Model(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class LabelledGate(_Model):
    """A gate in a picture."""

    colour: LabelColour
    corners: tuple[_Place, _Place, _Place, _Place] = Field(
        description="column and row of the corners: upper left, upper right, lower right, lower left"
    )
    whole: bool = Field(True, description="nothing of it is hidden or outside the picture")


class LabelledPicture(_Model):
    """A picture and the gates in it."""

    image: str = Field(min_length=1, max_length=500, description="name of the file in the folder")
    frames: tuple[LabelledGate, ...] = ()


class PictureShape(_Model):
    """Sizes of the gates."""

    outer_width_m: _Size = 0.42
    outer_height_m: _Size = 0.22
    bar_m: _Bar = 0.02
    depth_m: _Bar = 0.02

    @property
    def gate(self) -> GateShape:
        """As a detector is told."""
        return GateShape(self.outer_width_m, self.outer_height_m, self.bar_m, self.depth_m)


class PictureLabels(_Model):
    """What the file `labels.json` holds."""

    focal_px: float | None = Field(None, gt=1, le=1e5, description="of a camera without distortion")
    calibration: str | None = Field(
        None, description="file of `framerunner camera calibrate`, beside the labels"
    )
    shape: PictureShape = Field(PictureShape(), description="of the gates")
    corners_of: Literal["outline", "opening"] = Field(
        "outline", description="which corners of the gates are given; those are compared with a detector's"
    )
    images: tuple[LabelledPicture, ...] = Field(min_length=1)

    @model_validator(mode="after")
    def _one_camera(self) -> Self:
        if (self.focal_px is None) == (self.calibration is None):
            raise ValueError("give either focal_px or calibration")
        return self

    def as_text(self) -> str:
        """The file's text, a line for each picture."""
        content = finite(self.model_dump(mode="json", exclude_none=True), _DIGITS)
        images = ",\n  ".join(json.dumps(picture) for picture in content.pop("images"))
        return f'{json.dumps(content, indent=1)[:-2]},\n "images": [\n  {images}\n ]\n}}\n'


@dataclass(frozen=True, slots=True, eq=False)
class OwnPictures:
    """A folder of pictures and their labels."""

    folder: Path
    labels: PictureLabels
    calibration: Calibration | None

    @classmethod
    def of_folder(cls, folder: Path) -> OwnPictures:
        """Read the labels.

        Raises:
            SettingError: they cannot be read, or are not of the documented form.
            CalibrationError: the calibration is none.
        """
        path = folder / FILE
        try:
            labels = PictureLabels.model_validate_json(read_bytes(path, _MAX_BYTES))
        except TextError as error:
            raise SettingError(f"--labelled {folder}: {FILE} {error}; see docs/vision.md") from error
        except ValidationError as error:
            fault = error.errors()[0]
            field = ".".join(map(str, fault["loc"])) or "the whole"
            raise SettingError(f"{path}: {field}: {fault['msg']}; see docs/vision.md") from error
        file = labels.calibration
        return cls(folder, labels, None if file is None else load_calibration(folder / file))

    def images(self) -> Iterator[LabelledImage]:
        """The pictures with what is true of their gates, as far as the corners tell.

        Raises:
            SettingError: a picture cannot be read, or corners are those of no gate.
        """
        shape = self.labels.shape.gate
        for picture in self.labels.images:
            path = self.folder / picture.image
            image = cv2.imread(str(path), cv2.IMREAD_COLOR)
            if image is None:
                raise SettingError(f"{path}: is no image that can be read; correct its name in {FILE}")
            height, width = image.shape[:2]
            calibration = self.calibration or Calibration.ideal(width, height, self.labels.focal_px or 0.0)
            lens = Lens(calibration)
            lens.check_size(width, height)
            gates = tuple(self._label(path, number, gate, lens) for number, gate in enumerate(picture.frames))
            yield LabelledImage(
                image=np.asarray(image, np.uint8),
                scenario=picture.image,
                position_arena_m=(0.0, 0.0, 0.0),
                attitude_arena=(1.0, 0.0, 0.0, 0.0),
                calibration=calibration,
                gates=gates,
                shapes=GateShapes(other=shape),
            )

    def _label(self, path: Path, number: int, gate: LabelledGate, lens: Lens) -> GateLabel:
        """What the corners of a gate tell of it; of two poses, the better one."""
        given = given_corners(gate.corners, lens)
        shape, of_opening = self.labels.shape.gate, self.labels.corners_of == "opening"
        poses = find_poses(given, GateModel.of_corners(shape, lens.focal_px, of_opening=of_opening), inf)
        if not poses:
            raise SettingError(
                f"{self.folder / FILE}: {path.name}: frames.{number}.corners: no upright gate looks so; "
                "give upper left, upper right, lower right, lower left"
            )
        pose = as_seen(poses[0])
        distance_m = hypot(*pose.position_flu_m)
        along = -sum(a * b for a, b in zip(pose.position_flu_m, pose.normal_flu, strict=True)) / distance_m
        return GateLabel(
            colour=gate.colour,
            distance_m=distance_m,
            angle_deg=degrees(acos(max(-1.0, min(1.0, along)))),
            position_flu_m=pose.position_flu_m,
            normal_flu=pose.normal_flu,
            corners_px=outline_of(given, shape) if of_opening else given,
            seen=True,
            whole=gate.whole,
            opening_px=given if of_opening else (),
        )


def keep_calibration(calibration: Calibration, folder: Path, source: str) -> str:
    """Have a calibration in a folder of pictures; its name there.

    Raises:
        SettingError: the folder has another one, or cannot be written to. `source` names the calibration.
    """
    path = folder / CALIBRATION
    if not path.exists():
        save_calibration(calibration, path)
    elif load_calibration(path) != calibration:
        raise SettingError(f"{path}: is another calibration than {source}; remove one of them")
    return CALIBRATION


def given_corners(corners: Sequence[tuple[float, float]], lens: Lens) -> Corners:
    """Corners in a picture, column and row, as pixels of an ideal camera from the optical axis."""
    columns, rows = lens.size_px
    places = np.array(corners) - np.array([(columns - 1) / 2, (rows - 1) / 2])
    return tuple((x, y) for x, y in lens.ideal(places).tolist())
