"""The detector with which a plan's mission sees, and the calibration of its camera."""

from __future__ import annotations

from framerunner.flying.plan import FlightPlan
from scenarios.imaging.effects import CameraEffects
from scenarios.models import Base, Camera
from vision.base.detector import DetectorWithBase, FindsBase
from vision.base.finder import BaseFinder
from vision.base.markers import MarkerReader
from vision.base.model import BaseShape
from vision.calibration.lens import Lens
from vision.calibration.model import Calibration
from vision.detectors import Detector, DetectorMaker, new_detector, others_detector
from vision.tracks.tracker import DetectorWithTracks, PointTracker


def plan_detector(plan: FlightPlan) -> Detector:
    """Make the detector of a plan; without a mission, the paper's.

    Args:
        plan: its scenario has the camera, and it may have a calibration and a detector of its own.

    Raises:
        DetectorError, ExtensionError: a detector of others cannot be made.
    """
    others = others_of(plan)
    calibration = plan.calibration or true_calibration(plan.scenario.camera)
    if others is not None:
        return _with_base(others_detector(others, calibration, plan.gate_shapes), plan, calibration)
    if plan.mission is None or plan.mission.vision == "boxes":
        return new_detector("boxes", shapes=plan.gate_shapes)  # with the paper's focal length
    detector = new_detector(plan.mission.vision, calibration=calibration, shapes=plan.gate_shapes)
    return _with_base(detector, plan, calibration)


def _with_base(detector: Detector, plan: FlightPlan, calibration: Calibration) -> Detector:
    """A detector that looks for the base, too; a drone that starts from the floor has none."""
    if plan.mission is None or plan.mission.vision == "boxes":
        return detector
    if plan.alone:
        lens = None if calibration.is_ideal else Lens(calibration)
        detector = DetectorWithTracks(detector, PointTracker(lens))
    if plan.lift_m:
        return detector
    return DetectorWithBase(detector, base_finder(plan.scenario.base, calibration))


def others_of(plan: FlightPlan) -> str | DetectorMaker | None:
    """The detector of others with which a plan's mission sees; None: it is one of ours."""
    return plan.detector or (None if plan.mission is None else plan.mission.detector or None)


def base_finder(base: Base, calibration: Calibration) -> FindsBase:
    """What looks for a scenario's base: by the markers on it if it has some, which hide its plain faces."""
    lens = None if calibration.is_ideal else Lens(calibration)
    if base.marker is not None:
        return MarkerReader(base.marker.markers, base.edge_m, base.top_m, lens)
    return BaseFinder(base_shape(base), calibration.fx_px, lens)


def base_shape(base: Base) -> BaseShape:
    """The size of a scenario's base, as it is looked for in images."""
    return BaseShape(base.edge_m, base.top_m, base.mark_share * base.edge_m)


def true_calibration(camera: Camera) -> Calibration:
    """The calibration of a scenario's simulated camera, without error."""
    effects = camera.effects or CameraEffects()
    ideal = Calibration.ideal(camera.width_px, camera.height_px, camera.focal_px, effects.lens.coefficients)
    return ideal.model_copy(update={"readout_s": effects.readout_s})
