"""Only the vehicle's own MAVLink takes ArduPilot's place."""

from framerunner.wire.dialect import mavlink
from sitl.ardupilot.sole_sender import mavlink_sender

HEARTBEAT = mavlink.MAVLink_heartbeat_message(2, 3, 0, 0, 4, 3)
STATION = mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)


def heartbeat(system_id, message=HEARTBEAT):
    return message.pack(mavlink.MAVLink(None, srcSystem=system_id, srcComponent=1))


def test_noise_and_another_vehicle_do_not_take_the_place_of_the_vehicle():
    said = []
    sender = mavlink_sender(9046, 5, said.append)
    stranger, vehicle = ("127.0.0.1", 50001), ("127.0.0.1", 50002)
    assert sender.select([(b"Init ArduCopter\n", vehicle)]) == said == []
    for data in (b"\xfd", b"\xff" * 100, heartbeat(1), heartbeat(5)[:-1], heartbeat(5, STATION)):
        assert sender.select([(data, stranger)]) == []
    assert sender.select([(heartbeat(5), vehicle)]) == [heartbeat(5)]
    assert said == [
        "warning: what 127.0.0.1:50001 sends to UDP 9046 is ignored: it is no MAVLink of ArduPilot with "
        "--sysid 5; end it, or choose another --instance"
    ]
