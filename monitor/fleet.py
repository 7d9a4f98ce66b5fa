"""All drones heard on one link, as the pages need them; lives on the asyncio loop."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from monitor.ports import Equipment
from monitor.sticks import Sticks
from monitor.tries import TryEvent

JsonMessage = dict[str, Any]


class Fleet:
    """What is known of the drones on one link, and the way to command them.

    All methods belong to the loop on which `run` runs.

    Args:
        equipment: the link and what else the monitor was given.
    """

    def __init__(self, equipment: Equipment) -> None:
        self._equipment = equipment

    async def run(self) -> None:
        """Listen until cancelled; a link that fails is opened again."""
        raise NotImplementedError

    def welcome(self) -> list[JsonMessage]:
        """What a new watcher is sent first: world, chart, transitions, texts, status."""
        raise NotImplementedError

    def pose_message(self) -> JsonMessage:
        """The message of kind "pose", as of now."""
        raise NotImplementedError

    def status_message(self) -> JsonMessage:
        """The message of kind "status", as of now."""
        raise NotImplementedError

    def subscribe(self, hear: Callable[[JsonMessage], None]) -> Callable[[], None]:
        """Hear all messages but pose and status, as they come.

        Args:
            hear: called on the loop; must not block.

        Returns:
            Ends it.
        """
        raise NotImplementedError

    def on_try(self, hear: Callable[[TryEvent], None]) -> None:
        """Hear of tries, for as long as the fleet lives.

        Args:
            hear: called on the loop; must not block.
        """
        raise NotImplementedError

    def drone_ids(self) -> list[int]:
        """System ids of the drones heard so far."""
        raise NotImplementedError

    def video_url(self, drone_id: int) -> str | None:
        """Where a drone's MJPEG is; None if it told none that may be asked for."""
        raise NotImplementedError

    async def do(self, drone_id: int, what: str) -> tuple[bool, str]:
        """Command a drone, and see that it does so.

        Args:
            drone_id: which.
            what: arm, disarm, take_off, land, hold, stop_motors, position or offboard.

        Returns:
            Whether telemetry shows it, and one line for people.
        """
        raise NotImplementedError

    def sticks(self, drone_id: int, sticks: Sticks | None) -> None:
        """Hold a drone's sticks: MANUAL_CONTROL at 25 Hz with the latest value.

        Args:
            drone_id: which.
            sticks: where they are; None lets go.
        """
        raise NotImplementedError

    def set_pilot(self, drone_id: int, name: str) -> None:
        """Say in the status who has a drone's sticks in a browser; "" is nobody."""
        raise NotImplementedError

    def notice(self, drone_id: int | None, level: str, text: str) -> None:
        """Tell all watchers something, as a message of kind "notice".

        Args:
            drone_id: of which drone; None: of none.
            level: info, warning or error.
            text: one line.
        """
        raise NotImplementedError
