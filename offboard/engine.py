"""Runs a mission tick by tick: position and detections in, a velocity command out. No clock, no drone.

Most ticks change no state. Sending an event through python-statemachine costs some hundred microseconds, so
the engine first evaluates the guards of the present state, compiled by the library's own restricted
evaluator. Only if one holds is `tick` sent to the chart, which evaluates the guards again, in order of
priority, and leaves and enters states; otherwise `during` is run here. `quiet_ticks=False` sends every tick
to the chart; a test shows that both fly alike.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import isfinite
from typing import TYPE_CHECKING, Any

from framerunner.errors import UserError
from offboard.chart.expressions import compile_value, names_in
from offboard.chart.native import RESUME, TICK
from offboard.chart.spec import Action, Leaf, enter_state, state_path
from offboard.drone import DroneState, VelocityCommand
from offboard.limits import CONTEST, CommandLimits
from offboard.mission import Mission
from offboard.navigation.view import NavigationView, Surroundings
from offboard.observation import ChartNow, check_change, guards_now, read_values, values_now
from offboard.pilot import Imu, Pilot, PilotError, velocity_command
from offboard.pilot_file import PilotFile, in_words, is_interrupt, place_in
from scenarios.models import COLOURS
from vision.types import Detections

if TYPE_CHECKING:
    from offboard.navigation.navigator import Navigator

Act = Callable[[Pilot], None]

DONE = "done"


class MissionRunError(UserError):
    """The mission cannot continue; the message is one line with the state and the reason."""


@dataclass(frozen=True, slots=True)
class TransitionTaken:
    """A change of state, and why.

    Attributes:
        when: the guard that held; "" for a transition without one, "done" if a superstate was finished,
            "resume" after a pause.
        values: each name of the guard that held with its value then, such as ("frame.d", 0.44), in the order
            of the guard; a name that could not be read is left out.
        ids: the transition, and then each `then` that it led to; see `offboard.chart.spec.transition_id`.
    """

    source: str  # full id of the leaf that was left
    target: str  # full id of the present state; if a superstate was finished, the state after it
    when: str
    values: tuple[tuple[str, object], ...]
    time_us: int  # vehicle time
    seconds_in_source: float  # vehicle time without pauses
    ids: tuple[str, ...] = ()


class _FastState:
    """A leaf of the chart with compiled guards and `during`."""

    __slots__ = ("during", "finish", "guards", "leaf")

    def __init__(self, leaf: Leaf, finish: bool) -> None:
        self.leaf = leaf
        self.guards = tuple(compile_value(transition.when or "True") for transition in leaf.transitions)
        self.during = tuple(_act(action) for action in leaf.during)
        self.finish = finish


class MissionEngine:
    """A mission in progress; the first tick enters the initial state.

    Args:
        mission: what to fly.
        pilot: by default a new one of the mission's class.
        surroundings: what is known of the arena before the flight; a mission with `vision: frames` needs it.
        quiet_ticks: do not send the chart the ticks that change nothing.
        limits: of the commands, with which it plans.

    Attributes:
        state: full id of the present state, such as "red.turning"; empty before the first tick.
        transition: the transition taken in the last tick; None if none was.
    """

    def __init__(
        self,
        mission: Mission,
        pilot: Pilot | None = None,
        *,
        limits: CommandLimits = CONTEST,
        surroundings: Surroundings | None = None,
        quiet_ticks: bool = True,
    ) -> None:
        self.state = ""
        self.transition: TransitionTaken | None = None
        self.mission = mission
        self.pilot = mission.new_pilot() if pilot is None else pilot
        self.pilot.limits = limits
        self._states = _fast_states(mission)
        self._quiet_ticks = quiet_ticks
        self._navigator = _new_navigator(mission, surroundings, limits)
        self.pilot._navigator = self._navigator
        self._chart: Any = None  # a `StateChart`, from the first tick on
        self._present: _FastState | None = None
        self._started_us = 0
        self._entered_us = 0
        self._last_us = 0
        self._seen_us: dict[str, int] = {}
        self._paused_us: int | None = None

    @property
    def finished(self) -> bool:
        """The mission has reached its end."""
        return self._present is not None and self._present.finish

    @property
    def has_navigator(self) -> bool:
        """Whether the mission uses the map of frames."""
        return self._navigator is not None

    @property
    def image_period_s(self) -> float:
        """In which the mission needs one image; 0: it needs all of them."""
        return 0.0 if self._navigator is None else self._navigator.image_period_s

    @property
    def navigation(self) -> NavigationView | None:
        """The map and the plan of the pilot's navigator, made anew at each call; None without a navigator."""
        return None if self._navigator is None else self._navigator.view()

    def tick(
        self,
        imu: Imu,
        cam: Detections,
        time_us: int,
        state: DroneState | None = None,
        *,
        images: Sequence[Detections] = (),
        sent: VelocityCommand | None = None,
    ) -> VelocityCommand:
        """Run one step of the chart, at this vehicle time. After a pause this continues the mission.

        Args:
            imu: where the drone is.
            cam: what the latest image showed.
            time_us: vehicle time.
            state: of the drone, from which `imu` is; needed by missions with `vision: frames`.
            images: what each image since the last tick showed, for the navigator's map.
            sent: the command that it has had since the last tick; None if it had none, or it is not known.

        Returns:
            The velocity that the mission wants from now on, not limited yet; `pilot.cmd.on` says whether the
            motors must run.

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
        self.transition = None
        try:
            if self._navigator is not None:
                if state is None:
                    raise PilotError("its map of frames needs the drone's state; give it to each tick")
                self._navigator.observe(state, images, sent)
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
        except BaseException as error:  # of an expression or a contestant's primitive
            if is_interrupt(error):
                raise
            raise self._error(self._place(error) + in_words(error)) from error

    def pause(self, time_us: int) -> None:
        """Pause the mission and its clocks from this vehicle time on, until the next call of `tick`."""
        self.transition = None
        if self._paused_us is None and self._present is not None:
            self._paused_us = time_us

    def chart_now(self) -> ChartNow:
        """The active states and what their guards read, computed at each call."""
        present, pilot = self._present, self.pilot
        active = state_path(self.state)
        if present is None or present.finish:
            return ChartNow(self.state, active, 0.0 if present is None else self._seconds_in_state())
        return ChartNow(
            self.state,
            active,
            self._seconds_in_state(),
            guards_now(present.leaf, present.guards, pilot),
            values_now(present.leaf.transitions, pilot),
        )

    def change(self, mission: Mission) -> None:
        """Go on with a changed chart from the next tick on, in the same active state.

        Nothing is entered or left. Times and the map are kept, and variables too, except one whose kind
        changes; new variables have their first value.

        Raises:
            ChangeRefusedError: the active state is not in the changed chart, or it needs another vehicle,
                pilot or perception; the mission in progress stays.
        """
        check_change(self.mission, mission, self.state)
        states = _fast_states(mission)
        if self._chart is not None:  # the library reads the active state from the pilot, and enters none
            self._chart = mission.chart(model=self.pilot)
            self._present = states[self.state]
        self.mission, self._states = mission, states
        memory, declared = vars(self.pilot.memory), mission.spec.variables
        for name in set(memory) - set(declared):
            del memory[name]
        for name, first in declared.items():
            if name not in memory or _kind(memory[name]) is not _kind(first):
                memory[name] = first

    def _count_unseen(self, time_us: int) -> None:
        """Update the time since the pilot's frame was wholly in view."""
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
                self._take(present.leaf, number, time_us)
                return
        if self._quiet_ticks:
            for act in present.during:
                act(pilot)
        elif present.during:
            self._chart.send(TICK)

    def _resume(self, present: _FastState, paused_us: int, time_us: int) -> bool:
        """End a pause; True if the chart went to another state, which ends this tick."""
        self._paused_us = None
        self._started_us += time_us - paused_us
        self._entered_us += time_us - paused_us
        resume = present.leaf.resume
        if resume is None:
            return False
        ids = (present.leaf.resume_id, *enter_state(self.mission.states, resume.to)[1])
        source, seconds = self.state, (time_us - self._entered_us) / 1e6
        self.pilot.seconds_in_mission = (time_us - self._started_us) / 1e6
        cmd = self.pilot.cmd
        cmd.vel_x = cmd.vel_y = cmd.vel_z = cmd.rot_z = 0.0  # those of the state that is left
        self._chart.send(RESUME)
        self._settle(time_us)
        self.transition = TransitionTaken(source, self.state, RESUME, (), time_us, seconds, ids)
        return True

    def _take(self, leaf: Leaf, number: int, time_us: int) -> None:
        """Let the chart take a transition whose guard holds, and record why."""
        transition = leaf.transitions[number]
        source, seconds = self.state, self.pilot.seconds_in_state
        # Now, because the actions on leaving may change them.
        values = read_values(names_in(transition.when), self.pilot)
        self._chart.send(TICK)
        self._settle(time_us)
        arrived = self.state == transition.to or self.state.startswith(f"{transition.to}.")
        when = transition.when if arrived else DONE
        ids = (leaf.transition_ids[number], *enter_state(self.mission.states, transition.to)[1])
        self.transition = TransitionTaken(source, self.state, when, values, time_us, seconds, ids)

    def _seconds_in_state(self) -> float:
        until_us = self._last_us if self._paused_us is None else self._paused_us
        return (until_us - self._entered_us) / 1e6

    def _settle(self, time_us: int) -> None:
        """Read the chart's present state."""
        self.state = next(state.id for state in self._chart.configuration if state.id in self._states)
        self._present = self._states[self.state]
        self._entered_us = time_us
        self.pilot.seconds_in_state = 0.0

    def _place(self, error: BaseException) -> str:
        """File and line of the contestant's code that raised an exception."""
        pilot = self.mission.pilot
        return place_in(pilot, type(self.pilot).__module__, error) if isinstance(pilot, PilotFile) else ""

    def _error(self, reason: str) -> MissionRunError:
        state = self.state or "not started"
        return MissionRunError(f"mission '{self.mission.name}', state '{state}': {reason}")


def _new_navigator(
    mission: Mission, surroundings: Surroundings | None, limits: CommandLimits
) -> Navigator | None:
    """A navigator for a mission that uses the map of frames."""
    if mission.vision != "frames":
        return None
    from offboard.navigation.navigator import Navigator  # noqa: PLC0415 - it imports filterpy: a second

    if surroundings is None:
        raise MissionRunError(
            f"mission '{mission.name}': its map of frames needs the surroundings; "
            "give the engine those of a FlightPlan"
        )
    return Navigator(surroundings, limits)


def _fast_states(mission: Mission) -> dict[str, _FastState]:
    return {
        leaf_id: _FastState(leaf, leaf_id in mission.finishes) for leaf_id, leaf in mission.leaves.items()
    }


def _kind(value: object) -> type:
    """The kind of a variable's value; numbers are of one kind."""
    if isinstance(value, int | float) and not isinstance(value, bool):
        return float
    return type(value)


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
