"""All measurements that aid the filter, and what they tell together."""

from __future__ import annotations

from math import nan

from firmware_py.estimation.aiding.aid import NEVER_US, Aid
from firmware_py.estimation.aiding.environment import BarometerAiding, MagnetometerAiding
from firmware_py.estimation.aiding.external_pose import PoseAiding
from firmware_py.estimation.aiding.gps import GpsAiding
from firmware_py.estimation.aiding.ground import GroundAiding
from firmware_py.estimation.aiding.target import Target
from firmware_py.estimation.error_state import POSITION, VELOCITY
from firmware_py.estimation.report import Ratios, Sensor
from firmware_py.estimation.settings import EstimatorSettings
from framerunner.geometry.vectors import Vec3
from framerunner.vehicle.geodesy import GeodeticPoint
from framerunner.vehicle.measurements import (
    BarometerSample,
    ExternalPose,
    FlowSample,
    GpsSample,
    MagnetometerSample,
    RangeSample,
)

Sample = ExternalPose | GpsSample | MagnetometerSample | BarometerSample | RangeSample | FlowSample

_STANDING_VELOCITY_M2_S2 = 0.01**2
_STANDING_PLACE_M2 = 0.25
_REDUNDANT_US = 200_000


class Aiding:
    """All kinds of aiding of one filter.

    Args:
        settings: which are used.
        field_ned_gauss: Earth's magnetic field here, shape (3,).
        origin: where on Earth the local frame is, if that is known; None: GPS tells.

    Attributes:
        target: the filter, and counts of its jumps.
        aids: of all kinds, by sensor.
        ground: aiding by sensors that look at the ground.
    """

    def __init__(
        self, settings: EstimatorSettings, field_ned_gauss: Vec3, origin: GeodeticPoint | None
    ) -> None:
        self.target = Target(settings)
        self._pose = PoseAiding(self.target, settings)
        self._gps = GpsAiding(self.target, settings, origin)
        self._barometer = BarometerAiding(self.target, settings)
        self._magnetometer = MagnetometerAiding(self.target, settings, field_ned_gauss)
        self.ground = GroundAiding(self.target, settings)
        self._has_position_sensor = settings.external or settings.gps
        self._has_flow = settings.flow_sigma_rad_s is not None
        self._stood_us = NEVER_US
        pose, gps = self._pose, self._gps
        self.aids: dict[Sensor, tuple[Aid, ...]] = {
            Sensor.EXTERNAL_POSE: (pose.horizontal, pose.vertical, pose.heading),
            Sensor.GPS: (gps.horizontal, gps.vertical, gps.velocity),
            Sensor.BAROMETER: (self._barometer.height,),
            Sensor.MAGNETOMETER: (self._magnetometer.field,),
            Sensor.RANGE_FINDER: (self.ground.height,),
            Sensor.OPTICAL_FLOW: (self.ground.flow,),
        }

    @property
    def origin(self) -> GeodeticPoint | None:
        """Where on Earth the local frame's origin is; None: not known yet."""
        return self._gps.origin

    @property
    def position_us(self) -> int:
        """When the horizontal position was measured last; with optical flow alone, its velocity.

        That a vehicle stands still tells where it is only if something can measure its motion in flight.
        """
        if self._has_position_sensor:
            pose_us, gps_us = self._pose.horizontal.fused_us, self._gps.horizontal.fused_us
            return pose_us if pose_us > gps_us else gps_us
        return max(self.ground.flow.fused_us, self._stood_us) if self._has_flow else NEVER_US

    @property
    def velocity_us(self) -> int:
        """When something was measured last that keeps the horizontal velocity from drifting."""
        ground = self.ground.flow.fused_us
        return max(self.position_us, self._gps.velocity.fused_us, ground, self._stood_us)

    @property
    def height_us(self) -> int:
        """When the height was measured last."""
        heights = (self._pose.vertical, self._gps.vertical, self._barometer.height)
        return max([aid.fused_us for aid in heights])

    def height_above_ground_m(self) -> float:
        """By range finder; NaN: not measured."""
        return self.ground.height_above_ground_m() if self.target.layout.ground >= 0 else nan

    def relied_on(self, since_us: int) -> frozenset[Sensor]:
        """Sensors of which something has been fused since a time."""
        return frozenset(
            sensor for sensor, aids in self.aids.items() if any(aid.fused_us >= since_us for aid in aids)
        )

    def ratios(self) -> Ratios:
        """Of the last innovations."""
        pose, gps = self._pose, self._gps
        return Ratios(
            velocity=max(gps.velocity.ratio, self.ground.flow.ratio),
            position_horizontal=max(pose.horizontal.ratio, gps.horizontal.ratio),
            position_vertical=max(pose.vertical.ratio, gps.vertical.ratio, self._barometer.height.ratio),
            heading=max(pose.heading.ratio, self._magnetometer.field.ratio),
            height_above_ground=self.ground.height.ratio,
        )

    def is_redundant(self, sample: Sample) -> bool:
        """Whether a pressure or range would tell next to nothing: the height is known to millimetres.

        A few a second are enough then to know their slow errors, when the better source fails.
        """
        if type(sample) is BarometerSample:
            aid = self._barometer.height
        elif type(sample) is RangeSample:
            aid = self.ground.height
        else:
            return False
        return (
            sample.time_us - self._pose.vertical.fused_us < _REDUNDANT_US
            and sample.time_us - aid.fused_us < _REDUNDANT_US
        )

    def fuse(self, sample: Sample) -> list[float]:
        """Correct the filter by a measurement of its time; return the errors found, shape (n,)."""
        into = self.target.filter
        into.predict()
        if type(sample) is ExternalPose:
            self._pose.fuse(sample)
        elif type(sample) is BarometerSample:
            self._barometer.fuse(sample)
        elif type(sample) is MagnetometerSample:
            self._magnetometer.fuse(sample)
        elif type(sample) is RangeSample:
            self.ground.fuse_range(sample)
        elif type(sample) is FlowSample:
            self.ground.fuse_flow(sample)
        elif type(sample) is GpsSample:
            self._gps.fuse(sample)
        self.ground.move_if_due()
        return into.correct()

    def stand(self) -> list[float]:
        """Use that the vehicle stands still, while nothing measures its position; see `fuse`."""
        into = self.target.filter
        into.predict()
        self._stood_us = into.time_us
        for axis, velocity in enumerate(into.state.velocity_ned_m_s):
            into.covariance.fuse_state(VELOCITY + axis, -velocity, _STANDING_VELOCITY_M2_S2)
        if self.position_us == NEVER_US:
            for axis in (0, 1):
                place_m = into.state.position_ned_m[axis]
                into.covariance.fuse_state(POSITION + axis, -place_m, _STANDING_PLACE_M2)
        return into.correct()
