"""The gates in the filter of the place: when they join, which images show them, when they are dropped."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import exp, hypot, radians, sqrt
from typing import TypeAlias

import numpy as np

from offboard.navigation.gates.gate_map import GateMap
from offboard.navigation.gates.gate_measurement import GateView, predicted
from offboard.navigation.gates.gate_track import CHI_SQUARED, half_turn, is_certain, is_moved
from offboard.navigation.view import GateEstimate
from offboard.place.measurements import Eye, corners, size
from offboard.place.place_filter import Floats, Model, PlaceFilter
from scenarios.models import COLOURS

# A gate joins the filter when the map is sure which of its yaws is right, and its corners are where they
# should be.
JOINS_VIEWS = 3
JOINS_YAW_STD_RAD = 0.2
JOINS_PX = 6.0
JOINS_STD_M, JOINS_STD_RAD = 0.5, 0.03  # beside the map's, which believes that it has a gate's size
GATE_FACTOR = (
    2.0  # of the map's gates: the filter's covariance is small, and corners have larger errors now and then
)
# A thing of a gate's colour may have another size, such as a picture of one. By how it grows when the drone
# comes nearer, its size is estimated with it; then it is a gate, or is dropped. Of both hypotheses one is
# likelier by the ratio of the densities of size zero after and before (J. M. Dickey, "The weighted likelihood
# ratio", Annals of Mathematical Statistics 42, 1971).
SIZE_STD = 0.5  # of the logarithm of a thing's size that is no gate
GATE_SIZE_STD = 0.00001  # times the metres since it was first seen, its place is known no better
IS_GATE, IS_NONE = 5.0, 0.05  # ratios
DROPPED_M, DROPPED_RAD = (0.2, 0.2, 0.05), radians(2.0)  # by which the place is less well known without it
CONTRADICTIONS = 6  # in a row; then the gate is dropped
ELSEWHERE_M = 0.5  # from where the map has the gate
ELSEWHERE_RAD = 0.3
STAYS_CERTAIN = 3.0  # times the usual deviations: a drone does not see a gate just before it
NOVEL_US = 1_000_000

_Seen: TypeAlias = tuple[GateView, Eye]


class GateLandmarks:
    """One gate of each colour in the filter: the one that the map knows best.

    Attributes:
        unsized: gates in the filter that may be things of another size still.
    """

    def __init__(self) -> None:
        self._used: dict[str, GateView] = {}
        self._contradicted: dict[str, int] = {}
        self._elsewhere: dict[str, int] = {}
        self._certain: set[str] = set()
        self.unsized: set[str] = set()

    def see(self, place: PlaceFilter, seen: Mapping[str, Sequence[_Seen]], gates: GateMap) -> None:
        """Use the gates in an image, after the map has used them.

        Args:
            place: the filter, at the image's time.
            seen: gates in the image by colour, each with the camera's carrier.
            gates: the map.
        """
        for colour, of_colour in seen.items():
            if colour in place.gates:
                self._see_known(place, colour, of_colour)
            elif colour in COLOURS:  # what has another one may be a poster or a window, of any size
                self._begin(place, colour, of_colour, gates)
        for colour in tuple(place.gates):
            self._compare(place, colour, gates.best(colour))

    def _see_known(self, place: PlaceFilter, colour: str, seen: Sequence[_Seen]) -> None:
        """Correct the place by a gate that is in the filter."""
        first = place.gates[colour]
        fits = []
        for number, (view, eye) in enumerate(seen):
            distance2 = place.distance2(_corners(place, colour, view, eye))
            if distance2 is not None:
                fits.append((distance2 / CHI_SQUARED[sum(view.seen)], distance2, number))
        if not fits:
            return
        share, distance2, number = min(fits)
        view, eye = seen[number]
        if share <= GATE_FACTOR:
            used = self._used[colour]
            if not is_moved(view, used) and view.time_us - used.time_us < NOVEL_US:
                self._contradicted[colour] = 0
                return
            most2 = GATE_FACTOR * CHI_SQUARED[sum(view.seen)]  # also where it leads to, which may be far away
            worse = max(1.0, distance2 / len(view.corners_px))  # farther off than its noise says: it has more
            noisy = replace(view, noise_px2=worse * view.noise_px2)
            if place.update(_corners(place, colour, noisy, eye), most2):
                self._contradicted[colour], self._used[colour] = 0, view
                if colour in self.unsized:
                    self._compare_size(place, colour)
                return
        elif not eye.sees(place.x, place.x[first : first + 3].tolist()):
            return  # what is seen is another one, such as a poster
        self._contradicted[colour] = self._contradicted.get(colour, 0) + 1
        if self._contradicted[colour] >= CONTRADICTIONS:
            self._drop(place, colour)

    def _compare_size(self, place: PlaceFilter, colour: str) -> None:
        """Decide whether a thing has the size of a gate, as soon as that is clear."""
        off, std = place.size(colour)
        ratio = SIZE_STD / std * exp(-0.5 * (off / std) ** 2)
        if ratio > IS_GATE:
            self.unsized.discard(colour)
            place.update(size(place.gates[colour], GATE_SIZE_STD))
        elif ratio < IS_NONE:
            self._drop(place, colour)

    def _begin(self, place: PlaceFilter, colour: str, seen: Sequence[_Seen], gates: GateMap) -> None:
        """Let a gate join the filter."""
        known, covariance = gates.best(colour), gates.covariance(colour)
        if known is None or covariance is None or known.ambiguous or known.views < JOINS_VIEWS:
            return
        if known.yaw_std_rad > JOINS_YAW_STD_RAD:
            return
        state = np.array((*known.position_m, known.yaw_rad))
        for view, eye in seen:
            expected = predicted(state, view)
            if sum(view.seen) < 3 or known.seen_us != view.time_us or expected is None:
                continue
            if np.abs(expected[0] - view.corners_px).max() <= JOINS_PX:
                noise = covariance + np.diag(
                    np.square((JOINS_STD_M, JOINS_STD_M, JOINS_STD_M, JOINS_STD_RAD))
                )
                place.add_gate(colour, state, noise, SIZE_STD)
                place.update(_corners(place, colour, view, eye))
                self._used[colour] = view
                self.unsized.add(colour)
                return

    def _compare(self, place: PlaceFilter, colour: str, known: GateEstimate | None) -> None:
        """Drop a gate that the map has elsewhere."""
        state = place.gate(colour)
        assert state is not None, "it is in the filter"
        if colour in self.unsized:
            state = place.if_sized(colour)
        away = known is None or (
            hypot(*(a - b for a, b in zip(state[:3].tolist(), known.position_m, strict=True))) > ELSEWHERE_M
            or (known.certain and abs(half_turn(known.yaw_rad - float(state[3]))) > ELSEWHERE_RAD)
        )
        self._elsewhere[colour] = self._elsewhere.get(colour, 0) + 1 if away else 0
        if self._elsewhere[colour] >= CONTRADICTIONS:
            self._drop(place, colour)

    def forget(self, place: PlaceFilter, colour: str) -> None:
        """Drop a gate, if it is in the filter."""
        if colour in place.gates:
            self._drop(place, colour)

    def _drop(self, place: PlaceFilter, colour: str) -> None:
        """Forget a gate that was none, or is elsewhere; one that was believed has moved the drone."""
        place.drop_gate(colour)
        if colour not in self.unsized:
            place.doubt(DROPPED_M, DROPPED_RAD)
        self.unsized.discard(colour)
        for counts in (self._contradicted, self._elsewhere):
            counts.pop(colour, None)
        self._used.pop(colour, None)

    def known(self, place: PlaceFilter, estimate: GateEstimate) -> GateEstimate:
        """A gate of the map, the best of its colour, as the filter has it: exact relative to the drone."""
        if estimate.colour in self.unsized:
            return replace(estimate, certain=False)
        state = place.gate(estimate.colour)
        assert state is not None, "it is in the filter"
        covariance = place.gate_from_drone(estimate.colour)
        vx, vy, vz, v_yaw = covariance.diagonal().tolist()
        x, y, z, yaw = state.tolist()
        return replace(
            estimate,
            position_m=(x, y, z),
            yaw_rad=half_turn(yaw),
            position_std_m=(sqrt(vx), sqrt(vy), sqrt(vz)),
            yaw_std_rad=sqrt(v_yaw),
            certain=self._is_certain(estimate, yaw, covariance),
        )

    def _is_certain(self, estimate: GateEstimate, yaw_rad: float, covariance: Floats) -> bool:
        """Whether a gate is certain: one that was stays so for a while when the drone does not see it."""
        colour = estimate.colour
        factor = STAYS_CERTAIN if colour in self._certain else 1.0
        if not estimate.ambiguous and is_certain(yaw_rad, covariance, estimate.shape, estimate.views, factor):
            self._certain.add(colour)
            return True
        self._certain.discard(colour)
        return False


def _corners(place: PlaceFilter, colour: str, view: GateView, eye: Eye) -> Model:
    """A view of a gate in the filter as a measurement."""
    first = place.gates[colour]
    yaw_var_rad2 = float(place.p[first + 3, first + 3])
    return corners(view, eye, first, yaw_var_rad2)
