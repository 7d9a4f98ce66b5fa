"""An operator takes the drone: the mission waits, and goes on when it is given back where that is safe."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from textwrap import dedent

import pytest

from offboard.app import MissionEnd, Moment, fly_mission
from offboard.drone import DroneError, VelocityFluCommand
from offboard.mission import Mission, load_mission
from offboard.perception import CameraLostError
from tests.offboard.fakes import START_1, TEST_CASE_1, GeometricPerception, KinematicDrone, crossings

MISSION = load_mission("frame_challenge")
POSCTL = "POSCTL"
PLACES = ["take_off.set_base", "blue.go_to_center", "red.crossing", "green.going_up", "landing.go_to_base"]


class Flight:
    """A flight and an operator who acts at some of its ticks."""

    def __init__(self, mission: Mission = MISSION, limit_s: float = 180.0) -> None:
        self.drone = KinematicDrone(*START_1)
        self.perception = GeometricPerception(self.drone, TEST_CASE_1)
        self.mission = mission
        self.limit_s = limit_s
        self.moments: list[Moment] = []
        self.acts: list[tuple[Callable[[Moment], bool], Callable[[], object]]] = []

    def when(self, holds: Callable[[Moment], bool], act: Callable[[], object]) -> Flight:
        """Do something at the first moment for which a condition holds, after all that was planned before."""
        self.acts.append((holds, act))
        return self

    def take(self, state: str, after_s: float = 0.5, pilot_m_s=(0.0, 0.0, 0.0)) -> Flight:
        """The operator takes the drone when it has been in a state for a while."""
        since: list[float] = []

        def holds(moment: Moment) -> bool:
            if moment.mission_state != state:
                return False
            since.append(moment.flight_time_s)
            return moment.flight_time_s - since[0] >= after_s

        return self.when(holds, lambda: self.set(pilot_mode=POSCTL, pilot_m_s=pilot_m_s))

    def give(self, after_s: float = 2.0) -> Flight:
        """He gives it back when he has had it for a while."""
        return self.after_paused(after_s, lambda: self.set(pilot_mode=""))

    def after_paused(self, seconds: float, act: Callable[[], object]) -> Flight:
        since: list[float] = []

        def holds(moment: Moment) -> bool:
            if moment.paused:
                since.append(moment.flight_time_s)
            return moment.paused and moment.flight_time_s - since[0] >= seconds

        return self.when(holds, act)

    def set(self, **fields: object) -> None:
        for name, value in fields.items():
            setattr(self.drone, name, value)

    async def fly(self) -> MissionEnd:
        return await fly_mission(
            self.drone, self.perception, self.mission, limit_s=self.limit_s, observer=self._see
        )

    def _see(self, moment: Moment) -> None:
        self.moments.append(moment)
        if self.acts and self.acts[0][0](moment):
            self.acts.pop(0)[1]()

    @property
    def paused(self) -> list[Moment]:
        return [moment for moment in self.moments if moment.paused]

    @property
    def first_after(self) -> Moment:
        """The first moment after the last pause."""
        last = max(number for number, moment in enumerate(self.moments) if moment.paused)
        return self.moments[last + 1]

    @property
    def last_taken(self) -> Moment:
        """The moment of the last transition."""
        return [moment for moment in self.moments if moment.transition][-1]


@pytest.mark.parametrize("state", PLACES)
async def test_while_a_pilot_has_it_nothing_is_commanded_and_all_stands_still(state):
    flight = Flight().take(state, pilot_m_s=(0.0, 0.3, 0.1)).give(2.0)
    outcome = await flight.fly()
    paused = flight.paused
    assert outcome.pauses == 1
    assert {moment.mission_state for moment in paused} == {state}
    assert {moment.command for moment in paused} == {VelocityFluCommand()}
    assert {moment.state.mode for moment in paused} == {POSCTL}
    assert not any(moment.transition or moment.remark for moment in paused)
    assert paused[-1].flight_time_s - paused[0].flight_time_s == pytest.approx(
        2.0, abs=0.06
    )  # the try's time goes on
    steps = [moment.state.time_us for moment in paused]
    assert all(later - earlier == 50_000 for earlier, later in pairwise(steps))
    stopped = outcome.ended == "finished"  # its last tick stops the motors instead
    assert len(flight.drone.commands) == outcome.ticks - len(paused) - stopped
    assert paused[-1].state.y - paused[0].state.y == pytest.approx(
        0.6, abs=0.02
    )  # it was the operator who flew it


GOES_ON = [
    ("take_off.set_base", "take_off.set_base"),
    ("blue.go_to_center", "blue.go_to_center"),
    ("blue.turning", "blue.go_to_center"),
    ("green.frame_visible", "green.go_to_center"),
    ("blue.shift_right", "blue.go_to_center"),
    ("red.crossing", "red.go_to_center"),
    ("green.going_up", "green.going_up"),
    ("landing.go_to_base", "landing.go_to_base"),
]


@pytest.mark.parametrize(("state", "place"), GOES_ON)
async def test_it_goes_on_where_the_mission_says_and_flies_to_its_end(state, place):
    flight = Flight().take(state, 0.3).give()
    outcome = await flight.fly()
    moment = flight.first_after
    assert moment.mission_state == place
    taken = moment.transition
    resumes = state.partition(".")[0] in TEST_CASE_1
    assert (
        taken is not None and (taken.source, taken.target, taken.when) == (state, place, "resume")
    ) == resumes
    assert (outcome.ended, outcome.mission_state) == ("finished", "landing.stop")
    if state != "blue.shift_right":  # given back so near and aside, the paper's navigator may pass it by
        for target in TEST_CASE_1.values():
            assert min(crossings(flight.drone.path, target)) < 0.1


COUNTS = dedent("""\
    initial: up
    variables: {entered: 0}
    states:
      up:
        enter:
          - hover
          - cmd.vel_z = 0.4
          - memory.entered = memory.entered + 1
        transitions:
          - when: seconds_in_state >= 2 and seconds_in_mission >= 2
            to: done
      done:
        final: true
        enter:
          - cmd.vel_x = memory.entered / 10
    """)


def small(tmp_path, text=COUNTS):
    path = tmp_path / "small.yaml"
    path.write_text(text)
    return load_mission(str(path))


async def test_without_a_place_to_resume_the_state_goes_on_with_its_time(tmp_path):
    flight = Flight(small(tmp_path)).take("up", 1.0).give(3.0)
    outcome = await flight.fly()
    assert outcome.ended == "finished"
    (taken,) = [moment.transition for moment in flight.moments if moment.transition]
    assert taken.seconds_in_source == pytest.approx(2.0)
    assert taken.values == (("seconds_in_state", 2.0), ("seconds_in_mission", 2.0))
    assert outcome.flight_time_s == pytest.approx(2.0 + 3.05, abs=0.06)
    assert flight.first_after.command.up_m_s == 0.4  # as before, though `enter` was not done again
    assert flight.moments[-1].mission_state == "done"
    assert flight.last_taken.command.forward_m_s == pytest.approx(0.1)  # entered once


async def test_a_state_that_resumes_in_itself_begins_anew_and_standing(tmp_path):
    text = COUNTS.replace("  up:\n", "  up:\n    resume: up\n")
    flight = Flight(small(tmp_path, text)).take("up", 1.0).give(3.0)
    outcome = await flight.fly()
    assert outcome.ended == "finished"
    assert flight.first_after.transition.seconds_in_source == pytest.approx(1.1, abs=0.06)
    assert flight.last_taken.transition.seconds_in_source == pytest.approx(2.0)
    assert flight.last_taken.command.forward_m_s == pytest.approx(0.2)  # entered twice


async def test_it_can_be_taken_and_given_again_and_again():
    flight = (
        Flight().take("take_off.set_base").give(1.0).take("red.frame_visible").give(1.0).take("blue.turning")
    )
    outcome = await flight.give(1.0).fly()
    assert (outcome.ended, outcome.pauses) == ("finished", 3)


@pytest.mark.parametrize("mode", ["HOLD", "RETURN_TO_LAUNCH", "LAND", "TAKEOFF", "MISSION", "STABILIZED"])
async def test_in_a_pause_every_mode_is_the_pilot_s_affair(mode):
    flight = Flight().take("blue.turning").after_paused(1.0, lambda: flight.set(pilot_mode=mode)).give(2.0)
    outcome = await flight.fly()
    assert outcome.ended == "finished"
    assert {moment.state.mode for moment in flight.paused} == {POSCTL, mode}


@pytest.mark.parametrize(
    ("landed", "reason"),
    [
        (True, "the pilot landed and stopped the motors"),
        (False, "the motors were stopped in the air while the pilot had the sticks"),
    ],
)
async def test_motors_stopped_in_a_pause_end_the_flight(landed, reason):
    flight = Flight().take("blue.turning")
    outcome = await flight.after_paused(1.0, lambda: flight.set(armed=False, landed=landed)).fly()
    assert (outcome.ended, outcome.reason, outcome.mission_state) == ("aborted", reason, "blue.turning")
    assert outcome.pauses == 1


async def test_the_try_s_time_goes_on_in_a_pause():
    flight = Flight(limit_s=20.0).take("take_off.set_base")
    outcome = await flight.fly()
    assert (outcome.ended, outcome.reason) == ("timed out", "not finished within 20 s")
    assert outcome.flight_time_s == pytest.approx(20.05)
    assert flight.moments[-1].paused


@pytest.mark.parametrize(
    "reason",
    ["link lost: no telemetry for 1.0 s", "this app hung for more than 0.6 s; its watchdog asked for hold"],
)
async def test_a_fault_of_the_drone_ends_a_pause_as_it_ends_a_flight(reason):
    flight = Flight().take("blue.turning")
    since = flight.after_paused(
        1.0, lambda: flight.drone.faults.update(dict.fromkeys(range(5000), DroneError(reason)))
    )
    outcome = await since.fly()
    assert (outcome.ended, outcome.reason) == ("aborted", reason)
    assert flight.moments[-1].paused


async def test_what_no_pilot_did_still_ends_the_flight():
    """The port raises for a mode that is no operator's; nothing here makes a pause of it."""
    flight = Flight()
    flight.drone.faults[200] = DroneError("the pilot or a failsafe took over: mode RETURN_TO_LAUNCH")
    outcome = await flight.fly()
    assert (outcome.ended, outcome.pauses) == ("aborted", 0)
    assert not flight.paused


class Blinking:
    """Detections of a camera that is lost for a time."""

    def __init__(self, perception: GeometricPerception) -> None:
        self.perception = perception
        self.dead = False

    async def open(self) -> None:
        pass

    async def close(self) -> None:
        pass

    def latest(self, time_us):
        if self.dead:
            raise CameraLostError("the camera is dead: no image for 1.1 s")
        return self.perception.latest(time_us)


async def test_with_a_dead_camera_it_is_not_taken_back_until_the_camera_lives():
    flight = Flight().take("blue.turning")
    flight.perception = perception = Blinking(flight.perception)
    flight.after_paused(1.0, lambda: setattr(perception, "dead", True)).give(2.0)
    flight.when(
        lambda moment: moment.remark != "" and moment.state.mode == "HOLD",
        lambda: setattr(perception, "dead", False),
    )
    outcome = await flight.give(1.0).fly()
    assert outcome.ended == "finished"
    assert flight.drone.calls.count("refuse") == 1
    remarks = list(dict.fromkeys(moment.remark for moment in flight.paused))
    assert remarks == ["", "the camera is dead: no image for 1.1 s"]
    refused = next(moment for moment in flight.paused if moment.remark)
    assert refused.state.offboard  # he had chosen it
    assert refused.command == VelocityFluCommand()
    assert flight.first_after.remark == ""


async def test_on_the_ground_it_is_not_taken_back_and_each_time_that_is_said(caplog):
    flight = Flight(limit_s=75.0).take("blue.turning").after_paused(1.0, lambda: flight.set(landed=True))
    flight.give(2.0).when(
        lambda moment: moment.state.mode == "HOLD", lambda: flight.set(pilot_mode=POSCTL)
    ).give(3.0)
    outcome = await flight.fly()
    assert outcome.ended == "timed out"
    assert flight.drone.calls.count("refuse") == 2
    assert [record.getMessage() for record in caplog.records if record.levelname == "WARNING"] == [
        "the mission does not continue: the drone stands on the ground"
    ] * 2
    assert len(flight.drone.commands) == outcome.ticks - len(flight.paused)


async def test_a_hold_that_is_refused_when_given_back_ends_the_flight(monkeypatch):
    flight = Flight().take("blue.turning").after_paused(1.0, lambda: flight.set(landed=True)).give(2.0)

    async def fail():
        raise DroneError("hold was refused: COMMAND_DENIED")

    monkeypatch.setattr(flight.drone, "refuse", fail)
    outcome = await flight.fly()
    assert (outcome.ended, outcome.reason) == ("aborted", "hold was refused: COMMAND_DENIED")


async def test_a_flight_that_nobody_touches_has_no_pause():
    flight = Flight()
    outcome = await flight.fly()
    assert (outcome.ended, outcome.pauses) == ("finished", 0)
    assert not flight.paused
