"""What is known about poses and vehicle when they are judged, and how poses are sent."""

from __future__ import annotations

from dataclasses import dataclass

from framerunner.mocap.motion import PoseComparison
from framerunner.wire.dialect import mavlink
from framerunner.wire.session.record import Record

NEAR_M, FAR_M = 0.10, 0.5
DELAY_S = 0.02  # difference that matters
VISION = int(mavlink.MAV_SYS_STATUS_SENSOR_VISION_POSITION)


@dataclass(frozen=True, slots=True)
class RoomOrigin:
    """Where on Earth the room's origin is."""

    latitude_deg: float
    longitude_deg: float
    altitude_m: float  # above mean sea level


@dataclass(frozen=True, slots=True)
class SendSettings:
    """How poses are sent.

    Attributes:
        rate_hz: at most so many a second; a source that has fewer is not repeated.
        forward_deg: from the body's first axis to the vehicle's forward axis, counter-clockwise.
        delay_s: constant delay of the motion capture, by which poses are older than they seem here.
        position_sigma_m: standard deviation of each axis.
        attitude_sigma_rad: standard deviation about each axis.
        velocity_sigma_m_s: standard deviation of each axis.
        height_sigma_m: standard deviation of the height; None: that of the other axes.
        origin: set in a vehicle that has none; None: nothing is set.
    """

    rate_hz: float = 50.0
    forward_deg: float = 0.0
    delay_s: float = 0.0
    position_sigma_m: float = 0.005
    attitude_sigma_rad: float = 0.01
    velocity_sigma_m_s: float = 0.05
    height_sigma_m: float | None = None
    origin: RoomOrigin | None = None


@dataclass(frozen=True, slots=True)
class Unused:
    """The time in which a vehicle did not use the poses that came, after it had used some.

    Attributes:
        seconds: how long, in all.
        farthest_m: from the pose of the same time.
        track: how it moved otherwise than the poses, in words; empty: it is not known.
    """

    seconds: float = 0.0
    farthest_m: float = 0.0
    track: str = ""


@dataclass(frozen=True, slots=True)
class Facts:
    """What is known at the end, or once a second.

    Attributes:
        record: what the vehicle has sent.
        comparison: of poses and vehicle.
        sent: number of poses.
        rate_hz: poses a second.
        longest_gap_s: between two poses.
        dropouts: how often the source stopped.
        worst_ratio: largest innovation ratio of position and height.
        converts_stamps: the vehicle has got enough answers to TIMESYNC to convert time stamps.
        faults: lines of the source that were left out.
        fault: what was wrong with the last of them.
        settings: how poses are sent.
        has_velocity: the source gives velocities.
        transit_s: time that a packet takes to the vehicle, half of a quick way there and back.
        unused: when it did not use the poses that came.
    """

    record: Record
    comparison: PoseComparison
    sent: int = 0
    rate_hz: float = 0.0
    longest_gap_s: float = 0.0
    dropouts: int = 0
    worst_ratio: float = 0.0
    converts_stamps: bool = False
    faults: int = 0
    fault: str = ""
    settings: SendSettings = SendSettings()
    has_velocity: bool = False
    transit_s: float = 0.0
    unused: Unused = Unused()
