"""An operator at a ground station takes the drone out of a mission, flies it aside and gives it back."""

from __future__ import annotations

import asyncio
import time
from math import hypot
from textwrap import dedent

import pytest
from pymavlink import mavutil

from offboard.app import fly_mission
from offboard.mavsdk_drone import MavsdkDrone
from offboard.mission import load_mission
from tests.offboard.fakes import NoCamera
from tests.realtime.conftest import Peer

mavlink = mavutil.mavlink
pytestmark = pytest.mark.realtime

SET_MODE = mavlink.MAV_CMD_DO_SET_MODE
MANUAL_INPUT_AND_CUSTOM = 1 | 128
OFFBOARD, POSCTL = 6, 3
STAYS_S = 5.0  # longer than MAVSDK goes on by itself with the setpoints it was last given

MISSION = dedent("""\
    initial: rise
    states:
      rise:
        enter:
          - hover
          - goal_m = (imu.x, imu.y, imu.z + 1.2)
        during:
          - fly_to_goal
        transitions:
          - when: distance_to_goal_m < 0.1
            to: ahead
      ahead:
        resume: look_round
        enter:
          - hover
          - cmd.vel_x = 0.2
        transitions:
          - when: seconds_in_state >= 8
            to: down
      look_round:
        enter:
          - hover
          - cmd.rot_z = 0.5
        transitions:
          - when: seconds_in_state >= 2
            to: down
      down:
        enter:
          - land
        final: true
    """)


class GroundStation(Peer):
    """An operator with sticks; he keeps them in his hands, at rest, after he has given the drone back."""

    main_mode = 0

    def read(self, seconds):
        """As a peer does; the camera's heartbeats show no mode."""
        came = super().read(seconds)
        for message in came:
            if message.get_type() == "HEARTBEAT" and message.get_srcComponent() == 1:
                self.main_mode = message.custom_mode >> 16 & 0xFF
        return came

    def hold_sticks(self, until, limit_s=15.0, **sticks):
        """Send the sticks at some 25 Hz until a condition holds."""
        end_s = time.monotonic() + limit_s
        while not until():
            assert time.monotonic() < end_s, f"waited in vain for {limit_s:g} s; mode {self.main_mode}"
            x, y = sticks.get("forward", 0), sticks.get("right", 0)
            self.link.mav.manual_control_send(self.link.target_system, x, y, 500, 0, 0)
            self.read(0.04)

    def choose(self, main_mode):
        """Ask for a mode and wait until a heartbeat shows it."""
        self.link.mav.command_long_send(
            *(self.link.target_system, 1, SET_MODE, 0, MANUAL_INPUT_AND_CUSTOM, main_mode, 0, 0, 0, 0, 0)
        )
        self.hold_sticks(lambda: self.main_mode == main_mode, 5.0)

    @property
    def place(self):
        told = self.latest["LOCAL_POSITION_NED"]
        return told.x, told.y


def take_and_give_back(station, moments, landed):
    """What the operator does; on a thread of his own."""
    state = lambda: moments[-1].mission_state if moments else ""  # noqa: E731
    station.hold_sticks(lambda: state() == "ahead", 30.0)
    station.choose(POSCTL)
    station.hold_sticks(lambda: moments[-1].paused)
    x, y = station.place
    station.hold_sticks(lambda: hypot(station.place[0] - x, station.place[1] - y) > 1.0, right=500)
    since_s = time.monotonic()
    station.hold_sticks(lambda: time.monotonic() > since_s + STAYS_S, STAYS_S + 5.0)
    station.choose(OFFBOARD)
    station.hold_sticks(landed.is_set, 60.0)


async def test_a_pilot_takes_the_drone_flies_it_aside_and_gives_it_back(sim, instance, tmp_path):
    path = tmp_path / "small.yaml"
    path.write_text(MISSION)
    station = await asyncio.to_thread(GroundStation, 14550 + instance)
    moments, landed = [], asyncio.Event()
    try:
        await asyncio.to_thread(station.wait, "LOCAL_POSITION_NED")
        pilot = asyncio.create_task(asyncio.to_thread(take_and_give_back, station, moments, landed))
        drone = MavsdkDrone(f"udpin://127.0.0.1:{14540 + instance}")
        outcome = await fly_mission(drone, NoCamera(), load_mission(str(path)), observer=moments.append)
        landed.set()
        await pilot
    finally:
        landed.set()
        station.link.close()
    assert (outcome.ended, outcome.reason, outcome.mission_state) == ("finished", "", "down")
    assert outcome.pauses == 1
    paused = [moment for moment in moments if moment.paused]
    assert {moment.mission_state for moment in paused} == {"ahead"}
    assert paused[-1].flight_time_s - paused[0].flight_time_s > STAYS_S
    first, last = paused[0].state, paused[-1].state
    assert hypot(last.x - first.x, last.y - first.y) > 0.9  # it was the operator who moved it
    at_rest = [moment.state for moment in paused if moment.flight_time_s > paused[-1].flight_time_s - 3.0]
    assert max(hypot(state.x - last.x, state.y - last.y) for state in at_rest) < 0.15  # and nobody else
    went_on = moments[moments.index(paused[-1]) + 1]
    assert (went_on.mission_state, went_on.transition.when) == ("look_round", "resume")
    assert went_on.state.mode == "OFFBOARD"
