"""MAVLink as PX4 speaks it, one module per service. Bytes in, bytes out, time given; no clock, no socket."""

from firmware_py.mavlink.links import GROUND, ONBOARD, LinkProfile
from firmware_py.mavlink.node import MavlinkNode
from firmware_py.mavlink.port import AutopilotPort

__all__ = ["GROUND", "ONBOARD", "AutopilotPort", "LinkProfile", "MavlinkNode"]
