"""Poses for ArduPilot, which EKF3 fuses as external navigation.

They are sent as VISION_POSITION_ESTIMATE, or as ODOMETRY if they have a velocity: ArduPilot takes
ODOMETRY only in MAV_FRAME_LOCAL_FRD and with a velocity. It counts time stamps from the quickest pose of some
seconds, so a constant delay of all of them has no effect: it is a parameter, VISO_DELAY_MS.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import pi, sqrt
from types import MappingProxyType

from framerunner.mocap.facts import (
    DELAY_S,
    FAR_M,
    VISION,
    Facts,
    SendSettings,
)
from framerunner.mocap.pose_messages import odometry, vision_position
from framerunner.mocap.poses import MeasuredPose
from framerunner.wire.ardupilot_messages import (
    EKF_STATUS_REPORT_ID,
    EXTERNAL_NAVIGATION,
    POSE_ARRIVAL_EARLY_MS,
)
from framerunner.wire.dialect import Message, mavlink
from offboard.safety.check import Check, Checks, Outcome, good, missing, note

_FAR_DELAY_S = 0.05  # 5 cm at 1 m/s
_MAX_DELAY_MS = 250.0
_MAX_POSITION_NOISE_M, _MAX_YAW_NOISE_RAD = 0.05, 0.1
_VELOCITIES = ("EK3_SRC1_VELXY", "EK3_SRC1_VELZ")


@dataclass(frozen=True, slots=True)
class _Rule:
    """A parameter and the values that let the poses be used."""

    name: str
    text: str  # what another value means
    allowed: tuple[int, ...] = (EXTERNAL_NAVIGATION,)
    advice: str = "set it to 6"
    judge: Callable[[str, str, str], Check] = missing


_RULES = (
    _Rule("AHRS_EKF_TYPE", "its estimator is not EKF3", (3,), "set it to 3"),
    _Rule("VISO_TYPE", "it takes no poses by MAVLink", (1,), "set it to 1, then restart the vehicle"),
    _Rule("VISO_SCALE", "it multiplies positions by this", (1,), "set it to 1"),
    _Rule("EK3_SRC1_POSXY", "its position is not that of the poses"),
    _Rule("EK3_SRC1_POSZ", "its height is not that of the poses", judge=note),
    _Rule("EK3_SRC1_YAW", "its heading is not that of the poses", judge=note),
    *(
        _Rule(
            name,
            "its velocity is from another sensor",
            (0, EXTERNAL_NAVIGATION),
            "set it to 0, or to 6 if the source has velocities",
        )
        for name in _VELOCITIES
    ),
)


class ArduPilotPoses:
    """ArduPilot, by EKF3 and its visual odometry of the type MAVLink."""

    name = "ArduPilot"
    guide = "docs/ardupilot.md, section 5"
    parameters: tuple[str, ...] = (
        *(rule.name for rule in _RULES),
        *("VISO_DELAY_MS", "VISO_POS_M_NSE", "VISO_YAW_M_NSE", "VISO_QUAL_MIN", "INS_GYRO_FILTER"),
    )
    streams_hz: Mapping[int, float] = MappingProxyType(
        {
            mavlink.MAVLINK_MSG_ID_ATTITUDE: 50.0,
            mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED: 30.0,
            EKF_STATUS_REPORT_ID: 2.0,
            mavlink.MAVLINK_MSG_ID_SYS_STATUS: 2.0,
        }
    )
    truth = mavlink.MAVLINK_MSG_ID_SIM_STATE
    estimator = "EKF_STATUS_REPORT"
    needs_origin = True

    def pose_message(self, pose: MeasuredPose, stamp_us: int, settings: SendSettings) -> Message:
        """ODOMETRY in FRD if the source has velocities, else VISION_POSITION_ESTIMATE."""
        if pose.velocity_ned_m_s is None:
            return vision_position(pose, stamp_us, settings)
        return odometry(pose, stamp_us, settings, mavlink.MAV_FRAME_LOCAL_FRD)

    def is_fused(self, facts: Facts) -> bool | None:
        """Poses arrive, external navigation is its source, it has a position, and that is where they say."""
        report, parameters = facts.record.estimator, facts.record.parameters
        system = facts.record.latest.get("SYS_STATUS")
        if report is None:
            return None
        arrive = system is None or bool(system.onboard_control_sensors_health & VISION)
        source = parameters.get("EK3_SRC1_POSXY", EXTERNAL_NAVIGATION)
        near = facts.comparison.distance_m < FAR_M
        return arrive and source == EXTERNAL_NAVIGATION and report.has_position and near

    def why_not_fused(self, facts: Facts) -> str:
        """By its parameters, whether poses arrive, and its estimator's state."""
        if any(finding.outcome is Outcome.FAIL for finding in _wrong_parameters(facts)):
            return "set the parameters that are named below"
        if facts.sent == 0:
            return "let the source send"
        system, report = facts.record.latest.get("SYS_STATUS"), facts.record.estimator
        if system is not None and not system.onboard_control_sensors_health & VISION:
            return "no poses arrive now: see the poses above, and whether the link is fast enough"
        if report is not None and not report.has_position:
            return "keep it still for half a minute after its start; then see the axes below"
        return "see the innovation ratio and the axes below"

    def used_in_part(self, facts: Facts) -> tuple[str, str] | None:
        """Never: each parameter has its own line."""
        return None

    def settings(self, facts: Facts) -> Checks:
        """Its parameters, one line for each that is wrong, and --delay."""
        found, parameters = list(_wrong_parameters(facts)), facts.record.parameters
        yield from found
        unknown = [rule.name for rule in _RULES if rule.name not in parameters]
        if len(unknown) == len(_RULES):
            yield missing("parameters", "none was received", "check that the link is not read-only")
        elif unknown == ["VISO_TYPE"]:
            yield missing(
                "VISO_TYPE", "the vehicle has no such parameter", "use a firmware with visual odometry"
            )
        elif unknown:
            yield note("parameters", f"not received yet: {', '.join(unknown)}", "wait some seconds")
        elif not found:
            yield good("parameters", "position, height and heading are taken from the poses")
        if facts.settings.delay_s:
            text = "has no effect: ArduPilot measures times from the quickest pose"
            yield note("--delay", text, "leave it out and set VISO_DELAY_MS")

    def heading_advice(self, facts: Facts) -> tuple[str, str]:
        """By EK3_SRC1_YAW."""
        if facts.record.parameters.get("EK3_SRC1_YAW", EXTERNAL_NAVIGATION) != EXTERNAL_NAVIGATION:
            return "it is not that of the poses", "set EK3_SRC1_YAW to 6"
        return "", "choose --frame or --forward, then restart the vehicle"

    def delay(self, facts: Facts) -> Checks:
        """VISO_DELAY_MS against the age of poses on their arrival."""
        behind_gyro_s = facts.comparison.delay_s + facts.settings.delay_s + facts.transit_s
        age_s = behind_gyro_s + _gyro_delay_s(facts.record.parameters.get("INS_GYRO_FILTER", 0.0))
        wanted_ms = min(_MAX_DELAY_MS, max(0.0, age_s * 1000 - POSE_ARRIVAL_EARLY_MS))
        given_ms = facts.record.parameters.get("VISO_DELAY_MS")
        words = f"poses are {round(age_s * 1000)} ms old on their arrival"
        if given_ms is None:
            yield note("delay", words, f"set VISO_DELAY_MS to {wanted_ms:.0f}")
            return
        wrong_s = abs(wanted_ms - given_ms) / 1000.0
        if wrong_s <= DELAY_S:
            yield good("delay", words)
            return
        advice = f"VISO_DELAY_MS is {given_ms:g}: set it to {wanted_ms:.0f}, then restart the vehicle"
        yield (missing if wrong_s > _FAR_DELAY_S else note)("delay", words, advice)


def _gyro_delay_s(cutoff_hz: float) -> float:
    """By how much the body rates of ATTITUDE are late: they pass a Butterworth filter of second order."""
    return sqrt(2.0) / (2.0 * pi * cutoff_hz) if cutoff_hz > 0.0 else 0.0


def _wrong_parameters(facts: Facts) -> Checks:
    parameters = facts.record.parameters
    for rule in _RULES:
        value = parameters.get(rule.name)
        if value is not None and value not in rule.allowed:
            yield rule.judge(rule.name, f"{value:g}: {rule.text}", rule.advice)
    if facts.sent and not facts.has_velocity:
        for name in _VELOCITIES:
            if parameters.get(name) == EXTERNAL_NAVIGATION:
                yield missing(
                    name, "6: it waits for velocities, which the source does not send", "set it to 0"
                )
        quality = parameters.get("VISO_QUAL_MIN", 0.0)
        if quality > 0.0:
            text = f"{quality:g}: it rejects poses without a quality, as those without velocity are"
            yield missing("VISO_QUAL_MIN", text, "set it to 0")
    noises = (
        ("VISO_POS_M_NSE", "m", _MAX_POSITION_NOISE_M, "0.02"),
        ("VISO_YAW_M_NSE", "rad", _MAX_YAW_NOISE_RAD, "0.05"),
    )
    for name, unit, highest, wanted in noises:
        noise = parameters.get(name, 0.0)
        if noise > highest:
            text = f"{noise:g} {unit}: it follows poses slowly, however exact they are"
            yield note(name, text, f"set it to {wanted} for poses as good as that")
