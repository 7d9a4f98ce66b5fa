"""Poses for PX4: ODOMETRY in NED, fused as EKF2's external vision."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from framerunner.mocap.facts import DELAY_S, FAR_M, NEAR_M, VISION, Facts, SendSettings
from framerunner.mocap.pose_messages import odometry
from framerunner.mocap.poses import MeasuredPose
from framerunner.wire.dialect import Message, mavlink
from offboard.safety.check import Checks, good, note

_POSITION, _HEIGHT, _VELOCITY, _YAW = 1, 2, 4, 8  # bits of EKF2_EV_CTRL
_WANTED = _POSITION | _HEIGHT | _VELOCITY | _YAW
_HEIGHT_BY_VISION = 3


class Px4Poses:
    """PX4, and what presents itself as PX4."""

    name = "PX4"
    guide = "docs/real-drone.md, step 6"
    parameters: tuple[str, ...] = (
        *("EKF2_EV_CTRL", "EKF2_EV_DELAY", "EKF2_EV_NOISE_MD", "EKF2_EVP_NOISE", "EKF2_EVA_NOISE"),
        *("EKF2_GPS_CTRL", "EKF2_HGT_REF", "EKF2_MAG_TYPE"),
    )
    streams_hz: Mapping[int, float] = MappingProxyType(
        {
            mavlink.MAVLINK_MSG_ID_ATTITUDE: 50.0,
            mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED: 30.0,
            mavlink.MAVLINK_MSG_ID_ESTIMATOR_STATUS: 2.0,
            mavlink.MAVLINK_MSG_ID_SYS_STATUS: 2.0,
            # PX4's filter estimates the drift per answer, so this rate must stay the same.
            mavlink.MAVLINK_MSG_ID_TIMESYNC: 20.0,
        }
    )
    truth = mavlink.MAVLINK_MSG_ID_HIL_STATE_QUATERNION
    estimator = "ESTIMATOR_STATUS"
    needs_origin = False

    def pose_message(self, pose: MeasuredPose, stamp_us: int, settings: SendSettings) -> Message:
        """ODOMETRY in NED."""
        return odometry(pose, stamp_us, settings, mavlink.MAV_FRAME_LOCAL_NED)

    def is_fused(self, facts: Facts) -> bool | None:
        """By the health of vision where it is sent, else by the estimator's aiding and the distance."""
        record = facts.record
        estimator, system = record.latest.get(self.estimator), record.latest.get("SYS_STATUS")
        if estimator is None:
            return None
        if system is not None and system.onboard_control_sensors_present & VISION:
            return bool(
                system.onboard_control_sensors_enabled & system.onboard_control_sensors_health & VISION
            )
        aided = bool(estimator.flags & mavlink.ESTIMATOR_PRED_POS_HORIZ_REL)
        by_gps = bool(estimator.flags & mavlink.ESTIMATOR_PRED_POS_HORIZ_ABS)
        control = _control(facts)
        requested = control is None or bool(control & _POSITION)
        distance_m = facts.comparison.distance_m
        return aided and requested and distance_m < FAR_M and not (by_gps and distance_m > NEAR_M)

    def why_not_fused(self, facts: Facts) -> str:
        """By EKF2_EV_CTRL, as far as it is known."""
        control = _control(facts)
        if control is not None and control & _WANTED != _WANTED:
            return f"EKF2_EV_CTRL is {control}: set it to 15, then restart the vehicle"
        if facts.sent == 0:
            return "let the source send"
        return "see the innovation ratio and the axes below; has its estimator started? Restart it"

    def used_in_part(self, facts: Facts) -> tuple[str, str] | None:
        """By EKF2_EV_CTRL; velocities need not be used."""
        control = _control(facts)
        if control is None or not ~control & _WANTED & ~_VELOCITY:
            return None
        return f"EKF2_EV_CTRL is {control}", "set it to 15"

    def settings(self, facts: Facts) -> Checks:
        """The reference of height."""
        reference = facts.record.parameters.get("EKF2_HGT_REF")
        if reference is not None and int(reference) != _HEIGHT_BY_VISION:
            yield note("height", f"EKF2_HGT_REF is {reference:g}, not vision", "set it to 3")

    def heading_advice(self, facts: Facts) -> tuple[str, str]:
        """By EKF2_EV_CTRL."""
        control = _control(facts)
        if control is not None and not control & _YAW:
            return "it is not that of the poses", "set EKF2_EV_CTRL to 15 and EKF2_MAG_TYPE to 5"
        return "", "choose --frame or --forward; without a compass restart the vehicle"

    def delay(self, facts: Facts) -> Checks:
        """EKF2_EV_DELAY, after TIMESYNC has converged."""
        delay_s = facts.comparison.delay_s
        given_ms = facts.record.parameters.get("EKF2_EV_DELAY", 0.0)
        words = f"poses are {delay_s * 1000:.0f} ms older than their time stamps"
        if abs(delay_s - given_ms / 1000.0) <= DELAY_S:
            yield good("delay", words)
        else:
            wanted_ms = max(0.0, delay_s * 1000)
            advice = f"EKF2_EV_DELAY is {given_ms:g} ms: set it to {wanted_ms:.0f}, or use --delay"
            yield note("delay", words, advice)
        if not facts.converts_stamps:
            text = "the vehicle has not got 500 answers to TIMESYNC yet: until then it uses times of arrival"
            yield note("time stamps", text, "")


def _control(facts: Facts) -> int | None:
    """EKF2_EV_CTRL; None: the vehicle has not told."""
    value = facts.record.parameters.get("EKF2_EV_CTRL")
    return None if value is None else int(value)
