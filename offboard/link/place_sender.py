"""Sends the place that the app has estimated to a vehicle that knows it from nothing else."""

from __future__ import annotations

import asyncio
import contextlib

from mavsdk.asyncio import MavsdkError

from framerunner.geometry.axes import Pose
from framerunner.wire.dialect import Message
from offboard.drone import DroneState
from offboard.link.direct import DirectMessages
from offboard.link.place_feedback import PERIOD_US, PlaceFeedback


class PlaceSender:
    """Sends where the drone stands until the first estimate: without that the vehicle does not get ready.

    Messages have vehicle time: a vehicle that knows no other clock takes the time of their arrival.

    Args:
        start: where the drone stands, arena axes.
    """

    def __init__(self, start: Pose) -> None:
        self._feedback = PlaceFeedback(start)
        self._messages: DirectMessages | None = None
        self._standing: asyncio.Task[None] | None = None

    def begin(self, messages: DirectMessages) -> None:
        """Begin to send."""
        self._messages = messages
        self._standing = asyncio.create_task(self._tell_standing(), name="standing place")

    def send(self, state: DroneState) -> None:
        """Send an estimate."""
        self._send(self._feedback.flying(state))

    def end(self) -> None:
        """Send no more."""
        if self._standing is not None:
            self._standing.cancel()
        self._messages = None

    async def _tell_standing(self) -> None:
        while self._feedback.stands:
            self._send(self._feedback.standing(0))
            await asyncio.sleep(PERIOD_US * 1e-6)

    def _send(self, message: Message) -> None:
        if self._messages is not None:
            with contextlib.suppress(MavsdkError):  # the link is closed; telemetry shows that
                self._messages.send(message)
