"""One flight, or batches, in a process of its own: `python -m framerunner.editing.worker`.

A line of standard input is a task, each further line of a single flight an order; standard output has a
message a line. Batches are flown one after the other, each in a child that has the libraries already: to
import them takes longer than a pupil's flight. A mission that computes without end or takes all memory ends
only this process, and when the server ends, standard input ends and this process with it.
"""

from __future__ import annotations

import asyncio
import os
import sys
import threading
import traceback
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import TextIO

from pydantic import BaseModel, ValidationError

from framerunner.child_process import end_with_standard_input, limit_resources
from framerunner.editing import editor_messages
from framerunner.editing.batch import fly_batch
from framerunner.editing.places import find_scenario
from framerunner.editing.run_reporter import RunReporter
from framerunner.editing.session_runs import KeptFlight
from framerunner.editing.words import Said, SaidError, reasons
from framerunner.errors import UserError
from framerunner.evaluation.runner import processor_limit
from framerunner.flying.lockstep import lockstep_flight
from framerunner.flying.plan import FlightPlan
from framerunner.flying.run_control import RunControl
from offboard.chart.mission_texts import Language
from offboard.mission import Mission, MissionError, mission_from_text
from offboard.pilot_file import PilotSource, find_pilot

_SPARE_S = 120  # processor time for all but flying
_NICENESS = 5
Tell = Callable[[BaseModel], None]


def main() -> int:
    """Do the tasks that lines of standard input name: batches, or one flight; returns 0, also if refused."""
    import cv2
    import scipy.optimize  # noqa: F401  # a flight imports it late, in each child of its own if not here

    output = os.fdopen(os.dup(sys.stdout.fileno()), "w", encoding="utf-8")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())  # what a contestant's file prints is no message
    os.nice(_NICENESS)
    cv2.setNumThreads(1)
    tell = _teller(output)
    while line := sys.stdin.readline():  # until it is not needed any more
        task = editor_messages.TASK.validate_json(line)
        if isinstance(task, editor_messages.RunTask):
            _carry_out(task, tell)
            return 0  # orders may follow that come too late
        code = _in_child(partial(_carry_out, task, tell))
        if code:
            return code
        tell(editor_messages.Ready())
    return 0


def _in_child(do: Callable[[], None]) -> int:
    """Do something in a process that has all libraries already; its exit code.

    Limits and whatever goes wrong are that process's alone; a signal that ends it ends this one, too.
    """
    child = os.fork()
    if child == 0:
        code = 1
        try:
            end_with_standard_input(lambda: None)
            do()
            code = 0
        except BaseException:
            traceback.print_exc()
        finally:
            sys.stderr.flush()
            os._exit(code)
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    if code < 0:
        os.kill(os.getpid(), -code)
    return code


def _carry_out(task: editor_messages.RunTask | editor_messages.BatchTask, tell: Tell) -> None:
    flights = 1 if isinstance(task, editor_messages.RunTask) else task.start.count + len(task.start.scenarios)
    limit_resources(task.memory_bytes, round(task.processor_s) * flights + _SPARE_S)
    tag = task.start.tag
    try:
        pilot = None if task.pilot is None else find_pilot(task.pilot)
        mission = mission_from_text(task.start.text, pilot)
        if isinstance(task, editor_messages.BatchTask):
            fly_batch(task, mission, tell)
        else:
            _ControlledRun(task, mission, pilot, tell).fly(sys.stdin)
    except UserError as error:
        tell(refusal(tag, error, task.start.language))


def refusal(tag: int, error: UserError, language: Language, run: str = "") -> editor_messages.Refused:
    """Why a mission is not flown: its first problem, and all of them."""
    lines = reasons(error, language)
    text = lines[0]
    if len(lines) > 1:
        text = Said("flight.more", first=text, count=len(lines) - 1).text(language)
    return editor_messages.Refused(
        tag=tag, text=text, lines=lines if isinstance(error, MissionError) else (), run=run
    )


class _ControlledRun:
    """A flight that follows orders."""

    def __init__(
        self, task: editor_messages.RunTask, mission: Mission, pilot: PilotSource | None, tell: Tell
    ) -> None:
        start = task.start
        _check_breaks(start.break_on, mission)
        self._task, self._mission, self._pilot, self._tell = task, mission, pilot, tell
        self._plan = FlightPlan(find_scenario(start.scenario), mission, start.seed)
        self._reporter = RunReporter(task.run, tell, solids=self._plan.scenario.solid_names)
        self._control = RunControl(
            speed=start.speed, paused=start.paused, break_on=start.break_on, listener=self._reporter.hear
        )

    def fly(self, orders: TextIO) -> None:
        """Fly to the end; this process ends when there can be no more orders."""
        layout = self._plan.scenario.model_dump(mode="json")
        self._tell(editor_messages.Started(tag=self._task.start.tag, run=self._task.run, layout=layout))
        threading.Thread(target=self._take_orders, args=(orders,), daemon=True).start()
        folder = None if self._task.keep is None else Path(self._task.keep)
        kept = KeptFlight(folder, self._plan, self._task.start.text)
        flight = lockstep_flight(
            self._plan,
            observers=(self._reporter.see, *kept.observers),
            truth_observers=(self._reporter.see_truth,),
            before_tick=self._control.before_tick,
        )
        try:
            with processor_limit(self._task.processor_s):
                flown = asyncio.run(flight)
        except Exception as error:  # a fault of the program, or of a contestant's file
            text = " ".join(str(error).split())
            kept.finish(None)
            self._tell(self._reporter.failed(f"{type(error).__name__}: {text}"))
        else:
            kept.finish(flown)
            self._tell(self._reporter.ended(flown))

    def _take_orders(self, orders: Iterator[str]) -> None:
        for line in orders:
            try:
                self._carry_out(editor_messages.ORDER.validate_json(line))
            except ValidationError:  # the server has checked it
                continue
        os._exit(1)

    def _carry_out(self, order: editor_messages.Order) -> None:
        """Answer an order, then give it: what it does may be told at once and follows the answer."""
        if isinstance(order, editor_messages.Change):
            self._change(order)
            return
        try:
            if isinstance(order, editor_messages.BreakOn):
                _check_breaks(order.states, self._mission)
        except UserError as error:
            self._tell(refusal(order.tag, error, order.language, self._task.run))
            return
        self._tell(editor_messages.Done(tag=order.tag))
        control = self._control
        match order:
            case editor_messages.Watch():
                self._reporter.tell_all()
                control.tell()
            case editor_messages.Pause():
                control.pause()
            case editor_messages.GoOn():
                control.go_on()
            case editor_messages.Step():
                control.step(order.ticks)
            case editor_messages.Speed():
                control.set_speed(order.speed)
            case editor_messages.BreakOn():
                control.break_on(order.states)
            case editor_messages.Stop():
                control.stop()

    def _change(self, order: editor_messages.Change) -> None:
        run = self._task.run
        try:
            mission = mission_from_text(order.text, self._pilot)
        except MissionError as error:
            self._tell(refusal(order.tag, error, order.language, run))
            return

        def changed(why_not: str, ids: Mapping[str, str]) -> None:
            if why_not:
                self._tell(editor_messages.Refused(tag=order.tag, text=why_not, run=run))
                return
            renamed = dict(ids)
            self._mission = mission
            self._reporter.rename(renamed)
            self._tell(editor_messages.Changed(run=run, tag=order.tag, ids=renamed))

        self._control.change(mission, changed)


def _check_breaks(states: tuple[str, ...], mission: Mission) -> None:
    """Raise `SaidError` if a state to stop at is not in the chart."""
    unknown = next((each for each in states if each not in mission.states), None)
    if unknown is not None:
        raise SaidError("flight.no_state", name=unknown[:60])


def _teller(output: TextIO) -> Tell:
    """Writes messages, a line each; may be called from several threads."""
    lock = threading.Lock()

    def tell(message: BaseModel) -> None:
        line = message.model_dump_json() + "\n"
        with lock:
            output.write(line)
            output.flush()

    return tell


if __name__ == "__main__":
    sys.exit(main())
