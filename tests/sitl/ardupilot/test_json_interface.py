"""ArduPilot's packets and lines, and the steps that they make, without sockets."""

import json
from itertools import pairwise
from math import inf

import pytest
from hypothesis import given
from hypothesis import strategies as st

from framerunner.cli import run
from framerunner.errors import SettingError
from framerunner.vehicle.airframe import load_airframe
from scenarios.loader import load_scenario
from sitl.ardupilot.json_interface import ServoFrame, decode_frame, encode_state
from sitl.ardupilot.parameters import all_parameters
from sitl.ardupilot.server import FrameExchange
from sitl.ardupilot.simulation import ArduPilotSimulation
from sitl.sensors.suite import load_suite
from tests.sitl.ardupilot.fake_ardupilot import LAYOUTS, parse

STILL = (1000,) * 16
NUMBERS = st.floats(-1e4, 1e4)
VECTORS = st.tuples(NUMBERS, NUMBERS, NUMBERS)


def frame(number, pulses=STILL):
    return ServoFrame(500, number, pulses)


def exchange(sensors="ideal", seed=0, clock=lambda: 0.0):
    """An exchange and its simulation."""
    scenario = load_scenario("test-case-1").model_copy(update={"sensors": sensors})
    simulation = ArduPilotSimulation(scenario, seed=seed)
    return FrameExchange(simulation, clock), simulation


@pytest.mark.parametrize("channels", [16, 32])
def test_frames_of_both_sizes_are_read(channels):
    magic, layout = LAYOUTS[channels]
    pulses = tuple(range(1000, 1000 + channels))
    assert decode_frame(layout.pack(magic, 1200, 7, *pulses)) == ServoFrame(1200, 7, pulses)


@given(st.binary(max_size=80))
def test_what_is_no_frame_is_ignored(packet):
    sizes = {magic.to_bytes(2, "little"): layout.size for magic, layout in LAYOUTS.values()}
    assert (decode_frame(packet) is None) == (sizes.get(packet[:2]) != len(packet))


@given(st.integers(0, 10**10), VECTORS, VECTORS, st.tuples(*[st.floats(-1, 1)] * 4))
def test_the_line_is_json_that_ardupilot_can_parse(time_us, vector, other, quaternion):
    line = encode_state(
        time_us,
        angular_rate_frd_rad_s=vector,
        specific_force_frd_m_s2=other,
        position_ned_m=vector,
        velocity_ned_m_s=other,
        attitude=quaternion,
        range_m=1.5,
    )
    read, strict = json.loads(line), parse(line)
    assert read["timestamp"] == strict["timestamp"] == pytest.approx(time_us / 1e6, abs=1e-6)
    assert read["imu"]["gyro"] == list(strict["gyro"]) == pytest.approx(vector, rel=1e-8)
    assert strict["accel_body"] == pytest.approx(other, rel=1e-8)
    assert strict["quaternion"] == pytest.approx(quaternion, rel=1e-8)
    assert read["rng_1"] == 1.5


def test_each_frame_is_one_step_of_the_physics():
    steps, _ = exchange()
    times = [parse(steps.answer(frame(number)))["timestamp"] for number in range(501)]
    assert {round(later - earlier, 6) for earlier, later in pairwise(times)} == {0.002}
    assert steps.steps == 501


def test_a_repeated_frame_makes_no_step_and_is_answered_only_if_its_answer_was_lost():
    now_s = [0.0]
    steps, _ = exchange(clock=lambda: now_s[0])
    first = steps.answer(frame(0))
    assert steps.answer(frame(0)) is None  # sent when the answer was on its way
    now_s[0] = 1.0
    assert steps.answer(frame(0)) == first
    assert (steps.steps, steps.repeated) == (1, 2)
    assert parse(steps.answer(frame(1)))["timestamp"] > parse(first)["timestamp"]


def test_pulses_fly_the_drone_and_show_it_armed():
    steps, simulation = exchange()
    for number in range(100):
        steps.answer(frame(number))
    assert not simulation.armed
    for number in range(100, 900):
        steps.answer(frame(number, (1400,) * 4 + (0,) * 12))
    assert simulation.armed
    assert simulation.truth.position_arena_m[2] > 1.0
    assert simulation.referee.snapshot().motors_on


def test_the_same_pulses_make_the_same_lines():
    def lines():
        steps, _ = exchange("mocap", seed=5)
        return [steps.answer(frame(number, (1300 + number % 7,) * 16)) for number in range(400)]

    assert lines() == lines()


def test_a_range_finder_too_near_to_measure_sends_its_shortest_distance_until_it_has_measured():
    simulation = ArduPilotSimulation(load_scenario("test-case-1").model_copy(update={"sensors": "outdoor"}))
    lines = [simulation.step((1000,) * 16) for _ in range(100)]
    assert b'"rng_1":0.1000}' in lines[-1]
    lines += [simulation.step((1400,) * 16) for _ in range(800)]  # it climbs
    lines += [simulation.step((1010,) * 16) for _ in range(1500)]  # armed, and on the ground again
    assert b'"rng_1":-1.0000}' in lines[-1]
    assert not any(b"nan" in line for line in lines)


@pytest.mark.parametrize("name", ["abejorro", "x500", "racer-3in"])
def test_parameters_suit_the_airframe(name):
    values = all_parameters(load_airframe(name), load_suite("mocap"))
    assert 0.125 <= values["MOT_THST_HOVER"] < 0.65  # ArduCopter's limits of its estimate
    assert values["MOT_SPIN_MIN"] < values["MOT_SPIN_MAX"] <= 1.0
    assert {values[f"SERVO{number}_FUNCTION"] for number in range(1, 5)} == {33, 34, 35, 36}
    assert all(0 < values[f"ATC_RAT_{axis}_P"] < inf for axis in ("RLL", "PIT", "YAW"))


def test_a_drone_that_is_no_quadrotor_in_x_is_refused():
    x500 = load_airframe("x500")
    swapped = x500.model_copy(update={"rotors": (*x500.rotors[2:], *x500.rotors[:2])})
    with pytest.raises(SettingError, match="quadrotor in X"):
        all_parameters(swapped, load_suite("mocap"))


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--ardupilot", "here"], "--ardupilot here: is for ArduPilot; add --autopilot ardupilot"),
        (["--autopilot", "ardupilot", "--ardupilot", "nowhere"], "has no arducopter"),
        (["--autopilot", "ardupilot", "--count", "2"], "--count: ArduPilot flies one drone"),
        (["--autopilot", "ardupilot", "--shell"], "--shell: MAVLink is ArduPilot's own"),
    ],
)
def test_options_that_do_not_fit_are_refused_in_words(options, words, capsys):
    assert run(["sim", "--video-rtp", "off", *options]) == 2
    assert words in capsys.readouterr().err
