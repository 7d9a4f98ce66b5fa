"""Identity, logging, and the facts that ground stations ask for when they connect.

Without these facts QGroundControl reports a firmware with parameters missing, or sensors to calibrate.
"""

from __future__ import annotations

from firmware_py.parameters.declare import Group

MAVLINK = Group("MAVLink")

MAVLINK.whole(
    "MAV_SYS_ID",
    1,
    (1, 250),
    "",
    "MAVLink system id",
    details="One more than the instance, taken at start.",
    reboot=True,
)
MAVLINK.fact("MAV_COMP_ID", 1, "MAVLink component id of the autopilot")
MAVLINK.fact("MAV_TYPE", 2, "MAV_TYPE of the vehicle", "2: a quadrotor.")
MAVLINK.fact("MAV_PROTO_VER", 2, "It speaks MAVLink 2")

SYSTEM = Group("System")

SYSTEM.fact("SYS_AUTOSTART", 4001, "Airframe", "4001: a generic quadcopter. Not 0: one is chosen.")
SYSTEM.fact("SYS_AUTOCONFIG", 0, "Nothing is configured by itself at the next start")
SYSTEM.switch(
    "SYS_FAILURE_EN",
    0,
    "Let MAVLink commands break sensors and motors",
    "For tests: injected failures can crash the vehicle, as they are meant to.",
)

LOGGING = Group("SD Logging")

LOGGING.choice(
    "SDLOG_MODE",
    0,
    {
        -1: "Never",
        0: "From arming until disarming",
    },
    "When a flight is logged",
)

CALIBRATION = Group("Sensor Calibration")

CALIBRATION.fact("CAL_ACC0_ID", 1_310_988, "The accelerometer", "Not 0: it is calibrated.")
CALIBRATION.fact("CAL_GYRO0_ID", 1_310_988, "The gyroscope", "Not 0: it is calibrated.")
CALIBRATION.fact("CAL_MAG0_ID", 197_388, "The magnetometer", "Not 0: it is calibrated.")
CALIBRATION.fact("CAL_MAG1_ID", 0, "There is no second magnetometer")
CALIBRATION.fact("CAL_MAG2_ID", 0, "There is no third magnetometer")

CHANNELS = Group("Radio Calibration")

CHANNELS.fact("RC_CHAN_CNT", 0, "No remote control has been calibrated")
for _use in ("ROLL", "PITCH", "YAW", "THROTTLE", "FLAPS", "AUX1", "AUX2", "FLTMODE"):
    CHANNELS.fact(f"RC_MAP_{_use}", 0, "No channel of a remote control does this")

MODE_SLOTS = Group("Commander")

for _slot in range(1, 7):
    MODE_SLOTS.fact(f"COM_FLTMODE{_slot}", -1, "No switch of a remote control chooses a mode")
