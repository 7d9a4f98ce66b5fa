"""Messages of PX4's simulator interface, against pymavlink."""

import pytest
from pymavlink.dialects.v20 import common as mavlink

from framerunner.vehicle.geodesy import GeodeticPoint
from framerunner.vehicle.measurements import (
    BarometerSample,
    ExternalPose,
    FixType,
    GpsSample,
    ImuSample,
    Readings,
    Sensors,
)
from framerunner.wire.framing import PacketReader
from sitl.px4.simulator_messages import ActuatorControls, SensorMessages

ORIGIN = GeodeticPoint(47.4, 8.5, 485.0)  # 3 m below the true position
IMU = ImuSample(4000, 4000, (0.1, -0.2, 0.3), (0.5, -0.6, -9.8))


def true_state(time_us):
    return Sensors(time_us, (1, 2, -3), (0.1, 0.2, -0.3), (1, 0, 0, 0), (0, 0, 0), (0, 0, -9.8))


def parsed(data):
    parser = mavlink.MAVLink(None)
    return parser.parse_buffer(data)


def test_a_tick_is_what_pymavlink_reads():
    messages = SensorMessages(None, ORIGIN)
    messages.pack(Readings(4000, IMU), None, true_state(4000))
    readings = Readings(
        20_000,
        IMU,
        barometer=BarometerSample(20_000, 95_600.0, 288.15),
        gps=GpsSample(0, FixType.FIX_3D, 47.4, -8.5, 488.2, (1.0, -1.0, 0.5), 0.9, 1.4, 0.1, 18),
    )
    pose = ExternalPose(
        1, (1.0, 2.0, -3.0), (1.0, 0.0, 0.0, 0.0), None, (1e-6,) * 3, (9e-6,) * 3, (float("nan"),) * 3
    )
    odometry, gps, truth, sensor = parsed(messages.pack(readings, pose, true_state(20_000)))
    assert (sensor.get_type(), sensor.id, sensor.time_usec) == ("HIL_SENSOR", 0, 20_000)
    assert sensor.abs_pressure == pytest.approx(956.0)  # hPa
    assert sensor.fields_updated == 0b1101000111111
    assert (gps.lat, gps.lon, gps.alt) == (474_000_000, -85_000_000, 488_200)
    assert (gps.vel, gps.cog, gps.fix_type) == (141, 31_500, 3)
    assert (odometry.z, odometry.pose_covariance[11]) == pytest.approx((-3.0, 1e-6))
    assert odometry.pose_covariance[20] == pytest.approx(9e-6)
    assert truth.alt == 488_000


def test_the_first_message_sets_the_clock():
    first = SensorMessages(None, ORIGIN).pack(Readings(0, IMU), None, true_state(0))
    assert [message.get_type() for message in parsed(first)] == ["HIL_SENSOR"]


def test_a_lost_imu_still_advances_the_clock():
    messages = SensorMessages(None, ORIGIN)
    messages.pack(Readings(4000, IMU), None, true_state(4000))
    (sensor,) = parsed(messages.pack(Readings(8000), None, true_state(8000)))
    assert (sensor.time_usec, sensor.fields_updated) == (8000, 0)


@pytest.mark.parametrize("size", [1, 7, 1000])
def test_outputs_are_read_from_any_pieces_among_noise(size):
    sender = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
    outputs = [0.25, 0.5, 0.75, 1.0] + [0.0] * 12
    packets = [
        sender.heartbeat_encode(0, 12, 0, 0, 0).pack(sender),
        sender.hil_actuator_controls_encode(4000, outputs, 129, 1).pack(sender),
        b"\xfd\x00noise",
        sender.hil_actuator_controls_encode(8000, [0.0] * 16, 1, 1).pack(sender),
    ]
    packets.append(bytes(packets[1][:-1]) + b"\x00")  # its checksum is wrong
    stream = b"".join(packets) + bytes(40)
    reader = PacketReader()
    messages = [each for at in range(0, len(stream), size) for each in reader.feed(stream[at : at + size])]
    found = [controls for each in messages if (controls := ActuatorControls.of(each)) is not None]
    assert [each.time_us for each in found] == [4000, 8000]
    assert found[0].controls[:4] == (0.25, 0.5, 0.75, 1.0)
    assert (found[0].armed, found[1].armed) == (True, False)
