"""What a chart does when a transition is taken, and what its expressions may calculate."""

from __future__ import annotations

from textwrap import dedent

import pytest

from offboard.chart.expressions import ExpressionError, compile_value
from offboard.engine import MissionEngine, MissionRunError
from offboard.mission import mission_from_text
from offboard.pilot import Imu, Pilot
from vision.types import Detections

NESTED = dedent("""\
    initial: first
    variables: {went: 0}
    states:
      first:
        enter: [enter_first]
        exit: [exit_first]
        initial: a
        transitions:
          - {when: go == 3, to: first}
          - {when: go == 4, to: b}
          - {when: go == 5, to: second.deep, do: [between]}
        states:
          a:
            enter: [enter_a]
            during: [stay_a]
            exit: [exit_a]
            transitions:
              - {when: go == 1, to: b}
              - {when: go == 2, to: a}
          b:
            enter: [enter_b]
            exit: [exit_b]
            transitions:
              - {when: go == 1, to: a}
      second:
        enter: [enter_second]
        exit: [exit_second]
        then: third
        initial: deep
        states:
          deep:
            enter: [enter_deep]
            exit: [exit_deep]
            initial: over
            then: done
            states:
              over: {final: true, enter: [enter_over], exit: [exit_over]}
          done: {final: true, enter: [enter_done]}
      third:
        enter: [enter_third]
        transitions:
          - {when: go == 9, to: end}
      end: {final: true, enter: [enter_end]}
    """)


class Logging(Pilot):
    """A pilot whose actions are noted."""

    go: float = 0.0

    def __init__(self, variables):
        super().__init__(variables)
        self.noted = []


def _noting(name):
    def note(self):
        self.noted.append(name)

    return note


for _name in sorted({word.strip("[]},") for word in NESTED.split() if "_" in word} | {"between"}):
    setattr(Logging, _name, _noting(_name))


def ticks(*orders):
    """The actions of each tick at which the pilot's `go` has a value."""
    engine = MissionEngine(mission_from_text(NESTED, Logging))
    found = []
    for number, order in enumerate(orders):
        engine.pilot.go, engine.pilot.noted = order, []
        engine.tick(Imu(), Detections(), 50_000 * number)
        found.append((engine.state, *engine.pilot.noted))
    return found, engine


@pytest.mark.parametrize(
    ("orders", "expected"),
    [
        ((0,), ("first.a", "enter_first", "enter_a")),
        ((0, 0), ("first.a", "stay_a")),
        ((0, 1), ("first.b", "exit_a", "enter_b")),  # the superstate around both is not left
        ((0, 2), ("first.a", "exit_a", "enter_a")),
        ((0, 1, 4), ("first.b", "exit_b", "enter_b")),  # the superstate's transition, taken from within
        ((0, 3), ("first.a", "exit_a", "exit_first", "enter_first", "enter_a")),
        (
            (0, 5),
            (
                *("third", "exit_a", "exit_first", "between", "enter_second", "enter_deep", "enter_over"),
                *("exit_over", "exit_deep", "enter_done", "exit_second", "enter_third"),
            ),
        ),
        ((0, 5, 9), ("end", "enter_end")),
        ((0, 5, 9, 9), ("end",)),
    ],
)
def test_actions_are_done_from_within_outwards_and_then_inwards(orders, expected):
    found, _ = ticks(*orders)
    assert found[-1] == expected


def test_what_was_taken_is_told_with_each_then():
    _, engine = ticks(0, 5)
    taken = engine.transition
    assert (taken.source, taken.target, taken.when) == ("first.a", "third", "done")
    assert taken.ids == ("first/3", "second.deep/then", "second/then")
    assert taken.values == (("go", 5),)


GROWING = """\
initial: a
variables:
  n: FIRST
states:
  a:
    during:
      - memory.n = VALUE
    transitions:
      - {when: imu.x > 1, to: b}
  b: {final: true}
"""


@pytest.mark.parametrize(
    ("first", "value", "message"),
    [
        ("3", "memory.n * memory.n", "a whole number of more than 4096 bits is too large"),
        ("3", "-memory.n * memory.n", "a whole number of more than 4096 bits is too large"),
        ("\"'x'\"", "memory.n + memory.n", "'x' is no number"),
        ("\"'x'\"", "memory.n * 9", "'x' is no number"),
        ("(0, 0, 1)", "(memory.n, memory.n, 1)", "is no number"),
    ],
)
def test_no_mission_fills_the_memory_tick_by_tick(first, value, message):
    engine = MissionEngine(mission_from_text(GROWING.replace("FIRST", first).replace("VALUE", value)))

    def fly():
        for tick in range(20):  # 3 squared so often has 1.6 million bits
            engine.tick(Imu(), Detections(), 50_000 * tick)

    with pytest.raises(MissionRunError, match=message):
        fly()


FORBIDDEN = (
    *("imu.__class__", "_navigator", "f(1)", "a[0]", "[1]"),
    *("lambda: 1", "2 ** 9", "(x := 1)", "{1: 2}", "1j"),
)


@pytest.mark.parametrize("text", FORBIDDEN)
def test_nothing_else_is_compiled(text):
    with pytest.raises(ExpressionError):
        compile_value(text)


def test_expressions_mean_what_they_mean_in_python():
    pilot = Logging({"n": 7})
    pilot.go = 2.5
    assert compile_value("-go + memory.n * 2 / 4")(pilot) == 1.0
    assert compile_value("1 < go < 3 and not memory.n == 8 or colour == 'red'")(pilot) is True
    assert compile_value("(go, memory.n, -1)")(pilot) == (2.5, 7, -1)
    assert compile_value("memory.n and go")(pilot) == 2.5
