"""What differs between autopilots that get poses, and which one a vehicle has.

To add an autopilot, write its dialect and choose it in `dialect_of`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

from framerunner.mocap.ardupilot import ArduPilotPoses
from framerunner.mocap.facts import Facts, SendSettings
from framerunner.mocap.poses import Pose
from framerunner.mocap.px4 import Px4Poses
from framerunner.wire.dialect import Message
from framerunner.wire.session.record import Record
from offboard.safety.check import Checks


class PoseDialect(Protocol):
    """How poses are sent to one kind of autopilot, and how it shows that it uses them.

    Attributes:
        name: of the autopilot.
        guide: where its parameters are documented.
        parameters: those that are read.
        streams_hz: number and rate of each message that is requested, by name.
        truth: name and number of the message with a simulator's true pose.
        estimator: the message with the estimator's state.
        needs_origin: without GPS it cannot be armed before its place on Earth is set.
    """

    name: str
    guide: str
    parameters: tuple[str, ...]
    streams_hz: Mapping[str, tuple[int, float]]
    truth: tuple[str, int]
    estimator: str
    needs_origin: bool

    def pose_message(self, pose: Pose, stamp_us: int, settings: SendSettings) -> Message:
        """The message that carries a pose taken at a time."""

    def innovation_ratio(self, estimator: Message) -> float:
        """The larger innovation ratio of position and height, above 1 for what is rejected."""
        ...

    def is_fused(self, facts: Facts) -> bool | None:
        """Whether the vehicle's position is made from the poses; None: it cannot be told yet."""

    def why_not_fused(self, facts: Facts) -> str:
        """What to do so that it is."""
        ...

    def used_in_part(self, facts: Facts) -> tuple[str, str] | None:
        """Which setting keeps it from using all of a pose, and what to do; None: it uses all."""

    def settings(self, facts: Facts) -> Checks:
        """Its other parameters."""
        ...

    def heading_advice(self, facts: Facts) -> tuple[str, str]:
        """Why its heading differs from that of the poses, and what to do."""
        ...

    def delay(self, facts: Facts) -> Checks:
        """Whether it knows how old poses are. Called only when that has been measured."""
        ...


_PX4, _ARDUPILOT = Px4Poses(), ArduPilotPoses()


def dialect_of(record: Record) -> PoseDialect:
    """The dialect of a vehicle by its HEARTBEAT; PX4's before the first, and for unknown autopilots."""
    return _ARDUPILOT if record.is_ardupilot else _PX4
