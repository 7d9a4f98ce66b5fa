"""Runs a mission, tick by tick: what the drone sees in, a velocity command out. No clock, no drone.

Most ticks change no state. Sending an event through python-statemachine costs some hundred microseconds,
so the engine first asks the guards of the present state, compiled by the library's own restricted
evaluator; only if one holds is the chart sent its `tick` (it asks the guards again, in order of priority,
and does the leaving and entering), otherwise `during` is done here. `quiet_ticks=False` sends every tick
through the chart; a test shows that both fly alike.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import isfinite

from statemachine import StateChart

from errors import UserError
from offboard.chart.expressions import Evaluate, compile_value, names_in
from offboard.chart.native import RESUME, TICK
from offboard.chart.spec import Action, Leaf, Transition
from offboard.drone import VelocityCommand
from offboard.mission import Mission
from offboard.pilot import Imu, Pilot, PilotError, velocity_command
from offboard.pilot_file import PilotFile, in_words, place_in
from scenarios.models import COLOURS
from vision.types import Detections

Act = Callable[[Pilot], None]

DONE = "done"


class MissionRunError(UserError):
    """The mission cannot go on; the message is one line with the state and the reason."""


@dataclass(frozen=True, slots=True)
class TransitionTaken:
    """A change of state, and why.

    Attributes:
        source: full id of the state (a leaf) that was left.
        target: full id of the one that is present now. If a superstate was finished on the way, this is
            where the mission went on.
        when: the guard that held; "" for a transition without one, "done" if a superstate was finished,
            "resume" if the mission goes on here after a pause.
        values: each name of the guard that held with its value then, such as ("frame.d", 0.44), in the order
            of the guard; a name that could not be read is left out.
        time_us: vehicle time, microseconds.
        seconds_in_source: how long it was in `source`, vehicle time without pauses.
    """

    source: str
    target: str
    when: str
    values: tuple[tuple[str, object], ...]
    time_us: int
    seconds_in_source: float


class _FastState:
    """A leaf of the chart with its guards and its `during` compiled."""

    __slots__ = ("during", "finish", "guards", "leaf")

    def __init__(self, leaf: Leaf, finish: bool) -> None:
        self.leaf = leaf
        self.guards = tuple(_guard(transition.when) for transition in leaf.transitions)
        self.during = tuple(_act(action) for action in leaf.during)
        self.finish = finish


class MissionEngine:
    """A mission under way."""

    def __init__(self, mission: Mission, pilot: Pilot | None = None, *, quiet_ticks: bool = True) -> None:
        """Prepare; the first tick enters the initial state.

        Args:
            mission: what to fly.
            pilot: its eyes and hands; by default a new one of the mission's class.
            quiet_ticks: spare the chart the ticks that change nothing.
        """
        self.mission = mission
        self.pilot = mission.new_pilot() if pilot is None else pilot
        self._states = {
            leaf_id: _FastState(leaf, leaf_id in mission.finishes) for leaf_id, leaf in mission.leaves.items()
        }
        self._quiet_ticks = quiet_ticks
        self._chart: StateChart | None = None
        self._id = ""
        self._present: _FastState | None = None
        self._started_us = 0
        self._entered_us = 0
        self._last_us = 0
        self._seen_us: dict[str, int] = {}
        self._paused_us: int | None = None
        self._taken: TransitionTaken | None = None

    @property
    def transition(self) -> TransitionTaken | None:
        """The transition taken in the last tick; None if none was."""
        return self._taken

    @property
    def state(self) -> str:
        """Full id of the present state, such as "red.turning"; empty before the first tick."""
        return self._id

    @property
    def finished(self) -> bool:
        """The mission has reached its end."""
        return self._present is not None and self._present.finish

    def tick(self, imu: Imu, cam: Detections, time_us: int) -> VelocityCommand:
        """Run one step of the chart. After a pause this goes on with the mission.

        Args:
            imu: where the drone is.
            cam: what the latest image showed.
            time_us: vehicle time, microseconds.

        Returns:
            The velocity to fly from now on, within the limits. `pilot.cmd.on` says whether motors shall run.

        Raises:
            MissionRunError: a value that is not finite, a clock that runs backwards, an error in the chart.
        """
        if not (isfinite(imu.x) and isfinite(imu.y) and isfinite(imu.z) and isfinite(imu.yaw)):
            raise self._error(f"the position is not finite: {imu}")
        if time_us < self._last_us:
            raise self._error(f"vehicle time ran back from {self._last_us} to {time_us} us; did it restart?")
        self._last_us = time_us
        pilot = self.pilot
        pilot.imu = imu
        pilot.cam = cam
        self._taken = None
        try:
            self._count_unseen(time_us)
            if self._present is None:
                self._start(time_us)
            elif not self._present.finish and not (
                self._paused_us is not None and self._resume(self._present, self._paused_us, time_us)
            ):
                self._step(self._present, time_us)
            return velocity_command(pilot.cmd)
        except PilotError as error:
            raise self._error(str(error)) from None
        except MissionRunError:
            raise
        except (
            Exception,
            SystemExit,
        ) as error:  # whatever an expression or a contestant's primitive may raise
            raise self._error(self._place(error) + in_words(error)) from error

    def pause(self, time_us: int) -> None:
        """Let the mission and its clocks stand still from this tick on, until the next call of `tick`.

        Args:
            time_us: vehicle time of the first tick that is left out, microseconds.
        """
        self._taken = None
        if self._paused_us is None and self._present is not None:
            self._paused_us = time_us

    def _count_unseen(self, time_us: int) -> None:
        """Note which frames are wholly in view."""
        pilot, seen_us = self.pilot, self._seen_us
        if self._present is None or self._paused_us is not None:
            seen_us.update(dict.fromkeys(COLOURS, time_us))
        for colour in COLOURS:
            if isfinite(getattr(pilot.cam, colour).d):
                seen_us[colour] = time_us
        pilot.seconds_unseen = (time_us - seen_us[pilot.colour]) / 1e6

    def _start(self, time_us: int) -> None:
        self._started_us = time_us
        self._chart = self.mission.chart(model=self.pilot)
        self._settle(time_us)

    def _step(self, present: _FastState, time_us: int) -> None:
        pilot = self.pilot
        pilot.seconds_in_state = (time_us - self._entered_us) / 1e6
        pilot.seconds_in_mission = (time_us - self._started_us) / 1e6
        for number, guard in enumerate(present.guards):
            if guard(pilot):
                self._take(present.leaf.transitions[number], time_us)
                return
        if self._quiet_ticks:
            for act in present.during:
                act(pilot)
        elif present.during:
            self._send_tick()

    def _resume(self, present: _FastState, paused_us: int, time_us: int) -> bool:
        """End a pause; True if the chart was sent elsewhere, so that this tick is done."""
        self._paused_us = None
        self._started_us += time_us - paused_us
        self._entered_us += time_us - paused_us
        if present.leaf.resume is None:
            return False
        assert self._chart is not None
        source, seconds = self._id, (time_us - self._entered_us) / 1e6
        self.pilot.seconds_in_mission = (time_us - self._started_us) / 1e6
        cmd = self.pilot.cmd
        cmd.vel_x = cmd.vel_y = cmd.vel_z = cmd.rot_z = 0.0  # those of the state that is left
        self._chart.send(RESUME)
        self._settle(time_us)
        self._taken = TransitionTaken(source, self._id, RESUME, (), time_us, seconds)
        return True

    def _take(self, transition: Transition, time_us: int) -> None:
        """Have the chart take a transition whose guard holds, and note why it did."""
        source, seconds = self._id, self.pilot.seconds_in_state
        values = _values(transition.when, self.pilot)  # now: what is done on leaving may change them
        self._send_tick()
        self._settle(time_us)
        arrived = self._id == transition.to or self._id.startswith(f"{transition.to}.")
        when = transition.when if arrived else DONE
        self._taken = TransitionTaken(source, self._id, when, values, time_us, seconds)

    def _send_tick(self) -> None:
        assert self._chart is not None
        self._chart.send(TICK)

    def _settle(self, time_us: int) -> None:
        """Note which state the chart is in now."""
        assert self._chart is not None
        self._id = next(state.id for state in self._chart.configuration if state.id in self._states)
        self._present = self._states[self._id]
        self._entered_us = time_us
        self.pilot.seconds_in_state = 0.0

    def _place(self, error: BaseException) -> str:
        """File and line of the contestant's code that an exception came from."""
        pilot = self.mission.pilot
        return place_in(pilot, type(self.pilot).__module__, error) if isinstance(pilot, PilotFile) else ""

    def _error(self, reason: str) -> MissionRunError:
        return MissionRunError(
            f"mission '{self.mission.name}', state '{self._id or 'not started'}': {reason}"
        )


def _values(when: str, pilot: Pilot) -> tuple[tuple[str, object], ...]:
    """What the names of a guard stand for now."""
    found = []
    for name in names_in(when):
        value: object = pilot
        try:
            for part in name.split("."):
                value = getattr(value, part)
        except (Exception, SystemExit):  # a value which the guard did not get to read; nothing hangs on it
            continue
        found.append((name, value))
    return tuple(found)


def _guard(when: str) -> Evaluate:
    return compile_value(when) if when else lambda pilot: True


def _act(action: Action) -> Act:
    if action.name:
        name = action.name

        def call(pilot: Pilot) -> None:
            getattr(pilot, name)()

        return call
    *owners, attribute = action.location.split(".")
    value = compile_value(action.expression)

    def assign(pilot: Pilot) -> None:
        owner: object = pilot
        for part in owners:
            owner = getattr(owner, part)
        setattr(owner, attribute, value(pilot))

    return assign
