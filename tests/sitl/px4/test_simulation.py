"""A drone that PX4 flies: its remote control, and faults of what PX4 gets."""

import os
import struct

import pytest
from pymavlink.dialects.v20 import common as mavlink

from framerunner.errors import SettingError
from scenarios.faults.declaration import FaultError, parse_fault
from scenarios.loader import load_scenario
from sitl.ardupilot.simulation import ArduPilotSimulation
from sitl.px4.parameters import RC_PARAMETERS
from sitl.px4.simulation import Px4Simulation
from sitl.px4.simulator_messages import ActuatorControls
from sitl.px4.transmitter import CENTRED, Joystick, open_transmitter
from sitl.simulation import Simulation

AXIS, BUTTON = 2, 1


def flown(faults=(), sticks=None, seconds=1.0):
    """Times and channels of the RC_CHANNELS that PX4 gets when it is armed from the start."""
    scenario = load_scenario("test-case-1").model_copy(
        update={"sensors": "mocap", "faults": tuple(map(parse_fault, faults))}
    )
    simulation = Px4Simulation(scenario, transmitter=sticks)
    got = []
    for _ in range(round(seconds * 250)):
        time_us = simulation.time_us
        for message in mavlink.MAVLink(None).parse_buffer(simulation.sense()):
            if message.get_type() == "RC_CHANNELS":
                assert message.chancount == RC_PARAMETERS["RC_CHAN_CNT"]
                values = [getattr(message, f"chan{number}_raw") for number in range(1, 19)]
                got.append((time_us, tuple(values[: message.chancount])))
        simulation.move(ActuatorControls(time_us, (0.0,) * 16, armed=True))
    return got


def test_without_a_transmitter_px4_gets_no_channels():
    assert flown() == []


def test_the_channels_come_fifty_times_a_second_until_the_link_fails():
    sticks = iter(range(1000, 2000))

    def moving():
        return (next(sticks), *CENTRED[1:])

    got = flown(["rc off at 0.5 s for 0.3 s"], moving)
    times_s = [time_us / 1e6 for time_us, _ in got]
    assert len([time_s for time_s in times_s if time_s < 0.5]) == pytest.approx(25, abs=1)
    assert not [time_s for time_s in times_s if 0.53 < time_s < 0.79]
    assert len([time_s for time_s in times_s if time_s > 0.79]) == pytest.approx(10, abs=1)
    firsts = [channels[0] for _, channels in got]
    assert firsts == sorted(set(firsts))


def test_a_receiver_that_is_stuck_repeats_what_it_had_and_a_fault_brings_its_transmitter():
    sticks = iter(range(1000, 2000))
    got = flown(["rc stuck at 0.5 s"], lambda: (next(sticks), *CENTRED[1:]))
    assert {channels[0] for time_us, channels in got if time_us > 510_000} == {got[-1][1][0]}
    assert len({channels[0] for time_us, channels in got if time_us < 490_000}) > 20
    assert [channels for _, channels in flown(["rc stuck at 0.2 s"])] == [
        CENTRED
    ] * 49  # not in the first tick


def test_our_own_autopilot_has_no_remote_control_and_others_have_a_link_of_their_own():
    scenario = load_scenario("test-case-1").model_copy(update={"sensors": "mocap"})
    with pytest.raises(FaultError, match="only a drone that PX4 flies has a remote control"):
        Simulation(scenario.model_copy(update={"faults": (parse_fault("rc off at 1 s"),)}))
    for vehicle, name in ((Px4Simulation, "PX4"), (ArduPilotSimulation, "ArduPilot")):
        with pytest.raises(
            FaultError, match=f"the link to the app is {name}'s own; leave it out with {name}"
        ):
            vehicle(scenario.model_copy(update={"faults": (parse_fault("link off at 1 s"),)}))


def test_a_joystick_moves_the_channels_until_it_is_pulled_out(tmp_path):
    path = tmp_path / "js0"
    os.mkfifo(path)
    reading = os.open(path, os.O_RDONLY | os.O_NONBLOCK)  # so that it can be opened for writing
    writing = os.open(path, os.O_WRONLY)
    joystick = Joystick(str(path))
    os.close(reading)
    assert joystick() == CENTRED
    events = [(-32767, AXIS | 0x80, 0), (32767, AXIS, 4), (1, BUTTON, 0), (9, AXIS, 20), (1, BUTTON, 30)]
    os.write(writing, b"".join(struct.pack("<IhBB", 1, *event) for event in events))
    channels = joystick()
    assert channels == (1000, 1500, 1500, 1500, 2000, 1000, 1000, 1000, 2000, *CENTRED[9:])
    os.close(writing)
    assert joystick() is None
    path.unlink()
    assert [joystick() for _ in range(120)] == [None] * 120


@pytest.mark.parametrize("name", ["/dev/no", "/dev", __file__])
def test_what_is_no_device_is_one_line(name):
    assert open_transmitter("centred")() == CENTRED
    with pytest.raises(SettingError, match=rf"--transmitter {name}: cannot be read .* or centred"):
        open_transmitter(name)


def test_a_gyroscope_that_is_off_is_not_flagged_and_its_tick_is_not_answered():
    scenario = load_scenario("test-case-1").model_copy(
        update={"sensors": "mocap", "faults": (parse_fault("gyroscope off at 0.5 s"),)}
    )
    simulation = Px4Simulation(scenario)
    flags, speeds = {}, []
    for _ in range(200):
        time_us = simulation.time_us
        for message in mavlink.MAVLink(None).parse_buffer(simulation.sense()):
            if message.get_type() == "HIL_SENSOR":
                flags[simulation.is_answered] = message.fields_updated & 0b111_111
                assert message.xgyro == message.xgyro  # a number
        answer = ActuatorControls(time_us, (0.5,) * 16, armed=True)
        simulation.move(answer if simulation.is_answered else None)
        speeds.append(simulation.world.dynamics.motor_speeds_rad_s()[0])
    assert flags == {True: 0b111_111, False: 0b111}
    assert speeds[-1] == pytest.approx(speeds[110], rel=0.01)  # the motors go on
    assert simulation.armed
