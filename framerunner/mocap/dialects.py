"""Which autopilot gets poses, and how it does.

A dialect has the name of the autopilot and where its parameters are documented (`guide`); the parameters
that are read; the messages that are requested, with number and rate; the message with a simulator's true
pose; that with the estimator's state; and whether the autopilot needs a place on Earth before it can be armed
without GPS. To add an autopilot, write its dialect with the same methods and choose it in `dialect_of`.
"""

from __future__ import annotations

from framerunner.mocap.ardupilot import ArduPilotPoses
from framerunner.mocap.px4 import Px4Poses
from framerunner.wire.session.record import Record

PoseDialect = Px4Poses | ArduPilotPoses
_PX4, _ARDUPILOT = Px4Poses(), ArduPilotPoses()


def dialect_of(record: Record) -> PoseDialect:
    """The dialect of a vehicle by its HEARTBEAT; PX4's before the first, and for unknown autopilots."""
    return _ARDUPILOT if record.is_ardupilot else _PX4
