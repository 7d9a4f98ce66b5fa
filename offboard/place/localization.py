"""Where the drone is, where it was when an image was exposed, and where that is in the axes of flight."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import inf

from framerunner.geometry.vectors import Vec3
from offboard.drone import DroneState
from offboard.navigation.camera_model import CameraModel
from offboard.navigation.gates.gate_map import GateMap
from offboard.navigation.pose_history import DronePose, PoseCorrection, PoseHistory
from offboard.navigation.view import GateEstimate, Surroundings
from offboard.place.base_landmark import BaseLandmark
from offboard.place.flight_axes import DroneAndGates, FlightAxes
from offboard.place.place import PlaceEstimator
from vision.types import BaseExpectation, Detections


@dataclass(frozen=True, slots=True)
class ImagePose:
    """Of an image.

    Attributes:
        pose: of the drone when it was exposed.
        correction: of that pose, if the image can correct the drone's place.
    """

    pose: DronePose
    correction: PoseCorrection | None


class Localization:
    """The drone's poses by what the vehicle reports and what images show.

    Each tick: `add` the state, `pose_of` and `use` for each image, then `finish`.
    """

    def __init__(self, surroundings: Surroundings) -> None:
        camera = self._camera = CameraModel.of(surroundings.camera)
        self._history = PoseHistory(camera)
        self._place = PlaceEstimator(camera, surroundings.shapes, alone=surroundings.alone)
        self._base = BaseLandmark(camera, surroundings.base)
        self._axes = FlightAxes()
        self._before: DroneAndGates | None = None  # images changed the place in this tick

    def add(self, state: DroneState) -> None:
        """Add the state of a tick."""
        self._place.add(state)
        expected = self._place.correction(state.time_us)
        if expected is not None:
            self._before = DroneAndGates(expected.position_m, self._place.gates_m)
        for earlier in state.missed:
            self._history.add(earlier)
        self._history.add(state)

    def pose_of(self, image_us: int) -> ImagePose | None:
        """The pose when an image was exposed; None if the states around it are missing."""
        is_there = self._place.advance(image_us)
        correction = self._place.correction(image_us)
        pose = self._history.at(image_us, correction)
        return None if pose is None else ImagePose(pose, correction if is_there else None)

    def poses_of_rows(self, image: Detections, pose: DronePose) -> list[DronePose] | None:
        """With a rolling shutter, the drone's pose when each gate's middle row was read out."""
        if self._camera.readout_s == 0.0:
            return None
        poses = []
        for sighting in image.frames:
            rows = [corner.down_px for corner in sighting.corners if corner is not None]
            at = self._pose_of_row(sum(rows) / len(rows) if rows else 0.0, pose)
            poses.append(pose if at is None else replace(at, time_us=pose.time_us))
        return poses

    def use(
        self, image: Detections, at: ImagePose, poses: Sequence[DronePose] | None, gates: GateMap
    ) -> None:
        """Correct the place by what an image shows.

        Args:
            image: what it showed.
            at: its pose.
            poses: those of `poses_of_rows`.
            gates: the map, which has used the image.
        """
        if at.correction is None:
            return
        poses = [at.pose] * len(image.frames) if poses is None else poses
        self._place.see(image.frames, poses, at.correction, gates)
        self._see_base(image, at.pose, at.correction)
        self._see_tracks(image, at.pose)

    def finish(self, time_us: int) -> frozenset[str] | None:
        """End a tick: let the axes of flight take in by what it has corrected the place.

        Returns:
            Colours of the gates in the filter; None while the vehicle's reports are used.
        """
        self._place.advance()
        before, now = self._before, self._place.correction(time_us)
        if before is None or now is None:
            return None
        gates_m = self._place.gates_m
        self._axes.correct(before, DroneAndGates(now.position_m, gates_m), time_us)
        return frozenset(gates_m)

    def state(self, reported: DroneState) -> DroneState:
        """The drone's state now, by all that is known."""
        return self._place.state(reported)

    def known(self, estimate: GateEstimate) -> GateEstimate:
        """See `PlaceEstimator.known`."""
        return self._place.known(estimate)

    def stay_by(self, colour: str) -> None:
        """The drone is flown by a gate at this tick: see `FlightAxes`."""
        self._axes.stay_by(colour)

    def gate_in_flight(self, known: GateEstimate) -> GateEstimate:
        """A gate in the axes of flight."""
        return replace(known, position_m=self._axes.of(known.position_m))

    def state_in_flight(self, state: DroneState) -> DroneState:
        """The drone's state in the axes of flight, which are the arena's if the vehicle knows its place."""
        return self._axes.of_state(state)

    @property
    def velocity_error_flu_m_s(self) -> Vec3:
        """See `PlaceEstimator.velocity_error_flu_m_s`."""
        return self._place.velocity_error_flu_m_s

    def expected_base(self, time_us: int) -> BaseExpectation | None:
        """Where the base is to be looked for in an image; None if it need not be, or is out of view."""
        std = self._place.std
        pose = None if std is None else self._history.at(time_us, self._place.correction(time_us))
        return None if std is None or pose is None else self._base.expected(pose, std)

    def base_known(self, since_us: int) -> tuple[int, float] | None:
        """How often the base was seen since a time, and how well the place is known in plan, metres.

        None: the vehicle knows its place, so the base need not be looked at.
        """
        known = self._place.std is not None
        return (self._base.sightings(since_us), self.plan_std_m) if known else None

    @property
    def plan_std_m(self) -> float:
        """Standard deviation of the place in plan, where it is larger; 0 if the vehicle knows its place."""
        std = self._place.std
        return 0.0 if std is None else float(std[:2].max())

    def forget(self, colour: str) -> None:
        """Drop a gate from the filter."""
        self._place.forget(colour)

    def doubt(self) -> None:
        """See `PlaceEstimator.doubt`."""
        self._place.doubt()

    def _pose_of_row(self, down_px: float, pose: DronePose) -> DronePose | None:
        """The drone's pose when a row of an image was read out; None if the states around it are missing."""
        at_us = pose.time_us + round(1e6 * self._camera.read_after_s(down_px))
        return self._history.at(at_us, self._place.correction(at_us))

    def _see_tracks(self, image: Detections, pose: DronePose) -> None:
        correction = self._place.correction(pose.time_us)
        if image.tracks is not None and correction is not None:
            rows = (self._pose_of_row(row_px, pose) for row_px in (-inf, 0.0, inf))
            self._place.see_tracks(image.tracks, [each or pose for each in rows], correction)

    def _see_base(self, image: Detections, pose: DronePose, correction: PoseCorrection) -> None:
        sighting, base = image.base, self._base
        correction = self._place.correction(pose.time_us) or correction  # gates may have changed it
        if sighting is None:
            return
        pose = self._pose_of_row(base.row_px(sighting), pose) or pose
        if self._place.see_points(base.points_m(sighting), sighting, pose, correction):
            base.seen_us.append(pose.time_us)
