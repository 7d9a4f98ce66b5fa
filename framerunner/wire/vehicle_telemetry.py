"""The state of a vehicle, read from its autopilot's parsed MAVLink messages.

Each report has the vehicle time at which it was true. Links swap, double and delay messages: a late report is
inserted among the others and changes nothing newer; a clock that goes back by more than `RESTART_US` means
that the vehicle has restarted, and its earlier reports are dropped.
"""

from __future__ import annotations

from bisect import bisect_right, insort
from collections.abc import Callable
from dataclasses import dataclass
from math import fsum, hypot, remainder, tau
from operator import attrgetter
from typing import Generic, NamedTuple, TypeVar

from framerunner.geometry.rotations import (
    interpolated,
    quaternion_from_euler,
    rotated_by_rate,
    rotation,
    to_world,
    yaw_of,
)
from framerunner.geometry.vectors import Quaternion, Vec3
from framerunner.wire.dialect import Message, mavlink
from framerunner.wire.px4_modes import Px4Mode, mode_of, mode_title

RESTART_US = 3_000_000
SPAN_US = RESTART_US  # minimum span of the reports that are kept
AHEAD_US = 60_000  # maximum extrapolation of a pose beyond the last report
GAP_US = 300_000  # maximum distance of reports between which poses are interpolated
NEAR_US = 100_000  # a position is valid for this time before the first and after the last report
_MAX_PLAUSIBLE = 1e6  # metres, metres a second or radians a second
_MIN_NORM, _MAX_NORM = 0.5, 2.0  # of a quaternion that can be an attitude
_UNKNOWN_MV = 0xFFFF
_YEAR_2001_US = 978_307_200_000_000


class MessageOrder:
    """The order of messages of one kind from one vehicle, by their time stamps."""

    def __init__(self) -> None:
        self._newest_us = 0

    def is_next(self, time_us: int) -> bool:
        """Whether a message, by its vehicle time, is not older than those before, or is a boot's first."""
        if self._newest_us - RESTART_US <= time_us < self._newest_us:
            return False
        self._newest_us = time_us
        return True


class AttitudeReport(NamedTuple):
    """An ATTITUDE or ATTITUDE_QUATERNION message."""

    time_us: int  # vehicle time
    attitude_ned: Quaternion  # unit quaternion (w, x, y, z), body FRD to NED
    rate_frd_rad_s: Vec3 = (0.0, 0.0, 0.0)
    by_angles: bool = False  # it is an ATTITUDE, whose angles are less accurate

    @property
    def yaw_ned_rad(self) -> float:
        """Heading, clockwise from north."""
        return yaw_of(self.attitude_ned)

    @property
    def turn_rate_ned_rad_s(self) -> float:
        """Angular rate about the vertical, clockwise seen from above."""
        return to_world(rotation(self.attitude_ned), *self.rate_frd_rad_s)[2]


class PositionReport(NamedTuple):
    """A LOCAL_POSITION_NED message."""

    time_us: int  # vehicle time
    position_ned_m: Vec3
    velocity_ned_m_s: Vec3
    yaw_ned_rad: float = 0.0  # of the latest attitude then, clockwise from north; 0 before the first


@dataclass(frozen=True, slots=True)
class VehiclePose:
    """Where the vehicle was at one instant, in its local frame."""

    time_us: int  # vehicle time
    position_ned_m: Vec3
    velocity_ned_m_s: Vec3
    attitude_ned: Quaternion  # unit quaternion (w, x, y, z), body FRD to NED


class VehicleTelemetry:
    """The present state of a vehicle as it reports it (None: not known), and its last seconds of motion."""

    def __init__(self) -> None:
        self.restarts = 0  # how often the vehicle's clock restarted at zero
        self.attitudes = self.positions = 0  # numbers of reports, of all boots
        self.autopilot: int | None = None  # MAV_AUTOPILOT; None before the first heartbeat
        self._forget()
        self._takers: dict[int, Callable[[Message, float], bool]] = {
            mavlink.MAVLINK_MSG_ID_HEARTBEAT: self._take_heartbeat,
            mavlink.MAVLINK_MSG_ID_ATTITUDE_QUATERNION: self._take_quaternion,
            mavlink.MAVLINK_MSG_ID_ATTITUDE: self._take_angles,
            mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED: self._take_position,
            mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: self._take_landed,
            mavlink.MAVLINK_MSG_ID_BATTERY_STATUS: self._take_battery,
            mavlink.MAVLINK_MSG_ID_SYS_STATUS: self._take_system_status,
            mavlink.MAVLINK_MSG_ID_SYSTEM_TIME: self._take_system_time,
        }

    def _forget(self) -> None:
        """Set the state of a vehicle that has sent nothing since its boot."""
        self._attitudes: _Track[AttitudeReport] = _Track()
        self._positions: _Track[PositionReport] = _Track()
        self.time_us = 0  # newest vehicle time received
        self.attitude_heard_s = self.position_heard_s = -1e9  # receiver's time of the newest report
        self.boot_unix_us: int | None = None  # time of boot, microseconds since 1970
        self.armed = False
        self.mode: Px4Mode | None = None  # None too if it is not one of PX4's
        self.mode_name = ""  # title of the mode; "" before the first heartbeat
        self.custom_mode = 0  # HEARTBEAT.custom_mode
        self.landed: bool | None = None  # it is on the ground
        self.battery_percent: int | None = None  # remaining charge
        self.voltage_v: float | None = None  # of the battery
        self._has_battery_status = False

    def take(self, message: Message, now_s: float = 0.0) -> bool:
        """Take a message of the vehicle's autopilot, with the receiver's time.

        Returns:
            Whether it is the newest of its kind; False if it is late, implausible or not read here.
        """
        taker = self._takers.get(message.get_msgId())
        return taker is not None and taker(message, now_s)

    @property
    def attitude(self) -> AttitudeReport | None:
        """The newest attitude; None before the first."""
        return self._attitudes.newest

    @property
    def position(self) -> PositionReport | None:
        """The newest position; None before the first."""
        return self._positions.newest

    @property
    def covered_us(self) -> int | None:
        """Vehicle time up to which attitude and position are both reported; None while one is missing."""
        attitude, position = self.attitude, self.position
        return None if attitude is None or position is None else min(attitude.time_us, position.time_us)

    @property
    def is_px4(self) -> bool:
        """Its modes are PX4's."""
        return bool(self.autopilot == mavlink.MAV_AUTOPILOT_PX4)

    @property
    def stands_disarmed(self) -> bool:
        """Known to be on the ground with its motors off."""
        return bool(self.mode_name) and not self.armed and self.landed is True

    def pose(self, time_us: int) -> VehiclePose | None:
        """The pose at a vehicle time; None outside the reports or in a gap of them.

        Between two reports it is interpolated (position linearly, attitude with a constant rate); beyond the
        last one it is extrapolated with velocity and body rates, by `AHEAD_US` at most.
        """
        attitudes, positions = self._attitudes.around(time_us), self._positions.around(time_us)
        if attitudes is None or positions is None:
            return None
        position_m, velocity_m_s = _position(*positions, time_us)
        return VehiclePose(time_us, position_m, velocity_m_s, _attitude(*attitudes, time_us))

    def position_near(self, time_us: int) -> PositionReport | None:
        """Position and heading at a vehicle time, interpolated linearly; None where no report is near."""
        index, reports = self._positions.index(time_us), self._positions.reports
        before = reports[index - 1] if index else None
        after = reports[index] if index < len(reports) else None
        if before is None or after is None:
            only = before or after
            return only if only is not None and abs(time_us - only.time_us) <= NEAR_US else None
        span_us = after.time_us - before.time_us
        if span_us > GAP_US:
            return None
        share = (time_us - before.time_us) / span_us
        turn_rad = remainder(after.yaw_ned_rad - before.yaw_ned_rad, tau)
        return PositionReport(
            time_us,
            _blend(before.position_ned_m, after.position_ned_m, 1.0 - share, share),
            before.velocity_ned_m_s,
            before.yaw_ned_rad + share * turn_rad,
        )

    def _follow_clock(self, time_us: int) -> None:
        if time_us < self.time_us - RESTART_US:
            self.restarts += 1
            self._forget()
        self.time_us = max(self.time_us, time_us)

    def _take_quaternion(self, message: Message, now_s: float) -> bool:
        return self._take_attitude(message, (message.q1, message.q2, message.q3, message.q4), now_s)

    def _take_angles(self, message: Message, now_s: float) -> bool:
        angles = (message.roll, message.pitch, message.yaw)
        if not abs(sum(angles)) < _MAX_PLAUSIBLE:  # or NaN
            return False
        return self._take_attitude(message, quaternion_from_euler(*angles), now_s, by_angles=True)

    def _take_attitude(
        self, message: Message, attitude: Quaternion, now_s: float, *, by_angles: bool = False
    ) -> bool:
        rates = (message.rollspeed, message.pitchspeed, message.yawspeed)
        w, x, y, z = attitude
        norm = hypot(w, x, y, z)
        if not (_MIN_NORM < norm < _MAX_NORM and _size(rates) < _MAX_PLAUSIBLE):  # or NaN
            return False
        time_us = message.time_boot_ms * 1000
        self._follow_clock(time_us)
        self.attitudes += 1
        newest = self._attitudes.newest
        if by_angles and newest is not None and newest.time_us == time_us and not newest.by_angles:
            return False
        unit = (w / norm, x / norm, y / norm, z / norm)
        if not self._attitudes.add(AttitudeReport(time_us, unit, rates, by_angles)):
            return False
        self.attitude_heard_s = now_s
        return True

    def _take_position(self, message: Message, now_s: float) -> bool:
        position, velocity = (message.x, message.y, message.z), (message.vx, message.vy, message.vz)
        if not _size(position) + _size(velocity) < _MAX_PLAUSIBLE:  # or NaN
            return False
        time_us = message.time_boot_ms * 1000
        self._follow_clock(time_us)
        self.positions += 1
        attitude = self.attitude
        yaw_rad = 0.0 if attitude is None else attitude.yaw_ned_rad
        if not self._positions.add(PositionReport(time_us, position, velocity, yaw_rad)):
            return False
        self.position_heard_s = now_s
        return True

    def _take_heartbeat(self, message: Message, _now_s: float) -> bool:
        self.armed = bool(message.base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED)
        self.autopilot = message.autopilot
        self.custom_mode = message.custom_mode
        self.mode = mode_of(message.custom_mode) if self.is_px4 else None
        self.mode_name = mode_title(message)
        return True

    def _take_landed(self, message: Message, _now_s: float) -> bool:
        state = message.landed_state
        known = state != mavlink.MAV_LANDED_STATE_UNDEFINED
        self.landed = state == mavlink.MAV_LANDED_STATE_ON_GROUND if known else None
        return True

    def _take_battery(self, message: Message, _now_s: float) -> bool:
        """Take BATTERY_STATUS of the first battery; the cells' voltages add up."""
        if message.id != 0:
            return False
        self._has_battery_status = True
        cells_mv = [cell for cell in message.voltages if cell != _UNKNOWN_MV]
        cells_mv += [cell for cell in message.voltages_ext if cell != 0]
        self.voltage_v = fsum(cells_mv) / 1e3 if cells_mv else None
        self.battery_percent = _percent(message.battery_remaining)
        return True

    def _take_system_status(self, message: Message, _now_s: float) -> bool:
        """Take the battery's state of SYS_STATUS, unless the more accurate BATTERY_STATUS was received."""
        if self._has_battery_status:
            return False
        known = message.voltage_battery != _UNKNOWN_MV
        self.voltage_v = message.voltage_battery / 1e3 if known else None
        self.battery_percent = _percent(message.battery_remaining)
        return True

    def _take_system_time(self, message: Message, _now_s: float) -> bool:
        """Take SYSTEM_TIME; the first one with a date counts."""
        boot_us = message.time_unix_usec - message.time_boot_ms * 1000
        if self.boot_unix_us is not None or boot_us <= _YEAR_2001_US:
            return False
        self.boot_unix_us = boot_us
        return True


T = TypeVar("T", AttitudeReport, PositionReport)
_time = attrgetter("time_us")


class _Track(Generic[T]):
    """Reports in order of their vehicle time, received in any order."""

    def __init__(self) -> None:
        self.reports: list[T] = []

    @property
    def newest(self) -> T | None:
        return self.reports[-1] if self.reports else None

    def add(self, report: T) -> bool:
        """Insert a report; whether none is newer. One with the newest's time replaces that."""
        reports, time_us = self.reports, report.time_us
        if reports and reports[-1].time_us > time_us:
            index = self.index(time_us)
            if index == 0 or reports[index - 1].time_us != time_us:
                insort(reports, report, key=_time)
            return False
        if reports and reports[-1].time_us == time_us:
            reports[-1] = report
        else:
            reports.append(report)
            if reports[0].time_us < time_us - 2 * SPAN_US:  # rarely, as deletion is slow
                del reports[: self.index(time_us - SPAN_US)]
        return True

    def index(self, time_us: int) -> int:
        """Number of reports up to a time."""
        return bisect_right(self.reports, time_us, key=_time)

    def around(self, time_us: int) -> tuple[T, T | None] | None:
        """The reports before and after a time; None before the first, in a gap, or too far ahead."""
        index = self.index(time_us)
        if index == 0:
            return None
        before = self.reports[index - 1]
        after = self.reports[index] if index < len(self.reports) else None
        if after is None:
            return (before, None) if time_us - before.time_us <= AHEAD_US else None
        return (before, after) if after.time_us - before.time_us <= GAP_US else None


def _position(before: PositionReport, after: PositionReport | None, time_us: int) -> tuple[Vec3, Vec3]:
    if after is None:
        step_s = (time_us - before.time_us) * 1e-6
        velocity = before.velocity_ned_m_s
        return _blend(before.position_ned_m, velocity, 1.0, step_s), velocity
    share = (time_us - before.time_us) / (after.time_us - before.time_us)
    return (
        _blend(before.position_ned_m, after.position_ned_m, 1.0 - share, share),
        _blend(before.velocity_ned_m_s, after.velocity_ned_m_s, 1.0 - share, share),
    )


def _attitude(before: AttitudeReport, after: AttitudeReport | None, time_us: int) -> Quaternion:
    step_us = time_us - before.time_us
    if after is None:
        return rotated_by_rate(before.attitude_ned, before.rate_frd_rad_s, step_us * 1e-6)
    return interpolated(before.attitude_ned, after.attitude_ned, step_us / (after.time_us - before.time_us))


def _blend(a: Vec3, b: Vec3, share_a: float, share_b: float) -> Vec3:
    return (share_a * a[0] + share_b * b[0], share_a * a[1] + share_b * b[1], share_a * a[2] + share_b * b[2])


def _size(vector: Vec3) -> float:
    return abs(vector[0]) + abs(vector[1]) + abs(vector[2])


def _percent(remaining: int) -> int | None:
    return remaining if 0 <= remaining <= 100 else None
