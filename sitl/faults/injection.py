"""MAVLink's failure injection: which fault each FAILURE_UNIT and FAILURE_TYPE is."""

from __future__ import annotations

from scenarios.faults.declaration import SIZES, Fault, FaultKind, FaultPart

_GARBAGE = 10.0  # times the default noise: MAVLink calls it complete garbage
_MOTOR, _BATTERY, _SLOW, _GARBAGE_TYPE = 101, 100, 5, 3

_UNITS: dict[int, FaultPart] = {
    0: FaultPart.GYROSCOPE,
    1: FaultPart.ACCELEROMETER,
    2: FaultPart.MAGNETOMETER,
    3: FaultPart.BAROMETER,
    4: FaultPart.GPS,
    5: FaultPart.OPTICAL_FLOW,
    6: FaultPart.EXTERNAL_POSE,
    7: FaultPart.RANGE_FINDER,
    _BATTERY: FaultPart.BATTERY_MONITOR,
    _MOTOR: FaultPart.MOTOR,
}
_TYPES: dict[int, FaultKind] = {
    1: FaultKind.OFF,
    2: FaultKind.STUCK,
    _GARBAGE_TYPE: FaultKind.NOISY,
    4: FaultKind.WRONG,
    6: FaultKind.DELAYED,
    7: FaultKind.LOSSY,  # intermittent
}


def part_of(unit: int) -> FaultPart | None:
    """The part of a FAILURE_UNIT; None: there is none that can fail here."""
    return _UNITS.get(unit)


def fault_of(unit: int, kind: int, number: int | None) -> Fault | None:
    """The fault of a FAILURE_UNIT and FAILURE_TYPE with its default size; None: there is none.

    A motor is slow if it is weak. The sensors' rates cannot be changed, so no sensor is slow.
    """
    part, fault_kind = _UNITS.get(unit), _TYPES.get(kind)
    if part is FaultPart.MOTOR and kind == _SLOW:
        fault_kind = FaultKind.WEAK
    if part is None or fault_kind is None or fault_kind not in SIZES[part]:
        return None
    meant = SIZES[part][fault_kind]
    size = None
    if meant is not None and kind == _GARBAGE_TYPE:
        size = min(_GARBAGE * meant.default, meant.high)
    return Fault(part=part, kind=fault_kind, size=size, number=number)
