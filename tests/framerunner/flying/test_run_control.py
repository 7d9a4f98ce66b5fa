"""A flight that is paused, stepped, stopped at a state, changed or ended, and is otherwise the same."""

from __future__ import annotations

import asyncio
from itertools import pairwise

import pytest

from framerunner.flying.lockstep import lockstep_flight
from framerunner.flying.plan import FlightPlan
from framerunner.flying.run_control import RunControl
from framerunner.runs.track import ChartRecord
from offboard.app import INTERRUPTED
from offboard.mission import load_mission
from scenarios.loader import load_scenario

HOP = """
name: hop
initial: wait
variables:
  hops: 0
states:
  wait:
    transitions:
      - when: seconds_in_state > 0.5
        to: up
  up:
    enter:
      - goal_m = (-3, -3, 1)
      - hover
      - memory.hops = memory.hops + 1
    during:
      - fly_to_goal
    transitions:
      - when: distance_to_goal_m < 0.3
        to: over
      - when: seconds_in_state > 20
        to: over
  over:
    initial: one
    then: down
    states:
      one:
        enter:
          - hover
        transitions:
          - when: seconds_in_state > 1 and memory.hops == 1
            to: two
      two: {final: true}
  down:
    enter:
      - land
    final: true
"""


async def until(holds):
    async with asyncio.timeout(60):
        while not holds():  # noqa: ASYNC110 - the flight is in the same loop and gives way at each tick
            await asyncio.sleep(0.001)


class Flight:
    """A flight whose control stands beside it, and what its listener was told."""

    def __init__(self, mission, **settings):
        self.seen = []
        self.record = ChartRecord()
        self.control = RunControl(listener=self._hear, **settings)
        plan = FlightPlan(load_scenario("test-case-1"), mission)
        flight = lockstep_flight(plan, observers=(self.record.see,), before_tick=self.control.before_tick)
        self.task = asyncio.create_task(flight)

    def _hear(self, engine, state, standing):
        self.engine = engine
        self.seen.append((state.time_us, engine.chart_now(), standing))

    async def go_on(self):
        """End a pause; what was told during it is forgotten."""
        self.control.go_on()
        self.seen.clear()
        await until(lambda: self.seen or self.task.done())

    async def until_paused(self):
        await until(lambda: self.seen and self.seen[-1][2].paused)
        return self.seen[-1]

    async def step(self, ticks=1):
        """Let ticks pass; what was told before is forgotten."""
        self.seen.clear()
        self.control.step(ticks)
        return await self.until_paused()

    async def change(self, mission):
        """Why a changed chart is refused, and what ids transitions have now."""
        answers = []
        self.control.change(mission, lambda *answer: answers.append(answer))
        await until(lambda: answers)
        return answers[0]


@pytest.fixture
def hop(tmp_path):
    def make(text=HOP):
        path = tmp_path / "hop.yaml"
        path.write_text(text, encoding="utf-8")
        return load_mission(path)

    return make


@pytest.mark.parametrize("mission", ["frame_challenge", "explorer"])
async def test_a_flight_that_is_paused_and_stepped_is_the_same_to_the_last_bit(mission):
    mission = load_mission(mission)
    plain = await lockstep_flight(FlightPlan(load_scenario("test-case-1"), mission))
    flight = Flight(mission, paused=True, break_on=["red", "landing"])
    for _ in range(3):
        await flight.step()
    await flight.go_on()
    stops = []
    for _ in range(2):
        *_, standing = await flight.until_paused()
        stops.append(standing.stopped_in)
        flight.control.step(5)
        await flight.go_on()
    controlled = await flight.task
    assert stops == ["red", "landing"]
    assert controlled.result == plain.result  # with `state_sha256` over every true state
    assert controlled.track == plain.track


async def test_a_step_lets_as_many_ticks_pass_as_it_says(hop):
    flight = Flight(hop(), paused=True)
    before_us, *_ = await flight.until_paused()
    for ticks in (1, 1, 7):
        time_us, *_ = await flight.step(ticks)
        assert time_us - before_us == pytest.approx(ticks * 50_000, abs=4_000)
        before_us = time_us
    flight.control.stop()
    assert (await flight.task).outcome.reason == INTERRUPTED


async def test_a_break_pauses_when_a_superstate_or_a_leaf_is_entered_and_goes_on(hop):
    flight = Flight(hop(), break_on=["wait", "over", "over.one", "up"])
    told = []
    for _ in range(3):
        _, chart, standing = await flight.until_paused()
        told.append((chart.state, standing.stopped_in))
        await flight.go_on()
    result = (await flight.task).result
    assert told == [("wait", "wait"), ("up", "up"), ("over.one", "over")]
    assert result.ended == "finished"
    assert flight.record.counts == {"wait/1": 1, "up/1": 1, "over.one/1": 1, "over/then": 1}
    spans = flight.record.spans()
    assert [span.state for span in spans] == ["wait", "up", "over.one", "down"]
    assert all(one.to_s == other.from_s for one, other in pairwise(spans))


async def test_a_pause_tells_what_the_guards_read(hop):
    flight = Flight(hop(), break_on=["up"])
    await flight.until_paused()
    _, chart, _ = await flight.step(3)
    assert chart.active == ("up",)
    assert [(guard.id, guard.to, guard.holds) for guard in chart.guards] == [
        ("up/1", "over", False),
        ("up/2", "over", False),
    ]
    values = {value.name: (value.value, value.unit) for value in chart.values}
    assert values["seconds_in_state"] == (chart.seconds_in_state, "s")
    assert values["distance_to_goal_m"][1] == "m"
    flight.control.stop()
    await flight.task


async def test_a_changed_chart_takes_over_in_the_same_state_with_variables_times_and_counts(hop):
    flight = Flight(hop(), break_on=["up"])
    await flight.until_paused()
    _, before, _ = await flight.step(4)
    changed = HOP.replace(
        "      - when: distance_to_goal_m < 0.3\n",
        "      - when: memory.extra == 5 and imu.z > 50\n        to: over.one\n"
        "      - when: distance_to_goal_m < 0.1\n",
    ).replace("  hops: 0\n", "  hops: 7\n  extra: 5\n")
    flight.record.counts["up/1"] = 3
    refusal, renamed = await flight.change(hop(changed))
    assert refusal == ""
    assert (renamed["up/1"], renamed["up/2"]) == ("up/2", "up/3")
    _, after, _ = await flight.until_paused()
    assert (after.state, after.seconds_in_state) == ("up", before.seconds_in_state)
    assert [guard.when for guard in after.guards][1] == "distance_to_goal_m < 0.1"
    assert {value.name: value.value for value in after.values}["memory.extra"] == 5
    assert flight.engine.pilot.memory.hops == 1  # entered once, and not again by the change
    flight.control.break_on([])
    flight.control.go_on()
    finished = await flight.task
    assert finished.result.ended == "finished"
    assert flight.record.counts["up/2"] == 1


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda text: text.replace("up", "climb"), "the active state 'up' is not in the changed chart"),
        (lambda text: "class: open\n" + text, "class: open cannot replace contest"),
        (lambda text: "vision: frames\n" + text, "vision: frames cannot replace boxes"),
    ],
)
async def test_a_changed_chart_that_cannot_take_over_is_refused_in_one_line(hop, change, words):
    flight = Flight(hop(), break_on=["up"])
    await flight.until_paused()
    refusal, _ = await flight.change(hop(change(HOP)))
    assert words in refusal
    assert "\n" not in refusal
    flight.control.go_on()
    assert (await flight.task).result.ended == "finished"  # with the chart that it had


async def test_a_changed_chart_flies_like_one_that_was_so_from_the_start(hop):
    """Changing only what comes later gives the flight of the changed chart, to the last bit."""
    later = HOP.replace("seconds_in_state > 1 and", "seconds_in_state > 2 and")
    flight = Flight(hop(), break_on=["up"])
    await flight.until_paused()
    await flight.change(hop(later))
    flight.control.go_on()
    changed = await flight.task
    plain = await lockstep_flight(FlightPlan(load_scenario("test-case-1"), hop(later)))
    assert changed.result == plain.result


async def test_speed_paces_a_flight_and_can_be_changed(hop):
    flight = Flight(hop(), speed=2.0)
    await until(lambda: flight.seen and flight.seen[-1][1].state == "up")  # the motors are on
    loop = asyncio.get_running_loop()
    await until(lambda: len(flight.seen) > 14)
    began_s, began_us = loop.time(), flight.seen[-1][0]
    await until(lambda: flight.seen[-1][0] >= began_us + 400_000)
    assert loop.time() - began_s > 0.15  # 0.2 s, less the time of a tick
    flight.control.set_speed(None)
    async with asyncio.timeout(30):
        await flight.task
    with pytest.raises(ValueError, match="speed 0"):
        flight.control.set_speed(0)
