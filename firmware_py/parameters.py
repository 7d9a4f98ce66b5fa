"""Parameters as data: one declaration makes the MAVLink list, the errors and the reference page.

Names, units and meanings are PX4's wherever PX4 has such a parameter. Two differences, both on purpose:

* PX4 accepts any value of the right type; here a value out of range or not finite is refused and the old one
  stays, so that what a ground station reads back is always what is flown.
* `COM_OBL_RC_ACT` defaults to 5 (hold) where PX4 has 0 (position, which without a remote control ends in
  return). Return does not exist here; hold is followed by landing after `COM_FAIL_ACT_T`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import isfinite
from struct import pack
from typing import Literal, Self
from zlib import crc32

from pydantic import BaseModel, ConfigDict, Field, model_validator

ParameterKind = Literal["int32", "float"]


class ParameterError(ValueError):
    """A parameter that cannot be set so; the message is one line for people."""


class Parameter(BaseModel):
    """The declaration of one parameter. Equal minimum and maximum make it a constant."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: str = Field(pattern=r"^[A-Z][A-Z0-9_]{0,15}$", description="at most 16 characters: MAVLink's limit")
    kind: ParameterKind
    default: float = Field(allow_inf_nan=False)
    minimum: float = Field(allow_inf_nan=False)
    maximum: float = Field(allow_inf_nan=False)
    unit: str = ""
    description: str = Field(min_length=1)

    @model_validator(mode="after")
    def _makes_sense(self) -> Self:
        if not self.minimum <= self.default <= self.maximum:
            raise ValueError(
                f"{self.name}: default {self.default} is outside {self.minimum} to {self.maximum}"
            )
        if self.kind == "int32" and any(bound % 1 for bound in (self.minimum, self.default, self.maximum)):
            raise ValueError(f"{self.name}: an int32 has whole numbers only")
        return self

    @property
    def constant(self) -> bool:
        """Whether it states a fact and cannot be changed."""
        return self.minimum == self.maximum

    def checked(self, value: float) -> float:
        """The value as it is kept: an int for `int32`, else a float.

        Raises:
            ParameterError: it is not finite, not whole where it must be, or out of range.
        """
        if not isfinite(value):
            raise ParameterError(f"{self.name}: {value} is not a finite number")
        if self.kind == "int32" and value % 1:
            raise ParameterError(f"{self.name}: {value:g} is not a whole number")
        if not self.minimum <= value <= self.maximum:
            if self.constant:
                raise ParameterError(f"{self.name}: stays {self.default:g}; it is a fact of this vehicle")
            unit = f" {self.unit}" if self.unit else ""
            raise ParameterError(
                f"{self.name}: {value:g} is outside {self.minimum:g} to {self.maximum:g}{unit}"
            )
        return int(value) if self.kind == "int32" else float(value)


Span = tuple[float, float, float]  # default, minimum, maximum


def _declare(kind: ParameterKind, name: str, span: Span, unit: str, description: str) -> Parameter:
    default, minimum, maximum = span
    return Parameter(
        name=name,
        kind=kind,
        default=default,
        minimum=minimum,
        maximum=maximum,
        unit=unit,
        description=description,
    )


def _real(name: str, span: Span, unit: str, description: str) -> Parameter:
    return _declare("float", name, span, unit, description)


def _whole(name: str, span: Span, unit: str, description: str) -> Parameter:
    return _declare("int32", name, span, unit, description)


def _fact(name: str, value: int, description: str) -> Parameter:
    return _whole(name, (value, value, value), "", description)


_FLOWN = (
    _real("COM_DISARM_LAND", (2.0, -1.0, 20.0), "s", "disarm this long after landing; zero or less: never"),
    _real(
        "COM_DISARM_PRFLT",
        (10.0, -1.0, 60.0),
        "s",
        "disarm this long after arming if still down; <= 0: never",
    ),
    _real("COM_FAIL_ACT_T", (5.0, 0.0, 25.0), "s", "a failsafe holds this long before it lands"),
    _whole("COM_OBL_RC_ACT", (5, 4, 5), "", "when offboard setpoints stop: 4 land, 5 hold and then land"),
    _real("COM_OF_LOSS_T", (1.0, 0.1, 60.0), "s", "offboard setpoints older than this count as lost"),
    _whole("MAV_SYS_ID", (1, 1, 250), "", "MAVLink system id; taken at start"),
    _real("MIS_TAKEOFF_ALT", (2.5, 0.3, 80.0), "m", "height of a take-off that names no altitude"),
    _real("MPC_LAND_SPEED", (0.7, 0.1, 3.0), "m/s", "descent when landing; the airframe's limit holds too"),
    _real("MPC_TKO_SPEED", (1.5, 0.1, 5.0), "m/s", "climb when taking off; the airframe's limit holds too"),
    _real("MPC_XY_VEL_MAX", (12.0, 0.1, 20.0), "m/s", "horizontal speed; the airframe's limit holds too"),
    _real("MPC_Z_VEL_MAX_DN", (1.5, 0.1, 4.0), "m/s", "descent; the airframe's limit holds too"),
    _real("MPC_Z_VEL_MAX_UP", (3.0, 0.1, 8.0), "m/s", "climb; the airframe's limit holds too"),
)

# What ground stations look for at connect; without them they report a firmware with parts missing.
_FACTS = (
    _fact("CAL_ACC0_ID", 1310988, "the accelerometer; not 0: calibrated"),
    _fact("CAL_GYRO0_ID", 1310988, "the gyroscope; not 0: calibrated"),
    _fact("CAL_MAG0_ID", 197388, "the magnetometer; not 0: calibrated"),
    _fact("CAL_MAG1_ID", 0, "no second magnetometer"),
    _fact("CAL_MAG2_ID", 0, "no third magnetometer"),
    _fact("COM_RC_IN_MODE", 1, "no remote control: joystick through MAVLink only"),
    _fact("MAV_COMP_ID", 1, "MAVLink component id of the autopilot"),
    _fact("MAV_TYPE", 2, "MAV_TYPE: quadrotor"),
    _fact("RC_MAP_PITCH", 0, "no remote control channel"),
    _fact("RC_MAP_ROLL", 0, "no remote control channel"),
    _fact("RC_MAP_THROTTLE", 0, "no remote control channel"),
    _fact("RC_MAP_YAW", 0, "no remote control channel"),
    _fact("SYS_AUTOCONFIG", 0, "nothing is configured by itself at the next start"),
    _fact("SYS_AUTOSTART", 4001, "airframe: a generic quadcopter; not 0: one is chosen"),
)

DECLARATIONS: tuple[Parameter, ...] = tuple(sorted(_FLOWN + _FACTS, key=lambda declared: declared.name))


class Parameters:
    """The values now, in the declarations' order (by name, as PX4 lists them).

    Attributes:
        declarations: what there is; the position is the MAVLink index.
        version: counts changes, so that a reader can tell cheaply whether to look again.
    """

    __slots__ = ("_index", "_listeners", "_values", "declarations", "version")

    def __init__(
        self, values: Mapping[str, float] | None = None, declarations: tuple[Parameter, ...] = DECLARATIONS
    ) -> None:
        """Start from the defaults.

        Args:
            values: what differs from the defaults.
            declarations: what there is, sorted by name.

        Raises:
            ParameterError: a value is unknown or cannot be.
        """
        self.declarations = declarations
        self.version = 0
        self._index = {declared.name: place for place, declared in enumerate(declarations)}
        self._values = {declared.name: declared.checked(declared.default) for declared in declarations}
        self._listeners: list[Callable[[str, float], None]] = []
        for name, value in (values or {}).items():
            self.set(name, value)

    def value(self, name: str) -> float:
        """The value of a declared parameter; one dictionary look-up, made for every tick."""
        return self._values[name]

    def integer(self, name: str) -> int:
        """The value of a declared `int32`."""
        return int(self._values[name])

    def __contains__(self, name: object) -> bool:
        return name in self._values

    def __len__(self) -> int:
        return len(self.declarations)

    def index(self, name: str) -> int:
        """MAVLink index of a declared parameter."""
        return self._index[name]

    def declaration(self, name: str) -> Parameter:
        """The declaration of that name.

        Raises:
            ParameterError: there is none.
        """
        if name not in self._index:
            raise ParameterError(f"{name}: there is no such parameter")
        return self.declarations[self._index[name]]

    def set(self, name: str, value: float) -> None:
        """Change a value.

        Raises:
            ParameterError: unknown, not finite, not whole or out of range; nothing has changed then.
        """
        kept = self.declaration(name).checked(value)
        if kept == self._values[name]:
            return
        self._values[name] = kept
        self.version += 1
        for listener in self._listeners:
            listener(name, kept)

    def on_change(self, listener: Callable[[str, float], None]) -> None:
        """Have a function called with name and new value after each change."""
        self._listeners.append(listener)

    def hash(self) -> int:
        """PX4's `_HASH_CHECK`: CRC-32 (start 0, not inverted) over each name and its four bytes, in order."""
        crc = 0xFFFFFFFF
        for declared in self.declarations:
            value = self._values[declared.name]
            four = pack("<i", int(value)) if declared.kind == "int32" else pack("<f", value)
            crc = crc32(declared.name.encode() + four, crc)
        return crc ^ 0xFFFFFFFF
