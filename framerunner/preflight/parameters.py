"""A vehicle's parameters over MAVLink: read, set and checked."""

from __future__ import annotations

import struct
from collections.abc import Iterable
from dataclasses import dataclass
from functools import partial

from framerunner.doctor.listen import parameter_value
from framerunner.preflight.session import VehicleSession
from framerunner.wire.dialect import AUTOPILOT_COMPONENT_ID, Message, mavlink
from offboard.drone import DroneError

_FLOAT = mavlink.MAV_PARAM_TYPE_REAL32
_SAME = 1e-6  # of a value that was set and read back, relative


@dataclass(frozen=True, slots=True)
class ParameterValue:
    """One parameter as a vehicle has it."""

    name: str
    value: float
    kind: int  # MAV_PARAM_TYPE


def read_parameters(session: VehicleSession, names: Iterable[str]) -> dict[str, ParameterValue]:
    """Read parameters; those that the vehicle does not answer for are left out."""
    found = {}
    for name in names:
        request = mavlink.MAVLink_param_request_read_message(
            session.system_id, AUTOPILOT_COMPONENT_ID, name.encode(), -1
        )
        value = session.request(request, partial(_value_of, session, name))
        if value is not None:
            found[name] = value
    return found


def set_parameter(session: VehicleSession, parameter: ParameterValue) -> None:
    """Set a parameter and read it back.

    Raises:
        DroneError: the vehicle does not answer, or keeps another value.
    """
    name = parameter.name
    message = mavlink.MAVLink_param_set_message(
        session.system_id,
        AUTOPILOT_COMPONENT_ID,
        name.encode(),
        _on_wire(parameter, bytewise=session.is_px4),
        parameter.kind,
    )
    answered = session.request(message, partial(_value_of, session, name))
    kept = read_parameters(session, [name]).get(name)
    if answered is None or kept is None:
        raise DroneError(f"{name}: the vehicle did not answer; check the link, then try again")
    if abs(kept.value - parameter.value) > _SAME * max(1.0, abs(parameter.value)):
        raise DroneError(f"{name}: was set to {parameter.value:g}, but the vehicle keeps {kept.value:g}")


def _value_of(session: VehicleSession, name: str, message: Message) -> ParameterValue | None:
    """The parameter that a PARAM_VALUE tells, if it is the one of this name."""
    if message.get_type() != "PARAM_VALUE" or message.param_id != name:
        return None
    value = parameter_value(message) if session.is_px4 else float(message.param_value)
    return ParameterValue(name, value, message.param_type)


def _on_wire(parameter: ParameterValue, *, bytewise: bool) -> float:
    """The field of a PARAM_SET: PX4 takes an integer's bytes in the place of a float's, others its value."""
    if parameter.kind == _FLOAT or not bytewise:
        return parameter.value
    layout = "<I" if parameter.kind == mavlink.MAV_PARAM_TYPE_UINT32 else "<i"
    as_float: float = struct.unpack("<f", struct.pack(layout, round(parameter.value)))[0]
    return as_float
