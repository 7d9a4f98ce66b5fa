"""The calibration of a camera, as a file holds it."""

from __future__ import annotations

from math import atan
from typing import Annotated, Literal, Self

from pydantic import BaseModel, ConfigDict, Field

from framerunner.errors import UserError
from framerunner.geometry.lens import Coefficients
from framerunner.geometry.rotations import MAX_MOUNTING_RAD

Coefficient = Annotated[float, Field(ge=-100, le=100)]
_Weight = Annotated[float, Field(ge=-10, le=10)]
_Weights = tuple[_Weight, _Weight, _Weight]
_Angle = Annotated[float, Field(ge=-MAX_MOUNTING_RAD, le=MAX_MOUNTING_RAD)]
_Offset = Annotated[float, Field(ge=-2, le=2)]
_Deviation = Annotated[float, Field(ge=0, le=10)]
_Day = Annotated[str, Field(pattern=r"^20\d\d-(0[1-9]|1[0-2])-(0[1-9]|[12]\d|3[01])$")]
ColourMatrix = tuple[_Weights, _Weights, _Weights]


class CalibrationError(UserError):
    """A calibration that cannot be made or used; the message is one line for people."""


class Mounting(BaseModel):
    """How a camera is mounted on a drone, as `camera extrinsics` measures it.

    Angles turn the body's axes into the camera's: yaw, pitch, roll, about the axes down, right, forward.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    angles_frd_rad: tuple[_Angle, _Angle, _Angle] = Field(
        description="roll, pitch and yaw; to the right, up and to the right are positive"
    )
    angles_std_rad: tuple[_Deviation, _Deviation, _Deviation] | None = Field(
        None, description="standard deviations of the angles, that of yaw against the telemetry's heading"
    )
    position_flu_m: tuple[_Offset, _Offset, _Offset] | None = Field(
        None, description="of the lens from the drone's centre: forward, left, up; None: the scenario's"
    )
    position_std_m: tuple[_Deviation, _Deviation, _Deviation] | None = Field(
        None, description="standard deviations of the position"
    )
    measured_on: _Day | None = Field(None, description="the day of the measurement, year-month-day")


class Calibration(BaseModel):
    """Camera matrix and lens distortion, by OpenCV's conventions: whole numbers are pixel centres."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    model: Literal["brown-conrady"] = Field("brown-conrady", description="of the lens distortion")
    width_px: int = Field(ge=16, le=16384, description="columns of the images")
    height_px: int = Field(ge=16, le=16384, description="rows of the images")
    fx_px: float = Field(gt=1, le=1e5, description="focal length in columns")
    fy_px: float = Field(gt=1, le=1e5, description="focal length in rows")
    cx_px: float = Field(ge=0, le=16384, description="column of the optical axis")
    cy_px: float = Field(ge=0, le=16384, description="row of the optical axis")
    distortion: tuple[Coefficient, Coefficient, Coefficient, Coefficient, Coefficient] = Field(
        (0.0,) * 5, description="k1, k2, p1, p2, k3"
    )
    readout_s: float = Field(
        0.0, ge=0, le=0.1, description="of a rolling shutter, from the first to the last row; 0 if not known"
    )
    colour_matrix: ColourMatrix | None = Field(
        None,
        description="by which blue, green and red are multiplied, from `camera colours`",
    )
    mounting: Mounting | None = Field(
        None, description="how it is mounted on the drone, from `camera extrinsics`; None: never measured"
    )
    delay_s: float | None = Field(
        None,
        ge=0,
        le=0.5,
        description="from exposure to arrival of an image without a time stamp; None: --camera-delay says it",
    )
    rms_px: float | None = Field(
        None, ge=0, le=10_000, description="root mean square of what is left of the corners' errors"
    )
    images: int | None = Field(None, ge=1, le=1_000_000, description="how many images it was made from")
    made_on: _Day | None = Field(None, description="the day on which the lens was calibrated, year-month-day")

    @classmethod
    def ideal(
        cls, width_px: int, height_px: int, focal_px: float, distortion: Coefficients = (0.0,) * 5
    ) -> Self:
        """A camera with square pixels and the optical axis in the image's middle."""
        return cls(
            width_px=width_px,
            height_px=height_px,
            fx_px=focal_px,
            fy_px=focal_px,
            cx_px=(width_px - 1) / 2,
            cy_px=(height_px - 1) / 2,
            distortion=distortion,
        )

    @property
    def is_ideal(self) -> bool:
        """Whether pixels need no correction, and all are exposed at once."""
        ideal = self.ideal(self.width_px, self.height_px, self.fx_px)
        mine = (self.fy_px, self.cx_px, self.cy_px, self.distortion, self.readout_s)
        return mine == (ideal.fy_px, ideal.cx_px, ideal.cy_px, ideal.distortion, ideal.readout_s)

    @property
    def horizontal_fov_rad(self) -> float:
        """Angle of view over the width, of a camera without distortion with this focal length."""
        return 2.0 * atan(self.width_px / 2.0 / self.fx_px)
