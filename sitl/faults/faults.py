"""All faults of one simulated drone: those declared for its flight, and those injected over MAVLink."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

from scenarios.faults.declaration import SIZES, Fault, FaultError, FaultKind, FaultPart
from sitl.battery import Battery
from sitl.faults.link import LinkFault
from sitl.faults.sensors import IDEAL_PARTS, SensorFaults
from sitl.sensors.specs import SuiteSpec
from sitl.world import World

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


_NEVER_US = 1 << 62
_OTHERS = frozenset({FaultPart.BATTERY, FaultPart.MOTOR, FaultPart.CAMERA, FaultPart.LINK, FaultPart.RC})
_ALWAYS = frozenset({FaultPart.GYROSCOPE, FaultPart.ACCELEROMETER, FaultPart.BATTERY_MONITOR})
"""In each suite; the other sensors are named as their fields of a suite, which may lack them."""


@dataclass(frozen=True, slots=True)
class RunningFault:
    """A fault that has begun.

    Attributes:
        fault: as declared or injected.
        time_us: when it began, vehicle time.
        ended_us: when it ended; None: it is active.
    """

    fault: Fault
    time_us: int
    ended_us: int | None = None


class Faults:
    """Starts and ends faults; the simulation applies those of sensors in each tick.

    Args:
        declared: for each try, with times that count from arming.
        suite: the drone's sensors.
        world: whose motors fail, and whose time counts.
        battery: that sags.
        seed: of the flight.
        autopilot: a genuine one, whose link to the app is its own; empty: our own flies.
        has_transmitter: there is a remote control, which can fail.

    Raises:
        FaultError: the drone has no such part.

    Attributes:
        next_us: before this time `update` need not be called.
        sensors: active faults of sensors; None: there are none.
        link: the active fault of the link; None: there is none.
        rc: the active fault of the remote control; None: there is none.
        camera: active faults of the camera.
        begun: of the present or last try, oldest first.
        notice: called with a line for people when a fault begins or ends.
    """

    def __init__(
        self,
        declared: Iterable[Fault],
        suite: SuiteSpec,
        world: World,
        battery: Battery,
        seed: int,
        *,
        autopilot: str = "",
        has_transmitter: bool = False,
    ) -> None:
        self._autopilot, self._has_transmitter = autopilot, has_transmitter
        self._declared = tuple(declared)
        self._suite, self._world, self._battery, self._seed = suite, world, battery, seed
        self._rotors = len(world.airframe.rotors)
        self._all_sensors = SensorFaults(seed, ideal=suite.ideal)
        self._scheduled: list[tuple[int, int, Fault]] = []  # when, 0 to begin or 1 to end; latest first
        self._active: list[Fault] = []
        self._armed_us: int | None = None
        self.next_us = _NEVER_US
        self.sensors: SensorFaults | None = None
        self.link: LinkFault | None = None
        self.rc: Fault | None = None
        self.camera: tuple[Fault, ...] = ()
        self.begun: list[RunningFault] = []
        self.notice: Callable[[str], None] = lambda line: None
        for fault in self._declared:
            self._check(fault)

    @property
    def active(self) -> tuple[Fault, ...]:
        """Faults that act now, oldest first."""
        return tuple(self._active)

    def armed(self, now_us: int) -> None:
        """A try begins: schedule what is declared."""
        self._armed_us = now_us
        self.begun = [RunningFault(fault, now_us) for fault in self._active]  # those injected before
        self._scheduled = []
        for fault in self._declared:
            begin_us = now_us + round(fault.at_s * 1e6)
            self._scheduled.append((begin_us, 0, fault))
            if fault.for_s is not None:
                self._scheduled.append((begin_us + round(fault.for_s * 1e6), 1, fault))
        self._scheduled.sort(key=lambda event: event[:2], reverse=True)
        self._set_next()

    def disarmed(self, now_us: int) -> None:
        """The try is over: what was declared ends; what was injected over MAVLink stays."""
        self._armed_us = None
        self._scheduled = []
        self.next_us = _NEVER_US
        for fault in self._declared:
            self._end(fault, now_us)

    def update(self, now_us: int) -> None:
        """Begin and end what is due."""
        while self._scheduled and self._scheduled[-1][0] <= now_us:
            _, ends, fault = self._scheduled.pop()
            if ends:
                self._end(fault, now_us)
            else:
                self._begin(fault, now_us)
        self._set_next()

    def inject(self, unit: int, kind: int, instance: int) -> str | None:
        """Inject a failure by MAVLink's numbers, or repair a unit.

        Args:
            unit: FAILURE_UNIT.
            kind: FAILURE_TYPE; 0 repairs.
            instance: of the unit, from 1; 0: all.

        Returns:
            What is done, in words; None: that cannot be done, and nothing has changed.
        """
        part, now_us = part_of(unit), self._world.time_us
        if part is None or not self._has(part):
            return None
        numbers: list[int | None] = [None]
        if part is FaultPart.MOTOR:
            numbers = [number for number in range(1, self._rotors + 1) if instance in (0, number)]
        elif instance > 1:
            return None
        if kind == 0:
            for fault in self.active:
                if fault.part is part and (part is not FaultPart.MOTOR or (fault.number or 1) in numbers):
                    self._end(fault, now_us)
            return f"{part.value.replace('_', ' ')} repaired" if numbers else None
        faults = [fault_of(unit, kind, number) for number in numbers]
        begun = [fault for fault in faults if fault is not None]
        if not begun or len(begun) < len(faults):
            return None
        for fault in begun:
            for same in self.active:
                if (same.part, same.kind, same.number) == (fault.part, fault.kind, fault.number):
                    self._end(same, now_us)
            self._begin(fault.model_copy(update={"at_s": self._flown_s(now_us)}), now_us)
        return ", ".join(str(fault).partition(" at ")[0] for fault in begun)

    def _flown_s(self, now_us: int) -> float:
        """Seconds since arming; 0 while disarmed."""
        return 0.0 if self._armed_us is None else round((now_us - self._armed_us) / 1e6, 3)

    def _set_next(self) -> None:
        self.next_us = self._scheduled[-1][0] if self._scheduled else _NEVER_US

    def _has(self, part: FaultPart) -> bool:
        if part is FaultPart.RC:
            return self._has_transmitter
        if part in _OTHERS:
            return True
        if self._suite.ideal:
            return part in IDEAL_PARTS
        pose = self._suite.external_pose
        if part is FaultPart.EXTERNAL_POSE and pose is not None and pose.source != "simulated":
            return False  # its poses come over MAVLink
        return part in _ALWAYS or getattr(self._suite, part) is not None

    def _check(self, fault: Fault) -> None:
        """Refuse a fault of a part that the drone does not have."""
        if fault.part is FaultPart.RC and not self._has_transmitter:
            raise FaultError(
                f"fault `{fault}`: only a drone that PX4 flies has a remote control; leave it out, or fly PX4"
            )
        name = self._autopilot
        if fault.part is FaultPart.LINK and name:
            raise FaultError(
                f"fault `{fault}`: the link to the app is {name}'s own; leave it out with {name}"
            )
        if not self._has(fault.part):
            raise FaultError(
                f"fault `{fault}`: the sensors {self._suite.name} have no {fault.part}; leave it out"
            )
        if fault.number is not None and fault.number > self._rotors:
            raise FaultError(f"fault `{fault}`: the drone has {self._rotors} motors; use 1 to {self._rotors}")

    def _begin(self, fault: Fault, now_us: int) -> None:
        self._active.append(fault)
        self.notice(f"fault begins: {fault}")
        self.begun.append(RunningFault(fault, now_us))
        if fault.part not in _OTHERS:
            self._all_sensors.begin(fault)
        self._apply()

    def _end(self, fault: Fault, now_us: int) -> None:
        if fault not in self._active:
            return
        self._active.remove(fault)
        self.notice(f"fault ends: {fault}")
        for number, each in enumerate(self.begun):
            if each.fault == fault and each.ended_us is None:
                self.begun[number] = replace(each, ended_us=now_us)
        if fault.part not in _OTHERS:
            self._all_sensors.end(fault)
        self._apply()

    def _apply(self) -> None:
        """Let what is active act; of several faults of one motor or link the last counts."""
        self.sensors = self._all_sensors if self._all_sensors.active else None
        self.camera = tuple(fault for fault in self._active if fault.part is FaultPart.CAMERA)
        self.rc = next((fault for fault in reversed(self._active) if fault.part is FaultPart.RC), None)
        links = [fault for fault in self._active if fault.part is FaultPart.LINK]
        if not links:
            self.link = None
        elif self.link is None or self.link.fault is not links[-1]:
            self.link = LinkFault(links[-1], self._seed)
        sags = [fault.amount for fault in self._active if fault.part is FaultPart.BATTERY]
        self._battery.sag = max(sags, default=0.0)
        dynamics = self._world.dynamics
        states = {fault.number or 1: fault for fault in self._active if fault.part is FaultPart.MOTOR}
        for number in range(1, self._rotors + 1):
            state = states.get(number)
            if state is None:
                dynamics.repair_motor(number - 1)
            elif state.kind is FaultKind.WEAK:
                dynamics.weaken_motor(number - 1, state.amount)
            else:
                dynamics.fail_motor(number - 1, stuck=state.kind is FaultKind.STUCK)
