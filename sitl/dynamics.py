"""The drone as a rigid body: the JSBSim model made from its airframe, and the JSBSim instance that steps it.

Forces and moments are `external_reactions` in body axes. JSBSim computes them from rotor speeds and
air-relative velocity, so a physics step runs no Python. JSBSim's structural axes are x aft, y right, z up.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from math import degrees, pi, sqrt
from pathlib import Path

import jsbsim

from framerunner.errors import UserError
from framerunner.geometry.rotations import quaternion_from_euler
from framerunner.geometry.vectors import ZERO3, Quaternion, Vec3
from framerunner.vehicle.airframe import Airframe

_METRES_PER_FOOT = 0.3048
_FEET_PER_METRE = 1 / _METRES_PER_FOOT
_POUNDS_PER_NEWTON = 1 / 4.4482216152605
_POUND_FEET_PER_NEWTON_METRE = _POUNDS_PER_NEWTON * _FEET_PER_METRE

_COMMAND = "fcs/motor{}/command-rad_s"
_SPEED = "fcs/motor{}/speed-rad_s"
_TOUCH_FORCES = ("fcs/touch/force-x-n", "fcs/touch/force-y-n", "fcs/touch/force-z-n")
_TOUCH_MOMENTS = ("fcs/touch/moment-roll-nm", "fcs/touch/moment-pitch-nm", "fcs/touch/moment-yaw-nm")
_HEIGHT_FT = "position/h-agl-ft"
_GROUND_EFFECT = "fcs/ground-effect-factor"
_UNITS: dict[str, Vec3] = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
_AIR_VELOCITY_FPS = ("velocities/u-aero-fps", "velocities/v-aero-fps", "velocities/w-aero-fps")
_RATE_RAD_S = ("velocities/p-aero-rad_sec", "velocities/q-aero-rad_sec", "velocities/r-aero-rad_sec")


class DynamicsError(UserError):
    """JSBSim refused the model; the message is one line for people."""


class Dynamics:
    """A rigid body in JSBSim, in NED axes of the tangent plane at the arena's centre.

    JSBSim's earth is the rotating WGS 84 ellipsoid; within an arena it differs from a plane by less than
    a micrometre, and `position/from-start-neu-*` gives Cartesian feet from the starting point.

    Args:
        airframe: the declared drone.
        position_ned_m: start of its centre, relative to the arena's centre on the floor.
        yaw_rad: heading at the start, clockwise from north.
        latitude_deg: of the arena's centre; gravity at the start hardly differs.
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
        # The logger belongs to the thread; it must be set before the instance prints its greeting.
        jsbsim.set_logger(jsbsim.DefaultLogger(jsbsim.LogLevel.ERROR))
        self._fdm = fdm = jsbsim.FGFDMExec(None)
        fdm.set_debug_level(0)
        fdm.set_dt(1.0 / rate_hz)  # before loading: the filters' coefficients are made from it
        self._load(airframe, rate_hz)
        self._start_ned_m = position_ned_m
        self._floor_ft = altitude_m / _METRES_PER_FOOT
        self._ground_m: float | None = None
        self._commanded: tuple[float, ...] = ()
        for name, value in (
            ("ic/lat-geod-deg", latitude_deg),
            ("ic/long-gc-deg", longitude_deg),
            ("ic/terrain-elevation-ft", self._floor_ft),
            ("ic/h-agl-ft", -position_ned_m[2] / _METRES_PER_FOOT),
            ("ic/psi-true-deg", degrees(yaw_rad) % 360.0),
        ):
            fdm.set_property_value(name, value)
        if not fdm.run_ic():
            raise DynamicsError(f"airframe {airframe.name}: JSBSim refuses its initial state")
        self._cache_nodes(airframe)
        # JSBSim's zero of these three is not exactly the initial position.
        self._start_neu_ft = (self._north(), self._east(), self._up())

    def _load(self, airframe: Airframe, rate_hz: int) -> None:
        with tempfile.TemporaryDirectory(prefix="framerunner-") as folder:
            model = Path(folder) / "aircraft" / airframe.name / f"{airframe.name}.xml"
            model.parent.mkdir(parents=True)
            model.write_text(airframe_xml(airframe, rate_hz), encoding="utf-8")
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
        self._motors = tuple(setter(_COMMAND.format(index)) for index in rotors)
        self._commands = list(self._motors)
        self._speeds = tuple(getter(_SPEED.format(index)) for index in rotors)
        self._touch = tuple(setter(name) for name in (*_TOUCH_FORCES, *_TOUCH_MOMENTS))
        self._air = tuple(setter(f"atmosphere/gust-{axis}-fps") for axis in ("north", "east", "down"))
        self._ground = setter("position/terrain-elevation-asl-ft")
        self._corners = tuple(getter(f"contact/unit[{index}]/WOW") for index in range(8))

    def command_motors(self, speeds_rad_s: tuple[float, ...]) -> None:
        """Set the commanded rotor speeds, rad/s, in the airframe's order."""
        if speeds_rad_s is self._commanded:  # JSBSim keeps them
            return
        self._commanded = speeds_rad_s
        for command, speed in zip(self._commands, speeds_rad_s, strict=True):
            command(speed)

    def fail_motor(self, index: int, *, stuck: bool = False) -> None:
        """Make a motor ignore its commands: it stops, or keeps the speed last commanded (`stuck`)."""
        if not stuck:
            self._motors[index](0.0)
        self._commands[index] = _ignore

    def weaken_motor(self, index: int, lost: float) -> None:
        """Make a motor lose a share of its thrust, 0..1; it turns slower than commanded."""
        motor, share = self._motors[index], sqrt(1.0 - lost)
        self._commands[index] = lambda speed_rad_s: motor(share * speed_rad_s)
        self._commanded = ()

    def repair_motor(self, index: int) -> None:
        """Make a motor follow its commands again."""
        self._commands[index] = self._motors[index]
        self._commanded = ()

    def push(self, force_frd_n: Vec3, moment_frd_nm: Vec3) -> None:
        """Set the force and moment of contacts, in body axes; they hold until the next call."""
        for setter, value in zip(self._touch, (*force_frd_n, *moment_frd_nm), strict=True):
            setter(value)

    def set_air_velocity(self, velocity_ned_m_s: Vec3) -> None:
        """Set the air's velocity over ground, m/s; it holds until the next call, and is zero at first.

        JSBSim's own turbulence is not used: its low-altitude model takes heights above sea level.
        """
        for setter, value in zip(self._air, velocity_ned_m_s, strict=True):
            setter(value * _FEET_PER_METRE)

    def set_ground_height(self, height_m: float) -> None:
        """Set the height of the ground below, metres above the floor."""
        if height_m != self._ground_m:  # JSBSim keeps it
            self._ground_m = height_m
            self._ground(self._floor_ft + height_m / _METRES_PER_FOOT)

    def touches_ground(self) -> bool:
        """Whether any corner of the body is in contact with the ground."""
        return any(corner() for corner in self._corners)

    def position_ned_m(self) -> Vec3:
        """Centre of mass relative to the arena's centre on the floor."""
        north, east, down = self._start_ned_m
        north_ft, east_ft, up_ft = self._start_neu_ft
        return (
            north + (self._north() - north_ft) * _METRES_PER_FOOT,
            east + (self._east() - east_ft) * _METRES_PER_FOOT,
            down - (self._up() - up_ft) * _METRES_PER_FOOT,
        )

    def velocity_ned_m_s(self) -> Vec3:
        """Velocity over ground."""
        north, east, down = self._velocity
        return (north() * _METRES_PER_FOOT, east() * _METRES_PER_FOOT, down() * _METRES_PER_FOOT)

    def motion(self) -> tuple[Vec3, Quaternion, Vec3, Vec3]:
        """Velocity NED (m/s), attitude, angular rate FRD (rad/s) and specific force FRD (m/s²).

        The specific force is what an accelerometer at the centre of mass measures.
        """
        x, y, z = self._force
        force = (x() * _METRES_PER_FOOT, y() * _METRES_PER_FOOT, z() * _METRES_PER_FOOT)
        return (self.velocity_ned_m_s(), self.attitude(), self.angular_rate_frd_rad_s(), force)

    def attitude(self) -> Quaternion:
        """Unit quaternion (w, x, y, z), body FRD to NED."""
        roll, pitch, yaw = self._angles
        heading = yaw()
        if heading > pi:  # JSBSim counts from 0 to a full turn
            heading -= 2 * pi
        return quaternion_from_euler(roll(), pitch(), heading)

    def angular_rate_frd_rad_s(self) -> Vec3:
        """Angular rate relative to the ground."""
        p, q, r = self._rates
        return (p(), q(), r())

    def motor_speeds_rad_s(self) -> tuple[float, ...]:
        """True speeds of the rotors."""
        return tuple([speed() for speed in self._speeds])


def _ignore(_speed_rad_s: float) -> bool:
    """Take the command of a motor that has failed."""
    return False


def airframe_xml(airframe: Airframe, rate_hz: int) -> str:
    """The `fdm_config` document of an airframe, for so many physics steps a second."""
    ixx, iyy, izz = airframe.inertia_kg_m2
    references = "".join(_location(ZERO3, name) for name in ("AERORP", "EYEPOINT", "VRP"))
    axes = "".join(f'<axis name="{name}"/>' for name in ("DRAG", "SIDE", "LIFT", "ROLL", "PITCH", "YAW"))
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<fdm_config name="{airframe.name}" version="2.0" release="ALPHA">
<fileheader/>
<metrics>
  <wingarea unit="M2">1.0</wingarea> <wingspan unit="M">1.0</wingspan> <chord unit="M">1.0</chord>
  {references}
</metrics>
<mass_balance>
  <ixx unit="KG*M2">{ixx}</ixx> <iyy unit="KG*M2">{iyy}</iyy> <izz unit="KG*M2">{izz}</izz>
  <emptywt unit="KG">{airframe.mass_kg}</emptywt>
  {_location(ZERO3, "CG")}
</mass_balance>
<ground_reactions>{_contacts(airframe)}</ground_reactions>
<system name="motors">{_motors(airframe)}</system>
<external_reactions>{_external_reactions(airframe, rate_hz)}</external_reactions>
<aerodynamics>{axes}</aerodynamics> <!-- JSBSim refuses a model without these axes -->
</fdm_config>
"""


def _location(position_m: Vec3, name: str = "") -> str:
    """A position in structural axes."""
    x, y, z = position_m
    return f'<location name="{name}" unit="M"><x>{x}</x><y>{y}</y><z>{z}</z></location>'


def _contacts(airframe: Airframe) -> str:
    """Eight corners of the envelope can touch the ground, so the drone may also land upside down."""
    length, width, height = (extent / 2 for extent in airframe.envelope_m)
    contact = airframe.contact
    corners = [(x, y, z) for z in (-height, height) for x in (-length, length) for y in (-width, width)]
    return "".join(
        f"""
  <contact type="STRUCTURE" name="CORNER{index}"> {_location(corner)}
    <static_friction>{contact.friction}</static_friction>
    <dynamic_friction>{contact.friction}</dynamic_friction>
    <spring_coeff unit="N/M">{contact.stiffness_n_m}</spring_coeff>
    <damping_coeff unit="N/M/SEC">{contact.damping_n_s_m}</damping_coeff>
  </contact>"""
        for index, corner in enumerate(corners)
    )


def _motors(airframe: Airframe) -> str:
    """The properties that `Dynamics` sets, and the rotors' speeds, which follow their commands with a lag."""
    lag_s, rotors = airframe.motor.time_constant_s, range(len(airframe.rotors))
    names = (*_TOUCH_FORCES, *_TOUCH_MOMENTS, *(_COMMAND.format(index) for index in rotors))
    properties = "".join(f'<property value="0.0">{name}</property>' for name in names)
    tag, gain = ("lag_filter", f"<c1>{1 / lag_s}</c1>") if lag_s > 0 else ("pure_gain", "<gain>1.0</gain>")
    filters = "".join(
        f'<{tag} name="{_SPEED.format(index)}"><input>{_COMMAND.format(index)}</input>'
        f"{gain}<output>{_SPEED.format(index)}</output></{tag}>"
        for index in rotors
    )
    ground_effect = _ground_effect(airframe) if airframe.air.ground_effect else ""
    return f'{properties}<channel name="motors">{filters}{ground_effect}</channel>'


def _ground_effect(airframe: Airframe) -> str:
    """The factor by which thrust increases near the ground: T / T_free = 1 / (1 - (R / 4z)^2).

    Source: Cheeseman & Bennett, "The Effect of the Ground on a Helicopter Rotor in Forward Flight", 1955.
    z is the rotors' mean height over base or floor for a level drone, and counts as at least R / 2, where
    the factor is 4/3: at R / 4 the formula has no value.
    """
    radius_m, rotors = airframe.motor.radius_m, airframe.rotors
    above_centre_m = -sum(rotor.position_frd_m[2] for rotor in rotors) / len(rotors)
    height = f"<sum>{_product(_METRES_PER_FOOT, _HEIGHT_FT)}<value>{above_centre_m}</value></sum>"
    bounded = f"<max>{height}<value>{radius_m / 2}</value></max>"
    ratio = f"<pow><quotient><value>{radius_m / 4}</value>{bounded}</quotient><value>2</value></pow>"
    factor = f"<quotient><value>1</value><difference><value>1</value>{ratio}</difference></quotient>"
    return f'<fcs_function name="{_GROUND_EFFECT}"><function>{factor}</function></fcs_function>'


def _product(
    factor: float, *properties: str, magnitude_of: str | None = None, most: float | None = None
) -> str:
    """The product of a factor, properties, and a property's magnitude, which counts as `most` at most."""
    factors = "".join(f"<property>{name}</property>" for name in properties)
    if magnitude_of is not None:
        magnitude = f"<abs><property>{magnitude_of}</property></abs>"
        factors += magnitude if most is None else f"<min>{magnitude}<value>{most}</value></min>"
    return f"<product><value>{factor}</value>{factors}</product>"


def _reaction(tag: str, name: str, direction: Vec3, content: str) -> str:
    """A force or a moment along a unit vector in body FRD; the content has its function."""
    x, y, z = direction
    along = f"<direction><x>{x}</x><y>{y}</y><z>{z}</z></direction>"
    return f'<{tag} name="{name}" frame="BODY">{content}{along}</{tag}>\n'


def _stopped_in_a_step_rad_s(airframe: Airframe, axis: int, rate_hz: int) -> float:
    """The rate at which the body's drag, which grows with its square, would stop the rotation in one step.

    A step takes the moment at its beginning for all of it, so above twice this rate the rotation would be
    reversed and grow without end. At rates above this one the drag stops it in a step, and no more.
    """
    return airframe.inertia_kg_m2[axis] * rate_hz / airframe.drag.moment_nm_s2[axis]


def _external_reactions(airframe: Airframe, rate_hz: int) -> str:
    """Each rotor's thrust and drag; forces and moments of the body's drag, touch and the rotors' torques."""
    motor, drag = airframe.motor, airframe.drag
    reactions, torques = "", ""
    for index, rotor in enumerate(airframe.rotors):
        speed, (forward, right, down) = _SPEED.format(index), rotor.position_frd_m
        factors = (speed, speed, _GROUND_EFFECT) if airframe.air.ground_effect else (speed, speed)
        thrust = _product(motor.thrust_n_s2 * _POUNDS_PER_NEWTON, *factors)
        hub = _location((-forward, right, -down))
        content = f"<function>{thrust}</function>{hub}"
        reactions += _reaction("force", f"rotor{index}", (0.0, 0.0, -1.0), content)
        if airframe.air.rotor_drag_n_s2_m_rad > 0.0:
            reactions += _rotor_drag(airframe, index, speed, hub)
        torques += _product(rotor.yaw_sign * motor.torque_nm_s2 * _POUND_FEET_PER_NEWTON_METRE, speed, speed)
    for axis, (letter, unit) in enumerate(_UNITS.items()):
        speed, factor = _AIR_VELOCITY_FPS[axis], -drag.force_n_s2_m2[axis] * _POUNDS_PER_NEWTON
        total = _product(factor / _FEET_PER_METRE**2, speed, magnitude_of=speed)
        total += _product(_POUNDS_PER_NEWTON, _TOUCH_FORCES[axis])
        content = f"<function><sum>{total}</sum></function>{_location(ZERO3)}"
        reactions += _reaction("force", f"body-{letter}", unit, content)
    for axis, (letter, unit) in enumerate(_UNITS.items()):
        rate, factor = _RATE_RAD_S[axis], -drag.moment_nm_s2[axis] * _POUND_FEET_PER_NEWTON_METRE
        most = _stopped_in_a_step_rad_s(airframe, axis, rate_hz) if factor else None
        total = _product(factor, rate, magnitude_of=rate, most=most)
        total += _product(_POUND_FEET_PER_NEWTON_METRE, _TOUCH_MOMENTS[axis])
        total += torques if letter == "z" else ""
        content = f"<function><sum>{total}</sum></function>"
        reactions += _reaction("moment", f"body-moment-{letter}", unit, content)
    return reactions


def _rotor_drag(airframe: Airframe, index: int, speed: str, hub: str) -> str:
    """A rotor's drag in its plane, F = -c w v, linear in the velocity of the air (H-force).

    Source: Mahony, Kumar & Corke, "Multirotor Aerial Vehicles", IEEE Robotics & Automation Magazine, 2012.
    The velocity is that of the drone's centre: what the body's rotation adds at the hub is left out.
    """
    factor = -airframe.air.rotor_drag_n_s2_m_rad * _POUNDS_PER_NEWTON * _METRES_PER_FOOT
    reactions = ""
    for velocity, letter in zip(_AIR_VELOCITY_FPS[:2], "xy", strict=True):
        content = f"<function>{_product(factor, speed, velocity)}</function>{hub}"
        reactions += _reaction("force", f"rotor{index}-drag-{letter}", _UNITS[letter], content)
    return reactions
