"""Axes and delay, by poses and a vehicle that is turned and carried by hand."""

from dataclasses import dataclass
from math import cos, isnan, sin

import pytest

from framerunner.geometry.rotations import quaternion_from_euler, rotated_by_rate
from framerunner.mocap.motion import MotionCheck, SentPose
from framerunner.mocap.poses import Axes, MeasuredPose, in_ned, with_forward
from framerunner.wire.dialect import mavlink
from framerunner.wire.vehicle_telemetry import VehicleTelemetry

SECONDS = 12.0
NED = Axes.NED


@dataclass
class ByHand:
    """A vehicle that is turned about all axes and carried around, at 250 Hz, from a vehicle time of 40 s."""

    turns: float = 1.0

    def __post_init__(self):
        self.track = []
        attitude = quaternion_from_euler(0.0, 0.0, 0.4)
        for tick in range(round(SECONDS * 250)):
            t = tick / 250
            rate = tuple(
                self.turns * part for part in (0.9 * cos(3.0 * t), 0.7 * sin(2.3 * t), 0.8 * cos(1.1 * t))
            )
            attitude = rotated_by_rate(attitude, rate, 0.004)
            position = (0.8 * sin(0.9 * t), 0.5 * sin(1.7 * t), -1.0 + 0.3 * sin(1.3 * t))
            self.track.append((40_000_000 + tick * 4000, position, attitude, rate))

    def report(self, *, changed=lambda position: position):
        """What the vehicle's telemetry says; `changed` makes the position that its estimator believes."""
        telemetry, rates = VehicleTelemetry(), []
        for time_us, position, (w, x, y, z), rate in self.track[::5]:
            ms = time_us // 1000
            rates.append((time_us, *rate))
            telemetry.take(mavlink.MAVLink_attitude_quaternion_message(ms, w, x, y, z, *rate))
            telemetry.take(mavlink.MAVLink_local_position_ned_message(ms, *changed(position), 0, 0, 0))
        return telemetry, rates

    def checked(self, change=lambda pose: pose, *, delay_us=0, period=5):
        """The check, with poses that are later than their time stamps, and changed."""
        check = MotionCheck()
        for time_us, position, attitude, _ in self.track[::period]:
            pose = change(MeasuredPose(time_us / 1e6, position, attitude))
            check.note(SentPose(time_us + delay_us, pose.position_ned_m, pose.attitude))
        return check


@pytest.mark.parametrize("delay_us", [0, 45_000, 130_000])
def test_right_axes_and_the_delay(delay_us):
    hand = ByHand()
    found = hand.checked(delay_us=delay_us).compare(*hand.report())
    assert found.moves
    assert (found.axes, found.track) == ("", "")
    assert found.delay_s == pytest.approx(delay_us / 1e6, abs=0.006)
    assert found.correlation > 0.95


def test_right_poses_are_where_the_vehicle_is():
    hand = ByHand()
    found = hand.checked().compare(*hand.report())
    assert found.distance_m < 0.005
    assert abs(found.heading_deg) < 0.5
    assert found.tilt_deg < 0.5


@pytest.mark.parametrize(
    ("change", "words"),
    [
        # Data in NED that are taken for forward, left, up.
        (
            lambda pose: in_ned(pose, Axes.FLU),
            "the vehicle's right is the poses' reversed right, "
            "the vehicle's down is the poses' reversed down",
        ),
        (
            lambda pose: with_forward(pose, 90.0),
            "the vehicle's forward is the poses' right, the vehicle's right is the poses' reversed forward",
        ),
        (
            lambda pose: in_ned(pose, Axes.YUP),
            "the vehicle's right is the poses' reversed down, the vehicle's down is the poses' right",
        ),
    ],
)
def test_wrong_body_axes_are_named(change, words):
    hand = ByHand()
    found = hand.checked(change).compare(*hand.report())
    assert found.axes == words
    assert isnan(found.delay_s)


def test_a_body_that_is_another_vehicle_does_not_correlate():
    hand, other = ByHand(), ByHand(turns=-0.3)
    other.track = [(t, p, q, (r[2], r[0], -r[1])) for t, p, q, r in reversed(other.track)]
    other.track = [(h[0], *o[1:]) for h, o in zip(hand.track, other.track, strict=True)]
    found = other.checked().compare(*hand.report())
    assert found.axes or found.correlation < 0.7


def test_a_vehicle_that_stands_tells_only_offsets():
    hand = ByHand(turns=0.0)
    found = hand.checked().compare(*hand.report())
    assert not found.moves
    assert isnan(found.delay_s)
    assert found.distance_m < 0.005


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        (lambda p: (p[0], -p[1], p[2]), "east is mirrored"),
        (lambda p: (p[1], p[0], p[2]), "north and east are swapped"),
        (lambda p: (-p[0], -p[1], p[2]), "north and east are both reversed"),
    ],
)
def test_a_track_that_differs_from_the_poses_is_named(changed, words):
    hand = ByHand(turns=0.0)
    found = hand.checked().compare(*hand.report(changed=changed))
    assert (found.axes, found.track) == ("", words)


def test_poses_tilted_by_a_body_that_was_not_level():
    hand = ByHand(turns=0.0)
    tilt = quaternion_from_euler(0.0, 0.3, 0.0)

    def tilted(pose):
        from framerunner.geometry.rotations import multiply

        return MeasuredPose(pose.time_s, pose.position_ned_m, multiply(pose.attitude, tilt))

    assert hand.checked(tilted).compare(*hand.report()).tilt_deg == pytest.approx(17.2, abs=0.2)
