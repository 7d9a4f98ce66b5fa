"""MuJoCo in the comparison: the same arena and drone, physics at MuJoCo's default 500 Hz, control at 250 Hz.

Variants:
    default: MuJoCo's own quality: shadows from a map of 4096 × 4096, four samples a pixel.
    alike: as plain as our painter: one sample a pixel, shadows from a map of 1024 × 1024 (a pixel is a
        centimetre, a gate's bar two).
    fastest: one sample a pixel, no shadows, no sky, no ground beyond the floor.
"""

from __future__ import annotations

import ctypes
import os
from dataclasses import dataclass
from math import degrees, dist
from typing import Any

from benchmarks.peers.cascade import Cascade
from benchmarks.peers.job import (
    EGL_ADVICE,
    CannotFlyError,
    Flight,
    GoalFollower,
    Job,
    Stopwatch,
    answer,
    keep_image,
    pin_to_one_core,
)

MASS_KG = 0.300
INERTIA_KG_M2 = (0.0010225, 0.0010225, 0.0020)
ARM_M = 0.075
TORQUE_PER_THRUST_M = 1.3581e-7 / 3.9718e-6
MAX_THRUST_N = 3.9718e-6 * 1650.0**2
MOTOR_LAG_S = 0.03
HALF_EXTENTS_M = "0.125 0.125 0.0225"
CONTROL_EVERY = 2
TIMESTEP_S = 0.002
WARM_UP_S = 1.0
QUALITY = {
    "default": "",
    "alike": '<quality shadowsize="1024" offsamples="0"/>',
    "fastest": '<quality offsamples="0"/>',
}
SKY = """<asset>
        <texture type="skybox" builtin="gradient" width="256" height="1536"
                 rgb1="0.7 0.8 0.85" rgb2="0.85 0.9 0.92"/>
      </asset>"""
GROUND = (
    '<geom type="plane" size="40 40 20" pos="0 0 -0.01" rgba="0.5 0.5 0.5 1" contype="0" conaffinity="0"/>'
)
"""Beyond the floor, as in our images. Not MuJoCo's infinite plane: that is a fine grid, expensive to draw."""
ROTORS = ((1, -1, 1), (-1, 1, 1), (1, 1, -1), (-1, -1, -1))
"""Signs of x, y and of the torque about z: front right, rear left, front left, rear right."""


def model_xml(job: Job) -> str:
    """The arena and the drone of the job in MuJoCo's XML."""
    start = job.goals[0]
    boxes = "".join(
        f'<geom type="box" size="{words(box.half_m)}" pos="{words(box.centre_m)}" '
        f'euler="0 0 {box.yaw_rad}" rgba="{words(box.rgb)} 1"/>'
        for box in job.boxes
    )
    sites = "".join(
        f'<site name="rotor{i}" pos="{x * ARM_M} {y * ARM_M} 0" group="3"/>'
        for i, (x, y, _) in enumerate(ROTORS)
    )
    motors = "".join(
        f'<general site="rotor{i}" gear="0 0 1 0 0 {spin * TORQUE_PER_THRUST_M}" dyntype="filterexact" '
        f'dynprm="{MOTOR_LAG_S}" ctrlrange="0 {MAX_THRUST_N}"/>'
        for i, (_, _, spin) in enumerate(ROTORS)
    )
    floor = f'<geom type="plane" size="{job.arena_m[0] / 2} {job.arena_m[1] / 2} 0.1" rgba="0.8 0.65 0.2 1"/>'
    plain = job.variant == "fastest"
    shadow = "false" if plain else "true"
    return f"""
    <mujoco>
      <compiler angle="radian"/>
      <option timestep="{TIMESTEP_S}" density="1.225" viscosity="1.8e-5"/>
      <visual>{QUALITY[job.variant]}</visual>
      {"" if plain else SKY}
      <worldbody>
        <light directional="true" pos="0 0 5" dir="{words(job.sun_direction)}" castshadow="{shadow}"/>
        {"" if plain else GROUND}
        {floor}
        {boxes}
        <body pos="{words(start.position_m)}" euler="0 0 {start.yaw_rad}">
          <freejoint/>
          <inertial pos="0 0 0" mass="{MASS_KG}" diaginertia="{words(INERTIA_KG_M2)}"/>
          <geom type="box" size="{HALF_EXTENTS_M}" group="3"/>
          <camera name="camera" pos="{words(job.camera_flu_m)}" xyaxes="0 -1 0 0 0 1"
                  fovy="{degrees(job.vertical_fov_rad)}"/>
          {sites}
        </body>
      </worldbody>
      <actuator>{motors}</actuator>
    </mujoco>"""


def words(values: tuple[float, ...]) -> str:
    """Numbers as MuJoCo writes vectors."""
    return " ".join(str(value) for value in values)


def choose_display() -> None:
    """Choose an OpenGL library that draws without a screen, unless the user has."""
    if os.environ.get("MUJOCO_GL"):
        return
    for name, library in (("egl", "libEGL.so.1"), ("osmesa", "libOSMesa.so.8"), ("osmesa", "libOSMesa.so.6")):
        try:
            ctypes.CDLL(library)
        except OSError:
            continue
        os.environ["MUJOCO_GL"] = name
        return
    raise CannotFlyError(f"MuJoCo needs EGL to draw without a screen. {EGL_ADVICE}")


@dataclass(frozen=True, slots=True)
class World:
    """MuJoCo with the job's arena in it."""

    mujoco: Any
    model: Any
    renderer: Any


def make_world(job: Job) -> World:
    """Compile the model and open a renderer."""
    choose_display()
    try:
        import mujoco

        model = mujoco.MjModel.from_xml_string(model_xml(job))
        return World(mujoco, model, mujoco.Renderer(model, job.height_px, job.width_px))
    except Exception as error:  # the system's OpenGL may raise anything; one line must say what is missing
        raise CannotFlyError(f"MuJoCo cannot draw without a screen ({error}). {EGL_ADVICE}") from error


def fly(job: Job) -> Flight:
    """Fly once to warm up and once for the time."""
    pin_to_one_core()
    world = make_world(job)
    from OpenGL import GL

    for seconds in (WARM_UP_S, job.seconds):
        data = world.mujoco.MjData(world.model)
        world.mujoco.mj_forward(world.model, data)
        stopwatch = Stopwatch()
        images, image = loop(job, seconds, world, data)
        processor_s, wall_s = stopwatch.read()
    return Flight(
        world.mujoco.__version__,
        f"{1 / TIMESTEP_S:.0f}/{1 / TIMESTEP_S / CONTROL_EVERY:.0f} Hz",
        GL.glGetString(GL.GL_RENDERER).decode(),
        job.seconds,
        processor_s,
        wall_s,
        images,
        keep_image(job, image),
        dist(data.qpos[:3], job.goals[-1].position_m),
    )


def loop(job: Job, seconds: float, world: World, data: Any) -> tuple[int, Any]:
    """Physics, control and images; how many of them, and the last."""
    controller = Cascade(MASS_KG, INERTIA_KG_M2, ARM_M, TORQUE_PER_THRUST_M, MAX_THRUST_N)
    follower = GoalFollower(job.goals)
    step, model, renderer = world.mujoco.mj_step, world.model, world.renderer
    qpos, qvel, ctrl = data.qpos, data.qvel, data.ctrl
    images, image = 0, None
    control_rate_hz = 1 / TIMESTEP_S / CONTROL_EVERY
    for tick in range(round(seconds * control_rate_hz)):
        goal = follower.at(tick / control_rate_hz)
        ctrl[:] = controller.step(qpos.tolist(), qvel.tolist(), goal.position_m, goal.yaw_rad)
        step(model, data, CONTROL_EVERY)
        if (tick + 1) * job.image_rate_hz >= (images + 1) * control_rate_hz:
            renderer.update_scene(data, "camera")
            image = renderer.render()
            images += 1
    return images, image


if __name__ == "__main__":
    answer(fly)
