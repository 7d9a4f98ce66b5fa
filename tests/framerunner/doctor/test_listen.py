"""What is received from a drone and recorded, what is requested, and that nothing is changed in it."""

import itertools
import random
import struct
from math import nan

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from framerunner.cli import run
from framerunner.doctor import listen
from framerunner.doctor.listen import PARAMETERS
from framerunner.wire.dialect import mavlink
from framerunner.wire.framing import SequenceCounter
from framerunner.wire.session.client import VehicleClient
from framerunner.wire.session.record import SUMMARY, Record
from framerunner.wire.session.session import ParameterValue, VehicleError

HARMLESS = {"HEARTBEAT", "COMMAND_LONG", "PARAM_REQUEST_READ"}


class Wire:
    """Packs messages as a vehicle's and reads them back, with sequence numbers."""

    def __init__(self, system=1, component=1):
        self.codec = mavlink.MAVLink(None, srcSystem=system, srcComponent=component)
        self.reader = mavlink.MAVLink(None)

    def over(self, message):
        data = message.pack(self.codec)
        self.codec.seq = (self.codec.seq + 1) % 256
        return self.reader.parse_buffer(data)[0]


def heartbeat(kind=2, autopilot=12, base_mode=29):
    return mavlink.MAVLink_heartbeat_message(kind, autopilot, base_mode, 3 << 24 | 4 << 16, 3, 3)


def text(words, identity=0, chunk=0):
    return mavlink.MAVLink_statustext_message(4, words.encode(), identity, chunk)


def heard(*messages, system=1, component=1):
    record, wire = Record(), Wire(system, component)
    for index, message in enumerate([heartbeat(), *messages]):
        record.take(wire.over(message), index * 0.1)
    return record


@given(st.integers(0, 255), st.integers(1, 2000), st.floats(0, 0.3), st.integers(0, 2**31))
def test_lost_packets_are_counted_by_their_numbers(first, count, share, seed):
    chance = random.Random(seed)
    kept = [0, *(k for k in range(1, count - 1) if chance.random() >= share), max(count - 1, 0)]
    counter = SequenceCounter()
    for number in sorted(set(kept)):
        counter.take((first + number) % 256)
    assert counter.sent == count
    assert counter.lost_share == pytest.approx(1 - len(set(kept)) / count)


def test_swapped_and_doubled_packets_are_no_loss():
    counter = SequenceCounter()
    for number in (254, 0, 255, 1, 1, 2):
        counter.take(number)
    assert counter.sent == 5
    assert counter.lost_share == 0.0


def test_the_first_vehicle_is_recorded_and_others_are_left_out():
    record = Record()
    station, camera, other = Wire(255, 190), Wire(1, 100), Wire(2, 1)
    record.take(station.over(heartbeat(kind=6, autopilot=8)), 0.0)
    assert record.system_id is None
    record.take(Wire().over(heartbeat()), 0.0)
    record.take(other.over(heartbeat()), 0.1)
    record.take(camera.over(heartbeat(kind=30, autopilot=8)), 0.1)
    record.take(other.over(text("not mine")), 0.2)
    assert record.system_id == 1
    assert (record.counts, record.cameras, record.stations) == ({"HEARTBEAT": 1}, {100}, {(255, 190)})
    assert not record.texts


def test_rates_count_from_the_first_to_the_last():
    record, wire = heard(), Wire()
    for index in range(11):
        record.take(wire.over(mavlink.MAVLink_attitude_message(1000 + index * 19, *[0.0] * 6)), index * 0.02)
    assert record.rate_hz("ATTITUDE") == pytest.approx(50.0)
    assert record.rate_hz("HEARTBEAT") == record.rate_hz("ODOMETRY") == 0.0
    assert record.real_time_factor is None  # too short
    record.take(wire.over(mavlink.MAVLink_attitude_message(3000, *[0.0] * 6)), 4.0)
    assert record.real_time_factor == pytest.approx(0.5)


def test_texts_in_pieces_are_joined_and_control_characters_left_out():
    long = "Preflight Fail: " + "x" * 50
    record = heard(
        text(long[:50], 7, 0), text(long[50:], 7, 1), text("Ready\t\x1b[0m"), text("Ready\t\x1b[0m")
    )
    assert list(record.texts) == [(4, long), (4, "Ready [0m")]


@given(st.integers(-(2**31), 2**31 - 1))
@example(-1)
def test_integer_parameters_are_sent_by_their_bytes(value):
    as_float = struct.unpack("<f", struct.pack("<i", value))[0]
    message = mavlink.MAVLink_param_value_message(b"COM_RCL_EXCEPT", as_float, 6, 1, 0)
    packet = bytearray(message.pack(Wire().codec))
    packet[10:14] = struct.pack("<i", value)
    message._msgbuf = packet  # as received
    assert ParameterValue.of(message, bytewise=True).value == value


def test_parameters_are_kept_by_name():
    record = heard(mavlink.MAVLink_param_value_message(b"COM_OF_LOSS_T", 1.5, 9, 1, 0))
    assert record.parameters == {"COM_OF_LOSS_T": 1.5}


def test_a_parameter_that_is_no_number_is_left_out():
    record = heard(mavlink.MAVLink_param_value_message(b"COM_OF_LOSS_T", nan, 9, 1, 0))
    assert "COM_OF_LOSS_T" not in record.parameters


def test_the_drift_is_the_farthest_from_the_first():
    places = [(0, 0, 0), (0.3, 0, 0.4), (0.1, 0, 0), (float("nan"), 0, 0)]
    record = heard(*(mavlink.MAVLink_local_position_ned_message(1, *place, 0, 0, 0) for place in places))
    assert record.wander_m == pytest.approx(0.5)
    assert Record().wander_m == 0.0


class StillVehicle:
    """Answers like a vehicle; each `receive` takes twenty milliseconds of the patched clock."""

    def __init__(self, clock, *, armed=False, mute=()):
        self.url = "a wire"
        self.clock, self.armed, self.mute = clock, armed, mute
        self.sent = []
        self.reports = False
        self._codec = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
        self._reader = mavlink.MAVLink(None)
        self._asker = mavlink.MAVLink(None, srcSystem=listen.SYSTEM_ID, srcComponent=listen.COMPONENT_ID)
        self._answers = []
        self._beat_s = -1.0

    def addresses(self, system_id, component_id):
        return ()

    def send_to_all(self, message):
        self.send(message)

    def send(self, message):
        message = self._reader.parse_buffer(message.pack(self._asker))[0]
        self.sent.append(message)
        if message.get_type() == "PARAM_REQUEST_READ" and message.param_id not in self.mute:
            self._answers.append(
                mavlink.MAVLink_param_value_message(message.param_id.encode(), 2.5, 9, 100, 0)
            )
        if message.get_type() == "COMMAND_LONG" and message.command == mavlink.MAV_CMD_RUN_PREARM_CHECKS:
            arguments = list(struct.pack("<BIIII", 0, 0, 0, 0x807F3A80, 0).ljust(40, b"\0"))
            report = mavlink.MAVLink_event_message(0, 0, SUMMARY, 0, 0, 0x88, arguments)
            self._answers += [report] if self.reports else []
        if message.get_type() == "COMMAND_LONG" and message.param1 == 242:
            self._answers.append(
                mavlink.MAVLink_home_position_message(1, 2, 3, 0, 0, 0, [1, 0, 0, 0], 0, 0, 0)
            )

    def receive(self, timeout_s):
        self.clock.now_s += timeout_s
        if self.clock.now_s - self._beat_s >= 1.0:
            self._beat_s = self.clock.now_s
            mode = 157 if self.armed else 29
            self._answers.append(mavlink.MAVLink_heartbeat_message(2, 12, mode, 0, 3, 3))
        out, self._answers = self._answers, []
        return [self._reader.parse_buffer(self._packed(message))[0] for message in out]

    def _packed(self, message):
        data = message.pack(self._codec)
        self._codec.seq = (self._codec.seq + 1) % 256
        return data


class Clock:
    now_s = 100.0

    def __call__(self):
        return self.now_s


@pytest.fixture
def clock():
    return Clock()


def listened(vehicle, seconds=5.0):
    record, shares = Record(heartbeat="ground station"), []
    client = VehicleClient(vehicle, record, vehicle.clock, lambda _, share: shares.append(share))
    client.find()
    listen.listen(client, seconds)
    assert all(0.0 <= share <= 1.0 for share in shares)
    return record


def commands(vehicle):
    return {message.command for message in vehicle.sent if message.get_type() == "COMMAND_LONG"}


def test_everything_is_requested_and_nothing_is_changed(clock):
    vehicle = StillVehicle(clock)
    record = listened(vehicle)
    assert set(record.parameters) == set(PARAMETERS)
    assert "HOME_POSITION" in record.latest
    assert {message.get_type() for message in vehicle.sent} <= HARMLESS
    assert commands(vehicle) == {mavlink.MAV_CMD_REQUEST_MESSAGE, mavlink.MAV_CMD_RUN_PREARM_CHECKS}


def test_what_is_not_answered_is_requested_again_and_what_is_answered_is_not(clock):
    vehicle = StillVehicle(clock, mute={"MPC_THR_HOVER"})
    record = listened(vehicle, seconds=8.0)
    asked = [message.param_id for message in vehicle.sent if message.get_type() == "PARAM_REQUEST_READ"]
    assert asked.count("MPC_THR_HOVER") > 3
    assert asked.count("RTL_RETURN_ALT") == 1
    assert "MPC_THR_HOVER" not in record.parameters


@pytest.mark.parametrize(("reports", "asked"), [(True, 1), (False, 3)])
def test_the_arming_report_is_requested_until_it_is_received(clock, reports, asked):
    vehicle = StillVehicle(clock)
    vehicle.reports = reports
    assert listened(vehicle).arming.ready_for_offboard is reports
    checks = [message for message in vehicle.sent if message.get_type() == "COMMAND_LONG"]
    assert [check.command for check in checks].count(mavlink.MAV_CMD_RUN_PREARM_CHECKS) == asked


def test_to_an_armed_vehicle_it_is_no_ground_station_and_requests_no_checks(clock):
    vehicle = StillVehicle(clock, armed=True)
    assert listened(vehicle).armed
    kinds = {message.type for message in vehicle.sent if message.get_type() == "HEARTBEAT"}
    assert kinds == {mavlink.MAV_TYPE_ONBOARD_CONTROLLER}
    assert commands(vehicle) == {mavlink.MAV_CMD_REQUEST_MESSAGE}


def test_no_vehicle_is_found_on_a_silent_line(clock):
    class Silence:
        url = "a wire"

        def send(self, _message):
            pass

        def receive(self, timeout_s):
            clock.now_s += timeout_s
            return []

    with pytest.raises(VehicleError, match=r"no vehicle was heard on a wire within 10 s"):
        VehicleClient(Silence(), Record(), clock).find()
    assert clock.now_s == pytest.approx(110.0, abs=0.1)


class Open(StillVehicle):
    """Replaces `VehicleLink`."""

    clocks = itertools.repeat(Clock())

    def __init__(self, url, **_):
        super().__init__(next(self.clocks))
        self.url = url

    def close(self):
        pass


def test_the_page_names_what_is_missing_and_the_exit_code_is_one(monkeypatch, capsys):
    monkeypatch.setattr("framerunner.commands.doctor.time.monotonic", next(Open.clocks))
    monkeypatch.setattr("framerunner.wire.transports.vehicle_link.VehicleLink", Open)
    monkeypatch.setenv("COLUMNS", "160")
    assert run(["doctor", "--drone", "udpin://0.0.0.0:14540"]) == 1
    page = capsys.readouterr().out
    assert "Vehicle 1 on udpin://0.0.0.0:14540" in page
    assert "PX4, quadrotor" in page
    assert "no LOCAL_POSITION_NED is received" in page
    assert "RTL_RETURN_ALT" in page
    assert "cannot fly the challenge yet" in page


def test_after_a_walk_it_is_said_what_the_walk_has_shown(monkeypatch, capsys):
    monkeypatch.setattr("framerunner.commands.doctor.time.monotonic", next(Open.clocks))
    monkeypatch.setattr("framerunner.wire.transports.vehicle_link.VehicleLink", Open)
    monkeypatch.setenv("COLUMNS", "200")
    assert run(["doctor", "--drone", "udpin://0.0.0.0:14540", "--walk", "30"]) == 1
    page = capsys.readouterr().out
    assert "0 samples a second are received" in page
    assert "no DISTANCE_SENSOR that looks down is received" in page


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["doctor", "--walk", "5"], "--walk 5: must be from 10 to 300"),
        (["doctor", "--drone", "udp://:14540"], "bad drone address"),
        (["doctor", "--seconds", "1"], "--seconds 1: must be from 2 to 600"),
        (["camera", "--port", "0"], "--port 0: must be from 1 to 65535"),
        (["camera", "--drone", "nonsense"], "bad drone address"),
        (["camera", "--scenario", "no-such-scenario"], "no-such-scenario"),
    ],
)
def test_bad_options_are_one_line_and_exit_code_two(arguments, words, capsys):
    assert run(arguments) == 2
    error = capsys.readouterr().err
    assert words in error
    assert error.count("\n") == 1
