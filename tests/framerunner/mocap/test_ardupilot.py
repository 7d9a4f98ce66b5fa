"""Poses to an ArduCopter: a protocol fake, over a link without sockets, in simulated time."""

from functools import partial
from math import cos, nan, pi, sin

import pytest

from framerunner.geometry.rotations import multiply
from framerunner.mocap.facts import RoomOrigin, SendSettings, Unused
from framerunner.mocap.judgement import is_fused, judge, line
from framerunner.mocap.motion import PoseComparison
from framerunner.mocap.poses import MeasuredPose
from framerunner.mocap.session import COMPONENT_ID, SYSTEM_ID, MocapSession
from framerunner.mocap.sources import SitlSource, TimedPose
from framerunner.wire.dialect import mavlink
from framerunner.wire.framing import PacketReader
from offboard.safety.check import Outcome
from tests.framerunner.mocap.arducopter import TICK_US, FakeArduCopter

AHEAD_S = 7.0  # of vehicle time, by this program's clock
HALL = RoomOrigin(40.4168, -3.7038, 650.0)


class HandHeldSource:
    """The fake's true poses, late by a constant delay; a motion capture has no velocities."""

    def __init__(self, vehicle, *, delay_s=0.0, velocity=None, turned_deg=0.0):
        self.label, self.ended, self.fault, self.faults, self.needs_truth = "tracking", False, "", 0, False
        self.stopped, self.streams_hz, self.failure = False, {}, ""
        self._vehicle, self._delay_us, self._velocity = vehicle, round(delay_s * 1e6), velocity
        half = turned_deg * pi / 360.0
        self._turn = (cos(half), 0.0, 0.0, sin(half))

    def poll(self, now_s):
        time_us = self._vehicle.time_us - self._delay_us
        if self.stopped or self._vehicle.time_us % 20_000:
            return []
        attitude = multiply(self._vehicle.attitude(time_us), self._turn)
        return [
            TimedPose(MeasuredPose(nan, self._vehicle.position(time_us), attitude, self._velocity), now_s)
        ]

    def take(self, message, now_s):
        pass

    def close(self):
        pass


class Trial:
    """A fake ArduCopter and a session that is its link's other end."""

    def __init__(self, parameters=(), source=HandHeldSource, zero_s=0.0, **settings):
        self.vehicle = FakeArduCopter(**dict(parameters))
        self.now_s = AHEAD_S
        self.source = source(self.vehicle)
        self.sent, self.said = [], []
        self._packer = mavlink.MAVLink(None, SYSTEM_ID, COMPONENT_ID)
        self._reader, self._theirs = PacketReader(), PacketReader()
        settings = SendSettings(**settings)
        self.session = MocapSession(self, self.source, settings, self.said.append, zero_s)

    def receive(self, timeout_s):
        return [message for data in self.vehicle.take_output() for message in self._reader.feed(data)]

    def send(self, message):
        self.sent.append(message)
        for received in self._theirs.feed(message.pack(self._packer)):
            self.vehicle.take(received)

    def run(self, seconds):
        for _ in range(round(seconds * 1e6) // TICK_US):
            self.vehicle.tick()
            self.now_s += TICK_US / 1e6
            self.session.step(self.now_s, 0.0, lambda: self.now_s)
        return self

    def facts(self):
        return self.session.facts(self.now_s)

    def found(self, level=Outcome.FAIL):
        return {each.name: each for each in judge(self.facts()) if each.outcome is level}


def test_poses_without_velocity_are_sent_as_arducopter_takes_them_and_nothing_is_set():
    trial = Trial(position_sigma_m=0.02, attitude_sigma_rad=0.03, zero_s=1000.0).run(8.0)
    assert is_fused(trial.facts())
    assert set(trial.found()) == {"origin"}
    assert "50 Hz · fused" in line(trial.facts())
    assert "NO origin" in line(trial.facts())
    kinds = {message.get_type() for message in trial.sent}
    assert kinds == {
        "HEARTBEAT",
        "TIMESYNC",
        "PARAM_REQUEST_READ",
        "COMMAND_LONG",
        "VISION_POSITION_ESTIMATE",
    }
    pose = trial.vehicle.poses[-1]
    assert pose.covariance[0] == pytest.approx(4e-4)
    assert pose.covariance[20] == pytest.approx(9e-4)
    assert pose.usec == pytest.approx((trial.now_s + 1000.0) * 1e6, abs=25_000)


def test_poses_with_velocity_are_sent_as_odometry_in_frd():
    trial = Trial(source=partial(HandHeldSource, velocity=(0.0, 0.0, 0.0))).run(8.0)
    assert is_fused(trial.facts())
    assert {message.get_type() for message in trial.vehicle.poses} == {"ODOMETRY"}


def test_an_origin_is_set_once_and_again_after_a_restart():
    trial = Trial(origin=HALL).run(8.0)
    assert trial.vehicle.origins == 1
    assert trial.vehicle.origin == (404_168_000, -37_038_000, 650_000)
    assert trial.found() == {}
    assert "40.4168, -3.7038, 650 m" in trial.found(Outcome.PASS)["origin"].value
    trial.vehicle.restart()
    trial.run(8.0)
    assert trial.vehicle.origins == 1


@pytest.mark.parametrize("state", ["has one", "armed"])
def test_no_origin_is_set_where_one_is_known_or_motors_run(state):
    trial = Trial(origin=HALL)
    trial.vehicle.armed = state == "armed"
    trial.vehicle.origin = (1, 2, 3) if state == "has one" else None
    trial.run(8.0)
    assert trial.vehicle.origins == 0
    assert ("origin" in trial.found()) == (state == "armed")


def test_a_turned_vehicle_shows_axes_and_delay():
    trial = Trial({"VISO_DELAY_MS": 20}, partial(HandHeldSource, delay_s=0.03), origin=HALL)
    trial.vehicle.turning = True
    trial.run(25.0)
    assert trial.facts().comparison.delay_s == pytest.approx(0.03, abs=0.01)
    assert trial.found() == {}
    assert {"axes", "delay"} <= set(trial.found(Outcome.PASS))


def test_a_delay_that_is_wrong_by_a_tenth_of_a_second_is_missing():
    trial = Trial({"VISO_DELAY_MS": 10}, partial(HandHeldSource, delay_s=0.11), origin=HALL)
    trial.vehicle.turning = True
    trial.run(25.0)
    assert "VISO_DELAY_MS is 10: set it to" in trial.found()["delay"].advice


def test_a_delay_given_to_this_program_does_not_hide_a_wrong_parameter():
    trial = Trial({"VISO_DELAY_MS": 10}, partial(HandHeldSource, delay_s=0.11), origin=HALL, delay_s=0.1)
    trial.vehicle.turning = True
    trial.run(25.0)
    assert "delay" in trial.found()
    assert "VISO_DELAY_MS" in trial.found(Outcome.NOTE)["--delay"].advice


def test_a_body_that_is_turned_by_90_degrees_is_told_by_the_gyroscope():
    trial = Trial(source=partial(HandHeldSource, turned_deg=90.0), origin=HALL)
    trial.vehicle.turning = True
    trial.run(25.0)
    assert "axes WRONG" in line(trial.facts())
    assert "--forward" in trial.found()["axes"].advice


def test_poses_that_stop_are_not_fused_any_more():
    trial = Trial(origin=HALL).run(8.0)
    assert trial.found() == {}
    trial.source.stopped = True
    trial.run(2.0)
    assert trial.said == ["no pose for 0.2 s: nothing is sent until poses come again"]
    assert "NOT fused" in line(trial.facts())
    assert "no poses arrive now" in trial.found()["fused"].advice


def test_a_vehicle_that_left_the_poses_and_came_back_is_told():
    trial = Trial(origin=HALL).run(8.0)
    session = trial.session
    away = PoseComparison(50.0, track="north is mirrored")
    session.note_use(False, away, 10.0)  # it has used none yet
    session.note_use(True, PoseComparison(0.0), 1.0)
    session.note_use(False, away, 2.0)
    session.note_use(False, PoseComparison(), 10.0)
    assert session.unused == Unused(12.0, 50.0, "north is mirrored")
    trial.source.stopped = True
    trial.run(1.0)
    session.note_use(False, away, 10.0)
    trial.source.stopped = False
    trial.vehicle.restart()
    trial.run(2.0)
    session.note_use(False, away, 10.0)
    assert session.unused.seconds == 12.0


def test_visual_odometry_that_is_off():
    trial = Trial({"VISO_TYPE": 0}, origin=HALL).run(8.0)
    assert "NOT fused" in line(trial.facts())
    assert trial.found()["fused"].advice == "set the parameters that are named below"
    assert trial.found()["VISO_TYPE"].advice == "set it to 1, then restart the vehicle"


@pytest.mark.parametrize(
    ("parameters", "level", "subject", "words"),
    [
        ({"AHRS_EKF_TYPE": 10}, Outcome.FAIL, "AHRS_EKF_TYPE", "EKF3"),
        ({"EK3_SRC1_POSXY": 3}, Outcome.FAIL, "EK3_SRC1_POSXY", "position"),
        ({"EK3_SRC1_POSZ": 1}, Outcome.NOTE, "EK3_SRC1_POSZ", "height"),
        ({"EK3_SRC1_YAW": 1}, Outcome.NOTE, "EK3_SRC1_YAW", "heading"),
        ({"EK3_SRC1_VELXY": 3}, Outcome.FAIL, "EK3_SRC1_VELXY", "another sensor"),
        ({"EK3_SRC1_VELZ": 6}, Outcome.FAIL, "EK3_SRC1_VELZ", "does not send"),
        ({"VISO_QUAL_MIN": 10}, Outcome.FAIL, "VISO_QUAL_MIN", "quality"),
        ({"VISO_SCALE": 1.1}, Outcome.FAIL, "VISO_SCALE", "multiplies"),
        ({"VISO_POS_M_NSE": 0.2}, Outcome.NOTE, "VISO_POS_M_NSE", "slowly"),
        ({"VISO_YAW_M_NSE": 0.2}, Outcome.NOTE, "VISO_YAW_M_NSE", "slowly"),
    ],
)
def test_a_parameter_that_is_wrong_is_named(parameters, level, subject, words):
    trial = Trial(parameters, origin=HALL).run(6.0)
    assert words in trial.found(level)[subject].value


def test_a_firmware_without_visual_odometry_is_told():
    trial = Trial(origin=HALL)
    del trial.vehicle.parameters["VISO_TYPE"]
    trial.run(6.0)
    assert "no such parameter" in trial.found()["VISO_TYPE"].value


def test_arducopters_own_truth_is_requested_and_sent_back():
    trial = Trial(source=lambda _: SitlSource(), origin=HALL).run(8.0)
    assert is_fused(trial.facts())
    requested = [m.param1 for m in trial.sent if m.get_type() == "COMMAND_LONG"]
    assert mavlink.MAVLINK_MSG_ID_SIM_STATE in requested
    assert trial.found() == {}
