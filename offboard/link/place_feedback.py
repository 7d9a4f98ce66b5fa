"""The place that the app has estimated, for a vehicle that knows it from nothing else: as ODOMETRY.

It is in the arena's axes as north, east, down, as motion capture has it, and without jumps: it is moved by
the estimated velocity, and pulled slowly to the estimated place. What lies between is what the place's filter
finds the vehicle's report to be wrong by.
"""

from __future__ import annotations

from math import dist
from struct import Struct

from framerunner.geometry.axes import Pose, flip_vector
from framerunner.geometry.rotations import quaternion_from_yaw, rotation, to_body
from framerunner.geometry.vectors import ZERO3, Quaternion, Vec3
from framerunner.wire.dialect import Message, mavlink
from offboard.drone import DroneState

PERIOD_US = 50_000
STD_M, STD_RAD = 0.02, 0.03
STD_M_S, STD_RAD_S = 0.1, 1.0  # the rates are not estimated here
HEIGHT_STD_M = 0.5  # in flight: the vehicle's range finder knows it better
PULL_S, PULL_M_S = 2.5, 0.05  # time constant, and fastest, of the pull to the estimated place
LONGEST_S = 0.2  # between two states; after a longer time the place is taken as it is
STILL_M = 1e-4  # poses that are equal to the last digit are those of a source that hangs
_ON_WIRE = Struct("<7f")  # a message that was not sent has double precision
_DIAGONAL = (0, 6, 11, 15, 18, 20)


class PlaceFeedback:
    """Makes the messages; it does not read the clock.

    Args:
        start: where the drone stands until it flies, arena axes.
    """

    def __init__(self, start: Pose) -> None:
        self._start = start
        self._place_m: Vec3 | None = None
        self._time_us = 0
        self._count = 0

    @property
    def stands(self) -> bool:
        """Nothing was estimated yet: the drone is where it was put."""
        return self._place_m is None

    def standing(self, time_us: int) -> Message:
        """Of a drone that is where it was put."""
        attitude = quaternion_from_yaw(self._start.yaw_rad)
        return self._message(time_us, self._start.position_m, attitude, ZERO3, STD_M)

    def flying(self, state: DroneState) -> Message:
        """Of a drone whose place was estimated."""
        now_m, step_s = (state.x, state.y, state.z), (state.time_us - self._time_us) * 1e-6
        before_m, self._time_us = self._place_m, state.time_us
        if before_m is None or not 0.0 < step_s <= LONGEST_S:
            place_m = now_m
        else:
            moved = tuple(a + step_s * v for a, v in zip(before_m, state.velocity_arena_m_s, strict=True))
            away_m = dist(now_m, moved)
            share = step_s * min(1.0 / PULL_S, PULL_M_S / max(away_m, 1e-9))
            x, y, z = (a + share * (b - a) for a, b in zip(moved, now_m, strict=True))
            place_m = (x, y, z)
        self._place_m = place_m
        velocity_m_s = state.velocity_arena_m_s
        return self._message(state.time_us, place_m, state.attitude_arena, velocity_m_s, HEIGHT_STD_M)

    def _message(
        self,
        time_us: int,
        place_m: Vec3,
        attitude_arena: Quaternion,
        velocity_arena_m_s: Vec3,
        height_std_m: float,
    ) -> Message:
        self._count += 1
        (x, y, z), (w, qx, qy, qz) = flip_vector(place_m), attitude_arena
        x, y, z, *attitude = _ON_WIRE.unpack(
            _ON_WIRE.pack(x + STILL_M * (self._count % 2), y, z, w, qx, -qy, -qz)
        )
        vx, vy, vz = flip_vector(to_body(rotation(attitude_arena), *velocity_arena_m_s))
        stds = (STD_M, STD_M, height_std_m, STD_RAD, STD_RAD, STD_RAD)
        return mavlink.MAVLink_odometry_message(
            time_usec=time_us,
            frame_id=mavlink.MAV_FRAME_LOCAL_NED,
            child_frame_id=mavlink.MAV_FRAME_BODY_FRD,
            x=x,
            y=y,
            z=z,
            q=attitude,
            vx=vx,
            vy=vy,
            vz=vz,
            rollspeed=0.0,
            pitchspeed=0.0,
            yawspeed=0.0,
            pose_covariance=_covariance(stds),
            velocity_covariance=_covariance((STD_M_S,) * 3 + (STD_RAD_S,) * 3),
            reset_counter=0,
            estimator_type=mavlink.MAV_ESTIMATOR_TYPE_VIO,
            quality=100,
        )


def _covariance(stds: tuple[float, ...]) -> list[float]:
    """The upper triangle of a matrix of six rows with these variances; JSON has no NaN."""
    entries = [0.0] * 21
    for index, std in zip(_DIAGONAL, stds, strict=True):
        entries[index] = std**2
    return entries
