"""The airframe: all numbers of a multicopter, declared once.

The stabiliser's gains and the simulator's JSBSim model are computed from them, so a new drone is a new YAML
file in `framerunner/vehicle/airframes/`.
"""

from __future__ import annotations

from functools import cached_property
from math import cos, inf, sin, sqrt
from typing import Annotated, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, StringConstraints, model_validator

from framerunner.errors import UserError
from framerunner.files.yaml_file import FileKind, refusal

GRAVITY_M_S2 = 9.80665

ParameterName = Annotated[str, StringConstraints(pattern=r"^[A-Z][A-Z0-9_]{0,15}$")]
"""A parameter's name, by the limits of PX4 and MAVLink."""


class AirframeError(UserError):
    """An airframe that cannot be used; the message is one line for people."""


_Coordinate = Annotated[float, Field(ge=-10, le=10)]
_Inertia = Annotated[float, Field(ge=1e-8, le=1000)]
_DragCoefficient = Annotated[float, Field(ge=0, le=1000)]
_Size = Annotated[float, Field(ge=0.01, le=20)]


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class Rotor(_Part):
    """One rotor: its position and direction of rotation."""

    position_frd_m: tuple[_Coordinate, _Coordinate, _Coordinate] = Field(
        description="hub relative to the centre of mass: forward, right, down"
    )
    spin: Literal["cw", "ccw"] = Field(description="seen from above; the drag torque on the body is opposite")

    @property
    def yaw_sign(self) -> float:
        """Sign of its drag torque about body down (clockwise from above is positive)."""
        return -1.0 if self.spin == "cw" else 1.0


class Motor(_Part):
    """Properties of every motor with its propeller."""

    thrust_n_s2: float = Field(ge=1e-10, le=1, description="thrust per squared rotor speed, N/(rad/s)^2")
    torque_nm_s2: float = Field(
        ge=1e-12, le=1, description="drag torque per squared rotor speed, N m/(rad/s)^2"
    )
    max_speed_rad_s: float = Field(ge=10, le=1e5)
    time_constant_s: float = Field(0.03, ge=0, le=1, description="first-order lag of the speed; 0: none")
    radius_m: float = Field(0.05, ge=0.005, le=5)


class DragSpec(_Part):
    """Quadratic drag in body axes: F = -k v|v|, M = -k w|w|."""

    force_n_s2_m2: tuple[_DragCoefficient, _DragCoefficient, _DragCoefficient] = Field(
        (0.0, 0.0, 0.0), description="N/(m/s)^2: forward, right, down"
    )
    moment_nm_s2: tuple[_DragCoefficient, _DragCoefficient, _DragCoefficient] = Field(
        (0.0, 0.0, 0.0), description="N m/(rad/s)^2: roll, pitch, yaw"
    )


class AirEffects(_Part):
    """Effects of the air on the rotors; by default none."""

    rotor_drag_n_s2_m_rad: float = Field(
        0.0,
        ge=0,
        le=1,
        description="drag of each rotor in its plane, N per m/s of air and rad/s of the rotor: F = -c w v",
    )
    ground_effect: bool = Field(False, description="thrust increases near base and floor")


class ContactSpec(_Part):
    """Contact with ground and solids: a spring and a damper with friction at each contact point."""

    stiffness_n_m: float = Field(300.0, ge=1, le=1e6)
    damping_n_s_m: float = Field(6.0, ge=0, le=1e5)
    friction: float = Field(0.8, ge=0, le=10)


class BatterySpec(_Part):
    """The battery."""

    cells: int = Field(4, ge=1, le=16, description="in series")
    capacity_mah: float = Field(5000.0, ge=10, le=1e6)
    resistance_ohm: float = Field(0.02, ge=0, le=10, description="of the whole battery with its leads")
    efficiency: float = Field(
        0.75, ge=0.01, le=1, description="mechanical over electrical power of the motors"
    )
    electronics_a: float = Field(0.5, ge=0, le=1000, description="current of everything except the motors")


class Limits(_Part):
    """Limits of the stabiliser's commands."""

    tilt_rad: float = Field(0.52, ge=0.05, lt=1.3)
    roll_pitch_rate_rad_s: float = Field(4.0, ge=0.05, le=100)
    yaw_rate_rad_s: float = Field(2.0, ge=0.05, le=100)
    speed_horizontal_m_s: float = Field(2.0, ge=0.05, le=100)
    speed_up_m_s: float = Field(1.5, ge=0.05, le=100)
    speed_down_m_s: float = Field(1.0, ge=0.05, le=100)


class Weights(_Part):
    """Tuning of the regulator (Bryson's rule: each weight is 1 / value^2) and of its disturbance observer.

    Weights of torque and thrust are in units of angular and linear acceleration, so the same numbers suit
    airframes of any size.
    """

    tilt_rad: float = Field(0.6, ge=0.05, le=1000)
    roll_pitch_rate_rad_s: float = Field(4.0, ge=0.05, le=100)
    yaw_rate_rad_s: float = Field(0.5, ge=0.05, le=100)
    velocity_horizontal_m_s: float = Field(0.6, ge=0.001, le=1000)
    velocity_vertical_m_s: float = Field(0.3, ge=0.001, le=1000)
    integral_horizontal_m: float = Field(0.3, ge=0.001, le=1000, description="only of the level law")
    integral_vertical_m: float = Field(0.1, ge=0.001, le=1000, description="only of the level law")
    integral_yaw_rad: float = Field(0.1, ge=0.001, le=1000, description="only of the level law")
    acceleration_vertical_m_s2: float = Field(3.0, ge=0.001, le=1000)
    acceleration_roll_pitch_rad_s2: float = Field(60.0, ge=0.001, le=1000)
    acceleration_yaw_rad_s2: float = Field(6.0, ge=0.001, le=1000)
    observer_force_rad_s: float = Field(2.0, ge=0.001, le=1000, description="bandwidth for unknown forces")
    observer_moment_rad_s: float = Field(4.0, ge=0.001, le=1000, description="bandwidth for unknown moments")


class Airframe(_Part):
    """A multicopter."""

    name: str = Field(pattern=r"^[a-z0-9][a-z0-9_-]*$")
    mass_kg: float = Field(ge=0.005, le=1000)
    inertia_kg_m2: tuple[_Inertia, _Inertia, _Inertia] = Field(
        description="principal moments about forward, right, down"
    )
    rotors: tuple[Rotor, ...] = Field(min_length=4)
    motor: Motor
    drag: DragSpec = DragSpec()
    air: AirEffects = AirEffects()
    contact: ContactSpec = ContactSpec()
    limits: Limits = Limits()
    battery: BatterySpec = BatterySpec()
    stabiliser: Weights = Field(Weights(), description="of its design")
    parameters: dict[ParameterName, float | int] = Field(
        default_factory=dict, description="defaults of the autopilot's parameters for this airframe"
    )
    envelope_m: tuple[_Size, _Size, _Size] = Field(
        description="length, width, height of the box around it, centred on the mass"
    )

    def __hash__(self) -> int:
        """Without the parameters, which have no hash; what is designed from an airframe is kept by it."""
        parts = (self.motor, self.rotors, self.drag, self.air, self.limits, self.stabiliser)
        return hash((self.name, self.mass_kg, self.inertia_kg_m2, *parts))

    @model_validator(mode="after")
    def _can_fly(self) -> Self:
        if self.hover_speed_rad_s >= self.motor.max_speed_rad_s:
            speed = self.motor.max_speed_rad_s
            message = "is too slow: the rotors cannot carry the mass; increase it"
            raise refusal(speed, message, "motor", "max_speed_rad_s")
        if abs(sum(rotor.yaw_sign for rotor in self.rotors)) > 0:
            cw = sum(rotor.spin == "cw" for rotor in self.rotors)
            message = "of them spin cw; as many must spin cw as ccw, or yaw cannot be balanced"
            raise refusal(cw, message, "rotors")
        return self

    @property
    def weight_n(self) -> float:
        """Weight at standard gravity."""
        return self.mass_kg * GRAVITY_M_S2

    @property
    def full_thrust_n(self) -> float:
        """Thrust of all rotors at maximum speed."""
        return len(self.rotors) * self.motor.thrust_n_s2 * self.motor.max_speed_rad_s**2

    @cached_property
    def level_speed_m_s(self) -> float:
        """The highest speed forward at a height that stays: drag needs all of the tilt, or a limit holds.

        Along the flight and upwards, with drag in body axes and tilt t, forces are in balance:
        T sin t = v^2 (k1 cos^3 t + k3 sin^3 t) and T cos t = m g + v^2 sin t cos t (k3 sin t - k1 cos t).
        With drag of n rotors it is solved along the body: m g sin t = k1 s^2 + n c w s, s = v cos t.
        """
        if self.air.rotor_drag_n_s2_m_rad > 0.0:
            return min(self._level_speed_with_rotor_drag(), self.limits.speed_horizontal_m_s)
        drag_forward, _, drag_down = self.drag.force_n_s2_m2
        sine, cosine = sin(self.limits.tilt_rad), cos(self.limits.tilt_rad)
        along = drag_forward * cosine**3 + drag_down * sine**3
        down = sine * cosine * (drag_down * sine - drag_forward * cosine)
        drag = along * cosine - down * sine
        fastest_m_s = (self.weight_n * sine / drag) ** 0.5 if drag > 0.0 else inf
        return min(fastest_m_s, self.limits.speed_horizontal_m_s)

    def _level_speed_with_rotor_drag(self) -> float:
        """`level_speed_m_s` without its limit; thrust and rotor speed w by T = m g cos t + k3 (v sin t)^2."""
        drag_forward, _, drag_down = self.drag.force_n_s2_m2
        sine, cosine, rotors = sin(self.limits.tilt_rad), cos(self.limits.tilt_rad), len(self.rotors)
        pull_n, through_n, speed_m_s = self.weight_n * sine, 0.0, 0.0
        for _ in range(
            20
        ):  # of a fixed-point iteration; the rotors' speed depends little on that of the drone
            thrust_n = self.weight_n * cosine + through_n
            rotor_rad_s = sqrt(thrust_n / (rotors * self.motor.thrust_n_s2))
            linear = rotors * self.air.rotor_drag_n_s2_m_rad * rotor_rad_s
            root = sqrt(linear * linear + 4.0 * drag_forward * pull_n)
            speed_m_s = 2.0 * pull_n / (linear + root) / cosine
            through_n = drag_down * (speed_m_s * sine) ** 2
        return speed_m_s

    @cached_property
    def hover_speed_rad_s(self) -> float:
        """Rotor speed at which the thrust equals the weight."""
        return float((self.weight_n / (len(self.rotors) * self.motor.thrust_n_s2)) ** 0.5)


AIRFRAME_FILES = FileKind(
    "airframe",
    Airframe,
    AirframeError,
    folder="airframes",
    package="framerunner.vehicle",
    extension="airframe",
)


def load_airframe(name_or_path: str) -> Airframe:
    """Load an airframe.

    Args:
        name_or_path: of a file in `framerunner/vehicle/airframes/` or of another package, or a path: it has a
            directory or ends in .yaml or .yml.

    Raises:
        AirframeError: there is none of that name, or the file is not a valid airframe; the message names
            line, field, value and what to do.
        ExtensionError: another package adds it, but it cannot be used.
    """
    airframe = AIRFRAME_FILES.load(name_or_path)
    if airframe is None:
        raise AIRFRAME_FILES.unknown(name_or_path)
    return airframe
