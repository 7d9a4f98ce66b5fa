"""PyFlyt in the comparison: its quadrotor, its own cascaded position control, its camera.

Variants:
    default: PyFlyt as it comes: PyBullet's own renderer on the processor.
    fastest: OpenGL through PyBullet's EGL plug-in, no shadows, no segmentation image.

Physics and control run at PyFlyt's defaults, 240 and 120 Hz. Its camera delivers colour, depth and, in the
default variant, a segmentation with every image; there is no switch for less.
"""

from __future__ import annotations

import ctypes
import importlib.util
from functools import partial
from math import degrees, dist
from typing import Any

from benchmarks.peers.job import (
    EGL_ADVICE,
    Box,
    CannotFlyError,
    Flight,
    GoalFollower,
    Job,
    Stopwatch,
    answer,
    keep_image,
    pin_to_one_core,
)

PHYSICS_RATE_HZ = 240
CONTROL_RATE_HZ = 120
POSITION_MODE = 7  # x, y, yaw, z
WARM_UP_S = 1.0


def fly(job: Job) -> Flight:
    """Fly once to warm up (PyFlyt compiles functions at their first call) and once for the time."""
    pin_to_one_core()
    from importlib import metadata

    if PHYSICS_RATE_HZ % job.image_rate_hz:
        raise CannotFlyError(
            f"{job.image_rate_hz:g} images a second: PyFlyt takes rates that divide {PHYSICS_RATE_HZ} Hz only"
        )
    for seconds in (WARM_UP_S, job.seconds):
        aviary = make_aviary(job)
        stopwatch = Stopwatch()
        images = loop(job, seconds, aviary)
        processor_s, wall_s = stopwatch.read()
        image, position_m = aviary.drones[0].rgbaImg, aviary.state(0)[3]
        aviary.disconnect()
    return Flight(
        metadata.version("PyFlyt"),
        f"{PHYSICS_RATE_HZ}/{CONTROL_RATE_HZ} Hz",
        "TinyRenderer" if job.variant == "default" else "OpenGL",
        job.seconds,
        processor_s,
        wall_s,
        images,
        keep_image(job, image),
        dist(position_m, job.goals[-1].position_m),
    )


def make_aviary(job: Job) -> Any:
    """The arena with the drone at its start."""
    import numpy as np
    from PyFlyt.core import Aviary

    start = job.goals[0]
    aviary = Aviary(
        np.array([start.position_m]),
        np.array([[0.0, 0.0, start.yaw_rad]]),
        drone_type="quadx",
        drone_options={
            "control_hz": CONTROL_RATE_HZ,
            "use_camera": True,
            "camera_fps": round(job.image_rate_hz),
            "camera_resolution": (job.height_px, job.width_px),
            "camera_FOV_degrees": degrees(job.vertical_fov_rad),
            "camera_angle_degrees": 0,
            "camera_position_offset": np.array(job.camera_flu_m),
        },
        physics_hz=PHYSICS_RATE_HZ,
    )
    if job.variant == "fastest":
        draw_with_opengl(aviary)
    for box in job.boxes:
        add_box(aviary, box)
    aviary.register_all_new_bodies()
    aviary.set_mode(POSITION_MODE)
    return aviary


def draw_with_opengl(aviary: Any) -> None:
    """Load PyBullet's plug-in, then the arena again: the plug-in draws only what is loaded after it."""
    import pybullet

    try:
        ctypes.CDLL("libEGL.so.1")  # without it, the plug-in ends the process
    except OSError:
        raise CannotFlyError(f"PyBullet's OpenGL plug-in needs EGL. {EGL_ADVICE}") from None
    spec = importlib.util.find_spec("eglRenderer")
    if spec is None or aviary.loadPlugin(spec.origin, "_eglRendererPlugin") < 0:
        raise CannotFlyError(f"PyBullet's OpenGL plug-in does not load. {EGL_ADVICE}")
    aviary.reset()
    aviary.getCameraImage = partial(
        aviary.getCameraImage,
        shadow=0,
        flags=pybullet.ER_NO_SEGMENTATION_MASK,
        renderer=pybullet.ER_BULLET_HARDWARE_OPENGL,
    )


def add_box(aviary: Any, box: Box) -> None:
    """Put a solid, visible box into the arena."""
    import pybullet

    body = aviary.createMultiBody(
        0,
        aviary.createCollisionShape(pybullet.GEOM_BOX, halfExtents=box.half_m),
        aviary.createVisualShape(pybullet.GEOM_BOX, halfExtents=box.half_m, rgbaColor=[*box.rgb, 1.0]),
        box.centre_m,
        aviary.getQuaternionFromEuler([0.0, 0.0, box.yaw_rad]),
    )
    if body < 0:
        raise CannotFlyError("PyBullet does not take the boxes of the arena")


def loop(job: Job, seconds: float, aviary: Any) -> int:
    """Physics, control and images; how many of them."""
    import numpy as np

    follower = GoalFollower(job.goals)
    drone, goal, images = aviary.drones[0], None, 0
    image = drone.rgbaImg
    for tick in range(round(seconds * CONTROL_RATE_HZ)):
        wanted = follower.at(tick / CONTROL_RATE_HZ)
        if wanted is not goal:
            goal = wanted
            x, y, z = goal.position_m
            aviary.set_setpoint(0, np.array([x, y, goal.yaw_rad, z]))
        aviary.step()
        if drone.rgbaImg is not image:
            image = drone.rgbaImg
            images += 1
    return images


if __name__ == "__main__":
    answer(fly)
