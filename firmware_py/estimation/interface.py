"""What the flight loop needs of an estimator."""

from __future__ import annotations

from typing import Protocol

from firmware_py.estimation.report import EstimatorReport
from firmware_py.types import VehicleState
from framerunner.vehicle.geodesy import GeodeticPoint
from framerunner.vehicle.measurements import ExternalPose, Readings, Sensors


class StateEstimator(Protocol):
    """Estimates the vehicle state from what the sensors deliver in each control tick.

    Attributes:
        state: the estimate, updated in place.
        stands: set by the flight loop: the vehicle is disarmed.
    """

    state: VehicleState
    stands: bool

    @property
    def has_position(self) -> bool:
        """Whether the horizontal position is measured, or was until a short while ago."""

    @property
    def origin(self) -> GeodeticPoint | None:
        """Where on Earth the local frame's origin is; None before it is known."""

    def report(self) -> EstimatorReport:
        """The condition now."""

    def update(self, sensors: Sensors | Readings) -> bool:
        """Take one tick's sensors; return whether they give an estimate of this tick."""

    def take_external_pose(self, pose: ExternalPose) -> None:
        """Take a pose of motion capture or visual odometry."""
