"""Images of the calibration board as a camera with a known lens sees it."""

from __future__ import annotations

from math import cos, radians, sin

import cv2
import numpy as np

from framerunner.geometry.lens import rays_of_pixels
from vision.calibration.board import CharucoBoard
from vision.calibration.model import Calibration

TRUE = Calibration(
    width_px=640,
    height_px=480,
    fx_px=520.0,
    fy_px=518.0,
    cx_px=326.3,
    cy_px=236.8,
    distortion=(-0.22, 0.07, 0.0008, -0.0006, 0.0),
)
BOARD = CharucoBoard()
_PX_PER_MM = 3.0


def board_image(turn_deg, tilt_deg, roll_deg, place_m, camera=TRUE, noise=1.5, seed=0):
    """The board turned about the upright axis, tilted, rolled, its middle at a place right, down, ahead."""
    picture = cv2.cvtColor(BOARD.picture(margin_mm=12.0), cv2.COLOR_GRAY2BGR)
    size_mm = np.array([BOARD.columns, BOARD.rows]) * BOARD.square_mm + 24.0
    picture = cv2.resize(picture, tuple(int(n) for n in (size_mm * _PX_PER_MM)), interpolation=cv2.INTER_AREA)
    a, b, c = radians(turn_deg), radians(tilt_deg), radians(roll_deg)
    about_y = np.array([[cos(a), 0.0, sin(a)], [0.0, 1.0, 0.0], [-sin(a), 0.0, cos(a)]])
    about_x = np.array([[1.0, 0.0, 0.0], [0.0, cos(b), -sin(b)], [0.0, sin(b), cos(b)]])
    about_z = np.array([[cos(c), -sin(c), 0.0], [sin(c), cos(c), 0.0], [0.0, 0.0, 1.0]])
    rotation, shift = about_y @ about_x @ about_z, np.array(place_m)
    size_px, focal_px = (camera.width_px, camera.height_px), (camera.fx_px, camera.fy_px)
    rays = rays_of_pixels(size_px, focal_px, (camera.cx_px, camera.cy_px), camera.distortion)
    rays = np.concatenate([rays, np.ones((*rays.shape[:2], 1))], axis=-1)
    depth = (rotation[:, 2] @ shift) / (rays @ rotation[:, 2])
    on_board_m = (rays * depth[..., None] - shift) @ rotation
    at = (on_board_m[..., :2] * 1000.0 + size_mm / 2.0) * _PX_PER_MM - 0.5
    image = cv2.remap(
        picture,
        at[..., 0].astype(np.float32),
        at[..., 1].astype(np.float32),
        cv2.INTER_LINEAR,
        borderValue=(120, 120, 120),
    )
    random = np.random.default_rng(seed)
    noisy = cv2.GaussianBlur(image, (0, 0), 0.6) + random.normal(0.0, noise, image.shape)
    return np.clip(noisy, 0, 255).astype(np.uint8)


def board_images(count=20):
    """Views near and far, in the middle and in the corners, tilted to all sides."""
    random = np.random.default_rng(7)
    for number in range(count):
        ahead = random.uniform(0.24, 0.42)
        column, row = (number % 3) - 1, (number // 3 % 3) - 1
        place = (0.30 * column * ahead, 0.26 * row * ahead, ahead)
        turn, tilt = random.uniform(-38.0, 38.0, 2)
        yield board_image(turn, tilt, random.uniform(-15.0, 15.0), place, seed=number)
