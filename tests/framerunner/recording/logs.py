"""MAVLink logs made for tests."""

from pymavlink.dialects.v20 import common as mavlink


def write_log(path):
    """Ten seconds of telemetry; the vehicle's local frame is rotated and shifted against the arena.

    It is armed by a command at 6.2 s, which its heartbeat shows at 7 s.
    """
    link = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
    with path.open("wb") as file:

        def add(message, time_ms):
            file.write((1_700_000_000_000_000 + time_ms * 1000).to_bytes(8, "big") + message.pack(link))

        arm = mavlink.MAVLink_command_long_message(1, 1, 400, 0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        for time_ms in range(5000, 15_000, 20):
            if time_ms == 6200:
                add(arm, time_ms)
            if time_ms % 1000 == 0:
                armed = time_ms >= 7000
                flags = 1 | (mavlink.MAV_MODE_FLAG_SAFETY_ARMED if armed else 0)
                heartbeat = mavlink.MAVLink_heartbeat_message(2, 12, flags, 6 << 16, 4, 3)
                add(heartbeat, time_ms)
            add(mavlink.MAVLink_attitude_message(time_ms, 0.0, 0.0, 0.3, 0.0, 0.0, 0.0), time_ms)
            climb_m = max(0, time_ms - 7000) / 10_000
            position = mavlink.MAVLink_local_position_ned_message(
                time_ms, 5.0, 6.0, -7.0 - climb_m, 0.0, 0.0, -0.1
            )
            add(position, time_ms)
