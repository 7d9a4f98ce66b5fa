"""Runs a mission tick by tick: position and detections in, a velocity command out. No clock, no drone.

At each tick the guards of the active state are evaluated in order of priority. The step of the first that
holds is taken, and otherwise `during` is done; `offboard.chart.table` says what either does.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite
from typing import TYPE_CHECKING

from framerunner.errors import UserError
from framerunner.wire.mission_report import Plain, TransitionTaken
from offboard.chart.expressions import names_in
from offboard.chart.spec import RESUME, Transition, state_path
from offboard.chart.table import ChartRow
from offboard.drone import DroneState, VelocityFluCommand
from offboard.limits import CONTEST, CommandLimits
from offboard.mission import Mission
from offboard.navigation.view import NavigationView, Surroundings
from offboard.observation import ChartNow, check_change, guards_now, read_values, values_now
from offboard.pilot import Imu, Pilot, PilotError, velocity_command
from offboard.pilot_file import PilotFile, in_words, is_interrupt, place_in
from scenarios.models import COLOURS
from vision.types import BaseExpectation, Detections

if TYPE_CHECKING:
    from offboard.navigation.navigator import Navigator

DONE = "done"


class MissionRunError(UserError):
    """The mission cannot continue; the message is one line with the state and the reason."""


class MissionEngine:
    """A mission in progress; the first tick enters the initial state.

    Args:
        mission: what to fly.
        pilot: by default a new one of the mission's class.
        surroundings: what is known of the arena before the flight; a mission with `vision: frames` needs it.
        limits: of the commands, with which it plans.

    Attributes:
        state: full id of the present state, such as "red.turning"; empty before the first tick.
        transition: the transition taken in the last tick; None if none was.
        drone: its state in the last tick, as the navigator has estimated it; as it was given without one.
    """

    def __init__(
        self,
        mission: Mission,
        pilot: Pilot | None = None,
        *,
        limits: CommandLimits = CONTEST,
        surroundings: Surroundings | None = None,
    ) -> None:
        self.state = ""
        self.transition: TransitionTaken | None = None
        self.mission = mission
        self.pilot = mission.new_pilot() if pilot is None else pilot
        self.pilot.limits = limits
        self._navigator = _new_navigator(mission, surroundings, limits)
        self.pilot._navigator = self._navigator
        self.drone: DroneState | None = None
        self._present: ChartRow | None = None
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
        """Whether the mission uses the map of gates."""
        return self._navigator is not None

    @property
    def image_period_s(self) -> float:
        """In which the mission needs one image; 0: it needs all of them."""
        return 0.0 if self._navigator is None else self._navigator.image_period_s

    def expected_base(self, time_us: int) -> BaseExpectation | None:
        """See `Navigator.expected_base`."""
        return None if self._navigator is None else self._navigator.expected_base(time_us)

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
        sent: VelocityFluCommand | None = None,
    ) -> VelocityFluCommand:
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
        self.transition, self.drone = None, state
        try:
            if self._navigator is not None:
                if state is None:
                    raise PilotError("its map of frames needs the drone's state; give it to each tick")
                self.drone = at = self._navigator.observe(state, images, sent)
                std_m = 0.0 if at.estimate is None else max(at.estimate.position_std_m)
                pilot.imu = Imu(at.x, at.y, at.z, at.yaw, std_m)
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
        if present is None:
            return ChartNow(self.state, active, 0.0)
        return ChartNow(
            self.state,
            active,
            self._seconds_in_state(),
            guards_now(present.transitions, pilot),
            values_now(present.transitions, pilot),
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
        if self._present is not None:
            self._present = mission.table.rows[self.state]
        self.mission = mission
        memory, declared = vars(self.pilot.memory), mission.spec.variables
        for name in set(memory) - set(declared):
            del memory[name]
        for name, first in declared.items():
            if name not in memory or _kind(memory[name]) is not _kind(first):
                memory[name] = first

    def _count_unseen(self, time_us: int) -> None:
        """Update the time since the pilot's gate was wholly in view."""
        pilot, seen_us = self.pilot, self._seen_us
        if self._present is None or self._paused_us is not None:
            seen_us.update(dict.fromkeys(COLOURS, time_us))
        for colour in COLOURS:
            if isfinite(getattr(pilot.cam, colour).d):
                seen_us[colour] = time_us
        pilot.seconds_unseen = (time_us - seen_us[pilot.colour]) / 1e6

    def _start(self, time_us: int) -> None:
        self._started_us = time_us
        self._enter(self.mission.table.start, time_us)

    def _step(self, present: ChartRow, time_us: int) -> None:
        pilot = self.pilot
        pilot.seconds_in_state = (time_us - self._entered_us) / 1e6
        pilot.seconds_in_mission = (time_us - self._started_us) / 1e6
        for each in present.transitions:
            if each.holds(pilot):
                # Now, because the actions on leaving may change them.
                values = read_values(names_in(each.transition.when), pilot)
                self._take(each.transition, values, each.transition.when, time_us)
                return
        for act in present.during:
            act(pilot)

    def _resume(self, present: ChartRow, paused_us: int, time_us: int) -> bool:
        """End a pause; True if the chart went to another state, which ends this tick."""
        self._paused_us = None
        self._started_us += time_us - paused_us
        self._entered_us += time_us - paused_us
        if present.resume is None:
            return False
        self.pilot.seconds_in_mission = (time_us - self._started_us) / 1e6
        cmd = self.pilot.cmd
        cmd.vel_x = cmd.vel_y = cmd.vel_z = cmd.rot_z = 0.0  # those of the state that is left
        self._take(present.resume, (), RESUME, time_us)
        return True

    def _take(
        self, transition: Transition, values: tuple[tuple[str, Plain], ...], when: str, time_us: int
    ) -> None:
        """Take a transition, and record it with its guard and the values that the guard read."""
        source, seconds = self.state, (time_us - self._entered_us) / 1e6
        ids = self._enter(transition, time_us)
        arrived = when == RESUME or transition.to in state_path(self.state)
        reason = when if arrived else DONE
        self.transition = TransitionTaken(source, self.state, reason, values, time_us, seconds, ids)

    def _enter(self, transition: Transition, time_us: int) -> tuple[str, ...]:
        """Do what a transition does; the ids of what was taken."""
        passage = self.mission.table.passage(self.state, transition)
        for act in passage.actions:
            act(self.pilot)
        self.state = passage.leaf
        self._present = self.mission.table.rows[passage.leaf]
        self._entered_us = time_us
        self.pilot.seconds_in_state = 0.0
        return passage.ids

    def _seconds_in_state(self) -> float:
        until_us = self._last_us if self._paused_us is None else self._paused_us
        return (until_us - self._entered_us) / 1e6

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
    """A navigator for a mission that uses the map of gates."""
    if mission.vision != "frames":
        return None
    from offboard.navigation.navigator import Navigator  # noqa: PLC0415 - it imports filterpy: a second

    if surroundings is None:
        raise MissionRunError(
            f"mission '{mission.name}': its map of frames needs the surroundings; "
            "give the engine those of a FlightPlan"
        )
    return Navigator(surroundings, limits)


def _kind(value: object) -> type:
    """The kind of a variable's value; numbers are of one kind."""
    if isinstance(value, int | float) and not isinstance(value, bool):
        return float
    return type(value)
