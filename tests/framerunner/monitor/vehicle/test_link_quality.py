"""Losses, rates and age of a link."""

import pytest

from framerunner.monitor.ports import Equipment
from framerunner.monitor.vehicle.link_quality import LinkQuality
from framerunner.monitor.vehicle.vehicle import MonitoredVehicle, VehicleCallbacks
from framerunner.wire.dialect import mavlink


def heard(sequences, rate_hz=50.0):
    traffic = LinkQuality(0.0)
    for count, sequence in enumerate(sequences):
        traffic.count(sequence % 256, count / rate_hz)
    return traffic


def test_nothing_is_lost_when_numbers_follow_each_other():
    assert heard(range(600)).as_dict(12.0)["loss_percent"] == 0.0


def test_missing_numbers_are_losses_over_the_last_ten_seconds():
    told = heard([number for number in range(500) if number % 5]).as_dict(8.0)
    assert told["loss_percent"] == pytest.approx(20.0, abs=0.3)
    assert told["rate_hz"] == pytest.approx(50.0, abs=1.0)


def test_a_packet_out_of_order_is_no_loss():
    order = [number for pair in range(0, 200, 2) for number in (pair + 1, pair)]
    assert heard(order).as_dict(4.0)["loss_percent"] <= 1.0


def test_old_losses_are_forgotten():
    traffic = heard([0, 100])
    for count in range(600):
        traffic.count((101 + count) % 256, 1.0 + count / 50)
    assert traffic.as_dict(13.0)["loss_percent"] == 0.0


@pytest.mark.parametrize(("age_s", "state"), [(0.5, "live"), (1.5, "stale"), (2.9, "stale"), (3.1, "lost")])
def test_the_state_follows_from_the_age(age_s, state):
    told = heard([0]).as_dict(age_s)
    assert (told["state"], told["age_s"]) == (state, round(age_s, 1))


def test_a_long_silence_leaves_no_rate():
    told = heard(range(10)).as_dict(60.0)
    assert (told["rate_hz"], told["loss_percent"]) == (0.0, 0.0)


def wanted(messages):
    return [(each.target_system, each.command, each.param1, each.param2) for each in messages]


def boot_time_requests(unix_us):
    """What is requested in two minutes from a drone whose SYSTEM_TIME has this date; None: it sends none."""
    sent = []
    silent = Equipment(None, None, None, None, None, None)
    callbacks = VehicleCallbacks(sent.append, *[lambda *_: None] * 3)
    vehicle, packer = (
        MonitoredVehicle(1, silent, callbacks, 0.0),
        mavlink.MAVLink(None, srcSystem=1, srcComponent=1),
    )
    for second in range(120):
        messages = [mavlink.MAVLink_heartbeat_message(2, 12, 0, 0, 3, 3)]
        if unix_us is not None:
            messages.append(mavlink.MAVLink_system_time_message(unix_us + 1_000_000 * second, 1000 * second))
        for message in messages:
            packet = message.pack(packer)
            packer.seq = (packer.seq + 1) % 256
            vehicle.take(mavlink.MAVLink(None).parse_buffer(packet)[0], float(second))
        vehicle.tick(second + 0.1)
    return [each for each in wanted(sent) if each[1] == mavlink.MAV_CMD_REQUEST_MESSAGE]


def test_the_boot_time_is_requested_five_times_at_most_and_not_once_it_is_known():
    system_time = (1, mavlink.MAV_CMD_REQUEST_MESSAGE, mavlink.MAVLINK_MSG_ID_SYSTEM_TIME, 0)
    assert boot_time_requests(None) == [system_time] * 5
    assert boot_time_requests(1_700_000_000_000_000) == []
