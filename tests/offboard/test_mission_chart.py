"""Every transition of the frame challenge, through the pilot, with faked position and camera."""

from __future__ import annotations

from math import inf

import pytest

from framerunner.wire.mission_report import TransitionTaken
from offboard.drone import VelocityFluCommand
from offboard.engine import MissionEngine, MissionRunError
from offboard.limits import CONTEST
from offboard.mission import load_mission
from offboard.pilot import Imu
from vision.types import Detection, Detections

MISSION = load_mission("frame_challenge")
TICK_US = 50_000
AWAY = Imu(-3.0, -3.0, 0.53, 1.0)
LOST = Detection(n=119.0, s=20.0, e=30.0, w=-20.0)  # pixels seen, but not wholly: no distance
FAR = Detection(n=30.0, s=10.0, e=40.0, w=20.0, d=2.0, a=30.0)
NEAR = Detection(n=45.0, s=-40.0, e=40.0, w=-40.0, d=0.44, a=30.0)


def angle(degrees, d=0.44):
    return Detection(45, -40, 40, -40, d, degrees)


def see(colour, detection):
    return Detections(**{colour: detection})


class Driver:
    """Brings an engine where a test wants it, counting vehicle time."""

    def __init__(self, mission=MISSION):
        self.engine = MissionEngine(mission)
        self.time_us = 5_000_000
        self.command = None

    def tick(self, imu=AWAY, cam=Detections(), after_s=0.05):  # noqa: B008 - immutable
        self.time_us += round(after_s * 1e6)
        self.command = CONTEST.limited(self.engine.tick(imu, cam, self.time_us))
        return self.engine.state

    def to(self, state):
        """Walk the shortest way to a state."""
        self.tick()
        if state == "take_off.start":
            return self
        self.tick()
        if state == "take_off.set_base":
            return self
        self.tick(Imu(-3, -3, 0.95, 1))
        for colour in ("red", "green", "blue"):
            if state.startswith(colour):
                return self._within(colour, state.partition(".")[2])
            self._within(colour, "going_up")
            self.tick(after_s=2.0)
        return self

    def _within(self, colour, name):
        if name == "go_to_center":
            pass
        elif name == "turning":
            self.tick(Imu(0, 0, 2, 0))
        else:
            last = angle(31.0) if name == "shift_right" else angle(2.0)
            for detection in (FAR, NEAR, NEAR, last):
                if self.engine.state != f"{colour}.{name}":
                    self.tick(cam=see(colour, detection))
            if name == "going_up":
                self.tick(after_s=4.0)
        assert self.engine.state == f"{colour}.{name}"
        return self


def at(x, y, z):
    return Imu(x, y, z, 0.0)


OUTER = [
    ("take_off.start", AWAY, 0.05, "take_off.set_base"),
    ("take_off.set_base", at(-3, -3, 0.89), 0.05, "take_off.set_base"),
    ("take_off.set_base", at(-3, -3, 0.91), 0.05, "red.go_to_center"),
    ("landing.go_to_base", at(-3, -3, 0.66), 0.05, "landing.go_to_base"),
    ("landing.go_to_base", at(-3, -3, 0.64), 0.05, "landing.stop"),
]


@pytest.mark.parametrize(("state", "imu", "after_s", "expected"), OUTER)
def test_take_off_and_landing(state, imu, after_s, expected):
    driver = Driver().to(state)
    assert driver.engine.state == state
    assert driver.tick(imu, after_s=after_s) == expected


INNER = [
    # seen and at the centre: seen comes first
    ("go_to_center", at(0, 0, 2), FAR, 0.05, "frame_visible"),
    ("go_to_center", at(0, 0, 1.81), LOST, 0.05, "turning"),
    ("go_to_center", at(0, 0, 1.79), LOST, 0.05, "go_to_center"),
    ("go_to_center", AWAY, LOST, 0.05, "go_to_center"),
    ("turning", at(0, 0, 2), LOST, 0.05, "turning"),
    ("turning", at(0, 0, 2), FAR, 0.05, "frame_visible"),
    ("frame_visible", AWAY, angle(30, d=0.449), 0.05, "frame_close"),
    ("frame_visible", AWAY, angle(30, d=0.451), 0.05, "frame_visible"),
    ("frame_visible", AWAY, LOST, 0.05, "go_to_center"),
    ("frame_close", AWAY, LOST, 0.05, "shift_left"),
    # nearly square and more oblique than at first (30 degrees) cannot be at once; the first is 1
    ("shift_left", AWAY, angle(2.9), 0.05, "crossing"),
    ("shift_left", AWAY, angle(3.1), 0.05, "shift_left"),
    ("shift_left", AWAY, angle(30.0), 0.05, "shift_left"),
    ("shift_left", AWAY, angle(30.1), 0.05, "shift_right"),
    ("shift_left", AWAY, LOST, 0.05, "shift_right"),  # a lost gate's angle is infinite
    ("shift_right", AWAY, angle(2.9), 0.05, "crossing"),
    ("shift_right", AWAY, angle(80.0), 0.05, "shift_right"),
    ("crossing", AWAY, NEAR, 3.95, "crossing"),
    ("crossing", AWAY, LOST, 4.0, "going_up"),
    ("going_up", AWAY, NEAR, 1.95, "going_up"),
]


@pytest.mark.parametrize("colour", ["red", "green", "blue"])
@pytest.mark.parametrize(("state", "imu", "detection", "after_s", "expected"), INNER)
def test_crossing_of_a_gate(colour, state, imu, detection, after_s, expected):
    driver = Driver().to(f"{colour}.{state}")
    assert driver.engine.state == f"{colour}.{state}"
    assert driver.tick(imu, see(colour, detection), after_s) == f"{colour}.{expected}"


@pytest.mark.parametrize(
    ("colour", "following"),
    [("red", "green.go_to_center"), ("green", "blue.go_to_center"), ("blue", "landing.go_to_base")],
)
def test_after_going_up_comes_the_next(colour, following):
    driver = Driver().to(f"{colour}.going_up")
    assert driver.tick(after_s=2.0) == following


@pytest.mark.parametrize("colour", ["red", "green", "blue"])
def test_only_the_wanted_colour_counts(colour):
    others = {c: FAR for c in ("red", "green", "blue") if c != colour}
    driver = Driver().to(f"{colour}.turning")
    assert driver.tick(at(0, 0, 2), Detections(**others)) == f"{colour}.turning"


def test_a_transition_tells_its_guard_and_what_its_names_were():
    driver = Driver().to("red.frame_visible")
    assert driver.engine.transition.when == "frame_seen"
    driver.tick(cam=see("red", FAR))
    assert driver.engine.transition is None
    driver.tick(cam=see("red", NEAR))
    assert driver.engine.transition == TransitionTaken(
        "red.frame_visible",
        "red.frame_close",
        "frame.d < 0.45",
        (("frame.d", 0.44),),
        driver.time_us,
        0.1,
        ("red.frame_visible/1",),
    )
    driver.tick(cam=see("red", NEAR))
    taken = driver.engine.transition
    assert (taken.target, taken.when, taken.values) == ("red.shift_left", "", ())
    driver.tick(cam=see("red", angle(31.0)))
    assert driver.engine.transition.values == (("frame.a", 31.0), ("memory.alpha0", 30.0))


def test_a_superstate_that_is_done_is_told_with_the_leaves_on_both_sides():
    driver = Driver().to("red.going_up")
    driver.tick(after_s=2.0)
    assert driver.engine.transition == TransitionTaken(
        "red.going_up",
        "green.go_to_center",
        "done",
        (("seconds_in_state", 2.0),),
        driver.time_us,
        2.0,
        ("red.going_up/1", "red/then"),
    )


def test_nothing_happens_after_the_end():
    driver = Driver().to("landing")
    driver.tick(at(-3, -3, 0.6))
    assert driver.engine.finished
    assert not driver.engine.pilot.cmd.on
    assert driver.tick(at(5, 5, 5), see("red", FAR)) == "landing.stop"


ON_ENTRY = [
    ("take_off.start", VelocityFluCommand()),
    ("red.turning", VelocityFluCommand(yaw_rate_rad_s=1.0)),
    ("red.frame_visible", VelocityFluCommand()),
    ("red.frame_close", VelocityFluCommand()),
    ("red.shift_left", VelocityFluCommand(left_m_s=0.1)),
    ("red.crossing", VelocityFluCommand(forward_m_s=0.3)),
    ("red.going_up", VelocityFluCommand(up_m_s=0.3)),
]


@pytest.mark.parametrize(("state", "command"), ON_ENTRY)
def test_command_on_entry(state, command):
    assert Driver().to(state).command == command


def test_command_on_entry_of_shift_right_keeps_the_other_rates():
    driver = Driver().to("red.shift_left")
    driver.tick(cam=see("red", angle(20, d=0.5)))
    before = driver.command
    driver.tick(cam=see("red", angle(40, d=0.5)))
    assert driver.command.left_m_s == -0.1
    assert driver.command.forward_m_s == before.forward_m_s == pytest.approx(0.025)


def test_approach_looks_to_the_gate_and_keeps_to_one_metre_a_second():
    driver = Driver().to("green.frame_visible")
    driver.tick(cam=see("green", Detection(n=30.0, s=10.0, e=50.0, w=30.0, d=1.4, a=0.0)))
    assert driver.command.forward_m_s == pytest.approx(0.5)
    assert (driver.command.up_m_s, driver.command.yaw_rate_rad_s) == (20 / 120, -0.5)
    driver.tick(cam=see("green", Detection(n=30.0, s=10.0, e=50.0, w=30.0, d=9.0, a=0.0)))
    assert driver.command.forward_m_s == 1.0


def test_a_gate_lost_while_shifting_gives_full_speed_ahead_as_published_but_a_finite_one():
    driver = Driver().to("red.shift_right")
    driver.tick(cam=see("red", LOST))
    assert driver.engine.pilot.cmd.vel_x == inf
    assert driver.command.forward_m_s == 1.0
    assert driver.engine.state == "red.shift_right"


@pytest.mark.parametrize("bad", [float("nan"), inf])
def test_a_position_that_is_not_finite_stops_the_mission(bad):
    driver = Driver().to("red.turning")
    with pytest.raises(MissionRunError, match=r"state 'red.turning': the position is not finite"):
        driver.tick(Imu(bad, 0, 1, 0))


def test_a_clock_that_runs_back_stops_the_mission():
    driver = Driver().to("red.turning")
    with pytest.raises(MissionRunError, match="ran back"):
        driver.tick(after_s=-1.0)
