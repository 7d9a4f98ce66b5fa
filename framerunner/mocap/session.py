"""Sends poses to a vehicle and keeps what is needed to judge whether it uses them."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import replace

from framerunner.mocap.facts import Facts, SendSettings, Unused
from framerunner.mocap.motion import MotionCheck, PoseComparison, SentPose
from framerunner.mocap.poses import with_forward
from framerunner.mocap.sources import PoseSource, TimedPose
from framerunner.mocap.vehicle import PoseVehicle
from framerunner.wire.dialect import mavlink
from framerunner.wire.transports.vehicle_link import VehicleLink

SYSTEM_ID = 248  # the doctor has 247
COMPONENT_ID = mavlink.MAV_COMP_ID_VISUAL_INERTIAL_ODOMETRY
SILENT_S = 0.2  # without a new pose for so long, the source has stopped
_EARLY = 0.2  # share of a period by which a pose may come early
_RATE_SPAN_S = 2.0


class MocapSession:
    """Passes a source's poses to the vehicle on a link, in the form that its autopilot takes.

    Args:
        link: to the vehicle.
        source: of the poses.
        settings: how they are sent.
        say: called with lines for people.
        zero_s: reading of the clock of the time stamps at this program's time 0.

    Attributes:
        vehicle: as its messages show it.
        sent: number of poses.
        longest_gap_s: between two poses.
        silent: the source has stopped; nothing is sent.
        dropouts: how often it stopped.
        has_velocity: the source gives velocities.
        unused: when the vehicle did not use the poses that came.
    """

    def __init__(
        self,
        link: VehicleLink,
        source: PoseSource,
        settings: SendSettings,
        say: Callable[[str], None],
        zero_s: float = 0.0,
    ) -> None:
        self._link, self._source, self._settings, self._say = link, source, settings, say
        truth_hz = settings.rate_hz if source.needs_truth else 0.0
        self.vehicle = PoseVehicle(truth_hz, settings.origin, zero_s, streams_hz=source.streams_hz)
        self.sent = self.dropouts = 0
        self.longest_gap_s = 0.0
        self.unused = Unused()
        self._used_in_boot: int | None = None  # number of the vehicle's restarts when it used poses
        self.silent = self.has_velocity = False
        self._motion = MotionCheck()
        self._in_motion = PoseComparison()
        self._recent: deque[float] = deque()  # when poses were sent
        self._newest_s = -1e9  # when the last pose that was sent was taken
        self._heard_s = 0.0  # when a pose has come

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
            self.vehicle.take(message, arrived_s)
            self._source.take(message, arrived_s)
        for request in self.vehicle.due(arrived_s):
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
        if self.vehicle.system_id is None or taken_s - self._newest_s < (1.0 - _EARLY) / settings.rate_hz:
            return
        self._newest_s = taken_s
        pose = with_forward(timed.pose, settings.forward_deg)
        self.has_velocity = pose.velocity_ned_m_s is not None
        stamp_us = self.vehicle.stamp_us(taken_s)
        self._link.send(self.vehicle.dialect.pose_message(pose, stamp_us, settings))
        self.sent += 1
        self._recent.append(now_s)
        if offset_s is not None:
            time_us = round((taken_s + offset_s) * 1e6)
            self._motion.note(SentPose(time_us, pose.position_ned_m, pose.attitude))

    def note_use(self, fused: bool | None, comparison: PoseComparison, span_s: float) -> None:
        """Note whether the vehicle uses the poses and how it moves, once for each `span_s`."""
        boot = self.vehicle.telemetry.restarts
        if fused:
            self._used_in_boot = boot
        elif fused is False and self._used_in_boot == boot and not self.silent:
            before = self.unused
            self.unused = Unused(
                before.seconds + span_s,
                max(before.farthest_m, comparison.distance_m),  # NaN is never larger
                comparison.track or before.track,
            )

    def facts(self, now_s: float) -> Facts:
        """What is known now of poses and vehicle."""
        vehicle, source = self.vehicle, self._source
        vehicle.listened(now_s)
        return Facts(
            record=vehicle,
            comparison=self._compare(),
            sent=self.sent,
            rate_hz=self._rate_hz(now_s),
            longest_gap_s=self.longest_gap_s,
            dropouts=self.dropouts,
            worst_ratio=vehicle.worst_ratio,
            converts_stamps=vehicle.converts_stamps,
            faults=source.faults,
            fault=source.fault,
            settings=self._settings,
            has_velocity=self.has_velocity,
            transit_s=vehicle.transit_s,
            unused=self.unused,
        )

    def _rate_hz(self, now_s: float) -> float:
        """Poses sent a second, over the last two."""
        recent = self._recent
        while recent and recent[0] < now_s - _RATE_SPAN_S:
            recent.popleft()
        return len(recent) / _RATE_SPAN_S

    def _compare(self) -> PoseComparison:
        """The poses against what the vehicle reports now; of axes and delay, what was last seen in motion."""
        rates: Sequence[tuple[int, float, float, float]] = list(self.vehicle.rates_rad_s)
        found = self._motion.compare(self.vehicle.telemetry, rates)
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
