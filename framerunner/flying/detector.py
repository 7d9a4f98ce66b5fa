"""The detector with which a plan's mission sees."""

from __future__ import annotations

from framerunner.flying.plan import FlightPlan
from offboard.navigation.camera_model import CameraModel
from vision.detectors import Detector, new_detector


def plan_detector(plan: FlightPlan, *, rendered: bool) -> Detector:
    """Make the detector of a plan; without a mission, the paper's.

    Args:
        plan: its scenario has the camera.
        rendered: the images are the simulator's, not a real camera's.
    """
    if plan.mission is None or plan.mission.vision == "boxes":
        return new_detector("boxes")  # with the paper's focal length
    focal_px = CameraModel.of(plan.scenario.camera).focal_px
    return new_detector(plan.mission.vision, focal_px=focal_px, rendered=rendered)
