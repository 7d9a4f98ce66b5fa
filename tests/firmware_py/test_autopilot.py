"""The whole autopilot on a point mass that follows the stabiliser's commands exactly."""

from dataclasses import replace
from math import cos, nan, sin

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware_py.autopilot import Autopilot
from firmware_py.commands import FlightLimits, VelocityFrdCommand
from firmware_py.parameters import Parameters
from firmware_py.setpoints import TrajectorySetpoint
from firmware_py.status import CommandResult, FlightMode, LandedState
from firmware_py.types import MotorOutput
from framerunner.vehicle.airframe import load_airframe
from framerunner.vehicle.geodesy import GeodeticPoint
from framerunner.vehicle.measurements import Sensors

AIRFRAME = load_airframe("abejorro")
ORIGIN = GeodeticPoint(47.397742, 8.545594, 489.0)
BASE = (2.0, -1.0, -0.5)  # where it stands
HOVER = (AIRFRAME.hover_speed_rad_s / AIRFRAME.motor.max_speed_rad_s) ** 2
OFF = (0.0, 0.0, 0.0, 0.0)
OK, NO = CommandResult.ACCEPTED, CommandResult.TEMPORARILY_REJECTED
UP, STILL, DOWN, NORTH = (0.0, 0.0, -0.5), (0.0, 0.0, 0.0), (0.0, 0.0, 0.5), (1.0, 0.0, 0.0)


class Obedient:
    """A stabiliser that only records commands; low thrust stands for a descent."""

    def __init__(self):
        self.command = None
        self.grounded = False
        self.limits = FlightLimits(1.0)

    def reset(self):
        pass

    def idle(self):
        self.command = None
        return MotorOutput((100.0,) * 4, 0.004)

    def step(self, state, command, *, grounded=False):
        self.command, self.grounded = command, grounded
        share = 0.5 if command.velocity_level_m_s[2] > state.velocity_ned_m_s[2] + 0.01 else 1.0
        return MotorOutput((400.0,) * 4, share * HOVER)


class Flight:
    """An autopilot on a point mass over a flat ground."""

    def __init__(self, changed=None):
        parameters = Parameters(changed, defaults=AIRFRAME.parameters)
        self.stabiliser = Obedient()
        self.autopilot = Autopilot(AIRFRAME, ORIGIN, parameters, stabiliser=self.stabiliser)
        self.sensors = Sensors(0, BASE, STILL, (1.0, 0.0, 0.0, 0.0), STILL, (0.0, 0.0, -9.8))
        self.yaw = 0.0
        self.texts = []

    @property
    def status(self):
        return self.autopilot.status

    @property
    def height_m(self):
        return BASE[2] - self.sensors.position_ned_m[2]

    def tick(self):
        speeds = self.autopilot.step(self.sensors)
        self.texts += [message.text for message in self.autopilot.take_texts()]
        self._move(self.stabiliser.command if any(speeds) else None)
        return speeds

    def run(self, seconds, setpoint=None, **parts):
        for tick in range(round(seconds * 250)):
            if setpoint is not None and tick % 12 == 0:
                self.feed(setpoint, **parts)
            self.tick()
        return self

    def feed(self, velocity, **parts):
        self.autopilot.accept_setpoint(
            TrajectorySetpoint(self.sensors.time_us, velocity_ned_m_s=velocity, **parts)
        )

    def airborne(self):
        """Ready, taken off and holding."""
        self.run(1.0)
        assert self.autopilot.takeoff() is OK
        assert self.autopilot.arm() is OK
        self.run(10.0)
        assert self.status.mode is FlightMode.HOLD
        self.texts.clear()
        return self

    def in_offboard(self):
        """The same, following setpoints."""
        self.airborne()
        self.feed(STILL)
        assert self.autopilot.set_mode(FlightMode.OFFBOARD) is OK
        self.texts.clear()
        return self

    def _move(self, command: VelocityFrdCommand | None):
        north, east, down = self.sensors.position_ned_m
        if command is None:
            falls = self.height_m > 0
            velocity = (0.0, 0.0, self.sensors.velocity_ned_m_s[2] + 0.04 if falls else 0.0)
        else:
            forward, right, sink = command.velocity_level_m_s
            c, s = cos(self.yaw), sin(self.yaw)
            velocity = (c * forward - s * right, s * forward + c * right, sink)
            self.yaw += 0.004 * command.yaw_rate_rad_s
        down += 0.004 * velocity[2]
        if down >= BASE[2]:
            down, velocity = BASE[2], STILL
        self.sensors = replace(
            self.sensors,
            time_us=self.sensors.time_us + 4000,
            position_ned_m=(north + 0.004 * velocity[0], east + 0.004 * velocity[1], down),
            velocity_ned_m_s=velocity,
            attitude=(cos(self.yaw / 2), 0.0, 0.0, sin(self.yaw / 2)),
        )


def test_it_boots_in_hold_disarmed_and_is_ready_within_a_second():
    flight = Flight()
    assert flight.autopilot.global_position() is None
    assert flight.tick() == OFF
    assert not flight.status.ready
    assert flight.autopilot.arm() is NO
    flight.run(1.0)
    assert flight.status.ready
    assert flight.status.mode is FlightMode.HOLD
    assert flight.status.landed_state is LandedState.ON_GROUND
    assert flight.texts == ["Arming denied: Resolve system health failures first", "Ready for takeoff!"]


def test_origin_and_home_are_at_the_boot_position():
    flight = Flight().run(0.1)
    origin = flight.status.origin
    assert origin is not None
    assert origin.altitude_m == pytest.approx(489.5)
    assert flight.status.home == origin
    assert flight.autopilot.global_position() == origin
    assert flight.autopilot.state.position_ned_m == STILL


def test_home_moves_to_the_arming_position():
    flight = Flight().run(1.0)
    flight.sensors = replace(flight.sensors, position_ned_m=(12.0, -1.0, BASE[2]))
    flight.run(0.1)
    flight.autopilot.arm()
    assert flight.status.home_ned_m == pytest.approx((10.0, 0.0, 0.0))
    assert flight.status.home == flight.autopilot.global_position()


def test_arming_after_a_takeoff_command_flies_to_the_default_height():
    flight = Flight().run(1.0)
    assert flight.autopilot.takeoff() is OK
    assert flight.status.mode is FlightMode.TAKEOFF
    assert flight.tick() == OFF
    assert flight.autopilot.arm() is OK
    flight.run(1.0)
    assert flight.status.landed_state is LandedState.TAKEOFF
    flight.run(9.0)
    assert flight.status.mode is flight.status.intended_mode is FlightMode.HOLD
    assert flight.status.landed_state is LandedState.IN_AIR
    assert flight.height_m == pytest.approx(2.5, abs=0.01)
    assert "Using default takeoff altitude: 2.5 m" in flight.texts
    assert "Takeoff detected" in flight.texts


def test_takeoff_to_an_altitude_above_the_sea():
    flight = Flight().run(1.0)
    flight.autopilot.arm()
    assert flight.autopilot.takeoff(489.5 + 1.0) is OK
    flight.run(8.0)
    assert flight.height_m == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize("altitude_m", [0.0, -1e9, 489.5])
def test_takeoff_to_a_lower_altitude_stays_on_the_ground(altitude_m):
    flight = Flight().run(1.0)
    flight.autopilot.arm()
    assert flight.autopilot.takeoff(altitude_m) is OK
    flight.run(3.0)
    assert flight.height_m == 0.0


def test_takeoff_to_a_lower_altitude_stays_in_the_air():
    flight = Flight().airborne()
    assert flight.autopilot.takeoff(490.0) is OK
    flight.run(2.0)
    assert flight.height_m == pytest.approx(2.5, abs=0.02)
    assert flight.texts == ["Already higher than takeoff altitude"]
    assert flight.status.mode is FlightMode.HOLD


def test_an_infinite_altitude_is_denied():
    flight = Flight().run(1.0)
    assert flight.autopilot.takeoff(float("inf")) is CommandResult.DENIED
    assert flight.status.mode is FlightMode.HOLD


def test_armed_on_the_ground_it_idles_and_disarms_by_itself():
    flight = Flight().run(1.0)
    flight.autopilot.arm()
    assert flight.autopilot.arm() is OK
    flight.run(9.9)
    assert flight.autopilot.output.speeds_rad_s == (100.0,) * 4
    flight.run(0.2)
    assert not flight.status.armed
    assert flight.texts[-1] == "Disarmed by auto preflight disarming"


def test_landing_ends_with_motors_off_two_seconds_after_touching():
    flight = Flight().airborne()
    assert flight.autopilot.land() is OK
    flight.run(1.0)
    assert flight.status.landed_state is LandedState.LANDING
    while flight.status.landed_state is not LandedState.ON_GROUND:
        flight.tick()
    assert flight.height_m == 0.0
    assert flight.autopilot.output.throttle < 0.01  # idles as soon as it stands
    flight.run(1.9)
    assert flight.status.armed
    flight.run(0.2)
    assert not flight.status.armed
    assert flight.status.mode is FlightMode.HOLD
    assert [text for text in flight.texts if "anding" in text] == ["Landing detected", "Disarmed by landing"]


def test_disarming_in_the_air_must_be_forced():
    flight = Flight().airborne()
    assert flight.autopilot.disarm() is NO
    assert flight.texts == []
    flight.tick()
    assert flight.texts == ["Disarming denied: not landed"]
    assert flight.autopilot.disarm(force=True) is OK
    assert flight.autopilot.output.speeds_rad_s == OFF
    assert flight.tick() == OFF


def test_it_can_be_armed_again_after_a_flight():
    flight = Flight().in_offboard()
    flight.autopilot.disarm(force=True)
    flight.run(3.0)
    assert flight.status.mode is FlightMode.HOLD
    assert flight.status.ready
    assert flight.autopilot.arm() is OK


def test_offboard_needs_setpoints_when_armed():
    flight = Flight().airborne()
    assert flight.autopilot.set_mode(FlightMode.OFFBOARD) is NO
    flight.tick()
    assert flight.texts == ["Switching to Offboard is currently not available"]
    assert flight.status.mode is FlightMode.HOLD
    flight.feed(STILL)
    assert flight.autopilot.set_mode(FlightMode.OFFBOARD) is OK


def test_offboard_chosen_disarmed_without_setpoints_is_not_ready():
    flight = Flight().run(1.0)
    assert flight.autopilot.set_mode(FlightMode.OFFBOARD) is OK
    flight.tick()
    assert not flight.status.ready
    assert flight.autopilot.arm() is NO
    flight.feed(STILL)
    flight.tick()
    assert flight.status.ready
    assert flight.autopilot.arm() is OK
    assert flight.status.mode is FlightMode.OFFBOARD


@pytest.mark.parametrize("velocity", [STILL, DOWN, NORTH, (0.0, 0.0, -0.01)])
def test_offboard_on_the_ground_idles_until_a_climb_is_commanded(velocity):
    flight = Flight().run(1.0, velocity)
    flight.autopilot.set_mode(FlightMode.OFFBOARD)
    flight.autopilot.arm()
    flight.run(1.0, velocity)
    assert flight.stabiliser.command is None
    assert flight.height_m == 0.0
    flight.feed((0.3, 0.0, -0.25), yaw_rate_rad_s=1.0)
    flight.tick()
    assert flight.stabiliser.command == VelocityFrdCommand((0.0, 0.0, -0.25), 0.0)  # straight up first
    assert flight.stabiliser.grounded
    flight.run(0.1)
    assert flight.status.landed_state is LandedState.IN_AIR
    assert not flight.stabiliser.grounded
    assert flight.stabiliser.command.velocity_level_m_s[2] == -0.25


def test_integrals_are_released_when_lift_off_takes_longer():
    flight = Flight().run(1.0, UP)
    flight.autopilot.set_mode(FlightMode.OFFBOARD)
    flight.autopilot.arm()
    for _ in range(200):
        flight.feed(UP)
        flight.autopilot.step(flight.sensors)  # commanded, and it does not move
        flight.sensors = replace(flight.sensors, time_us=flight.sensors.time_us + 4000)
    assert flight.status.landed_state is LandedState.ON_GROUND
    assert not flight.stabiliser.grounded


def test_offboard_flies_its_setpoint():
    flight = Flight().in_offboard()
    before = flight.sensors.position_ned_m
    flight.run(2.0, (0.5, 0.25, -0.1), yaw_rate_rad_s=0.5)
    after = flight.sensors.position_ned_m
    assert [b - a for a, b in zip(before, after, strict=True)] == pytest.approx([1.0, 0.5, -0.2], abs=0.01)
    assert flight.autopilot.state.yaw_rad == pytest.approx(1.0, abs=0.01)


def test_an_offboard_descent_lands_and_disarms():
    flight = Flight().in_offboard()
    flight.run(9.0, DOWN)
    assert not flight.status.armed
    assert "Disarmed by landing" in flight.texts


def test_lost_setpoints_hold_then_land_then_disarm():
    flight = Flight().in_offboard()
    flight.run(0.2, NORTH)
    last_us = flight.autopilot._commander.situation.setpoint_us
    while not flight.status.failsafe:
        assert flight.stabiliser.command.velocity_level_m_s == NORTH  # the last setpoint is flown on
        flight.tick()
    assert flight.autopilot.state.time_us - last_us == 1_004_000
    assert (flight.status.mode, flight.status.intended_mode) == (FlightMode.HOLD, FlightMode.OFFBOARD)
    flight.run(4.9)
    assert flight.status.mode is FlightMode.HOLD
    assert flight.sensors.velocity_ned_m_s == pytest.approx(STILL, abs=0.01)
    flight.run(0.2)
    assert flight.status.mode is FlightMode.LAND
    flight.run(10.0)
    assert not flight.status.armed
    assert not flight.status.failsafe
    assert flight.texts == [
        "Failsafe activated: offboard setpoints lost, hold",
        "Failsafe: landing",
        "Landing detected",
        "Disarmed by landing",
        "Ready for takeoff!",
    ]


@pytest.mark.parametrize("lost_s", [2.0, 7.0])
def test_offboard_resumes_when_setpoints_return(lost_s):
    flight = Flight().in_offboard()
    flight.run(lost_s)
    assert flight.status.failsafe
    flight.run(0.1, NORTH)
    assert flight.status.mode is FlightMode.OFFBOARD
    assert not flight.status.failsafe
    assert flight.sensors.velocity_ned_m_s == NORTH


def test_another_mode_ends_the_failsafe():
    flight = Flight().in_offboard()
    flight.run(2.0)
    assert flight.autopilot.set_mode(FlightMode.HOLD) is OK
    assert not flight.status.failsafe
    flight.run(8.0, NORTH)
    assert flight.status.mode is FlightMode.HOLD


def test_setpoints_lost_on_the_ground_end_disarmed():
    flight = Flight({"COM_DISARM_PRFLT": 30.0}).run(1.0, STILL)
    flight.autopilot.set_mode(FlightMode.OFFBOARD)
    flight.autopilot.arm()
    flight.run(6.5)
    assert not flight.status.armed
    assert flight.texts[-2:] == ["Disarmed by failsafe", "Ready for takeoff!"]


def test_an_unusable_setpoint_is_refused_with_one_text_and_ignored():
    flight = Flight().in_offboard()
    flight.run(1.5, (nan, nan, nan))
    assert flight.status.failsafe
    assert flight.texts == [
        "Offboard setpoint ignored: nothing in it can be flown",
        "Failsafe activated: offboard setpoints lost, hold",
    ]


def test_a_changed_parameter_takes_effect_in_flight():
    flight = Flight().in_offboard()
    flight.autopilot.parameters.set("COM_OF_LOSS_T", 0.2)
    flight.autopilot.parameters.set("MPC_XY_VEL_MAX", 0.5)
    flight.tick()
    flight.feed(NORTH)
    for _ in range(4):  # setpoints are flown from the next multiple of 10 ms on
        flight.tick()
    assert flight.sensors.velocity_ned_m_s[0] == 0.5
    flight.run(0.3)
    assert flight.status.failsafe


def test_a_tumbling_vehicle_stops_its_motors():
    flight = Flight().airborne()
    for _ in range(80):
        flight.sensors = replace(flight.sensors, attitude=(0.5**0.5, 0.5**0.5, 0.0, 0.0))
        speeds = flight.tick()
    assert speeds == OFF
    assert flight.texts[-1] == "Attitude failure: flight terminated"
    assert flight.status.mode is FlightMode.TERMINATION
    assert flight.autopilot.set_mode(FlightMode.HOLD) is NO
    assert flight.autopilot.disarm() is OK
    assert flight.autopilot.arm() is NO


@pytest.mark.parametrize("fault", ["not finite", "stuck"])
def test_lost_sensors_are_bridged_and_then_stop_the_motors(fault):
    flight = Flight().airborne()
    before = flight.autopilot.output.speeds_rad_s
    sensors = flight.sensors
    flight.autopilot.step(sensors)
    for tick in range(80):
        if fault == "not finite":
            bad_velocity = (nan, 0.0, 0.0)
            sensors = replace(sensors, time_us=sensors.time_us + 4000, velocity_ned_m_s=bad_velocity)
        speeds = flight.autopilot.step(sensors)
        assert speeds == (before if tick < 75 else OFF)
    assert flight.autopilot.take_texts()[0].text == "Sensors lost: flight terminated"
    assert flight.status.mode is FlightMode.TERMINATION


def test_texts_that_are_not_taken_are_limited():
    autopilot = Flight().autopilot
    for number in range(1000):
        autopilot.say(6, f"text {number}")
    texts = autopilot.take_texts()
    assert len(texts) <= 100
    assert texts[-1].text == "text 999"
    assert autopilot.take_texts() == []


ACTIONS = {
    "arm": lambda flight: flight.autopilot.arm(),
    "disarm": lambda flight: flight.autopilot.disarm(),
    "kill": lambda flight: flight.autopilot.disarm(force=True),
    "takeoff": lambda flight: flight.autopilot.takeoff(491.0),
    "land": lambda flight: flight.autopilot.land(),
    "hold": lambda flight: flight.autopilot.set_mode(FlightMode.HOLD),
    "offboard": lambda flight: flight.autopilot.set_mode(FlightMode.OFFBOARD),
    "climb": lambda flight: flight.run(0.5, UP),
    "sink": lambda flight: flight.run(0.5, DOWN),
    "wait": lambda flight: flight.run(0.7),
    "wait long": lambda flight: flight.run(3.0),
    "glitch": lambda flight: flight.autopilot.step(replace(flight.sensors, velocity_ned_m_s=(nan, 0.0, 0.0))),
}


@settings(max_examples=60)
@given(names=st.lists(st.sampled_from(sorted(ACTIONS)), max_size=25))
def test_no_sequence_of_commands_breaks_the_rules(names):
    flight = Flight()
    for name in names:
        armed, ready = flight.status.armed, flight.status.ready
        in_air = flight.status.landed_state is not LandedState.ON_GROUND
        answer = ACTIONS[name](flight)
        status, output = flight.status, flight.autopilot.output
        if name == "arm" and not armed:
            assert status.armed == (answer is OK) == ready
        if not armed and name != "arm":
            assert not status.armed
        if name == "disarm" and armed and in_air:
            assert answer is NO
            assert status.armed
        if name == "kill":
            assert not status.armed
        flight.tick()
        assert any(output.speeds_rad_s) <= status.armed
        assert status.failsafe <= status.armed
        assert (status.mode is FlightMode.OFFBOARD) <= (status.intended_mode is FlightMode.OFFBOARD)


def test_the_same_flight_twice_is_bit_identical():
    def fly():
        flight = Flight().in_offboard()
        flight.run(1.0, (0.3, -0.2, -0.1), yaw_rate_rad_s=0.7)
        flight.autopilot.land()
        flight.run(10.0)
        return repr(flight.sensors), flight.texts

    assert fly() == fly()
