"""The detector with which a plan's mission sees, and the calibration of its camera."""

from __future__ import annotations

from framerunner.flying.plan import FlightPlan
from scenarios.imaging.effects import CameraEffects
from scenarios.models import Camera
from vision.calibration.model import Calibration
from vision.detectors import Detector, DetectorMaker, new_detector, others_detector


def plan_detector(plan: FlightPlan) -> Detector:
    """Make the detector of a plan; without a mission, the paper's.

    Args:
        plan: its scenario has the camera, and it may have a calibration and a detector of its own.

    Raises:
        DetectorError, ExtensionError: a detector of others cannot be made.
    """
    others = others_of(plan)
    if others is not None:
        return others_detector(others, plan.calibration or true_calibration(plan.scenario.camera))
    if plan.mission is None or plan.mission.vision == "boxes":
        return new_detector("boxes", shapes=plan.gate_shapes)  # with the paper's focal length
    calibration = plan.calibration or true_calibration(plan.scenario.camera)
    return new_detector(plan.mission.vision, calibration=calibration, shapes=plan.gate_shapes)


def others_of(plan: FlightPlan) -> str | DetectorMaker | None:
    """The detector of others with which a plan's mission sees; None: it is one of ours."""
    return plan.detector or (None if plan.mission is None else plan.mission.detector or None)


def true_calibration(camera: Camera) -> Calibration:
    """The calibration of a scenario's simulated camera, without error."""
    effects = camera.effects or CameraEffects()
    ideal = Calibration.ideal(camera.width_px, camera.height_px, camera.focal_px, effects.lens.coefficients)
    return ideal.model_copy(update={"readout_s": effects.readout_s})
