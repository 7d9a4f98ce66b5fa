"""What a vehicle's estimator reports, as PX4 and ArduPilot send it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import isnan

from framerunner.wire.dialect import Message, mavlink

_EKF_CONST_POS_MODE = 128  # of EKF_STATUS_REPORT; its other flags are ESTIMATOR_STATUS's
_OPTIONAL = "height above ground"


@dataclass(frozen=True, slots=True)
class EstimatorStatus:
    """ESTIMATOR_STATUS, or ArduPilot's EKF_STATUS_REPORT.

    Attributes:
        has_attitude: it knows its attitude.
        has_position: likewise, horizontally, relative or absolute.
        has_global_position: likewise, on Earth.
        has_height: likewise.
        ratios: of innovations to what their gates let pass, by what is measured.
    """

    has_attitude: bool
    has_position: bool
    has_global_position: bool
    has_height: bool
    ratios: Mapping[str, float]

    @property
    def largest_ratio(self) -> float:
        """Of the measurements that a flight needs; 0 without any."""
        needed = (ratio for name, ratio in self.ratios.items() if name != _OPTIONAL)
        return max((ratio for ratio in needed if not isnan(ratio)), default=0.0)

    @classmethod
    def of(cls, message: Message) -> EstimatorStatus:
        """By one of these messages."""
        if message.get_type() == "EKF_STATUS_REPORT":
            is_constant = bool(message.flags & _EKF_CONST_POS_MODE)
            ratios = {
                "velocity": message.velocity_variance,
                "position": message.pos_horiz_variance,
                "height": message.pos_vert_variance,
                "heading": message.compass_variance,
            }
        else:
            is_constant = False
            ratios = {
                "velocity": message.vel_ratio,
                "position": message.pos_horiz_ratio,
                "height": message.pos_vert_ratio,
                "heading": message.mag_ratio,
                _OPTIONAL: message.hagl_ratio,
            }
        flags, absolute = message.flags, mavlink.ESTIMATOR_POS_HORIZ_ABS
        return cls(
            has_attitude=bool(flags & mavlink.ESTIMATOR_ATTITUDE),
            has_position=bool(flags & (absolute | mavlink.ESTIMATOR_POS_HORIZ_REL)) and not is_constant,
            has_global_position=bool(flags & absolute),
            has_height=bool(flags & mavlink.ESTIMATOR_POS_VERT_ABS),
            ratios=ratios,
        )
