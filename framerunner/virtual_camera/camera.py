"""From a vehicle's telemetry to the arena's images and the referee's view of the flight.

No clock and no socket: time is the vehicle's; messages are put in, images are returned.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from math import atan2, cos, sin

from framerunner.flying.plan import FlightPlan
from framerunner.geometry.axes import ORIGIN, ArenaAlignment, Pose
from framerunner.geometry.rotations import quaternion_from_yaw, yaw_of
from framerunner.geometry.vectors import Quaternion, Vec3
from framerunner.wire.dialect import Message, mavlink
from framerunner.wire.vehicle_telemetry import AHEAD_US, VehiclePose, VehicleTelemetry
from offboard.link.gimbal import GimbalAttitude, gimbal_attitude
from scenarios.models import Scenario, TrueState
from scenarios.result import LocalFrame, Standing
from sitl.camera import FIRST_EXPOSURE_US, ExposureMotion, SimulatedCamera
from sitl.optics.painter import Image

REFEREE_STEP_US = 20_000
REPORT_GAP_US = 20_000  # between two reports: the one after an exposure is received so much later
HELD_AFTER_FLIGHT_US = 10_000_000  # time for the verdict, before the vehicle is put back on its start
GIMBAL_LOST_US = 2_000_000  # without a report; it sends ten a second
_PENDING = 200  # poses between two heartbeats


@dataclass(frozen=True, slots=True)
class ArenaPose:
    """A vehicle's pose in the arena; its attitude is a unit quaternion (w, x, y, z), body FLU to arena."""

    position_arena_m: Vec3
    velocity_arena_m_s: Vec3
    attitude_arena: Quaternion


class StartPlacement:
    """Places the arena so that the disarmed vehicle stands on the start; keeps it there during a flight.

    Only heartbeats, one a second, report arming, so the vehicle may have taken off before one does. Poses
    therefore wait until the next heartbeat confirms that they were taken disarmed; their mean is used.

    The start is that of the vehicle's centre, arena axes.
    """

    def __init__(self, start: Pose) -> None:
        self._start = start
        self._pending: deque[tuple[Vec3, float]] = deque(maxlen=_PENDING)
        self._rest: Pose | None = None
        self._landed_us: int | None = None
        self.alignment: ArenaAlignment | None = None  # local NED to arena, once the vehicle was seen disarmed
        self.armed: bool | None = None  # by the last heartbeat; None before the first

    def see_pose(self, pose: VehiclePose) -> None:
        """Take a pose; while the vehicle is armed it is ignored."""
        if not self.armed:
            self._pending.append((pose.position_ned_m, yaw_of(pose.attitude_ned)))

    def see_heartbeat(self, time_us: int, armed: bool) -> None:
        """Take a heartbeat, received at a vehicle time in microseconds."""
        if armed:
            if not self.armed and self._rest is not None:  # a try begins at the place where it stood
                self.alignment = ArenaAlignment(self._start, self._rest)
            self._landed_us = None
        elif self.armed:
            self._landed_us = time_us
        elif self._pending:
            self._rest = _mean(self._pending)
            if self._landed_us is None or time_us - self._landed_us >= HELD_AFTER_FLIGHT_US:
                self.alignment = ArenaAlignment(self._start, self._rest)
        self.armed = armed
        self._pending.clear()

    def arena_pose(self, pose: VehiclePose) -> ArenaPose | None:
        """A pose in arena axes; None before the arena is placed."""
        if self.alignment is None:
            return None
        return ArenaPose(
            self.alignment.position(pose.position_ned_m),
            self.alignment.vector(pose.velocity_ned_m_s),
            self.alignment.attitude(pose.attitude_ned),
        )


def _mean(poses: deque[tuple[Vec3, float]]) -> Pose:
    count = len(poses)
    north, east, down = (sum(position[axis] for position, _ in poses) / count for axis in range(3))
    yaw_rad = atan2(sum(sin(yaw) for _, yaw in poses), sum(cos(yaw) for _, yaw in poses))
    return Pose((north, east, down), yaw_rad)


class VirtualCamera:
    """Renders what a camera on the vehicle would see of the arena, and referees by the same poses.

    Exposures are on the grid of the simulated camera, on the vehicle's clock. An image is returned when
    that clock has passed its exposure by the camera's latency, less the time between two reports, and the
    pose there is known: at usual rates the reports around it have been received by then, so that nothing is
    extrapolated.

    Args:
        scenario: what is to be seen; its gates are higher than declared if there is no base.
        level: whether the camera is held level, as by a gimbal, and follows the heading only; else it is
            fixed to the drone or, if the vehicle reports a gimbal, looks as that does.
        base: whether the drone starts from the scenario's base; else it starts from the floor.
    """

    def __init__(self, scenario: Scenario, *, level: bool = False, base: bool = True) -> None:
        self.plan = FlightPlan(scenario, lift_m=0.0 if base else scenario.base.top_m)
        self._level = level
        self._camera = SimulatedCamera(self.plan.layout)
        self._period_us = 1e6 / scenario.camera.rate_hz
        self._wait_us = max(0, round(scenario.camera.latency_s * 1e6) - REPORT_GAP_US)
        self.restarts = 0  # of the vehicle
        self.telemetry = VehicleTelemetry()
        self._restart()

    def _restart(self) -> None:
        """Set the state of a vehicle of which nothing is known."""
        start = self.plan.start_pose
        self.placement = StartPlacement(Pose(start[:3], start[3]))
        self._referee = self.plan.new_referee()
        self._judged_us = 0
        self._next = 0
        self._motors_on = False
        self._gimbal: GimbalAttitude | None = None
        self._gimbal_us = 0  # time of the vehicle's telemetry when the gimbal was heard last

    @property
    def has_gimbal(self) -> bool:
        """Whether the images are those of a camera on the vehicle's gimbal."""
        heard = self._gimbal is not None and self.telemetry.time_us - self._gimbal_us <= GIMBAL_LOST_US
        return heard and not self._level

    def take_gimbal(self, message: Message) -> None:
        """Take a GIMBAL_DEVICE_ATTITUDE_STATUS of the vehicle."""
        attitude = gimbal_attitude(message)
        if attitude is not None:
            self._gimbal, self._gimbal_us = attitude, self.telemetry.time_us

    def take(self, message: Message) -> None:
        """Take one of the vehicle's messages; those without its pose or state are ignored."""
        self.telemetry.take(message)
        self.follow(message)

    def follow(self, message: Message) -> None:
        """Follow the vehicle, whose message the telemetry has taken."""
        telemetry = self.telemetry
        if telemetry.restarts != self.restarts:
            self.restarts = telemetry.restarts
            self._restart()
        elif message.get_msgId() == mavlink.MAVLINK_MSG_ID_HEARTBEAT:
            self.placement.see_heartbeat(telemetry.time_us, telemetry.armed)
        else:
            self._follow()

    def step(self) -> tuple[int, Image] | None:
        """Render the image that is due; after a gap in the telemetry, only the latest of those missed.

        Returns:
            Time of exposure, microseconds of vehicle time, and the image; None if none is due.
        """
        covered_us = self.telemetry.covered_us
        if covered_us is None:
            return None
        index = int((self.telemetry.time_us - self._wait_us - FIRST_EXPOSURE_US) // self._period_us)
        if index < self._next:
            return None
        exposure_us = round(FIRST_EXPOSURE_US + index * self._period_us)
        if exposure_us > covered_us + AHEAD_US:
            return None
        pose = self.telemetry.pose(exposure_us)
        where = None if pose is None else self.placement.arena_pose(pose)
        if where is None:
            return None
        self._next = index + 1
        motion = ExposureMotion(exposure_us, where.velocity_arena_m_s)
        gimbal, alignment = self._gimbal, self.placement.alignment
        turned = None
        attitude = where.attitude_arena
        if self.has_gimbal and gimbal is not None and pose is not None and alignment is not None:
            turned = alignment.attitude(gimbal.ned(yaw_of(pose.attitude_ned)))
        elif self._level:
            attitude = quaternion_from_yaw(yaw_of(attitude))
        image = self._camera.render(where.position_arena_m, attitude, motion=motion, gimbal_arena=turned)
        return exposure_us, image

    def standing(self, state: str = "", ended: str | None = None) -> Standing:
        """How the try stands, for `/referee.json`; `ended` is why the flight was aborted, if it was."""
        local_frame: LocalFrame | None = None
        if self.placement.alignment is not None:
            origin = self.placement.alignment.pose(ORIGIN)
            local_frame = LocalFrame(origin_arena_m=origin.position_m, yaw_rad=origin.yaw_rad)
        return Standing(
            scenario=self.plan.scenario.name,
            source="telemetry",
            lift_m=self.plan.lift_m,
            time_us=self.telemetry.time_us,
            local_frame=local_frame,
            snapshot=self._referee.snapshot(),
            report=self._referee.report(state, ended),
        )

    def _follow(self) -> None:
        """Show the vehicle to placement and referee at times that both kinds of reports have reached."""
        covered_us = self.telemetry.covered_us
        if covered_us is None or covered_us < self._judged_us + REFEREE_STEP_US:
            return
        pose = self.telemetry.pose(covered_us)
        if pose is None:
            return
        self._judged_us = covered_us
        self.placement.see_pose(pose)
        where = self.placement.arena_pose(pose)
        if where is None:
            return
        armed = bool(self.placement.armed)
        if armed and not self._motors_on and self._referee.over:
            self._referee = self.plan.new_referee()  # a new try
        self._motors_on = armed
        self._referee.update(
            TrueState(
                covered_us, where.position_arena_m, where.velocity_arena_m_s, where.attitude_arena, armed
            )
        )
