"""What an agent sees, as finite numbers in boxes."""

from __future__ import annotations

from math import isfinite, pi
from typing import Any

import cv2
import numpy as np
from gymnasium import spaces

from offboard.drone import DroneState
from scenarios.models import COLOURS, Camera
from vision.types import Detection, Detections, Image

Observation = dict[str, Any]
"""Arrays by name."""

FAR_M = 1000.0
"""Positions and distances are cut off here; nobody flies that far at 1 m/s."""
LONGEST_TRY_S = 36_000.0


def observation_space(camera: Camera, *, image: bool) -> spaces.Dict:
    """The space of `observe`.

    Args:
        camera: size of the image.
        image: with the image itself.
    """
    right_px, top_px = camera.width_px / 2, camera.height_px / 2
    low = np.array([-top_px, -top_px, -right_px, -right_px, 0.0, 0.0], np.float32)
    high = np.array([top_px, top_px, right_px, right_px, FAR_M, 180.0], np.float32)
    place = np.array([FAR_M, FAR_M, FAR_M, 4.0], np.float32)  # pi is a little more in 32 bits
    found: dict[str, spaces.Space[Any]] = {
        "imu": spaces.Box(-place, place, dtype=np.float32),
        "cam": spaces.Box(np.tile(low, (3, 1)), np.tile(high, (3, 1)), dtype=np.float32),
        "seen": spaces.MultiBinary([3, 2]),
        "time_left_s": spaces.Box(0.0, LONGEST_TRY_S, (1,), np.float32),
    }
    if image:
        found["image"] = spaces.Box(0, 255, (camera.height_px, camera.width_px, 3), np.uint8)
    return spaces.Dict(found)


def observe(
    state: DroneState, detections: Detections, time_left_s: float, image: Image | None = None
) -> Observation:
    """Put into arrays what a mission would see.

    Args:
        state: of the drone.
        detections: of the latest image.
        time_left_s: until the try's limit.
        image: the latest image, BGR; None to leave it out.

    Returns:
        imu: x, y, z (metres), yaw (-pi..pi), arena axes; shape (4,).
        cam: red, green, blue; each n, s, e, w (pixels), d (metres), a (degrees), 0 where not known; (3, 6).
        seen: red, green, blue; each whether n, s, e, w and whether d, a are known; (3, 2).
        time_left_s: shape (1,).
        image: RGB, shape (height, width, 3).
    """
    found = [getattr(detections, colour) for colour in COLOURS]
    cam = np.array([_six_numbers(detection) for detection in found], np.float32)
    x, y, z = (min(max(value, -FAR_M), FAR_M) for value in (state.x, state.y, state.z))
    yaw = min(max(state.yaw, -pi), pi)
    observation: Observation = {
        "imu": np.array([x, y, z, yaw], np.float32),
        "cam": cam,
        "seen": np.array([(detection.seen, isfinite(detection.d)) for detection in found], np.int8),
        "time_left_s": np.array([max(0.0, time_left_s)], np.float32),
    }
    if image is not None:
        observation["image"] = rgb(image)
    return observation


def rgb(image: Image) -> Image:
    """A new image with its channels the other way round."""
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2RGB), np.uint8)


def _six_numbers(detection: Detection) -> tuple[float, ...]:
    if not detection.seen:
        return (0.0,) * 6
    edges = (detection.n, detection.s, detection.e, detection.w)
    if not isfinite(detection.d):
        return (*edges, 0.0, 0.0)
    return (*edges, min(detection.d, FAR_M), detection.a)
