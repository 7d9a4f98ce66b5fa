"""The map of gates: every gate seen is remembered, and each image makes its pose better known.

How it works is in docs/navigation.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, hypot, sin

import numpy as np

from framerunner.geometry.gate_shape import PAPER_GATE, GateShapes
from offboard.navigation.camera_model import CameraModel, CameraPose
from offboard.navigation.gates.gate_measurement import Floats, GateView, Prior, solutions, view_of
from offboard.navigation.gates.gate_track import CHI_SQUARED, Fit, GateTrack, load_filters
from offboard.navigation.gates.lookalikes import Lookalikes
from offboard.navigation.pose_history import DronePose
from offboard.navigation.search.likelihood import LineOfSight
from offboard.navigation.view import GateEstimate
from scenarios.models import Arena
from vision.types import Detections, ObstacleEdge

# All sizes are those of the challenge's gate.
# A gate that is nearer, less oblique and farther inside the image than this is found in all but few images.
SURELY_FOUND_M = 5.0
SURELY_FOUND_COSINE = 0.5
SURELY_FOUND_MARGIN_PX = 8.0
HIDING_MARGIN_PX = 4.0  # what comes nearer than this to a gate before it may be hidden
OBSTACLE_STEP_PX = 8.0  # likewise to an obstacle, of which every eighth column is known
BEHIND_M = 0.5  # an obstacle that seems so much farther away than a gate does not hide it
NEAR_PX = 8.0  # a sighting whose centre is this near to where a gate should be is of that gate,
NEAR_SHARE = 0.75  # or this share of its width
DUPLICATE_M = 0.25  # two gates cannot be nearer to each other,
SEEMED_M = 0.6  # a gate that is so near to where one seemed to be was seen there
DUPLICATE_CERTAIN_M = 0.6  # nor as near as this to a certain one: what seemed to be there was seen badly


class GateMap:
    """The gates seen so far.

    Args:
        camera: of the drone.
        arena: gates are in it.
        shapes: of the gates of each colour.

    Attributes:
        gates: all that were seen, of every colour, in the order in which they were found.
    """

    def __init__(self, camera: CameraModel, arena: Arena, shapes: GateShapes) -> None:
        self._camera = camera
        self._arena = arena
        self._shapes = shapes
        self._prior = Prior.of(arena)
        self._tracks: list[GateTrack] = []
        self._lookalikes = Lookalikes()
        self.gates: tuple[GateEstimate, ...] = ()
        self._best: dict[str, GateEstimate] = {}  # by colour
        self._best_tracks: dict[str, GateTrack] = {}
        self._largest_m = hypot(arena.length_x_m, arena.width_y_m)
        self._time_us = -1
        load_filters()

    def best(self, colour: str) -> GateEstimate | None:
        """The gate of a colour; the one best known if there are several, None if there is none."""
        return self._best.get(colour)

    def covariance(self, colour: str) -> Floats | None:
        """That of x, y, z and yaw of the best gate of a colour, shape (4, 4)."""
        track = self._best_tracks.get(colour)
        return None if track is None else track.covariance

    def forget(self, colour: str) -> None:
        """Drop the gate of a colour and what looked like one; it begins anew where it is seen next."""
        dropped = self._best_tracks.get(colour)
        self._tracks = [track for track in self._tracks if track is not dropped]
        self._lookalikes.forget(colour)
        self._estimate()

    def is_lookalike(self, colour: str, line: LineOfSight) -> bool:
        """Whether what is seen in a direction looks like a gate of a colour, and is known to be none."""
        return self._lookalikes.are_at(colour, line.origin_m, line.direction)

    def observe(
        self, detections: Detections, pose: DronePose, poses: Sequence[DronePose] | None = None
    ) -> None:
        """Use an image; one that is not later than the last is ignored.

        Args:
            detections: the gates in it.
            pose: of the drone when it was exposed.
            poses: with a rolling shutter, of the drone when the rows of each gate were read out.
        """
        if pose.time_us <= self._time_us:
            return
        self._time_us = pose.time_us
        for track in self._tracks:
            track.predict(pose.time_us)
        unseen = list(self._tracks)
        if poses is None:
            poses = [pose] * len(detections.frames)
        sightings = zip(detections.frames, poses, strict=True)
        seen = [
            view_of(sighting, self._shapes.of(sighting.colour), self._camera, at)
            for sighting, at in sightings
        ]
        views = [view for view in seen if view is not None]
        for view in self._match(views, unseen):
            if not self._lookalikes.shows(view):
                self._explain(view, unseen)
        camera = self._camera.pose(pose.position_m, pose.attitude_arena)
        for track in unseen:
            if self._should_be_seen(track, camera, detections.obstacle_edges):
                track.miss()
        self._tracks = [
            track
            for track in self._tracks
            if track.is_believed(pose.time_us) and track.keep_inside(self._arena)
        ]
        self._drop_duplicates()
        self._estimate()
        for view in views:
            self._compare_sizes(view)

    def _compare_sizes(self, view: GateView) -> None:
        """Gates that turn out to be larger or smaller things elsewhere are taken from the map."""
        best = self._best.get(view.colour)
        lookalike = None if best is not None and best.certain else self._lookalikes.note(view)
        if lookalike is None:
            return
        self._tracks = [
            track
            for track in self._tracks
            if track.colour != view.colour
            or np.linalg.norm(lookalike.seemed_m - track.state[:3], axis=1).min() > SEEMED_M
        ]
        self._estimate()

    def _estimate(self) -> None:
        """Note what is known of each gate now: it is asked for far more often than images come."""
        tracks = [track for track in self._tracks if track.is_inside(self._arena)]
        self.gates = tuple(track.estimate() for track in tracks)
        self._best = {}
        best = self._best_tracks = {}
        for track, estimate in zip(tracks, self.gates, strict=True):
            other = best.get(track.colour)
            if other is None or track.rank > other.rank:
                best[track.colour], self._best[track.colour] = track, estimate

    def _match(self, views: list[GateView], unseen: list[GateTrack]) -> list[GateView]:
        """Give views to the gates that they fit best; returns those that fit none."""
        fits: list[tuple[float, int, GateTrack, Fit]] = []
        for number, view in enumerate(views):
            for track in unseen:
                if track.colour == view.colour:
                    fit = track.fit(view)
                    if fit.inside:
                        fits.append((fit.distance2, number, track, fit))
        fits.sort(key=lambda candidate: candidate[:2])
        matched: set[int] = set()
        for _, number, track, fit in fits:
            if number not in matched and track in unseen:
                track.accept(views[number], fit)
                matched.add(number)
                unseen.remove(track)
        return [view for number, view in enumerate(views) if number not in matched]

    def _explain(self, view: GateView, unseen: list[GateTrack]) -> None:
        """A view that fits no gate contradicts the one that should be seen there, or is of a new one."""
        for track in self._tracks:
            if track.colour == view.colour and self._is_near(track, view):
                if track in unseen:
                    unseen.remove(track)
                    if view.whole:
                        track.contradict(view, self._prior)
                return
        if sum(view.seen) < 3:
            return
        found = solutions([view], self._prior)
        if found and found[0].cost <= CHI_SQUARED[sum(view.seen)]:
            track = GateTrack(found, view)
            if track.keep_inside(self._arena):
                self._tracks.append(track)

    def _is_near(self, track: GateTrack, view: GateView) -> bool:
        """Whether a view is where a gate should be in the image."""
        x, y, z, _ = track.state.tolist()
        centre = self._camera.project(view.camera, (x, y, z))
        if centre is None:
            return False
        corners = view.corners_px.reshape(-1, 2)
        right, down = corners.mean(axis=0).tolist()
        distance_m = hypot(*(a - b for a, b in zip(view.camera.position_m, (x, y, z), strict=True)))
        near_px = max(NEAR_PX, NEAR_SHARE * view.shape.outer_width_m * view.focal_px / distance_m)
        return hypot(right - centre[0], down - centre[1]) <= near_px

    def _should_be_seen(
        self, track: GateTrack, camera: CameraPose, obstacles: tuple[ObstacleEdge, ...]
    ) -> bool:
        """Whether an image must show a gate: it is near, not oblique, wholly inside, hidden by nothing."""
        at = camera.position_m
        x, y, _, yaw = track.state.tolist()
        distance_m = _distance_m(track, camera)
        facing = abs((at[0] - x) * cos(yaw) + (at[1] - y) * sin(yaw))
        if (
            distance_m > SURELY_FOUND_M * self._camera.reach(track.shape)
            or facing < SURELY_FOUND_COSINE * distance_m
        ):
            return False
        outline = self._outline(track, camera)
        if outline is None or not all(
            self._camera.contains(right, down, SURELY_FOUND_MARGIN_PX)
            for right, down in ((outline[0], outline[1]), (outline[2], outline[3]))
        ):
            return False
        for other in self._tracks:
            if other is not track and _distance_m(other, camera) < distance_m:
                before = self._outline(other, camera)
                if before is None or _overlap(outline, before):
                    return False
        return not any(self._hides(edge, outline, distance_m, camera) for edge in obstacles)

    def _outline(self, track: GateTrack, camera: CameraPose) -> tuple[float, float, float, float] | None:
        """The box around a gate in the image: left, top, right, bottom; None if not before the camera."""
        x, y, z, yaw = track.state.tolist()
        half_width_m, half_height_m = track.shape.half_m
        sx, sy = -sin(yaw) * half_width_m, cos(yaw) * half_width_m
        corners = [
            self._camera.project(camera, (x + side * sx, y + side * sy, z + up * half_height_m))
            for side in (-1.0, 1.0)
            for up in (-1.0, 1.0)
        ]
        seen = [corner for corner in corners if corner is not None]
        if len(seen) < len(corners):
            return None
        rights, downs = zip(*seen, strict=True)
        return (min(rights), min(downs), max(rights), max(downs))

    def _hides(
        self,
        edge: ObstacleEdge,
        outline: tuple[float, float, float, float],
        distance_m: float,
        camera: CameraPose,
    ) -> bool:
        """Whether an obstacle's column of the image may be before a gate: where it stands says how far."""
        if not outline[0] - OBSTACLE_STEP_PX <= edge.right_px <= outline[2] + OBSTACLE_STEP_PX:
            return False
        if edge.cut:
            return True
        m, focal_px = camera.rotation, self._camera.focal_px
        left, up = -edge.right_px / focal_px, -edge.down_px / focal_px
        sinking = -(m[6] + m[7] * left + m[8] * up)
        if sinking <= 0.0:
            return True
        plan = hypot(m[0] + m[1] * left + m[2] * up, m[3] + m[4] * left + m[5] * up)
        away_m = camera.position_m[2] / sinking * plan
        # Where one thing hides the foot of another, it seems to stand farther away, often outside the arena.
        return away_m < distance_m + BEHIND_M or away_m > self._largest_m

    def _drop_duplicates(self) -> None:
        """Of gates of one colour that cannot both be there, keep the better known."""
        kept: list[GateTrack] = []
        for track in self._tracks:
            twin = next((other for other in kept if _are_one(other, track)), None)
            if twin is None:
                kept.append(track)
            elif track.rank > twin.rank:
                kept[kept.index(twin)] = track
        self._tracks = kept


def _distance_m(track: GateTrack, camera: CameraPose) -> float:
    x, y, z, _ = track.state.tolist()
    at = camera.position_m
    return hypot(at[0] - x, at[1] - y, at[2] - z)


def _overlap(a: tuple[float, float, float, float], b: tuple[float, float, float, float]) -> bool:
    margin = HIDING_MARGIN_PX
    return a[0] < b[2] + margin and b[0] < a[2] + margin and a[1] < b[3] + margin and b[1] < a[3] + margin


def _are_one(a: GateTrack, b: GateTrack) -> bool:
    """Whether two tracks are of one gate: of one colour, and too near to each other for two gates."""
    if a.colour != b.colour:
        return False
    x, y, z, _ = (a.state - b.state).tolist()
    away_m = hypot(x, y, z)
    larger = max(a.shape.outer_width_m / PAPER_GATE.outer_width_m, 1.0)
    if away_m >= DUPLICATE_CERTAIN_M * larger:
        return False
    return away_m < DUPLICATE_M * larger or any(
        one.estimate().certain and not one.is_doubted for one in (a, b)
    )
