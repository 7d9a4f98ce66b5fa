"""The flying body: one JSBSim instance behind cached property nodes."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from math import cos, degrees, pi, sin
from pathlib import Path

import jsbsim

from errors import UserError
from firmware_py.airframe import Airframe
from geometry.vectors import Quaternion, Vec3
from sitl.airframe_xml import (
    COMMAND_PROPERTY,
    SPEED_PROPERTY,
    TOUCH_FORCES,
    TOUCH_MOMENTS,
    airframe_xml,
)

METRES_PER_FOOT = 0.3048


class DynamicsError(UserError):
    """JSBSim refused the model; the message is one line for people."""


class Dynamics:
    """A rigid body in JSBSim, seen in NED axes of the tangent plane at the arena's centre.

    JSBSim flies over the rotating WGS 84 ellipsoid; within an arena it differs from a plane by less than
    a micrometre, and `position/from-start-neu-*` gives Cartesian metres from the starting point.

    Args:
        airframe: the declared drone.
        position_ned_m: where its centre starts, relative to the arena's centre on the floor.
        yaw_rad: heading at the start, clockwise from north.
        latitude_deg: of the arena's centre (the small offset of the start is of no account to gravity).
        longitude_deg: of the arena's centre.
        altitude_m: of the floor, above mean sea level.
        rate_hz: physics steps a second.

    Raises:
        DynamicsError: JSBSim does not load the model.
    """

    def __init__(
        self,
        airframe: Airframe,
        position_ned_m: Vec3,
        yaw_rad: float,
        *,
        latitude_deg: float,
        longitude_deg: float,
        altitude_m: float,
        rate_hz: int,
    ) -> None:
        # The logger belongs to the thread; it must be set before the instance says hello.
        jsbsim.set_logger(jsbsim.DefaultLogger(jsbsim.LogLevel.ERROR))
        self._fdm = fdm = jsbsim.FGFDMExec(None)
        fdm.set_debug_level(0)
        fdm.set_dt(1.0 / rate_hz)  # before loading: the filters' coefficients are made from it
        self._load(airframe)
        self._start_ned_m = position_ned_m
        self._floor_ft = altitude_m / METRES_PER_FOOT
        self._ground_m: float | None = None
        self._commanded: tuple[float, ...] = ()
        for name, value in (
            ("ic/lat-geod-deg", latitude_deg),
            ("ic/long-gc-deg", longitude_deg),
            ("ic/terrain-elevation-ft", self._floor_ft),
            ("ic/h-agl-ft", -position_ned_m[2] / METRES_PER_FOOT),
            ("ic/psi-true-deg", degrees(yaw_rad) % 360.0),
        ):
            fdm.set_property_value(name, value)
        if not fdm.run_ic():
            raise DynamicsError(f"airframe {airframe.name}: JSBSim refuses its initial state")
        self._cache_nodes(airframe)
        # JSBSim's own zero of these three is not exactly the initial position: ours is.
        self._start_neu_ft = (self._north(), self._east(), self._up())

    def _load(self, airframe: Airframe) -> None:
        with tempfile.TemporaryDirectory(prefix="framerunner-") as folder:
            model = Path(folder) / "aircraft" / airframe.name / f"{airframe.name}.xml"
            model.parent.mkdir(parents=True)
            model.write_text(airframe_xml(airframe), encoding="utf-8")
            fdm = self._fdm
            if not fdm.load_model_with_paths(
                airframe.name, str(model.parent.parent), str(model.parent), str(model.parent), True
            ):
                raise DynamicsError(f"airframe {airframe.name}: JSBSim refuses the model made from it")

    def _cache_nodes(self, airframe: Airframe) -> None:
        manager = self._fdm.get_property_manager()

        def node(name: str) -> jsbsim.FGPropertyNode:
            found = manager.get_node(name)
            if found is None:
                raise DynamicsError(f"airframe {airframe.name}: JSBSim has no property {name}")
            return found

        def getter(name: str) -> Callable[[], float]:
            return node(name).get_double_value

        def setter(name: str) -> Callable[[float], bool]:
            return node(name).set_double_value

        self.run = self._fdm.run
        self._north, self._east, self._up = (getter(f"position/from-start-neu-{axis}-ft") for axis in "neu")
        self._velocity = tuple(getter(f"velocities/v-{axis}-fps") for axis in ("north", "east", "down"))
        self._angles = tuple(getter(f"attitude/{axis}-rad") for axis in ("phi", "theta", "psi"))
        self._rates = tuple(getter(f"velocities/{axis}-rad_sec") for axis in "pqr")
        self._force = tuple(getter(f"accelerations/a-pilot-{axis}-ft_sec2") for axis in "xyz")
        rotors = range(len(airframe.rotors))
        self._motors = tuple(setter(COMMAND_PROPERTY.format(index)) for index in rotors)
        self._commands = list(self._motors)
        self._speeds = tuple(getter(SPEED_PROPERTY.format(index)) for index in rotors)
        self._touch = tuple(setter(name) for name in (*TOUCH_FORCES, *TOUCH_MOMENTS))
        self._ground = setter("position/terrain-elevation-asl-ft")
        self._corners = tuple(getter(f"contact/unit[{index}]/WOW") for index in range(8))

    def command_motors(self, speeds_rad_s: tuple[float, ...]) -> None:
        """Set the speeds the motors run up to, rad/s, in the airframe's order."""
        if speeds_rad_s is self._commanded:  # JSBSim keeps them
            return
        self._commanded = speeds_rad_s
        for command, speed in zip(self._commands, speeds_rad_s, strict=True):
            command(speed)

    def fail_motor(self, index: int, *, stuck: bool = False) -> None:
        """Cut a motor off from its commands.

        Args:
            index: in the airframe's order.
            stuck: it goes on at the speed last commanded; else it stops.
        """
        if not stuck:
            self._motors[index](0.0)
        self._commands[index] = _unheard

    def repair_motor(self, index: int) -> None:
        """Let a motor follow its commands again."""
        self._commands[index] = self._motors[index]
        self._commanded = ()

    def push(self, force_frd_n: Vec3, moment_frd_nm: Vec3) -> None:
        """Set the force and moment from touching things, in body axes, until set anew."""
        for setter, value in zip(self._touch, (*force_frd_n, *moment_frd_nm), strict=True):
            setter(value)

    def set_ground_height(self, height_m: float) -> None:
        """Set the height of what is below, metres above the floor."""
        if height_m != self._ground_m:  # JSBSim keeps it
            self._ground_m = height_m
            self._ground(self._floor_ft + height_m / METRES_PER_FOOT)

    def touches_ground(self) -> bool:
        """Whether any corner of the body presses on the ground."""
        return any(corner() for corner in self._corners)

    def position_ned_m(self) -> Vec3:
        """Centre of mass relative to the arena's centre on the floor."""
        north, east, down = self._start_ned_m
        north_ft, east_ft, up_ft = self._start_neu_ft
        return (
            north + (self._north() - north_ft) * METRES_PER_FOOT,
            east + (self._east() - east_ft) * METRES_PER_FOOT,
            down - (self._up() - up_ft) * METRES_PER_FOOT,
        )

    def velocity_ned_m_s(self) -> Vec3:
        """Velocity over ground."""
        north, east, down = self._velocity
        return (north() * METRES_PER_FOOT, east() * METRES_PER_FOOT, down() * METRES_PER_FOOT)

    def motion(self) -> tuple[Vec3, Quaternion, Vec3, Vec3]:
        """Read all of it at once.

        Returns:
            Velocity NED (m/s), attitude, angular rate FRD (rad/s), and what an accelerometer at the centre
            of mass reads, FRD (m/s^2).
        """
        north, east, down = self._velocity
        p, q, r = self._rates
        x, y, z = self._force
        return (
            (north() * METRES_PER_FOOT, east() * METRES_PER_FOOT, down() * METRES_PER_FOOT),
            self.attitude(),
            (p(), q(), r()),
            (x() * METRES_PER_FOOT, y() * METRES_PER_FOOT, z() * METRES_PER_FOOT),
        )

    def attitude(self) -> Quaternion:
        """Unit quaternion (w, x, y, z), body FRD to NED, from Z-Y-X Euler angles."""
        roll, pitch, yaw = self._angles
        heading = yaw()
        if heading > pi:  # JSBSim counts from 0 to a full turn
            heading -= 2 * pi
        half_roll, half_pitch, half_yaw = roll() / 2, pitch() / 2, heading / 2
        cr, sr = cos(half_roll), sin(half_roll)
        cp, sp = cos(half_pitch), sin(half_pitch)
        cy, sy = cos(half_yaw), sin(half_yaw)
        return (
            cr * cp * cy + sr * sp * sy,
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
        )

    def angular_rate_frd_rad_s(self) -> Vec3:
        """Rate of turn relative to the ground."""
        p, q, r = self._rates
        return (p(), q(), r())

    def motor_speeds_rad_s(self) -> tuple[float, ...]:
        """True speeds of the rotors."""
        return tuple(speed() for speed in self._speeds)


def _unheard(speed_rad_s: float) -> bool:
    """Take the command of a motor that has failed."""
    del speed_rad_s
    return False
