"""What is heard on a link, counted and kept."""

import random
import struct

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from framerunner.doctor.record import Record, StreamCounter, parameter_value
from wire.dialect import mavlink


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
def test_lost_packets_are_told_from_their_numbers(first, count, share, seed):
    chance = random.Random(seed)
    kept = [0, *(k for k in range(1, count - 1) if chance.random() >= share), max(count - 1, 0)]
    counter = StreamCounter()
    for number in sorted(set(kept)):
        counter.take((first + number) % 256)
    assert counter.passed == count
    assert counter.lost_share == pytest.approx(1 - len(set(kept)) / count)


def test_swapped_and_doubled_packets_are_no_loss():
    counter = StreamCounter()
    for number in (254, 0, 255, 1, 1, 2):
        counter.take(number)
    assert counter.passed == 5
    assert counter.lost_share == 0.0


def test_the_first_vehicle_is_the_patient_and_others_do_not_mix_in():
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
    assert record.real_time_factor is None  # too short to tell
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
def test_whole_parameters_travel_by_their_bytes(value):
    as_float = struct.unpack("<f", struct.pack("<i", value))[0]
    message = mavlink.MAVLink_param_value_message(b"COM_RCL_EXCEPT", as_float, 6, 1, 0)
    packet = bytearray(message.pack(Wire().codec))
    packet[10:14] = struct.pack("<i", value)
    message._msgbuf = packet  # as it comes from the wire
    assert parameter_value(message) == value


def test_parameters_are_kept_by_name():
    record = heard(mavlink.MAVLink_param_value_message(b"COM_OF_LOSS_T", 1.5, 9, 1, 0))
    assert record.parameters == {"COM_OF_LOSS_T": 1.5}


def test_wandering_is_the_farthest_from_the_first():
    places = [(0, 0, 0), (0.3, 0, 0.4), (0.1, 0, 0), (float("nan"), 0, 0)]
    record = heard(*(mavlink.MAVLink_local_position_ned_message(1, *place, 0, 0, 0) for place in places))
    assert record.wander_m == pytest.approx(0.5)
    assert Record().wander_m == 0.0
