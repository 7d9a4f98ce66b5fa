"""An offboard controller's requests: PX4's rules from a message to a `Setpoint`, and when it is flown.

Shared by the MAVLink service and by an adapter that flies in the same process.

Two rules of PX4: a request without any finite component is refused and counts as no setpoint; a request that
does not control an axis, or gives only one of the horizontal pair, is accepted but the vehicle brakes,
because its position controller cannot fly it. So one NaN or infinity among three velocities stops the
vehicle in the air.

One difference: PX4 transforms a body velocity to NED once, at reception. Here it continues to turn with the
vehicle, as the paper's drone does, so sending a setpoint again changes nothing.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from math import cos, isfinite, nan, sin

from firmware_py.guidance.limits import clamp
from firmware_py.setpoints import (
    AttitudeSetpoint,
    BodyRateSetpoint,
    BodyVelocitySetpoint,
    MotorSetpoint,
    Setpoint,
    TrajectorySetpoint,
)
from firmware_py.types import VehicleState
from framerunner.geometry.rotations import rotation, to_world
from framerunner.geometry.vectors import NAN3, ZERO3, Quaternion, Vec3
from framerunner.vehicle.airframe import Airframe
from framerunner.wire.dialect import mavlink

_LOCAL = "SET_POSITION_TARGET_LOCAL_NED"
_MIN_LENGTH = 1e-3  # of a quaternion that still has a direction
_GRID_US = 10_000
_MAX_RATE_RAD_S = 30.0


@dataclass(frozen=True, slots=True)
class SetpointRefusal:
    """A request that is not a setpoint, with PX4's text for people."""

    text: str


class TargetMask(IntEnum):
    """POSITION_TARGET_TYPEMASK: a set bit means that the component is ignored."""

    X = 1
    Y = 2
    Z = 4
    VX = 8
    VY = 16
    VZ = 32
    AX = 64
    AY = 128
    AZ = 256
    FORCE = 512
    YAW = 1024
    YAW_RATE = 2048


@dataclass(frozen=True, slots=True)
class LocalTarget:
    """The fields of SET_POSITION_TARGET_LOCAL_NED; vectors of shape (3,), metres, seconds, radians.

    A SET_POSITION_TARGET_GLOBAL_INT is given so, too, with its position in the local frame; `message` names
    what was received, for refusals.
    """

    frame: int
    type_mask: int
    position_m: Vec3 = ZERO3
    velocity_m_s: Vec3 = ZERO3
    acceleration_m_s2: Vec3 = ZERO3
    yaw_rad: float = 0.0
    yaw_rate_rad_s: float = 0.0
    message: str = _LOCAL


def setpoint_from_target(
    target: LocalTarget, state: VehicleState, time_us: int
) -> Setpoint | SetpointRefusal:
    """The setpoint of a target message.

    Args:
        target: the message's fields.
        state: of the vehicle now; its yaw and attitude transform body targets to NED.
        time_us: vehicle time of reception.
    """
    mask = target.type_mask
    body_velocity = None
    if target.frame == mavlink.MAV_FRAME_LOCAL_NED:
        position = _kept(target.position_m, mask, TargetMask.X)
        velocity = _kept(target.velocity_m_s, mask, TargetMask.VX)
        acceleration = _kept(target.acceleration_m_s2, mask, TargetMask.AX)
    elif target.frame == mavlink.MAV_FRAME_BODY_NED:
        position = velocity = acceleration = NAN3
        if not mask & (TargetMask.VX | TargetMask.VY | TargetMask.VZ):
            body_velocity = target.velocity_m_s
            velocity = _level_to_ned(target.velocity_m_s, state.yaw_rad)
        if not mask & (TargetMask.AX | TargetMask.AY | TargetMask.AZ):
            north, east, down = to_world(rotation(state.attitude), *target.acceleration_m_s2)
            acceleration = (_finite(north), _finite(east), _finite(down))
    else:
        return SetpointRefusal(f"{target.message} coordinate frame {target.frame} unsupported")
    if mask & TargetMask.FORCE and _any_finite(acceleration):
        return SetpointRefusal(f"{target.message} force not supported")
    yaw_rad = nan if mask & TargetMask.YAW else _finite(target.yaw_rad)
    yaw_rate_rad_s = nan if mask & TargetMask.YAW_RATE else _finite(target.yaw_rate_rad_s)
    wanted = TrajectorySetpoint(time_us, position, velocity, acceleration, yaw_rad, yaw_rate_rad_s)
    return _checked(wanted, body_velocity, target.message)


def setpoint_from_attitude(
    attitude: Quaternion | None,
    rate_frd_rad_s: Vec3 | None,
    yaw_rate_rad_s: float,
    thrust: float,
    time_us: int,
) -> Setpoint | SetpointRefusal:
    """The setpoint for an attitude or for body rates, with a thrust.

    Args:
        attitude: quaternion (w, x, y, z), body FRD to world NED, normalised here; None: not given.
        rate_frd_rad_s: body rates, shape (3,), used only without an attitude; None: not given.
        yaw_rate_rad_s: clockwise, added to an attitude's yaw control.
        thrust: share of full thrust, 0..1.
        time_us: vehicle time now.
    """
    if not isfinite(thrust):
        return SetpointRefusal("SET_ATTITUDE_TARGET invalid: thrust is not a number")
    thrust = clamp(thrust, 0.0, 1.0)
    if attitude is not None:
        length = sum(component * component for component in attitude) ** 0.5
        if not isfinite(length) or length < _MIN_LENGTH:
            return SetpointRefusal("SET_ATTITUDE_TARGET invalid: attitude is no quaternion")
        w, x, y, z = (component / length for component in attitude)
        return AttitudeSetpoint(time_us, (w, x, y, z), thrust, _finite(yaw_rate_rad_s))
    if rate_frd_rad_s is not None:
        roll, pitch, yaw = (_rate(rate) for rate in rate_frd_rad_s)
        return BodyRateSetpoint(time_us, (roll, pitch, yaw), thrust)
    return SetpointRefusal("SET_ATTITUDE_TARGET invalid: neither attitude nor rates")


def setpoint_from_controls(
    airframe: Airframe, torque_frd: Vec3, thrust: float, time_us: int
) -> Setpoint | SetpointRefusal:
    """The setpoint for normalised torques and thrust, mixed directly to the motors.

    Each rotor gets the thrust, plus roll and pitch by its lever arms and yaw by its direction of rotation.

    Args:
        airframe: with the rotors' positions.
        torque_frd: roll, pitch, yaw, each -1..1; shape (3,).
        thrust: 0..1.
        time_us: vehicle time now.
    """
    if not isfinite(sum(torque_frd) + thrust):
        return SetpointRefusal("SET_ACTUATOR_CONTROL_TARGET invalid: a control is not a number")
    roll, pitch, yaw = torque_frd
    arm_x_m = max(abs(rotor.position_frd_m[0]) for rotor in airframe.rotors) or 1.0
    arm_y_m = max(abs(rotor.position_frd_m[1]) for rotor in airframe.rotors) or 1.0
    outputs = [
        thrust
        - roll * rotor.position_frd_m[1] / arm_y_m
        + pitch * rotor.position_frd_m[0] / arm_x_m
        + yaw * rotor.yaw_sign
        for rotor in airframe.rotors
    ]
    return MotorSetpoint(time_us, tuple([clamp(output, 0.0, 1.0) for output in outputs]))


def setpoint_from_body_velocity(
    velocity_level_m_s: Vec3, yaw_rate_rad_s: float, state: VehicleState, time_us: int
) -> Setpoint | SetpointRefusal:
    """The setpoint for a velocity in level axes (forward, right, down) and a clockwise yaw rate.

    The same as `setpoint_from_target` with BODY_NED and mask 0x5C7.
    """
    velocity_ned_m_s = _level_to_ned(velocity_level_m_s, state.yaw_rad)
    yaw_rate_rad_s = _finite(yaw_rate_rad_s)
    if isfinite(sum(velocity_ned_m_s)) and isfinite(sum(velocity_level_m_s)):
        return BodyVelocitySetpoint(time_us, velocity_level_m_s, nan, yaw_rate_rad_s, velocity_ned_m_s)
    wanted = TrajectorySetpoint(time_us, NAN3, velocity_ned_m_s, NAN3, nan, yaw_rate_rad_s)
    return _checked(wanted, velocity_level_m_s, _LOCAL)


class SetpointQueue:
    """Holds the newest setpoint until it is flown: from the next multiple of 10 ms on.

    So a few milliseconds of delay change nothing, and flights over a network are repeatable, too.

    Attributes:
        waiting: the newest setpoint that is not flown yet.
        newest: the newest setpoint, flown or not.
    """

    def __init__(self) -> None:
        self.waiting: Setpoint | None = None
        self.newest: Setpoint | None = None
        self._slot = 0
        self._refused = False

    def put(self, setpoint: Setpoint, now_us: int) -> None:
        """Take a setpoint; it replaces the waiting one."""
        self.waiting = self.newest = setpoint
        self._slot = now_us // _GRID_US
        self._refused = False

    def refuse(self) -> bool:
        """Note an unusable setpoint; return whether it is the first since a usable one."""
        first, self._refused = not self._refused, True
        return first

    def newest_velocity(self) -> tuple[float, float, float, float] | None:
        """The newest setpoint as forward, right, down (m/s) and yaw rate (rad/s, clockwise; NaN: not given).

        None if it is of another kind, and before the first.
        """
        newest = self.newest
        if not isinstance(newest, BodyVelocitySetpoint):
            return None
        return (*newest.velocity_level_m_s, newest.yaw_rate_rad_s)

    def is_due(self, now_us: int) -> bool:
        """Whether the waiting setpoint is to be flown from now on."""
        return self.waiting is not None and now_us // _GRID_US != self._slot

    def take(self) -> Setpoint | None:
        """Remove and return the waiting setpoint, due or not."""
        waiting, self.waiting = self.waiting, None
        return waiting


def _checked(
    wanted: TrajectorySetpoint, body_velocity: Vec3 | None, message: str
) -> Setpoint | SetpointRefusal:
    """Refuse a setpoint without any component; brake if an axis or one of the horizontal pair is missing."""
    groups = (wanted.position_ned_m, wanted.velocity_ned_m_s, wanted.acceleration_ned_m_s2)
    if not any(_any_finite(group) for group in groups):
        return SetpointRefusal(f"{message} invalid")
    yaw_rad, yaw_rate_rad_s = wanted.yaw_rad, wanted.yaw_rate_rad_s
    pairs_whole = all(isfinite(group[0]) == isfinite(group[1]) for group in groups)
    axes_held = all(any(isfinite(group[axis]) for group in groups) for axis in range(3))
    if not (pairs_whole and axes_held):
        return TrajectorySetpoint(wanted.time_us, NAN3, ZERO3, NAN3, yaw_rad, yaw_rate_rad_s)
    if body_velocity is None or not isfinite(sum(body_velocity)):
        return wanted
    return BodyVelocitySetpoint(
        wanted.time_us,
        body_velocity,
        yaw_rad,
        yaw_rate_rad_s,
        wanted.velocity_ned_m_s,
        wanted.acceleration_ned_m_s2,
    )


def _finite(value: float) -> float:
    return value if isfinite(value) else nan


def _rate(value: float) -> float:
    return clamp(value, -_MAX_RATE_RAD_S, _MAX_RATE_RAD_S) if isfinite(value) else 0.0


def _any_finite(vector: Vec3) -> bool:
    return isfinite(vector[0]) or isfinite(vector[1]) or isfinite(vector[2])


def _kept(vector: Vec3, mask: int, first_bit: int) -> Vec3:
    x, y, z = vector
    return (
        nan if mask & first_bit else _finite(x),
        nan if mask & first_bit << 1 else _finite(y),
        nan if mask & first_bit << 2 else _finite(z),
    )


def _level_to_ned(vector: Vec3, yaw_rad: float) -> Vec3:
    forward, right, down = vector
    c, s = cos(yaw_rad), sin(yaw_rad)
    return (_finite(c * forward - s * right), _finite(s * forward + c * right), _finite(down))
