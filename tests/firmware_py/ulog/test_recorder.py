"""Logs of short lockstep flights, read by pyulog and compared with the true states."""

from dataclasses import dataclass
from io import BytesIO

import numpy as np
import pytest
from pyulog import ULog
from pyulog.px4 import PX4ULog

from firmware_py.autopilot import Autopilot
from firmware_py.parameters import Parameters
from firmware_py.status import CommandResult
from firmware_py.types import StatusText
from firmware_py.ulog import UlogRecorder
from framerunner.vehicle.airframe import load_airframe
from framerunner.vehicle.geodesy import GeodeticPoint
from scenarios.loader import load_scenario
from scenarios.models import Scenario
from sitl.simulation import Simulation
from sitl.storage import StorageLimits, TemporaryStorage
from sitl.world import World

ORIGIN = GeodeticPoint(47.397742, 8.545594, 489.0)
BOOT_US = 1_790_000_000_000_000
PATH = ("log", "2026-09-21", "13_33_20.ulg")


@dataclass
class Truth:
    time_us: int
    position_ned_m: tuple
    velocity_ned_m_s: tuple
    attitude: tuple
    rates: tuple


class Flight:
    """Take off, hover and land; record every tick's true state."""

    def __init__(self, storage=None):
        airframe = load_airframe("abejorro")
        self.world = World(Scenario(name="field"), airframe)
        parameters = Parameters({"MPC_LAND_SPEED": 0.5}, defaults=airframe.parameters)
        self.autopilot = Autopilot(airframe, ORIGIN, parameters)
        self.storage = storage or TemporaryStorage()
        self.recorder = UlogRecorder(self.storage, lambda time_us: PATH, boot_unix_us=BOOT_US)
        self.truth = []

    def run(self, seconds):
        for _ in range(round(seconds * 250)):
            self.tick()
        return self

    def tick(self):
        sensors = self.world.sensors()
        self.world.step(self.autopilot.step(sensors))
        self.recorder.update(self.autopilot)
        state = self.autopilot.state
        self.truth.append(
            Truth(
                state.time_us,
                state.position_ned_m,
                state.velocity_ned_m_s,
                state.attitude,
                state.angular_rate_frd_rad_s,
            )
        )

    def take_off(self, height_m):
        """From the first tick on; arming is possible shortly after."""
        self.run(1.0)
        assert self.autopilot.takeoff(ORIGIN.altitude_m + height_m) is CommandResult.ACCEPTED
        assert self.autopilot.arm() is CommandResult.ACCEPTED
        return self

    def fly(self):
        self.take_off(1.5).run(7.0)
        self.autopilot.parameters.set("MPC_LAND_SPEED", 0.7)
        self.recorder.hear_text(self.autopilot.state.time_us, StatusText(4, "something to worry about"))
        self.autopilot.land()
        while self.autopilot.status.armed:
            self.tick()
        self.run(0.1)
        return self

    def log(self, path=PATH):
        return ULog(BytesIO(self.storage.read(path, 0, 1 << 30)))


@pytest.fixture(scope="module")
def flown():
    return Flight().fly()


@pytest.fixture(scope="module")
def log(flown):
    return flown.log()


def columns(data, name, count):
    return np.stack([data[f"{name}[{place}]"] for place in range(count)], axis=1)


def test_the_file_is_valid_and_names_the_vehicle(log, flown):
    assert not log.file_corruption
    assert log.dropouts == []
    assert log.msg_info_dict["sys_name"] == "PX4"
    assert log.msg_info_dict["ver_hw"] == "PX4_SITL"
    assert log.msg_info_dict["ver_data_format"] == 2
    assert log.get_version_info_str() == "v1.17.0"
    first, last = flown.truth[250].time_us, flown.truth[-1].time_us
    assert log.start_timestamp == pytest.approx(first, abs=8000)
    assert log.last_timestamp == pytest.approx(last - 100_000, abs=8000)


def test_attitude_position_and_rates_are_the_true_ones(log, flown):
    by_time = {each.time_us: each for each in flown.truth}
    attitude = log.get_dataset("vehicle_attitude").data
    truth = [by_time[int(time_us)] for time_us in attitude["timestamp"]]
    assert columns(attitude, "q", 4) == pytest.approx(np.array([each.attitude for each in truth]), abs=1e-6)
    turning = log.get_dataset("vehicle_angular_velocity").data
    assert columns(turning, "xyz", 3) == pytest.approx(np.array([each.rates for each in truth]), abs=1e-5)
    place = log.get_dataset("vehicle_local_position").data
    truth = [by_time[int(time_us)] for time_us in place["timestamp"]]
    for axis, name in enumerate("xyz"):
        assert place[name] == pytest.approx([each.position_ned_m[axis] for each in truth], abs=1e-5)
        assert place["v" + name] == pytest.approx([each.velocity_ned_m_s[axis] for each in truth], abs=1e-5)
    assert -place["z"].min() > 0.9  # it has flown


def test_rates_of_the_topics(log):
    for name, rate_hz in (("vehicle_attitude", 50), ("vehicle_local_position", 10), ("battery_status", 2)):
        times = log.get_dataset(name).data["timestamp"]
        assert np.all(np.diff(times.astype(np.int64)) >= 0)
        assert len(times) / ((times[-1] - times[0]) / 1e6) == pytest.approx(rate_hz, rel=0.12), name


def test_modes_arming_and_landing(log):
    status = log.get_dataset("vehicle_status")
    changes = [int(state) for _, state in status.list_value_changes("nav_state")]
    assert changes[0] == 17  # take-off
    assert 18 in changes  # land
    assert status.data["arming_state"][0] == 2
    assert status.data["arming_state"][-1] == 1
    landed = log.get_dataset("vehicle_land_detected").data["landed"]
    assert (landed[0], landed.min(), landed[-1]) == (1, 0, 1)


def test_parameters_their_defaults_and_changes(log, flown):
    parameters = flown.autopilot.parameters
    assert len(log.initial_parameters) == len(parameters)
    assert log.initial_parameters["MPC_LAND_SPEED"] == pytest.approx(0.5)
    assert log.initial_parameters["MAV_TYPE"] == 2
    assert isinstance(log.initial_parameters["SYS_AUTOSTART"], int)
    assert log.has_default_parameters
    assert log.get_default_parameters(0) == {"MPC_LAND_SPEED": pytest.approx(0.7)}
    ((_, name, value),) = log.changed_parameters
    assert (name, value) == ("MPC_LAND_SPEED", pytest.approx(0.7))


def test_texts_have_their_level(log):
    (said,) = log.logged_messages
    assert (said.log_level_str(), said.message) == ("WARNING", "something to worry about")


def test_motors_gps_and_battery(log, flown):
    motors = log.get_dataset("actuator_motors").data
    hovering = columns(motors, "control", 4)[150]
    airframe = flown.autopilot.airframe
    expected = (airframe.hover_speed_rad_s / airframe.motor.max_speed_rad_s) ** 2
    assert hovering.mean() == pytest.approx(expected, rel=0.2)
    assert np.isnan(motors["control[4]"]).all()
    gps = log.get_dataset("vehicle_gps_position").data
    assert gps["latitude_deg"][0] == pytest.approx(ORIGIN.latitude_deg, abs=1e-6)
    assert gps["time_utc_usec"][0] - gps["timestamp"][0] == BOOT_US
    assert gps["fix_type"].min() == 3
    assert log.get_dataset("battery_status").data["voltage_v"].min() > 10.0


# Topics that Flight Review requires or plots (its plot_app, 2026).
FLIGHT_REVIEW = {
    "vehicle_attitude": ["q[0]", "q[3]"],
    "vehicle_angular_velocity": ["xyz[0]", "xyz[2]"],
    "vehicle_local_position": [
        *("x", "y", "z", "vx", "vy", "vz", "xy_valid", "z_valid", "v_xy_valid", "v_z_valid"),
        *("ref_timestamp", "ref_lat", "ref_lon", "dist_bottom", "dist_bottom_valid"),
    ],
    "vehicle_local_position_setpoint": ["x", "y", "z", "vx", "vy", "vz"],
    "vehicle_global_position": ["alt"],
    "vehicle_gps_position": [
        *("latitude_deg", "longitude_deg", "altitude_msl_m", "fix_type", "time_utc_usec", "vel_m_s"),
        *("eph", "epv", "hdop", "vdop", "s_variance_m_s", "satellites_used"),
        *("noise_per_ms", "jamming_indicator"),
    ],
    "vehicle_air_data": ["baro_alt_meter"],
    "vehicle_magnetometer": ["magnetometer_ga[0]", "magnetometer_ga[2]"],
    "vehicle_status": ["nav_state", "is_vtol", "vehicle_type", "failsafe", "failsafe_and_user_took_over"],
    "vehicle_thrust_setpoint": ["xyz[0]", "xyz[1]", "xyz[2]"],
    "actuator_motors": [f"control[{place}]" for place in range(12)],
    "actuator_outputs": ["noutputs", "output[0]", "output[15]"],
    "sensor_combined": ["accelerometer_m_s2[0]", "gyro_rad[2]"],
    "estimator_status": ["health_flags", "timeout_flags", "time_slip"],
    "battery_status": ["voltage_v", "current_a", "discharged_mah", "remaining"],
    "vehicle_land_detected": ["landed"],
}


@pytest.mark.parametrize("topic", FLIGHT_REVIEW)
def test_topics_that_flight_review_reads_exist(log, topic):
    data = log.get_dataset(topic).data
    missing = [name for name in FLIGHT_REVIEW[topic] if name not in data]
    assert missing == []


def test_pyulogs_px4_helpers_work(log):
    helper = PX4ULog(log)
    assert helper.get_mav_type() == "Quadrotor"
    helper.add_roll_pitch_yaw()
    assert np.abs(log.get_dataset("vehicle_attitude").data["roll"]).max() < 0.5


def test_a_log_can_be_read_while_it_is_written():
    flight = Flight().take_off(1.0).run(2.5)
    log = flight.log()
    assert not log.file_corruption
    seconds = (log.last_timestamp - log.start_timestamp) / 1e6
    assert 1.9 < seconds < 2.5


def test_an_erased_log_is_begun_again():
    flight = Flight().take_off(1.0).run(1.5)
    flight.storage.remove(PATH)
    flight.storage.remove_folder(PATH[:2])
    flight.run(3.0)
    log = flight.log()
    assert not log.file_corruption
    assert log.initial_parameters["MAV_TYPE"] == 2
    assert len(log.get_dataset("vehicle_attitude").data["timestamp"]) > 20


def test_the_oldest_log_is_removed_and_a_full_storage_ends_logging_with_a_text():
    storage = TemporaryStorage(StorageLimits(total_bytes=60_000))
    for folder in (("log",), ("log", "2026-01-01")):
        storage.make_folder(folder)
    old = ("log", "2026-01-01", "00_00_00.ulg")
    storage.create(old)
    storage.write(old, 0, bytes(40_000))
    note = ("log", "2025", "note.txt")
    storage.make_folder(note[:-1])
    storage.create(note)
    flight = Flight(storage).take_off(1.0).run(2.5)
    with pytest.raises(FileNotFoundError):
        storage.entry(old)
    assert storage.entry(note)
    flight.run(4.0)
    assert flight.recorder.path is None
    assert any("Logging stopped" in text.text for text in flight.autopilot.take_texts())
    assert storage.entry(PATH).size <= 60_000


def test_a_log_that_is_there_is_not_replaced():
    storage = TemporaryStorage()
    for depth in (1, 2):
        storage.make_folder(PATH[:depth])
    storage.create(PATH)
    storage.write(PATH, 0, b"of an earlier flight")
    flight = Flight(storage).take_off(1.0).run(2.5)
    assert storage.read(PATH, 0, 100) == b"of an earlier flight"
    assert flight.recorder.path == (*PATH[:2], "13_33_20_2.ulg")


def test_nothing_is_written_when_logging_is_off():
    flight = Flight()
    flight.autopilot.parameters.set("SDLOG_MODE", -1)
    flight.take_off(1.0).run(2.0)
    assert flight.recorder.path is None


def test_nothing_is_written_on_the_ground():
    flight = Flight().run(1.0)
    assert flight.storage.entries(()) == []


def test_with_sensors_the_samples_and_the_estimators_condition_are_logged():
    scenario = load_scenario("open-field").model_copy(update={"sensors": "outdoor"})
    simulation = Simulation(scenario, seed=4)
    storage = TemporaryStorage()
    recorder = UlogRecorder(storage, lambda time_us: PATH, boot_unix_us=BOOT_US)
    while simulation.time_us < 13_000_000:
        simulation.tick()
        recorder.update(simulation.autopilot)
        if simulation.time_us == 8_000_000:
            simulation.autopilot.takeoff()
            simulation.autopilot.arm()
    recorder.finish(simulation.autopilot)
    log = ULog(BytesIO(storage.read(PATH, 0, 1 << 30)))
    status = log.get_dataset("estimator_status").data
    assert set(status["control_mode_flags"][-2:] & 0x17) == {0x17}  # aligned, GPS, compass
    assert 0.5 < status["pos_horiz_accuracy"][-1] < 3.0
    assert status["pos_test_ratio"].max() > 0.0
    fix = log.get_dataset("vehicle_gps_position").data
    assert (fix["timestamp_sample"] < fix["timestamp"]).all()  # it arrives late
    assert 0.5 < fix["eph"][-1] < 2.0
    place = log.get_dataset("vehicle_local_position").data
    assert place["eph"][-1] == pytest.approx(status["pos_horiz_accuracy"][-1], rel=0.1)
    assert place["xy_valid"].all()
    assert np.std(log.get_dataset("sensor_combined").data["accelerometer_m_s2[0]"]) > 0.1  # vibration
