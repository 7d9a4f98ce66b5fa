"""What makes images hard: lens, exposure, sensor and colour; a hall with posters, stripes and tape."""

from __future__ import annotations

from math import hypot
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from scenarios.imaging.furnishings import PatchColour, Person, Picture, Surface, Window
from scenarios.imaging.textures import Texture
from scenarios.part import Part

MAX_K, MAX_P = 1.0, 0.1
_LENS_STEPS = 400
_MAX_TANGENT = 6.0  # of the angle between the optical axis and the image's corner

Gain = Annotated[float, Field(ge=0.2, le=5.0)]


class LensDistortion(Part):
    """Lens distortion: the Brown-Conrady model with the coefficients of OpenCV.

    A ray at (x, y) = (right, down) / ahead, with r² = x² + y², is seen at

        x (1 + k1 r² + k2 r⁴ + k3 r⁶) + 2 p1 x y + p2 (r² + 2 x²),
        y (1 + k1 r² + k2 r⁴ + k3 r⁶) + p1 (r² + 2 y²) + 2 p2 x y

    times the focal length (D. Brown, "Close-range camera calibration", Photogrammetric Engineering, 1971).
    """

    k1: float = Field(0.0, ge=-MAX_K, le=MAX_K, description="radial; negative: barrel distortion")
    k2: float = Field(0.0, ge=-MAX_K, le=MAX_K, description="radial")
    p1: float = Field(0.0, ge=-MAX_P, le=MAX_P, description="tangential")
    p2: float = Field(0.0, ge=-MAX_P, le=MAX_P, description="tangential")
    k3: float = Field(0.0, ge=-MAX_K, le=MAX_K, description="radial")

    @property
    def coefficients(self) -> tuple[float, float, float, float, float]:
        """In OpenCV's order."""
        return (self.k1, self.k2, self.p1, self.p2, self.k3)

    def sees_up_to(self, width: float, height: float) -> bool:
        """Whether every place of an image belongs to one ray.

        Args:
            width: of half the image, in focal lengths.
            height: the same.
        """
        corner = 1.1 * hypot(width, height)
        before = 0.0
        for step in range(1, _LENS_STEPS + 1):
            r = _MAX_TANGENT * step / _LENS_STEPS
            square = r * r
            seen = r * (1.0 + square * (self.k1 + square * (self.k2 + square * self.k3)))
            if seen >= corner:
                return True
            if seen <= before:
                return False
            before = seen
        return False


class CameraEffects(Part):
    """What a real camera does to an image; the numbers here are those of a camera without errors.

    Brightness is linear, without a gamma curve: the painted colours are what a sensor with the gain 1 sees.
    """

    lens: LensDistortion = Field(LensDistortion(), description="distortion")
    exposure_s: float = Field(
        0.0, ge=0, le=0.05, description="time of exposure, in which motion blurs the image"
    )
    readout_s: float = Field(
        0.0, ge=0, le=0.05, description="from the first to the last row; 0: all rows at once (global shutter)"
    )
    blur_px: float = Field(
        0.0, ge=0, le=10, description="standard deviation of the lens's blur, pixels of the image"
    )
    vignetting: float = Field(0.0, ge=0, le=0.9, description="share of the light lost in the image's corners")
    illumination: float = Field(
        1.0, ge=0.02, le=1, description="light that reaches the sensor; the painted colours have 1"
    )
    light_rgb: tuple[Gain, Gain, Gain] = Field((1.0, 1.0, 1.0), description="colour of that light")
    read_noise: float = Field(
        0.0, ge=0, le=20, description="standard deviation of noise in the dark, before the gain, of 255"
    )
    shot_noise: float = Field(
        0.0, ge=0, le=20, description="standard deviation of shot noise at white, before the gain, of 255"
    )
    gain: Literal["auto", "fixed"] = Field("fixed", description="whether brightness is regulated")
    fixed_gain: float = Field(1.0, ge=0.2, le=20, description="factor of brightness if it is fixed")
    auto_mean: float = Field(100.0, ge=10, le=200, description="mean brightness if it is regulated, of 255")
    max_gain: float = Field(8.0, ge=1, le=50, description="largest factor if it is regulated")
    white_balance: Literal["auto", "fixed"] = Field(
        "fixed", description="auto: the channels' means are drawn together, as if the scene were grey"
    )
    balance_rgb: tuple[Gain, Gain, Gain] = Field(
        (1.0, 1.0, 1.0), description="factors of the channels if it is fixed"
    )
    auto_balance: float = Field(0.5, ge=0, le=1, description="how far they are drawn together if it is auto")


class Patch(Part):
    """A flat rectangle on a surface: a poster, a stripe, a sheet; or only its border."""

    surface: Surface = Field(description="what it is on")
    colour: PatchColour = Field(description="of print, less pure than a frame's")
    across_m: float = Field(
        ge=-500, le=500, description="centre: x on the floor, else from the wall's middle"
    )
    up_m: float = Field(ge=-500, le=500, description="centre: y on the floor, else above the floor")
    width_m: float = Field(ge=0.01, le=100, description="along the first of them, before it is turned")
    height_m: float = Field(ge=0.01, le=100, description="along the second of them, before it is turned")
    turn_rad: float = Field(0.0, ge=-6.3, le=6.3, description="in its plane")
    border_m: float | None = Field(
        None,
        ge=0.001,
        le=50,
        description="width of its border if it is nothing but that; by default it is whole",
    )


class Hall(Part):
    """A room around the arena. It is only seen: nothing collides with its walls."""

    often_unused: ClassVar = ("wall_texture", "windows", "pictures", "people")

    beyond_m: float = Field(1.5, ge=0.01, le=100, description="from the arena's border to the walls")
    height_m: float = Field(5.0, ge=0.1, le=100, description="of the ceiling")
    wall_texture: Texture | None = Field(None, description="of the walls; by default they are plain")
    windows: tuple[Window, ...] = Field((), max_length=100, description="in the walls")
    pictures: tuple[Picture, ...] = Field((), max_length=100, description="on the walls")
    people: tuple[Person, ...] = Field((), max_length=50, description="who stand outside the arena")
