"""Whatever happens, the flight ends safely and says why."""

from __future__ import annotations

import asyncio
from itertools import pairwise
from textwrap import dedent

import numpy as np
import pytest

from framerunner.flying.plan import FlightPlan
from offboard.app import fly_mission
from offboard.drone import DroneError
from offboard.engine import MissionEngine
from offboard.mission import load_mission
from offboard.navigation.navigator import Navigator
from offboard.navigation.view import NavigationView
from offboard.perception import IMAGES_KEPT, CameraLostError, CameraPerception
from offboard.pilot import Pilot
from scenarios.loader import load_scenario
from tests.offboard.fakes import START_1, TEST_CASE_1, GeometricPerception, KinematicDrone, NoCamera
from vision.base.detector import BaseExpectations
from vision.types import CameraFrame, Detections

MISSION = load_mission("frame_challenge")


def starting():
    drone = KinematicDrone(*START_1)
    return drone, GeometricPerception(drone, TEST_CASE_1)


@pytest.mark.parametrize(
    "reason",
    [
        "the pilot took over: mode POSCTL",
        "link lost: no telemetry for 1.0 s",
        "the vehicle was disarmed by others",
        "the vehicle's position, velocity or attitude is not finite",
    ],
)
async def test_a_drone_error_stops_commanding_and_asks_for_hold(reason):
    drone, perception = starting()
    drone.faults[200] = DroneError(reason)
    outcome = await fly_mission(drone, perception, MISSION)
    assert (outcome.ended, outcome.reason) == ("aborted", reason)
    assert outcome.mission_state == "red.frame_visible"
    assert drone.calls == ["connect", "ready", "motors_on", "hold", "close"]
    assert outcome.ticks == len(drone.commands) == 199


async def test_a_hold_that_fails_is_told_as_well():
    drone, perception = starting()
    drone.faults[50] = DroneError("link lost")
    drone.hold_error = DroneError("no answer")
    outcome = await fly_mission(drone, perception, MISSION)
    assert outcome.reason == "link lost; hold: no answer"
    assert drone.calls[-1] == "close"


async def test_nothing_is_asked_of_a_drone_that_is_gone():
    drone, perception = starting()
    drone.faults[50] = DroneError("link lost")
    drone.gone = "the simulator has ended"
    outcome = await fly_mission(drone, perception, MISSION)
    assert (outcome.ended, outcome.reason) == ("aborted", "the simulator has ended")
    assert drone.calls == ["connect", "ready", "motors_on", "close"]


async def test_no_hold_is_asked_of_a_drone_that_never_started():
    drone, perception = starting()
    drone.faults[1] = DroneError("link lost")
    outcome = await fly_mission(drone, perception, MISSION)
    assert outcome.ended == "aborted"
    assert drone.calls == ["connect", "ready", "close"]


@pytest.mark.parametrize("step", ["connect", "ready"])
async def test_an_error_before_the_flight_is_raised_and_all_is_closed(step, monkeypatch):
    drone, perception = starting()

    async def fail():
        raise DroneError("no vehicle")

    monkeypatch.setattr(drone, step, fail)
    with pytest.raises(DroneError, match="no vehicle"):
        await fly_mission(drone, perception, MISSION)
    assert drone.calls[-1] == "close"


async def test_motors_on_refused_is_an_outcome_and_holds(monkeypatch):
    drone, perception = starting()

    async def refuse(*, confirmed):
        raise DroneError("arming was refused: COMMAND_DENIED")

    monkeypatch.setattr(drone, "motors_on", refuse)
    outcome = await fly_mission(drone, perception, MISSION)
    assert "COMMAND_DENIED" in outcome.reason
    assert drone.calls[-2:] == ["hold", "close"]
    assert drone.commands == []


@pytest.mark.parametrize(
    ("mission", "confirmed"),
    [("frame_challenge", True), ("explorer", False), ("explorer_soft_landing", False)],
)
async def test_only_missions_without_a_map_wait_until_telemetry_shows_the_motors_on(mission, confirmed):
    plan = FlightPlan(load_scenario("test-case-1"), load_mission(mission))
    drone = KinematicDrone(*START_1)
    sent = []
    observe = Navigator.observe
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            Navigator,
            "observe",
            lambda nav, state, images, given: (sent.append(given), observe(nav, state, images, given))[1],
        )
        outcome = await fly_mission(drone, Blind(), plan.chart, limit_s=0.2, surroundings=plan.surroundings)
    assert (outcome.ended, outcome.pauses) == ("timed out", 0)
    assert drone.confirmed is confirmed
    if not confirmed:  # the first command is given after the first tick, and holds from the second tick on
        assert sent[:2] == [None, None]
        assert sent[2] == drone.commands[1]


class Blind(NoCamera):
    """No images, for missions with a map."""

    def take(self) -> tuple[Detections, ...]:
        return ()

    def space_images(self, period_s: float) -> None:
        pass

    def expect_base(self, expected: BaseExpectations) -> None:
        pass


class Breaking(Pilot):
    def fly_to_goal(self) -> None:
        """Breaks."""
        raise RuntimeError("broken wing")


async def test_an_error_in_a_mission_aborts_with_its_state():
    drone, perception = starting()
    outcome = await fly_mission(drone, perception, load_mission("frame_challenge", Breaking))
    assert outcome.ended == "aborted"
    assert "state 'take_off.set_base': RuntimeError: broken wing" in outcome.reason
    assert "hold" in drone.calls


async def test_a_position_that_is_not_a_number_aborts():
    drone = KinematicDrone(*START_1)

    def spoil(moment):
        if moment.flight_time_s > 1:
            drone.x = float("nan")

    outcome = await fly_mission(drone, NoCamera(), MISSION, observer=spoil)
    assert "not finite" in outcome.reason
    assert drone.calls[-2:] == ["hold", "close"]


async def test_ctrl_c_holds_and_is_told():
    drone, perception = starting()

    def stop(moment):
        if moment.flight_time_s > 5:
            task.cancel()

    task = asyncio.create_task(fly_mission(yielding(drone), perception, MISSION, observer=stop))
    outcome = await task
    assert outcome.interrupted
    assert outcome.ended == "aborted"
    assert outcome.flight_time_s == pytest.approx(5.05, abs=0.06)
    assert drone.calls[-2:] == ["hold", "close"]


async def test_ctrl_c_after_motors_off_loses_no_result():
    drone, perception = starting()

    def stop(moment):
        if drone.calls[-1] == "motors_off":
            task.cancel()

    task = asyncio.create_task(fly_mission(yielding(drone), perception, MISSION, observer=stop))
    outcome = await task
    assert outcome.interrupted
    assert drone.calls[-2:] == ["motors_off", "close"]


async def test_an_observer_s_fault_still_holds_and_is_raised():
    drone, perception = starting()
    with pytest.raises(KeyError):
        await fly_mission(drone, perception, MISSION, observer=lambda m: {}["display"])
    assert drone.calls[-2:] == ["hold", "close"]


async def test_the_limit_counts_vehicle_time_from_motors_on():
    drone, perception = starting()
    outcome = await fly_mission(drone, perception, MISSION, limit_s=2.0)
    assert (outcome.ended, outcome.mission_state) == ("timed out", "take_off.set_base")
    assert outcome.flight_time_s == pytest.approx(2.05)


async def test_a_mission_that_ends_in_the_air_lands(tmp_path):
    path = tmp_path / "high.yaml"
    path.write_text(
        dedent("""\
            initial: up
            states:
              up:
                enter:
                  - hover
                  - cmd.vel_z = 0.5
                transitions:
                  - when: seconds_in_state > 2
                    to: enough
              enough:
                final: true
            """)
    )
    drone, perception = starting()
    moments = []
    drone.landing_us = 12_000_000
    outcome = await fly_mission(drone, perception, load_mission(str(path)), observer=moments.append)
    assert outcome.ended == "finished"
    assert drone.calls == ["connect", "ready", "motors_on", "land", "close"]
    landed_us = [
        moment.state.time_us for moment in moments if not moment.state.armed and moment.flight_time_s
    ]
    assert landed_us[-1] - landed_us[0] >= 3_000_000  # seen at rest by a referee who lives on telemetry


class Film:
    """A camera that gives some images and then stops, ends or fails."""

    def __init__(self, drone, images, then, timed=True):
        self.drone, self.images, self.then, self.timed = drone, images, then, timed

    async def frames(self):
        for _ in range(self.images):
            time_us = self.drone.time_us if self.timed else None
            yield CameraFrame(np.zeros((240, 320, 3), np.uint8), time_us, 0.0)
            await asyncio.sleep(0)
        if self.then == "fail":
            raise OSError("connection reset")
        if self.then == "silence":
            await asyncio.Event().wait()


def yielding(drone):
    """Let the camera's task run between ticks."""
    real_ticks = drone.ticks

    async def ticks():
        async for state in real_ticks():
            await asyncio.sleep(0)
            yield state

    drone.ticks = ticks
    return drone


@pytest.mark.parametrize("timed", [True, False])
@pytest.mark.parametrize(
    ("then", "reason"),
    [
        ("silence", "the camera is dead: no image for 1."),
        ("fail", "the camera failed: connection reset"),
        ("end", "the camera's stream ended"),
    ],
)
async def test_a_dead_camera_ends_the_flight(then, reason, timed):
    drone = yielding(KinematicDrone(*START_1))
    outcome = await fly_mission(drone, CameraPerception(Film(drone, 40, then, timed)), MISSION)
    assert outcome.ended == "aborted"
    assert outcome.reason.startswith(reason)
    assert drone.calls[-2:] == ["hold", "close"]
    assert 25 < outcome.ticks < 75


async def test_a_camera_without_a_first_image_is_an_error_before_the_flight():
    drone = KinematicDrone(*START_1)
    with pytest.raises(CameraLostError, match="connection reset"):
        await fly_mission(drone, CameraPerception(Film(drone, 0, "fail")), MISSION)
    assert drone.calls == ["connect", "close"]


async def test_old_images_from_a_buffer_count_as_old():
    drone = KinematicDrone(*START_1)
    perception = CameraPerception(
        Film(drone, 1, "silence"), lambda image, time_us: Detections(time_us=time_us)
    )
    await perception.open()
    assert perception.latest(drone.time_us + 1_000_000).time_us == drone.time_us
    with pytest.raises(CameraLostError, match=r"no image for 1\.1 s"):
        perception.latest(drone.time_us + 1_100_000)
    await perception.close()


@pytest.mark.parametrize("timed", [True, False])
async def test_an_image_without_a_time_stamp_gets_that_of_its_arrival_less_a_delay(timed):
    drone = KinematicDrone(*START_1)
    drone.time_us = 9_000_000
    film = Film(drone, 1, "silence", timed)
    perception = CameraPerception(film, lambda image, time_us: Detections(time_us=time_us))
    perception.assume_times(lambda wall_s: 7_000_000 + round(wall_s * 1e6), 0.15)
    await perception.open()
    assert perception.latest(9_100_000 if timed else 7_100_000).time_us == (9_000_000 if timed else 6_850_000)
    assert perception.oldest_s == pytest.approx(0.1 if timed else 0.25)
    await perception.close()


async def test_images_are_spaced_by_their_own_times():
    drone = KinematicDrone(*START_1)
    film = Film(drone, 40, "silence")
    perception = CameraPerception(film, lambda image, time_us: Detections(time_us=time_us))
    await perception.open()
    first_us = drone.time_us
    perception.take()
    perception.space_images(0.15)
    for _ in range(10):
        drone.time_us += 50_000
        await asyncio.sleep(0)
    taken_us = [one.time_us - first_us for one in perception.take()]
    assert taken_us == [150_000, 300_000, 450_000]
    assert perception.latest(drone.time_us + 1_000_000).time_us == first_us + 450_000
    perception.space_images(0.0)
    for _ in range(3):
        drone.time_us += 50_000
        await asyncio.sleep(0)
    assert len(perception.take()) == 3
    await perception.close()


async def test_every_image_since_the_last_call_is_taken_once():
    drone = KinematicDrone(*START_1)
    stamps_us = iter(range(drone.time_us, drone.time_us + 10_000, 100))
    perception = CameraPerception(
        Film(drone, 40, "silence"), lambda image, time_us: Detections(time_us=next(stamps_us))
    )
    await perception.open()
    taken = perception.take()
    for _ in range(3):
        await asyncio.sleep(0)
    taken += perception.take()
    assert [one.time_us - drone.time_us for one in taken] == list(range(0, 100 * len(taken), 100))
    assert taken[-1] == perception.latest(drone.time_us)
    assert perception.take() == ()
    for _ in range(60):
        await asyncio.sleep(0)
    assert len(perception.take()) == IMAGES_KEPT
    await perception.close()


async def test_observers_get_the_navigators_map_five_times_a_second(monkeypatch):
    made = []

    def view(engine):
        made.append(NavigationView(goal=engine.state))
        return made[-1]

    monkeypatch.setattr(MissionEngine, "navigation", property(view))
    drone, perception = starting()
    moments = []
    outcome = await fly_mission(drone, perception, MISSION, observer=moments.append)
    assert outcome.ended == "finished"
    renewed = [now for last, now in pairwise(moments) if now.navigation is not last.navigation]
    between_us = {now.state.time_us - last.state.time_us for last, now in pairwise(renewed)}
    assert between_us == {200_000}
    assert [moment.navigation for moment in renewed] == made[1:]
    assert moments[-1].navigation is made[-1]  # also at rest after the flight
