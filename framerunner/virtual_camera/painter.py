"""From a vehicle's telemetry to the arena's images and the referee's view of the flight.

No clock and no socket: time is the vehicle's, messages come in, images come out.
"""

from __future__ import annotations

from framerunner.flying.plan import FlightPlan
from framerunner.virtual_camera.placement import Placement
from geometry.axes import ORIGIN, Pose
from geometry.rotations import quaternion_from_yaw, yaw_of
from scenarios.models import Scenario, TrueState
from scenarios.result import LocalFrame, Standing
from sitl.camera import FIRST_EXPOSURE_US, Camera, Image
from wire.dialect import Message, mavlink
from wire.vehicle_telemetry import AHEAD_US, VehicleTelemetry

REFEREE_STEP_US = 20_000
REPORT_GAP_US = 20_000  # between two reports: the one that shows that a time is over comes so much later


class VirtualCamera:
    """Paints what a camera on the vehicle would see of the arena, and referees by the same poses.

    Exposures are on the grid of the simulated camera, on the vehicle's clock. An image is handed out when
    that clock is past its exposure by the camera's latency, less the time between two reports, and the pose
    there is known: at usual rates the reports around it have come by then, so that nothing is guessed.

    Args:
        scenario: what is to be seen.
        level: whether the camera is held level, as by a gimbal, and turns with the heading only.
        base: whether the drone starts from the scenario's base; else it starts from the floor.

    Attributes:
        plan: the flight that is seen; its frames are higher than declared if there is no base.
        placement: of the arena at the vehicle.
        telemetry: what the vehicle tells.
        images: painted so far.
        restarts: how often the vehicle has restarted.
    """

    def __init__(self, scenario: Scenario, *, level: bool = False, base: bool = True) -> None:
        self.plan = FlightPlan(scenario, lift_m=0.0 if base else scenario.base.top_m)
        self._level = level
        self._camera = Camera(self.plan.layout)
        self._period_us = 1e6 / scenario.camera.rate_hz
        self._wait_us = max(0, round(scenario.camera.latency_s * 1e6) - REPORT_GAP_US)
        self.images = self.restarts = 0
        self._restart()

    def _restart(self) -> None:
        """Know nothing of the vehicle."""
        self.telemetry = VehicleTelemetry()
        start = self.plan.start_pose
        self.placement = Placement(Pose(start[:3], start[3]))
        self._referee = self.plan.new_referee()
        self._judged_us = 0
        self._next = 0
        self._motors_on = False

    def take(self, message: Message) -> None:
        """Take one of the vehicle's messages; those that tell nothing of its pose are passed over."""
        telemetry = self.telemetry
        telemetry.take(message)
        if telemetry.restarts:
            self.restarts += 1
            self._restart()
        elif message.get_msgId() == mavlink.MAVLINK_MSG_ID_HEARTBEAT:
            self.placement.see_heartbeat(telemetry.time_us, telemetry.armed)
        else:
            self._follow()

    def step(self) -> tuple[int, Image] | None:
        """Paint the image that is due.

        After a gap in the telemetry only the latest of the exposures that were missed is painted.

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
        self.images += 1
        attitude = quaternion_from_yaw(yaw_of(where.attitude_arena)) if self._level else where.attitude_arena
        return exposure_us, self._camera.render(where.position_arena_m, attitude)

    def standing(self, state: str = "", ended: str | None = None) -> Standing:
        """How the try stands, for `/referee.json`.

        Args:
            state: the mission's, for the report.
            ended: why the flight was broken off, if it was.
        """
        return Standing(
            scenario=self.plan.scenario.name,
            source="telemetry",
            lift_m=self.plan.lift_m,
            time_us=self.telemetry.time_us,
            local_frame=self._local_frame(),
            snapshot=self._referee.snapshot(),
            report=self._referee.report(state, ended),
        )

    def _local_frame(self) -> LocalFrame | None:
        """Where in the arena the vehicle's local frame is; None as long as the arena has no place."""
        alignment = self.placement.alignment
        if alignment is None:
            return None
        origin = alignment.pose(ORIGIN)
        return LocalFrame(origin_arena_m=origin.position_m, yaw_rad=origin.yaw_rad)

    def _follow(self) -> None:
        """Let placement and referee see the vehicle where both kinds of reports have come to."""
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
