"""The log of MAVLink traffic, written to a disk that fills up."""

from pymavlink import mavutil
from pymavlink.dialects.v20 import common as mavlink

from offboard.link.tlog import TlogRecorder
from tests.disk import disk_that_takes


def packets(count):
    sender = mavlink.MAVLink(None, srcSystem=1)
    return [sender.system_time_encode(number, 0).pack(sender) for number in range(1, count + 1)]


def test_a_full_disk_ends_the_log_after_a_whole_packet(tmp_path):
    path = tmp_path / "flight.tlog"
    recorder = TlogRecorder(path)
    sent = packets(20)
    with disk_that_takes(200):
        for packet in sent[:10]:
            recorder.datagram_received(packet, ("127.0.0.1", 1))
    for packet in sent[10:]:  # there is space again, but the log would have a gap that nobody sees
        recorder.datagram_received(packet, ("127.0.0.1", 1))
    recorder.close()
    recorder.datagram_received(sent[0], ("127.0.0.1", 1))
    assert recorder.problem == f"recording of '{path}' stopped: No space left on device"
    log = mavutil.mavlink_connection(str(path))
    read = []
    while (message := log.recv_match()) is not None:
        read.append(message.time_unix_usec)
    log.close()
    assert read == list(range(1, recorder.packets + 1))
    assert 3 < recorder.packets < 10
