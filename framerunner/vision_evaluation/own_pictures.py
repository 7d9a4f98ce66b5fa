"""One's own pictures with labels, as labelled images: the four corners of each gate, as they were clicked."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import acos, degrees, hypot, inf
from pathlib import Path
from typing import Annotated, Literal, Self

import cv2
import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from framerunner.camera_calibration.calibration_file import load_calibration
from framerunner.errors import SettingError
from framerunner.files.text_file import TextError, read_bytes
from framerunner.geometry.gate_shape import BAR_LIMITS_M, SIZE_LIMITS_M, GateShape, GateShapes
from framerunner.vision_evaluation.labelled_images import GateLabel, LabelledImage
from vision.calibration.lens import Lens
from vision.calibration.model import Calibration
from vision.gate_model import GateModel, Point
from vision.gate_pose import as_seen, find_poses

FILE = "labels.json"
_MAX_BYTES = 100_000_000
_Size = Annotated[float, Field(ge=SIZE_LIMITS_M[0], le=SIZE_LIMITS_M[1])]
_Bar = Annotated[float, Field(ge=BAR_LIMITS_M[0], le=BAR_LIMITS_M[1])]
_Pixel = Annotated[float, Field(ge=-100_000, le=100_000)]
_Place = tuple[_Pixel, _Pixel]


class _Model(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class LabelledGate(_Model):
    """A gate in a picture."""

    colour: Literal["red", "green", "blue", "cyan", "magenta"]
    corners: tuple[_Place, _Place, _Place, _Place] = Field(
        description="column and row of the outer corners: upper left, upper right, lower right, lower left"
    )
    whole: bool = Field(True, description="nothing of it is hidden or outside the picture")


class LabelledPicture(_Model):
    """A picture and the gates in it."""

    image: str = Field(min_length=1, max_length=500, description="name of the file in the folder")
    frames: tuple[LabelledGate, ...] = ()


class _Shape(_Model):
    outer_width_m: _Size = 0.42
    outer_height_m: _Size = 0.22
    bar_m: _Bar = 0.02
    depth_m: _Bar = 0.02


class PictureLabels(_Model):
    """What the file `labels.json` holds."""

    focal_px: float | None = Field(None, gt=1, le=1e5, description="of a camera without distortion")
    calibration: str | None = Field(
        None, description="file of `framerunner camera calibrate`, beside the labels"
    )
    shape: _Shape = Field(_Shape(), description="of the gates")
    images: tuple[LabelledPicture, ...] = Field(min_length=1)

    @model_validator(mode="after")
    def _one_camera(self) -> Self:
        if (self.focal_px is None) == (self.calibration is None):
            raise ValueError("give either focal_px or calibration")
        return self


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
        size = self.labels.shape
        shape = GateShape(size.outer_width_m, size.outer_height_m, size.bar_m, size.depth_m)
        for picture in self.labels.images:
            path = self.folder / picture.image
            image = cv2.imread(str(path), cv2.IMREAD_COLOR)
            if image is None:
                raise SettingError(f"{path}: is no image that can be read; correct its name in {FILE}")
            height, width = image.shape[:2]
            calibration = self.calibration or Calibration.ideal(width, height, self.labels.focal_px or 0.0)
            lens = Lens(calibration)
            lens.check_size(width, height)
            gates = tuple(
                _label(path, number, gate, shape, lens) for number, gate in enumerate(picture.frames)
            )
            yield LabelledImage(
                image=np.asarray(image, np.uint8),
                scenario=picture.image,
                position_arena_m=(0.0, 0.0, 0.0),
                attitude_arena=(1.0, 0.0, 0.0, 0.0),
                calibration=calibration,
                gates=gates,
                shapes=GateShapes(other=shape),
            )


def _label(path: Path, number: int, gate: LabelledGate, shape: GateShape, lens: Lens) -> GateLabel:
    """What the corners of a gate tell of it; of two poses, the better one."""
    columns, rows = lens.size_px
    places = np.array(gate.corners) - np.array([(columns - 1) / 2, (rows - 1) / 2])
    corners: list[Point] = [(x, y) for x, y in lens.ideal(places).tolist()]
    outline = GateShape(
        shape.outer_width_m + shape.bar_m, shape.outer_height_m + shape.bar_m, shape.bar_m, shape.depth_m
    )  # whose bars' axes are where the outer corners of the gate are
    poses = find_poses(corners, GateModel(outline, lens.focal_px), inf)
    if not poses:
        raise SettingError(
            f"{path.parent / FILE}: {path.name}: frames.{number}.corners: no upright gate looks so; "
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
        corners_px=tuple(corners),
        seen=True,
        whole=gate.whole,
    )
