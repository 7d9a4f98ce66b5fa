"""Sends poses to a vehicle and keeps what is needed to judge whether it uses them."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import nan
from typing import Protocol

from framerunner.mocap.motion import MotionCheck, PoseComparison, SentPose, body_velocity
from framerunner.mocap.poses import Pose, with_forward
from framerunner.mocap.sources import PoseSource, TimedPose
from framerunner.mocap.vehicle import Vehicle
from wire.dialect import Message, mavlink

SYSTEM_ID = 248  # the doctor has 247
COMPONENT_ID = mavlink.MAV_COMP_ID_VISUAL_INERTIAL_ODOMETRY
SILENT_S = 0.2  # without a new pose for so long, the source has stopped
_EARLY = 0.2  # share of a period by which a pose may come early
_DIAGONAL = (0, 6, 11, 15, 18, 20)
_QUALITY = 100
_RATE_SPAN_S = 2.0


class Link(Protocol):
    """What is needed of a link, as `VehicleLink` has it."""

    def receive(self, timeout_s: float) -> list[Message]:
        """Wait for messages."""

    def send(self, message: Message) -> None:
        """Send a message."""


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
    """

    rate_hz: float = 50.0
    forward_deg: float = 0.0
    delay_s: float = 0.0
    position_sigma_m: float = 0.005
    attitude_sigma_rad: float = 0.01
    velocity_sigma_m_s: float = 0.05


class MocapSession:
    """Passes a source's poses to the vehicle on a link, as ODOMETRY of the type VISION.

    Args:
        link: to the vehicle.
        source: of the poses.
        settings: how they are sent.
        say: called with lines for people.

    Attributes:
        vehicle: as its messages show it.
        sent: number of poses.
        longest_gap_s: between two poses.
        silent: the source has stopped; nothing is sent.
        dropouts: how often it stopped.
    """

    def __init__(
        self, link: Link, source: PoseSource, settings: SendSettings, say: Callable[[str], None]
    ) -> None:
        self._link, self._source, self._settings, self._say = link, source, settings, say
        self.vehicle = Vehicle(settings.rate_hz if source.needs_truth else 0.0)
        self.sent = self.dropouts = 0
        self.longest_gap_s = 0.0
        self.silent = False
        self._motion = MotionCheck()
        self._in_motion = PoseComparison()
        self._recent: deque[float] = deque()  # when poses were sent
        self._newest_s = -1e9  # when the last pose that was sent was taken
        self._heard_s = 0.0  # when a pose has come
        self._covariance = _covariance(settings.position_sigma_m**2, settings.attitude_sigma_rad**2)
        self._velocity_covariance = _covariance(settings.velocity_sigma_m_s**2, nan)

    @property
    def source(self) -> PoseSource:
        """Where the poses come from."""
        return self._source

    def step(self, now_s: float, wait_s: float, clock: Callable[[], float]) -> None:
        """Receive, answer and send what is due.

        Args:
            now_s: this program's time.
            wait_s: how long to wait for messages.
            clock: gives this program's time.
        """
        messages = self._link.receive(wait_s)
        arrived_s = clock() if messages else now_s
        for message in messages:
            answer = self.vehicle.take(message, arrived_s)
            if answer is not None:
                self._link.send(answer)
            self._source.take(message, arrived_s)
        for request in self.vehicle.requests(arrived_s):
            self._link.send(request)
        self._pass_poses(clock())

    def _pass_poses(self, now_s: float) -> None:
        poses = self._source.poll(now_s)
        if poses:
            if self.silent:
                self.silent = False
                self._say(f"poses are back after {now_s - self._heard_s:.1f} s")
            elif self.sent:
                self.longest_gap_s = max(self.longest_gap_s, now_s - self._heard_s)
            self._heard_s = now_s
            for timed in poses:
                self._pass(timed, now_s)
        elif self.sent and not self.silent and now_s - self._heard_s > SILENT_S:
            self.silent = True
            self.dropouts += 1
            if not self._source.ended:
                self._say(f"no pose for {SILENT_S:g} s: nothing is sent until poses come again")

    def _pass(self, timed: TimedPose, now_s: float) -> None:
        """Send a pose, unless the one before was sent only just."""
        settings, offset_s = self._settings, self.vehicle.offset_s
        taken_s = timed.taken_s - settings.delay_s
        if timed.vehicle_time_us is not None and offset_s is not None:
            taken_s = timed.vehicle_time_us / 1e6 - offset_s
        if not self.vehicle.found or taken_s - self._newest_s < (1.0 - _EARLY) / settings.rate_hz:
            return
        self._newest_s = taken_s
        pose = with_forward(timed.pose, settings.forward_deg)
        self._link.send(self._odometry(pose, taken_s))
        self.sent += 1
        self._recent.append(now_s)
        if offset_s is not None:
            time_us = round((taken_s + offset_s) * 1e6)
            self._motion.note(SentPose(time_us, pose.position_ned_m, pose.attitude))

    def _odometry(self, pose: Pose, taken_s: float) -> Message:
        velocity = pose.velocity_ned_m_s
        body = (nan, nan, nan) if velocity is None else body_velocity(pose.attitude, velocity)
        return mavlink.MAVLink_odometry_message(
            max(1, round(taken_s * 1e6)),
            mavlink.MAV_FRAME_LOCAL_NED,
            mavlink.MAV_FRAME_BODY_FRD,
            *pose.position_ned_m,
            list(pose.attitude),
            *body,
            nan,
            nan,
            nan,
            self._covariance,
            self._velocity_covariance,
            0,
            mavlink.MAV_ESTIMATOR_TYPE_VISION,  # PX4's estimator ignores the type MOCAP
            _QUALITY,
        )

    def rate_hz(self, now_s: float) -> float:
        """Poses sent a second, over the last two."""
        recent = self._recent
        while recent and recent[0] < now_s - _RATE_SPAN_S:
            recent.popleft()
        return len(recent) / _RATE_SPAN_S

    def compare(self) -> PoseComparison:
        """The poses against what the vehicle reports now; of axes and delay, what was last seen in motion."""
        rates: Sequence[tuple[int, float, float, float]] = list(self.vehicle.rates_rad_s)
        found = self._motion.compare(self.vehicle.record.telemetry, rates)
        if found.moves:
            self._in_motion = found
        seen = self._in_motion
        return replace(
            found,
            moves=seen.moves,
            delay_s=seen.delay_s,
            correlation=seen.correlation,
            axes=seen.axes,
            track=found.track or seen.track,
        )


def _covariance(first: float, second: float) -> list[float]:
    """A covariance matrix with the same variance three times, and another one three times."""
    entries = [nan] * 21
    for index, variance in zip(_DIAGONAL, (first,) * 3 + (second,) * 3, strict=True):
        entries[index] = variance
    return entries
