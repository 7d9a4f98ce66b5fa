"""Poses to a simulated drone over a link without sockets, in simulated time, and the judgement of it."""

from dataclasses import replace
from functools import partial
from math import nan

import pytest

from firmware_py.mavlink.node import MavlinkNode, NodeOptions
from firmware_py.mavlink.telemetry.profiles import ONBOARD
from firmware_py.setpoints import BodyVelocitySetpoint
from firmware_py.status import FlightMode
from framerunner.mocap.facts import Facts, RoomOrigin, SendSettings, Unused
from framerunner.mocap.judgement import is_fused, judge, line
from framerunner.mocap.motion import PoseComparison
from framerunner.mocap.poses import MeasuredPose
from framerunner.mocap.session import COMPONENT_ID, SYSTEM_ID, MocapSession
from framerunner.mocap.sources import SitlSource, TimedPose
from framerunner.mocap.vehicle import PoseVehicle
from framerunner.wire.dialect import mavlink
from framerunner.wire.framing import PacketReader
from framerunner.wire.session.record import Record
from offboard.safety.check import Outcome
from scenarios.loader import load_scenario
from sitl.simulation import Simulation

AHEAD_S = 3.0  # of vehicle time, by this program's clock


class TrackingSource:
    """The true poses of a simulation as a motion capture has them: late, and stamped by their arrival."""

    def __init__(self, simulation, delay_s=0.0):
        self.label, self.ended, self.fault, self.faults, self.needs_truth = "tracking", False, "", 0, False
        self.stopped, self.streams_hz, self.failure = False, {}, ""
        self._simulation, self._delay_s = simulation, delay_s
        self._waiting = []

    def poll(self, now_s):
        simulation = self._simulation
        if simulation.time_us // 4000 % 5 == 0 and not self.stopped:
            true, _ = simulation.true_state()
            noise_m = 1e-4 * (simulation.time_us // 20_000 % 7)
            north_m, east_m, down_m = true.position_ned_m
            pose = MeasuredPose(nan, (north_m + noise_m, east_m, down_m), true.attitude)
            self._waiting.append((now_s, pose))
        due = [pose for time_s, pose in self._waiting if time_s + self._delay_s <= now_s]
        self._waiting = self._waiting[len(due) :]
        return [TimedPose(pose, now_s) for pose in due]

    def take(self, message, now_s):
        pass

    def close(self):
        pass


class Trial:
    """A simulated drone with the suite `external`, its node, and a session that is its link's other end."""

    def __init__(self, source=TrackingSource, **settings):
        scenario = load_scenario("open-field").model_copy(update={"sensors": "external"})
        self.simulation = Simulation(scenario, seed=2)
        self.autopilot = self.simulation.autopilot
        self.node = MavlinkNode(self.autopilot, (ONBOARD,), NodeOptions(truth=self.simulation.true_state))
        self._packer = mavlink.MAVLink(None, SYSTEM_ID, COMPONENT_ID)
        self._reader = PacketReader()
        self.sent, self.said = [], []
        self.source = source(self.simulation)
        self.session = MocapSession(self, self.source, SendSettings(**settings), self.said.append)

    def receive(self, timeout_s):
        return [message for _, data in self.node.take_output() for message in self._reader.feed(data)]

    def send(self, message):
        self.sent.append(message)
        self.node.add_input("onboard", message.pack(self._packer))
        self.node.process_input("onboard", 100)

    @property
    def now_s(self):
        return self.simulation.time_us / 1e6 + AHEAD_S

    def run(self, seconds, setpoint=None):
        for tick in range(round(seconds * 250)):
            if setpoint is not None and tick % 12 == 0:
                self.autopilot.accept_setpoint(setpoint(self.simulation.time_us))
            now_us = self.simulation.time_us
            self.simulation.tick()
            self.node.update(now_us)
            self.session.step(self.now_s, 0.0, lambda: self.now_s)
        return self

    def facts(self):
        return self.session.facts(self.now_s)

    def missing(self):
        return [finding.name for finding in judge(self.facts()) if finding.outcome is Outcome.FAIL]

    def sent_of(self, kind):
        return [message for message in self.sent if message.get_type() == kind]


def wandering(time_us):
    """Commands that tilt and turn the drone."""
    phase = time_us // 700_000 % 4
    forward, right = ((2.0, 0.0), (0.0, 2.0), (-2.0, 0.0), (0.0, -2.0))[phase]
    return BodyVelocitySetpoint(time_us, (forward, right, 0.0), 1.2 if phase % 2 else -1.0)


def test_a_standing_drone_uses_the_poses_and_nothing_in_it_is_changed():
    trial = Trial().run(12.0)
    facts = trial.facts()
    assert is_fused(facts)
    assert trial.missing() == []
    assert facts.rate_hz == pytest.approx(50.0, abs=2.0)
    assert facts.comparison.distance_m < 0.02
    assert trial.session.vehicle.offset_s == pytest.approx(-AHEAD_S, abs=0.01)
    assert {message.get_type() for message in trial.sent} == {
        "HEARTBEAT",
        "TIMESYNC",
        "PARAM_REQUEST_READ",
        "COMMAND_LONG",
        "ODOMETRY",
    }
    commands = {message.command for message in trial.sent_of("COMMAND_LONG")}
    assert commands == {mavlink.MAV_CMD_SET_MESSAGE_INTERVAL}
    assert "50 Hz · fused" in line(facts)
    assert trial.autopilot.parameters.changed() == {}


def test_what_a_vehicle_has_told_before_it_died_does_not_count():
    trial = Trial().run(8.0)
    facts = trial.session.facts(trial.now_s + 20.0)
    assert line(facts).startswith("the vehicle is not heard for 20 s; is it running?")
    assert is_fused(facts) is None
    (gone,) = (finding for finding in judge(facts) if finding.outcome is Outcome.FAIL)
    assert (gone.name, gone.value) == ("vehicle", "not heard for 20 s")
    assert "· fused" in line(trial.run(3.0).facts())  # it was only silent


def test_an_estimator_that_tells_nothing_more_is_not_known_to_use_the_poses():
    trial = Trial().run(8.0)
    trial.session.vehicle.heard_s = trial.now_s + 6.0  # by its heartbeats
    assert is_fused(trial.session.facts(trial.now_s + 6.0)) is None


def test_what_is_sent():
    trial = Trial(position_sigma_m=0.02, attitude_sigma_rad=0.03).run(2.0)
    pose = trial.sent_of("ODOMETRY")[-1]
    assert pose.estimator_type == mavlink.MAV_ESTIMATOR_TYPE_VISION
    assert (pose.frame_id, pose.child_frame_id) == (
        mavlink.MAV_FRAME_LOCAL_NED,
        mavlink.MAV_FRAME_BODY_FRD,
    )
    assert pose.pose_covariance[0] == pytest.approx(4e-4)
    assert pose.pose_covariance[20] == pytest.approx(9e-4)
    assert pose.time_usec == pytest.approx(trial.now_s * 1e6, abs=25_000)


def test_a_flight_by_poses_that_are_late_shows_axes_and_delay():
    trial = Trial(partial(TrackingSource, delay_s=0.03)).run(4.0)
    trial.autopilot.takeoff()
    trial.autopilot.arm()
    trial.run(10.0)
    trial.autopilot.accept_setpoint(wandering(trial.simulation.time_us))
    trial.run(0.1, wandering)
    trial.autopilot.set_mode(FlightMode.OFFBOARD)
    trial.run(20.0, wandering)
    facts = trial.facts()
    assert trial.autopilot.status.mode is FlightMode.OFFBOARD
    assert facts.comparison.moves
    assert facts.comparison.axes == ""
    assert facts.comparison.delay_s == pytest.approx(0.03, abs=0.012)
    assert facts.comparison.correlation > 0.8
    delay = next(finding for finding in judge(facts) if finding.name == "delay")
    assert delay.outcome is Outcome.NOTE
    assert "EKF2_EV_DELAY is 0 ms: set it to" in delay.advice


def test_a_source_that_stops_is_told_once_and_nothing_is_sent():
    trial = Trial().run(4.0)
    sent = len(trial.sent_of("ODOMETRY"))
    trial.source.stopped = True
    trial.run(3.0)
    assert trial.said == ["no pose for 0.2 s: nothing is sent until poses come again"]
    assert len(trial.sent_of("ODOMETRY")) == sent
    assert trial.session.silent
    trial.source.stopped = False
    trial.run(1.0)
    assert trial.said[1:] == ["poses are back after 3.0 s"]
    assert trial.session.dropouts == 1


def test_a_simulators_truth_is_requested_and_sent_back():
    trial = Trial(lambda _: SitlSource()).run(6.0)
    assert len(trial.sent_of("ODOMETRY")) > 150
    assert is_fused(trial.facts())
    requested = [m.param1 for m in trial.sent_of("COMMAND_LONG")]
    assert mavlink.MAVLINK_MSG_ID_HIL_STATE_QUATERNION in requested


def test_a_faster_source_is_thinned_out():
    trial = Trial(rate_hz=25.0).run(5.0)
    assert trial.facts().rate_hz == pytest.approx(25.0, abs=1.0)


def recorded(flags, *, parameters=None):
    """A record of a PX4 vehicle, which sends no health of vision."""
    record, packer = Record(), mavlink.MAVLink(None, 1, 1)
    reader = PacketReader()
    for message in (
        mavlink.MAVLink_heartbeat_message(2, mavlink.MAV_AUTOPILOT_PX4, 29, 0x03040000, 3, 3),
        mavlink.MAVLink_sys_status_message(0x2F, 0x2F, 0x2F, *[0] * 12, 0),
        mavlink.MAVLink_estimator_status_message(1, flags, *[0.0] * 8),
    ):
        for each in reader.feed(message.pack(packer)):
            record.take(each, 0.0)
    record.parameters |= parameters or {}
    return record


RELATIVE = mavlink.ESTIMATOR_PRED_POS_HORIZ_REL
GLOBAL = mavlink.ESTIMATOR_PRED_POS_HORIZ_ABS
RIGHT = PoseComparison(0.01, 0.2, 0.3, moves=True, delay_s=0.0, correlation=0.95)


@pytest.mark.parametrize(
    ("flags", "control", "distance_m", "expected"),
    [
        (RELATIVE, 15, 0.01, True),
        (RELATIVE, 0, 0.01, False),
        (RELATIVE | GLOBAL, 15, 2.0, False),  # by GPS, in another frame
        (0, 15, 0.01, False),
        (RELATIVE, 15, nan, False),
    ],
)
def test_whether_px4_uses_the_poses(flags, control, distance_m, expected):
    record = recorded(flags, parameters={"EKF2_EV_CTRL": control})
    facts = Facts(record, replace(RIGHT, distance_m=distance_m), 100, 50.0)
    assert is_fused(facts) is expected


@pytest.mark.parametrize(
    ("changes", "subject", "advice"),
    [
        ({"parameters": {"EKF2_EV_CTRL": 0}}, "fused", "EKF2_EV_CTRL is 0: set it to 15"),
        ({"comparison": replace(RIGHT, tilt_deg=90.0)}, "tilt", "--frame"),
        ({"comparison": replace(RIGHT, heading_deg=90.0)}, "heading", "--forward"),
        ({"comparison": replace(RIGHT, distance_m=0.3)}, "position", "step 6"),
        ({"comparison": replace(RIGHT, correlation=0.2)}, "axes", "rigid"),
        ({"sent": 0}, "poses", "tracked"),
        ({"unused": Unused(12.0, 50.0)}, "used", "by hand"),
        (
            {"worst_ratio": 2.0, "comparison": replace(RIGHT, distance_m=0.4)},
            "innovation",
            "see gaps, axes and delay",
        ),
    ],
)
def test_what_is_missing_and_what_to_do(changes, subject, advice):
    parameters = changes.pop("parameters", {"EKF2_EV_CTRL": 15})
    record = recorded(changes.pop("flags", RELATIVE), parameters=parameters)
    given = {"comparison": RIGHT, "sent": 100, "rate_hz": 50.0} | changes
    found = {each.name: each for each in judge(Facts(record, **given)) if each.outcome is Outcome.FAIL}
    assert advice in found[subject].advice


def test_a_right_setup_has_no_missing_finding():
    record = recorded(RELATIVE, parameters={"EKF2_EV_CTRL": 15, "EKF2_HGT_REF": 3})
    facts = Facts(record, RIGHT, 100, 50.0, 0.03, converts_stamps=True)
    assert {finding.outcome for finding in judge(facts)} == {Outcome.PASS}


@pytest.mark.parametrize("origin", [None, RoomOrigin(47.4, 8.5, 400.0)])
def test_an_origin_is_set_in_a_px4_only_if_one_is_given(origin):
    vehicle, reader = PoseVehicle(origin=origin), PacketReader()
    heartbeat = mavlink.MAVLink_heartbeat_message(2, mavlink.MAV_AUTOPILOT_PX4, 29, 0x03040000, 3, 3)
    for message in reader.feed(heartbeat.pack(mavlink.MAVLink(None, 1, 1))):
        vehicle.take(message, 0.0)
    kinds = {message.get_type() for tick in range(30) for message in vehicle.due(tick / 10)}
    assert ("SET_GPS_GLOBAL_ORIGIN" in kinds) == (origin is not None)


def test_no_origin_is_set_in_a_drone_that_has_one():
    trial = Trial(origin=RoomOrigin(47.4, 8.5, 400.0)).run(6.0)
    assert trial.sent_of("SET_GPS_GLOBAL_ORIGIN") == []
    assert "origin" in {finding.name for finding in judge(trial.facts())}
