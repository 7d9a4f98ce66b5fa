"""Where the drone is: as its vehicle reports it while that knows, then as the filter estimates it.

A vehicle with motion capture knows its place and its heading, and tells that by standard deviations that stay
small. For one that does not, from its first state on or since it has lost its motion capture, the filter
estimates the place, with the gates as landmarks.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import replace
from math import hypot, inf, pi, radians, remainder, sqrt

import numpy as np

from framerunner.geometry.gate_shape import GateShapes
from framerunner.geometry.vectors import Vec3, turned
from offboard.drone import SURE_OF_POSITION_M, DroneState, PlaceEstimate, ReportedAccuracy
from offboard.navigation.camera_model import CameraModel
from offboard.navigation.gates.gate_map import GateMap
from offboard.navigation.gates.gate_measurement import GateView, view_of
from offboard.navigation.pose_history import DronePose, PoseCorrection, turned_by
from offboard.navigation.view import GateEstimate
from offboard.place.inertial_track import InertialTrack
from offboard.place.landmarks import GateLandmarks
from offboard.place.measurements import Eye, height, points, report, stands
from offboard.place.place_filter import (
    POSITION,
    TURN,
    TURN_RAD,
    TURN_SETTLING_RAD,
    VELOCITY,
    Floats,
    PlaceFilter,
)
from offboard.place.point_tracks import PointWindow
from vision.types import BaseSighting, GateSighting, PointTracks

# A place that is known so many times worse than at the start is not known, if it is known worse than this.
SURE_FACTOR = 2.0
ALWAYS_SURE_M = 0.01
SURE_RAD = 0.02

LATE_US = 300_000  # of images; the filter stays so far behind the present when none come
SETTLING_US = 3_000_000  # after take-off, in which a vehicle corrects its heading

STOOD_US = 300_000  # before the vehicle says that it has left the ground
STANDS_M_S = 0.1  # reported by a vehicle that has left the ground and does not say so yet
STANDS_STD = (0.003, 0.003, 0.01)  # metres, radians, metres a second

# The vehicle's errors are slow: those of reports in so long are one error. The noise of each report is larger
# by that, as if they were independent.
ERROR_S = 2.0
LEAST_POSITION_STD_M = 0.005
LEAST_VELOCITY_STD_M_S = 0.03
LEAST_HEIGHT_STD_M = 0.05
HEIGHT_FACTOR = 2.0  # a height farther off than so many deviations is known less well than the vehicle says

RESET_TURN_RAD = radians(3.0)
BLIND_M = 0.1  # of the reported way in a gap of the IMU's samples, per root of a second
BLIND_M_S = 0.3  # of the velocity after it

POINTS_GATE = 30.0  # squared distance that fits; corners of a rigid cube have six degrees of freedom
POINTS_STD_FACTOR = 2.0  # of corners: the errors of images from nearly the same place are not independent
POINTS_MISFITS = 4  # in a row: known points tell that the estimate is wrong, and that is less well known then
MISFIT_M, MISFIT_RAD = (0.2, 0.2, 0.05), radians(4.0)
UNSEEN_M, UNSEEN_RAD = (0.5, 0.5, 0.05), radians(4.0)
IMAGE_STD_M = 0.001


class PlaceEstimator:
    """Estimates the drone's place from its states, and from the gates and known points that images show.

    Args:
        camera: of the drone.
        shapes: of the gates of each colour.
        alone: the vehicle knows its place and its heading from this estimate only, so what it reports of
            them, beside the height, says nothing; followed points do.
    """

    def __init__(self, camera: CameraModel, shapes: GateShapes, *, alone: bool = False) -> None:
        self._camera, self._shapes = camera, shapes
        self._points = PointWindow(camera.focal_px) if alone else None
        self._track = InertialTrack()
        self._filter: PlaceFilter | None = None
        self._reports: deque[tuple[int, DroneState, ReportedAccuracy]] = deque()
        self._last: DroneState | None = None
        self._start: DroneState | None = None
        self._first_std_m: float | None = None
        self._left_us: int | None = None  # when the drone left the ground
        self._landmarks = GateLandmarks()
        self._fused_us = 0
        self._misfits = 0  # of known points, in a row

    def add(self, state: DroneState) -> None:
        """Take in a state as the vehicle reports it; call it once a tick, before images are used.

        All begins when the vehicle is armed: how much of its telemetry has come before is a matter of chance.
        """
        if self._start is None:
            self._start = state
        if self._last is None and not state.armed:
            return
        track, last, place = self._track, self._last, self._filter
        if place is not None and last is not None and track.is_interrupted(state.imu, state.time_us):
            self.advance(last.time_us)
            self._bridge(place, last, state)
            self._last = state
        if not state.imu:
            return
        continued = track.add(state.imu, state.time_us, state.attitude_arena)
        position_us = state.time_us - round(state.position_age_s * 1e6)
        if not state.landed and self._left_us is None:
            self._left_us = state.time_us
        if self._filter is None and continued and not self._is_sure(state):
            self._filter = PlaceFilter(position_us, (state.x, state.y, state.z), state.velocity_arena_m_s)
        place = self._filter
        accuracy = state.accuracy
        if place is not None and accuracy is not None:
            if last is not None and _resets(last) != _resets(state):
                place.p[TURN, TURN] += RESET_TURN_RAD**2
            for each in (*state.missed, state):
                at_us = each.time_us - round(each.position_age_s * 1e6)
                if not self._reports or at_us > self._reports[-1][0]:
                    self._reports.append((at_us, each, accuracy))
        self._last = state

    def _is_sure(self, state: DroneState) -> bool:
        """Whether the vehicle knows its place and its heading, by what it tells."""
        accuracy = state.accuracy
        if self._points is not None:
            return False
        return accuracy is None or (self._knows_position(accuracy) and accuracy.heading_std_rad < SURE_RAD)

    def _knows_position(self, accuracy: ReportedAccuracy) -> bool:
        if self._first_std_m is None:
            self._first_std_m = accuracy.position_std_m
        return accuracy.position_std_m < min(
            SURE_OF_POSITION_M, max(ALWAYS_SURE_M, SURE_FACTOR * self._first_std_m)
        )

    def _bridge(self, place: PlaceFilter, last: DroneState, state: DroneState) -> None:
        """Go on while the IMU's samples are missing: by how far the vehicle reports to have moved."""
        if self._points is not None:
            self._points.forget(place)
        gap_s = max(0.0, (state.time_us - place.time_us) * 1e-6)
        x, y = turned(state.x - last.x, state.y - last.y, place.turn_rad)
        place.displace(state.time_us, (x, y, state.z - last.z), BLIND_M * sqrt(gap_s), BLIND_M_S)
        place.update(report(state.velocity_arena_m_s, BLIND_M_S, BLIND_M_S))
        self._reports.clear()

    def advance(self, time_us: int | None = None) -> bool:
        """Bring the filter to the time of an image, or as far behind the present as images may be late.

        Returns:
            Whether it is there now: not if it is beyond that time already, or samples are missing.
        """
        place, last = self._filter, self._last
        if place is None or last is None:
            return False
        at_us = last.time_us - LATE_US if time_us is None else time_us
        reports = self._reports
        while reports and reports[0][0] <= at_us:
            report_us, state, accuracy = reports.popleft()
            if report_us >= place.time_us and self._predict(place, report_us):
                self._use(place, state, accuracy, report_us)
        return self._predict(place, at_us)

    def _predict(self, place: PlaceFilter, time_us: int) -> bool:
        if time_us <= place.time_us:
            return time_us == place.time_us
        motion = self._track.between(place.time_us, time_us)
        if motion is None:
            return False
        place.predict(motion, inf if self._points is not None else _heading_std_rad(self._left_us, time_us))
        place.time_us = time_us
        return True

    def _use(self, place: PlaceFilter, state: DroneState, accuracy: ReportedAccuracy, time_us: int) -> None:
        """Fuse what a state reports of a time."""
        start = self._start
        assert start is not None, "the filter begins with a state"
        step_s = min(max((time_us - self._fused_us) * 1e-6, 0.01), 0.2)
        self._fused_us = time_us
        stood = self._left_us is None or time_us < self._left_us - STOOD_US
        if stood and hypot(*state.velocity_arena_m_s) < STANDS_M_S:
            turn_rad = remainder(start.yaw - state.yaw, 2 * pi)
            place.update(stands((start.x, start.y, start.z), turn_rad, *STANDS_STD))
            return
        height_std_m = max(accuracy.height_std_m, LEAST_HEIGHT_STD_M)
        if self._points is not None:
            place.update(height(state.z, height_std_m))
            return
        slow = sqrt(2.0 * ERROR_S / step_s)
        height_std_m = slow * max(height_std_m, abs(state.z - float(place.x[2])) / HEIGHT_FACTOR)
        level, climb = (
            slow * max(std, LEAST_VELOCITY_STD_M_S)
            for std in (accuracy.velocity_std_m_s, accuracy.climb_std_m_s)
        )
        knows = self._knows_position(accuracy)
        place.update(
            report(
                state.velocity_arena_m_s,
                level,
                climb,
                position_m=(state.x, state.y, state.z),
                height_std_m=height_std_m,
                position_std_m=slow * max(accuracy.position_std_m, LEAST_POSITION_STD_M) if knows else inf,
            )
        )

    def _motion_at(self, time_us: int) -> tuple[Vec3, Vec3, float] | None:
        """Position, velocity and turn at a time; None while the vehicle's reports are used."""
        place = self._filter
        if place is None:
            return None
        motion = self._track.between(place.time_us, time_us)
        if motion is None:
            x, y, z = place.x[VELOCITY].tolist()
            step_s = (time_us - place.time_us) * 1e-6
            px, py, pz = place.x[POSITION].tolist()
            return (px + step_s * x, py + step_s * y, pz + step_s * z), (x, y, z), place.turn_rad
        return *place.moved(motion), place.turned_rad(
            motion, inf if self._points is not None else _heading_std_rad(self._left_us, time_us)
        )

    def correction(self, time_us: int) -> PoseCorrection | None:
        """Of a pose at a time; None while the vehicle's reports are used."""
        motion = self._motion_at(time_us)
        return None if motion is None else PoseCorrection(motion[0], motion[2], IMAGE_STD_M)

    def state(self, reported: DroneState) -> DroneState:
        """The drone's state now."""
        place, motion = self._filter, self._motion_at(reported.time_us)
        if place is None or motion is None:
            return reported
        (x, y, z), velocity_m_s, turn_rad = motion
        yaw, camera = remainder(reported.yaw + turn_rad, 2 * pi), reported.camera_attitude_arena
        covariance = place.covariance(reported.time_us)
        covariance_m2, yaw_std_rad = covariance[:3, :3].ravel().tolist(), sqrt(covariance[TURN, TURN])
        return replace(
            reported,
            x=x,
            y=y,
            z=z,
            yaw=yaw,
            velocity_arena_m_s=velocity_m_s,
            position_age_s=0.0,
            attitude_arena=turned_by(turn_rad, reported.attitude_arena),
            camera_attitude_arena=None if camera is None else turned_by(turn_rad, camera),
            estimate=PlaceEstimate((x, y, z), yaw, tuple(covariance_m2), yaw_std_rad),
        )

    @property
    def gates_m(self) -> dict[str, Vec3]:
        """Where the gates are that the filter has and knows to be gates, by colour."""
        place = self._filter
        found: dict[str, Vec3] = {}
        if place is None:
            return found
        for colour, at in place.gates.items():
            if colour not in self._landmarks.unsized:
                x, y, z = place.x[at : at + 3].tolist()
                found[colour] = (x, y, z)
        return found

    @property
    def velocity_error_flu_m_s(self) -> Vec3:
        """By what the reported velocity is wrong, in level axes turned with the yaw.

        A vehicle that flies a commanded velocity flies that much less.
        """
        place, state = self._filter, self._last
        if place is None or state is None:
            return (0.0, 0.0, 0.0)
        motion = self._motion_at(state.time_us - round(state.position_age_s * 1e6))
        assert motion is not None, "there is a filter"
        (x, y, z), (_, velocity_m_s, turn_rad) = state.velocity_arena_m_s, motion
        ahead, left = turned(x, y, -state.yaw)
        true_ahead, true_left = turned(velocity_m_s[0], velocity_m_s[1], -state.yaw - turn_rad)
        return (ahead - true_ahead, left - true_left, z - velocity_m_s[2])

    def see(
        self,
        sightings: Sequence[GateSighting],
        poses: Sequence[DronePose],
        at: PoseCorrection,
        gates: GateMap,
    ) -> None:
        """Use the gates in an image, to whose time the filter was brought, after the map has used them.

        Args:
            sightings: in the image.
            poses: corrected, of the drone when each was read out.
            at: the correction of these poses.
            gates: the map.
        """
        place = self._filter
        if place is None:
            return
        by_colour: dict[str, list[tuple[GateView, Eye]]] = {}
        for sighting, pose in zip(sightings, poses, strict=True):
            view = view_of(sighting, self._shapes.of(sighting.colour), self._camera, pose)
            if view is not None:
                by_colour.setdefault(sighting.colour, []).append((view, self._eye(pose, at)))
        self._landmarks.see(place, by_colour, gates)

    def see_tracks(self, tracks: PointTracks, rows: Sequence[DronePose], at: PoseCorrection) -> None:
        """Use followed points in an image, to whose time the filter was brought.

        Args:
            tracks: in the image.
            rows: corrected, of the drone when the first, the middle and the last row were read out.
            at: the correction of these poses.
        """
        if self._filter is not None and self._points is not None:
            eyes = [self._eye(pose, at) for pose in rows]
            self._points.see(self._filter, tracks, *eyes)

    def see_points(
        self, points_m: Floats, sighting: BaseSighting, pose: DronePose, at: PoseCorrection
    ) -> bool:
        """Use known points in an image, to whose time the filter was brought; whether they fit.

        Args:
            points_m: in the arena, shape (n, 3).
            sighting: of them.
            pose: corrected, of the drone when they were read out.
            at: the correction of the pose.
        """
        place = self._filter
        if place is None:
            return False
        covariance = POINTS_STD_FACTOR**2 * sighting.covariance_px2
        model = points(points_m, sighting.pixels, covariance, self._eye(pose, at), pose.attitude_std_rad)
        if place.update(model, POINTS_GATE):
            self._misfits = 0
            return True
        self._misfits += 1
        if self._misfits >= POINTS_MISFITS:
            self._misfits = 0
            place.doubt(MISFIT_M, MISFIT_RAD)
        return False

    def doubt(self) -> None:
        """What should be in view for long is not seen: the place is not known as well as it seems."""
        if self._filter is not None:
            self._filter.doubt(UNSEEN_M, UNSEEN_RAD)

    def forget(self, colour: str) -> None:
        """See `GateLandmarks.forget`."""
        if self._filter is not None:
            self._landmarks.forget(self._filter, colour)

    @property
    def std(self) -> Floats | None:
        """Standard deviations of x, y, z (metres) and the heading (radians); None if nothing is estimated."""
        return None if self._filter is None else np.sqrt(self._filter.p.diagonal()[:4])

    def _eye(self, pose: DronePose, at: PoseCorrection) -> Eye:
        """The carrier of a corrected pose, without the correction."""
        x, y, z = (a - b for a, b in zip(pose.position_m, at.position_m, strict=True))
        return Eye(
            self._camera,
            turned_by(-at.turn_rad, pose.attitude_arena),
            (*turned(x, y, -at.turn_rad), z),
        )

    def known(self, estimate: GateEstimate) -> GateEstimate:
        """A gate of the map, the best of its colour, as the filter has it: exact relative to the drone.

        One that the filter could have and has not is not certain: the map does not know how the drone drifts.
        """
        place, last = self._filter, self._last
        if place is None or last is None:
            return estimate
        if estimate.colour not in place.gates:
            return replace(estimate, certain=False) if last.imu else estimate
        return self._landmarks.known(place, estimate)


def _resets(state: DroneState) -> int:
    return 0 if state.accuracy is None else state.accuracy.resets


def _heading_std_rad(left_us: int | None, time_us: int) -> float:
    """Of the reported heading after a second; the vehicle corrects it after it has left the ground."""
    settling = left_us is None or time_us - left_us < SETTLING_US
    return TURN_SETTLING_RAD if settling else TURN_RAD
