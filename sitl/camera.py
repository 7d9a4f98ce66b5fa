"""The drone's camera: `SimulatedCamera` makes images, `CameraFeed` takes them in simulated time.

`Painter` paints a canvas of twice the resolution. Without effects a pixel of the image is the mean of four of
it. With them, it is painted at several times of the exposure if the image moves much, and lens and sensor
make the image of that (`sitl/optics`). The time of an image is the middle of its exposure and of its
read-out.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import hypot, isfinite

import cv2
import numpy as np

from framerunner.geometry.rotations import (
    RotationRows,
    mounting_flu,
    multiply,
    normalized,
    rotated_by_rate,
    rotation,
    rotation_rows,
)
from framerunner.geometry.solids import Solid
from framerunner.geometry.vectors import ZERO3, Quaternion, Vec3
from scenarios.models import Scenario, TrueState
from sitl.camera_projection import Pinhole
from sitl.optics.backdrop import Backdrop
from sitl.optics.painter import MARGIN_PX, Image, Painter, reduced
from sitl.optics.sensor import SCALE, LensMap, SensorChain

FIRST_EXPOSURE_US = 36_000
_INSIDE = (slice(MARGIN_PX, -MARGIN_PX), slice(MARGIN_PX, -MARGIN_PX))
_NOMINAL_M = 1.5  # distance of what moves in an image by the drone's speed, to choose how it is exposed
_BLUR_STEP_PX = 1.0  # motion in an image during one of the exposures that it is the mean of
_MAX_EXPOSURES = 4


@dataclass(frozen=True, slots=True)
class ExposureMotion:
    """When an image is exposed, and how the drone moves then; all that effects need beside its pose."""

    time_us: int = 0
    velocity_arena_m_s: Vec3 = ZERO3
    rate_frd_rad_s: Vec3 = ZERO3


STILL = ExposureMotion()


class SimulatedCamera:
    """The camera of a scenario. It has no state: the same pose, motion and time give the same image.

    Args:
        scenario: camera and what is to be seen.
        seed: of noise.
    """

    def __init__(self, scenario: Scenario, seed: int = 0) -> None:
        self._settings = settings = scenario.camera
        self._effects = effects = settings.effects
        angles_rad = settings.mounting_frd_rad
        self._mounting = mounting_flu(angles_rad) if any(angles_rad) else None
        if effects is None:
            width_px, height_px = (
                SCALE * (px + 2 * MARGIN_PX) for px in (settings.width_px, settings.height_px)
            )
            focal_px = SCALE * settings.focal_px
        else:
            self._lens = lens = LensMap(settings)
            self._blur_px = effects.blur_px
            self._sensor = SensorChain(settings, seed)
            # Of the read-out while as many rows are read as the canvas has.
            self._readout_s = effects.readout_s * lens.height_px / (SCALE * settings.height_px)
            width_px, height_px, focal_px = lens.width_px, lens.height_px, lens.focal_px
        self._canvas = np.empty((height_px, width_px, 3), np.uint8)  # painted again and again
        pinhole = Pinhole(width_px, height_px, focal_px, settings.near_m, settings.far_m)
        self._pinhole = pinhole
        self._painter = Painter(scenario, pinhole)

    @property
    def focal_px(self) -> float:
        """Focal length, pixels."""
        return self._settings.focal_px

    def render(
        self,
        position_arena_m: Vec3,
        attitude_arena: Quaternion,
        drones: Sequence[Solid] = (),
        motion: ExposureMotion = STILL,
        *,
        gimbal_arena: Quaternion | None = None,
        backdrop: Backdrop | None = None,
    ) -> Image:
        """What the camera sees.

        Args:
            position_arena_m: centre of the drone; the scenario has the camera's place on it.
            attitude_arena: quaternion (w, x, y, z), body FLU to arena; need not have unit length.
            drones: boxes of other drones. They move, so they are not in the tree of faces: each is painted
                where the tree has its centre. That is correct unless it flies closer to a thing than about
                its own size.
            motion: of the drone, for blur and rolling shutter; its time is that of light and noise.
            gimbal_arena: attitude of a camera on a gimbal, forward-left-up to arena; its centre is the
                camera's place on the drone. None: the camera is fixed to the drone.
            backdrop: seen behind gates, base and obstacles, instead of floor, hall and sky.

        Returns:
            A new image, BGR, shape (height, width, 3), uint8; its rows need not follow each other in memory.

        Raises:
            ValueError: a number is not finite, or the quaternion is zero.
        """
        if gimbal_arena is not None:
            place = self._eye(position_arena_m, _rows(attitude_arena))
            x, y, z = self._settings.position_flu_m
            turned = zip(place, _rows(gimbal_arena), strict=True)
            cx, cy, cz = (e - r[0] * x - r[1] * y - r[2] * z for e, r in turned)
            position_arena_m, attitude_arena = (cx, cy, cz), gimbal_arena
        if self._effects is None:
            attitude = _unit(attitude_arena)
            eye, rotation = self._seen_from(position_arena_m, attitude)
            canvas = self._canvas
            self._painter.paint(
                eye, rotation, drones, time_us=motion.time_us, canvas=canvas, backdrop=backdrop
            )
            return reduced(canvas, SCALE)[_INSIDE]
        light = self._exposed(position_arena_m, attitude_arena, drones, motion, backdrop)
        return self._sensor.develop(light, motion.time_us)

    def _exposed(
        self,
        position: Vec3,
        attitude: Quaternion,
        drones: Sequence[Solid],
        motion: ExposureMotion,
        backdrop: Backdrop | None,
    ) -> Image:
        """The mean of what is seen behind the lens during the exposure."""
        drift = None
        if self._readout_s > 0.0 and motion != STILL:
            first, last = (
                self._pinhole.matrix(*self._pose_at(position, attitude, motion, share * self._readout_s))
                for share in (-0.5, 0.5)
            )
            drift = last - first
        count = self._exposures(motion)
        mean: Image | None = None
        for index in range(count):
            after_s = self._exposure_s * ((index + 0.5) / count - 0.5)
            eye, rotation = self._pose_at(position, attitude, motion, after_s)
            self._painter.paint(
                eye,
                rotation,
                drones,
                time_us=motion.time_us,
                drift=drift,
                canvas=self._canvas,
                backdrop=backdrop,
            )
            seen = self._lens.image(self._canvas)
            if mean is None:
                mean = seen
            else:
                cv2.addWeighted(mean, index / (index + 1), seen, 1 / (index + 1), 0.0, dst=mean)
        assert mean is not None  # there is at least one exposure
        if self._blur_px > 0.0:
            mean = np.asarray(cv2.GaussianBlur(mean, (0, 0), self._blur_px), np.uint8)
        return mean

    @property
    def _exposure_s(self) -> float:
        return 0.0 if self._effects is None else self._effects.exposure_s

    def _exposures(self, motion: ExposureMotion) -> int:
        """At how many times within the exposure the canvas is painted."""
        rate = hypot(*motion.rate_frd_rad_s) + hypot(*motion.velocity_arena_m_s) / _NOMINAL_M
        blur_px = self._settings.focal_px * rate * self._exposure_s
        return min(_MAX_EXPOSURES, 1 + int(blur_px / _BLUR_STEP_PX))

    def _pose_at(
        self, position: Vec3, attitude: Quaternion, motion: ExposureMotion, after_s: float
    ) -> tuple[Vec3, RotationRows]:
        """The camera's position and axes a short time later, with constant velocity and body rates."""
        x, y, z = position
        vx, vy, vz = motion.velocity_arena_m_s
        roll, pitch, yaw = motion.rate_frd_rad_s
        turned = rotated_by_rate(_unit(attitude), (roll, -pitch, -yaw), after_s)
        return self._seen_from((x + vx * after_s, y + vy * after_s, z + vz * after_s), turned)

    def _seen_from(self, position: Vec3, attitude: Quaternion) -> tuple[Vec3, RotationRows]:
        """The camera's position and axes on a drone with this pose; its attitude has unit length."""
        rows = rotation_rows(rotation(attitude))
        eye = self._eye(position, rows)
        if self._mounting is not None:
            rows = rotation_rows(rotation(multiply(attitude, self._mounting)))
        return eye, rows

    def _eye(self, position: Vec3, rotation: RotationRows) -> Vec3:
        if not all(map(isfinite, position)):
            raise ValueError(f"position_arena_m: every component must be finite, got {position}")
        x, y, z = self._settings.position_flu_m
        ex, ey, ez = (p + r[0] * x + r[1] * y + r[2] * z for p, r in zip(position, rotation, strict=True))
        return (ex, ey, ez)


def _unit(attitude: Quaternion) -> Quaternion:
    norm = hypot(*attitude)
    if not isfinite(norm) or norm == 0.0:
        raise ValueError(f"attitude_arena: need a finite quaternion other than zero, got {attitude}")
    return normalized(attitude)


def _rows(attitude: Quaternion) -> RotationRows:
    """The rotation matrix of a quaternion of any length but zero."""
    return rotation_rows(rotation(_unit(attitude)))


class Exposure:
    """What the camera sees at a time, painted when `image` is first asked for.

    Args:
        camera: that sees it.
        truth: pose of the drone then.
        drones: boxes of other drones then.

    Attributes:
        time_us: of the exposure, simulated time.
    """

    def __init__(self, camera: SimulatedCamera, truth: TrueState, drones: Sequence[Solid]) -> None:
        self.time_us = truth.time_us
        self._camera, self._truth, self._drones = camera, truth, drones

    @cached_property
    def image(self) -> Image:
        """BGR, shape (height, width, 3), uint8."""
        truth, gimbal = self._truth, self._truth.camera
        rate = truth.rate_frd_rad_s if gimbal is None else gimbal.rate_frd_rad_s
        return self._camera.render(
            truth.position_arena_m,
            truth.attitude_arena,
            self._drones,
            ExposureMotion(truth.time_us, truth.velocity_arena_m_s, rate),
            gimbal_arena=None if gimbal is None else gimbal.attitude_arena,
        )


Change = Callable[[int, Exposure | None], Exposure | None]


class CameraFeed:
    """Takes images at the camera's rate and returns each after the camera's latency.

    Exposures are on a grid of the camera's period that begins at 36 ms, each once; a rate above the control
    rate gives one image a tick. The navigator's ticks are 50 ms apart and begin at 0: with the default
    latency an image arrives 14 ms before one. That is recent, which the paper's navigator needs to keep its
    height before a gate, and early enough that video and telemetry do not race.

    Args:
        scenario: camera settings and what is to be seen.
        drones: called at each exposure for the boxes of other drones.
        seed: of noise.
        change: from the time and the image that would arrive, or None, to what arrives; None: no fault.

    Attributes:
        next_us: before this time there is nothing to do.
    """

    def __init__(
        self,
        scenario: Scenario,
        drones: Callable[[], Sequence[Solid]] = tuple,
        seed: int = 0,
        change: Change | None = None,
    ) -> None:
        self._camera = SimulatedCamera(scenario, seed)
        self._change = change
        self._drones = drones
        self._period_us = 1e6 / scenario.camera.rate_hz
        self._latency_us = round(scenario.camera.latency_s * 1e6)
        self._taken = 0
        self.next_us = 0
        self._waiting: deque[Exposure] = deque()

    def step(self, truth: TrueState) -> tuple[int, Image] | None:
        """Take the image that is due at this tick, and return the one that arrives.

        Args:
            truth: pose of the drone now.

        Returns:
            Time of exposure, microseconds, and the image; None if none arrives at this tick.
        """
        arrived = self.arrival(truth)
        return None if arrived is None else (arrived.time_us, arrived.image)

    def arrival(self, truth: TrueState) -> Exposure | None:
        """As `step`, for a user who does not look at every image: those are not painted."""
        if truth.time_us < self.next_us:
            return None
        index = int((truth.time_us - FIRST_EXPOSURE_US) // self._period_us)
        if index >= self._taken:
            self._taken = index + 1
            self._waiting.append(Exposure(self._camera, truth, self._drones()))
        arrived = None
        if self._waiting and self._waiting[0].time_us + self._latency_us <= truth.time_us:
            arrived = self._waiting.popleft()
        self.next_us = int(FIRST_EXPOSURE_US + self._taken * self._period_us)
        if self._waiting:
            self.next_us = min(self.next_us, self._waiting[0].time_us + self._latency_us)
        if self._change is not None:
            self.next_us = 0  # an image may be late
            return self._change(truth.time_us, arrived)
        return arrived
