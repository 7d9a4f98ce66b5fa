"""A visit to a vehicle on a wire that needs no time: what is asked, and that nothing is changed."""

import itertools
import struct

import pytest

from framerunner.cli import run
from framerunner.doctor import visit
from framerunner.doctor.record import SUMMARY, Record
from framerunner.doctor.visit import PARAMETERS
from wire.dialect import mavlink

HARMLESS = {"HEARTBEAT", "COMMAND_LONG", "PARAM_REQUEST_READ"}


class StillVehicle:
    """Answers like a vehicle; each look at it takes twenty milliseconds of the patched clock."""

    def __init__(self, clock, *, armed=False, mute=()):
        self.url = "a wire"
        self.clock, self.armed, self.mute = clock, armed, mute
        self.sent = []
        self.reports = False
        self._codec = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
        self._reader = mavlink.MAVLink(None)
        self._asker = mavlink.MAVLink(None, srcSystem=visit.SYSTEM_ID, srcComponent=visit.COMPONENT_ID)
        self._answers = []
        self._beat_s = -1.0

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

    def monotonic(self):
        return self.now_s


@pytest.fixture
def clock(monkeypatch):
    clock = Clock()
    monkeypatch.setattr(visit, "time", clock)
    return clock


def visited(vehicle, seconds=5.0):
    record, shares = Record(), []
    assert visit.find(vehicle, record, lambda _, share: shares.append(share))
    visit.listen(vehicle, record, seconds, lambda _, share: shares.append(share))
    assert all(0.0 <= share <= 1.0 for share in shares)
    return record


def commands(vehicle):
    return {message.command for message in vehicle.sent if message.get_type() == "COMMAND_LONG"}


def test_everything_is_asked_and_nothing_is_changed(clock):
    vehicle = StillVehicle(clock)
    record = visited(vehicle)
    assert set(record.parameters) == set(PARAMETERS)
    assert "HOME_POSITION" in record.latest
    assert {message.get_type() for message in vehicle.sent} <= HARMLESS
    assert commands(vehicle) == {mavlink.MAV_CMD_REQUEST_MESSAGE, mavlink.MAV_CMD_RUN_PREARM_CHECKS}


def test_what_is_not_answered_is_asked_again_and_what_is_answered_is_not(clock):
    vehicle = StillVehicle(clock, mute={"MPC_THR_HOVER"})
    record = visited(vehicle, seconds=8.0)
    asked = [message.param_id for message in vehicle.sent if message.get_type() == "PARAM_REQUEST_READ"]
    assert asked.count("MPC_THR_HOVER") > 3
    assert asked.count("RTL_RETURN_ALT") == 1
    assert "MPC_THR_HOVER" not in record.parameters


@pytest.mark.parametrize(("reports", "asked"), [(True, 1), (False, 3)])
def test_the_arming_report_is_asked_for_until_it_comes(clock, reports, asked):
    vehicle = StillVehicle(clock)
    vehicle.reports = reports
    assert visited(vehicle).arming.ready_for_offboard is reports
    checks = [message for message in vehicle.sent if message.get_type() == "COMMAND_LONG"]
    assert [check.command for check in checks].count(mavlink.MAV_CMD_RUN_PREARM_CHECKS) == asked


def test_to_an_armed_vehicle_it_is_no_ground_station_and_asks_for_no_checks(clock):
    vehicle = StillVehicle(clock, armed=True)
    assert visited(vehicle).armed
    kinds = {message.type for message in vehicle.sent if message.get_type() == "HEARTBEAT"}
    assert kinds == {mavlink.MAV_TYPE_ONBOARD_CONTROLLER}
    assert commands(vehicle) == {mavlink.MAV_CMD_REQUEST_MESSAGE}


def test_no_vehicle_is_found_on_a_silent_line(clock):
    class Silence:
        def send(self, _message):
            pass

        def receive(self, timeout_s):
            clock.now_s += timeout_s
            return []

    assert not visit.find(Silence(), Record(), lambda *_: None)
    assert clock.now_s == pytest.approx(110.0, abs=0.1)


class Open(StillVehicle):
    """Stands in for `VehicleLink`."""

    clocks = itertools.repeat(Clock())

    def __init__(self, url, **_):
        super().__init__(next(self.clocks))
        self.url = url

    def close(self):
        pass


def test_the_page_names_what_is_missing_and_the_exit_code_is_one(monkeypatch, capsys):
    monkeypatch.setattr(visit, "time", next(Open.clocks))
    monkeypatch.setattr("wire.transports.vehicle_link.VehicleLink", Open)
    monkeypatch.setenv("COLUMNS", "160")
    assert run(["doctor", "--drone", "udpin://0.0.0.0:14540"]) == 1
    page = capsys.readouterr().out
    assert "Vehicle 1 on udpin://0.0.0.0:14540" in page
    assert "PX4, quadrotor" in page
    assert "no LOCAL_POSITION_NED comes" in page
    assert "RTL_RETURN_ALT" in page
    assert "cannot fly the challenge yet" in page


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
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
