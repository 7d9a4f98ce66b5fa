"""Where a drone was during a flight, and where its navigator believed the gates to be."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from math import isfinite

import numpy as np
import numpy.typing as npt

from framerunner.geometry.vectors import Vec3
from framerunner.wire.mission_report import TransitionTaken
from offboard.app import Moment
from offboard.navigation.view import GateEstimate
from scenarios.result import TimedPosition


@dataclass(frozen=True, slots=True)
class Track:
    """Where a drone was, as it reported; those before `estimates` have the same length.

    Attributes:
        time_s: since motors on, not decreasing, shape (n,).
        x: arena metres, shape (n,); a sample that is not finite leaves a gap in the drawn path.
        y: see x.
        z: see x.
        mission_state: the state's id at each sample, such as "red.turning"; "" where there is none.
        estimates: the gates as the navigator knew them at the end; empty without a navigator.
        true_path: where a simulated drone truly was: seconds since motors on, arena metres; empty if unknown.
        estimated_path: likewise, where the app itself has estimated it to be, at the ticks at which it has.

    Raises:
        ValueError: the sequences have different lengths.
    """

    time_s: Sequence[float] = ()
    x: Sequence[float] = ()
    y: Sequence[float] = ()
    z: Sequence[float] = ()
    mission_state: Sequence[str] = ()
    estimates: Sequence[GateEstimate] = ()
    true_path: Sequence[TimedPosition] = ()
    estimated_path: Sequence[TimedPosition] = ()

    def __post_init__(self) -> None:
        lengths = {name: len(getattr(self, name)) for name in ("time_s", "x", "y", "z", "mission_state")}
        if len(set(lengths.values())) > 1:
            raise ValueError(f"a track's sequences must have one length, not {lengths}")

    def __len__(self) -> int:
        return len(self.time_s)

    def is_drawable(self, index: int) -> bool:
        """Whether the position of a sample is finite."""
        return isfinite(self.x[index]) and isfinite(self.y[index]) and isfinite(self.z[index])

    def position_at(self, time_s: float) -> Vec3 | None:
        """Where the drone was at a time, interpolated linearly between samples.

        Returns:
            Arena metres, shape (3,); None before the first and after the last sample that is drawable.
        """
        known = [i for i in range(len(self)) if self.is_drawable(i)]
        for i, j in zip(known, known[1:] or known, strict=False):
            if not self.time_s[i] <= time_s <= self.time_s[j]:
                continue
            span_s = self.time_s[j] - self.time_s[i]
            part = (time_s - self.time_s[i]) / span_s if span_s > 0 else 0.0
            x, y, z = (values[i] + part * (values[j] - values[i]) for values in (self.x, self.y, self.z))
            return (x, y, z)
        return None

    def as_flown(self) -> Track:
        """The same track with the true positions, as far as they are known."""
        if not self.true_path:
            return self
        x, y, z = _along(self.true_path, self.time_s).T.tolist()
        return replace(self, x=x, y=y, z=z)

    @property
    def reported_path(self) -> tuple[TimedPosition, ...]:
        """The samples that are drawable."""
        samples = zip(self.time_s, self.x, self.y, self.z, strict=True)
        return tuple(sample for index, sample in enumerate(samples) if self.is_drawable(index))

    def largest_error_m(self, path: Sequence[TimedPosition]) -> float | None:
        """How far a path was from the true one at most, while that is known; None if it never is."""
        true_path = self.true_path
        known = [sample for sample in path if true_path and true_path[0][0] <= sample[0] <= true_path[-1][0]]
        if not known:
            return None
        true_m = _along(self.true_path, [time_s for time_s, *_ in known])
        return float(np.linalg.norm(np.array(known)[:, 1:] - true_m, axis=1).max())

    def place_error_m(self, time_s: float) -> Vec3 | None:
        """The place by which the drone was flown less the true one; None if that is not known.

        That place is the estimated one or, at times at which there is none, the reported one.
        """
        path = self.estimated_path
        if not path or not path[0][0] <= time_s <= path[-1][0]:
            path = self.reported_path
        if not path or not self.true_path:
            return None
        x, y, z = (_along(path, [time_s]) - _along(self.true_path, [time_s]))[0].tolist()
        return (x, y, z)

    def stretches(self) -> Iterator[tuple[str, range]]:
        """Stretches flown in one kind of state, in order of time.

        The kind is the last part of the state's id, so turning towards green and towards red are one kind; a
        dozen colours can be told apart, three dozen cannot. A stretch ends at the first sample of the next.
        """
        kinds = (state.rpartition(".")[2] for state in self.mission_state)
        for kind, group in groupby(enumerate(kinds), key=lambda pair: pair[1]):
            indices = [index for index, _ in group]
            yield kind, range(indices[0], min(indices[-1] + 2, len(self)))

    def seconds_in_state(self) -> dict[str, float]:
        """Time spent in each kind of state, seconds, in order of first appearance."""
        spent_s: dict[str, float] = {}
        for kind, indices in self.stretches():
            duration_s = self.time_s[indices[-1]] - self.time_s[indices[0]]
            spent_s[kind] = spent_s.get(kind, 0.0) + duration_s
        return spent_s


def _along(path: Sequence[TimedPosition], times_s: Sequence[float]) -> npt.NDArray[np.float64]:
    """Positions on a path at some times, interpolated linearly, shape (n, 3); outside it its ends."""
    path_s, *path_m = np.array(path).T
    return np.column_stack([np.interp(times_s, path_s, values) for values in path_m])


class TrackRecorder:
    """Records where the drone is at every tick of a flight.

    Attributes:
        largest_std_m: standard deviation of the app's own estimate, of the coordinate known worst, when it
            was largest; None if it has not estimated anything.
    """

    def __init__(self) -> None:
        self._time_us: list[int] = []
        self._x: list[float] = []
        self._y: list[float] = []
        self._z: list[float] = []
        self._mission_state: list[str] = []
        self._estimates: Sequence[GateEstimate] = ()
        self._places: list[tuple[int, Vec3]] = []
        self.largest_std_m: float | None = None

    def see(self, moment: Moment) -> None:
        """Add a tick."""
        state = moment.state
        self._time_us.append(state.time_us)
        self._x.append(state.x)
        self._y.append(state.y)
        self._z.append(state.z)
        self._mission_state.append(moment.mission_state)
        if moment.navigation is not None:
            self._estimates = moment.navigation.gates
        if moment.place is not None:
            self._places.append((state.time_us, moment.place.position_m))
            self.largest_std_m = max(self.largest_std_m or 0.0, *moment.place.position_std_m)

    def track(self, began_us: int | None, *, true_path: Sequence[TimedPosition] = ()) -> Track:
        """Return the track so far; times count from `began_us`, vehicle time, or from the first tick."""
        if began_us is None:
            began_us = self._time_us[0] if self._time_us else 0
        time_s = [(time_us - began_us) / 1e6 for time_us in self._time_us]
        estimated = [((time_us - began_us) / 1e6, *position_m) for time_us, position_m in self._places]
        return Track(
            time_s, self._x, self._y, self._z, self._mission_state, self._estimates, true_path, estimated
        )


@dataclass(frozen=True, slots=True)
class StateSpan:
    """A time in which a state was active; vehicle time, seconds."""

    state: str  # full id of the leaf
    from_s: float
    to_s: float


class ChartRecord:
    """Sees a flight tick by tick, as an observer.

    Attributes:
        counts: how often each transition was taken, by id; see `offboard.chart.spec.transition_id`.
        taken: all transitions, in order.
    """

    def __init__(self) -> None:
        self.counts: Counter[str] = Counter()
        self.taken: list[TransitionTaken] = []
        self._spans: list[StateSpan] = []
        self._state = ""
        self._since_us = 0
        self._last_us = 0

    def see(self, moment: Moment) -> None:
        """Take a tick."""
        time_us = self._last_us = moment.state.time_us
        taken = moment.transition
        if taken is None and moment.mission_state == self._state:
            return
        if taken is not None:
            self.taken.append(taken)
            self.counts.update(taken.ids)
        if self._state:
            self._spans.append(self._span(time_us))
        self._state, self._since_us = moment.mission_state, time_us

    def rename(self, ids: Mapping[str, str]) -> None:
        """After a change of the chart: keep the counts of transitions that are still there, by new ids."""
        self.counts = Counter({ids[name]: count for name, count in self.counts.items() if name in ids})

    def ended(self, since: int = 0) -> tuple[StateSpan, ...]:
        """The times of states that were left, in order, without the first `since` of them."""
        return tuple(self._spans[since:])

    def spans(self) -> tuple[StateSpan, ...]:
        """The time line of states until now, the present one last."""
        if not self._state:
            return ()
        return (*self._spans, self._span(self._last_us))

    def _span(self, to_us: int) -> StateSpan:
        return StateSpan(self._state, self._since_us / 1e6, to_us / 1e6)
