"""What differs between autopilots: their modes' names, and how they are commanded.

`MavsdkDrone` asks a dialect for everything that PX4 and ArduPilot do differently; see `px4.py` and
`ardupilot.py`. To add an autopilot, write its dialect and choose it in `autopilots.py`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Awaitable, Mapping
from dataclasses import dataclass, field
from typing import ClassVar, Protocol

from offboard.drone import VelocityFluCommand


@dataclass(frozen=True, slots=True)
class ModeNames:
    """The flight modes that the app knows, by the names that `TelemetryFeed.mode` has."""

    offboard: str  # follows the app's setpoints
    hold: str  # hovers without setpoints or sticks
    land: str
    manual: frozenset[str]  # flown by an operator's sticks


@dataclass(frozen=True, slots=True)
class AutopilotKind:
    """What is known of an autopilot, however it is commanded.

    Attributes:
        name: for people.
        modes: the names of its modes.
        offboard: parameters of MAV_CMD_DO_SET_MODE for that mode.
        hold: likewise.
        land: likewise.
        ready_limit_s: wall time until it can be armed, usually.
        checks_in_offboard: its pre-arm checks are those of its mode, so it must enter offboard to be ready.
        numbered_modes: names by HEARTBEAT.custom_mode; empty: MAVSDK's names are used.
        tells_accuracy: it sends how sure it is of its estimate (ODOMETRY).
    """

    name: str
    modes: ModeNames
    offboard: tuple[float, ...]
    hold: tuple[float, ...]
    land: tuple[float, ...]
    ready_limit_s: float
    checks_in_offboard: bool = False
    numbered_modes: Mapping[int, str] = field(default_factory=dict)
    tells_accuracy: bool = True


class TickExchange(Protocol):
    """What makes all that app and vehicle send each other arrive while time stands; DroneError: it cannot."""

    async def before_tick(self) -> None:
        """The vehicle has what was sent to it, and a setpoint, when this returns."""

    async def after_tick(self) -> None:
        """What the vehicle has sent has been received when this returns."""


class Dialect(ABC):
    """Commands to one vehicle. Its coroutines raise `MavsdkError` when the vehicle refuses.

    Attributes:
        kind: of its autopilot.
        has_resets: its estimator may turn or move its local frame in flight, see `resets.py`.
        ended: no setpoint is sent any more.
    """

    kind: ClassVar[AutopilotKind]
    has_resets: bool
    ended = False

    @property
    def exchange(self) -> TickExchange | None:
        """Of a vehicle whose time waits for this app; None: its time goes on."""
        return None

    @abstractmethod
    def request_streams(self) -> Awaitable[None]:
        """Request what the vehicle does not send by itself, or too rarely, as soon as it is connected."""

    @abstractmethod
    def send(self, command: VelocityFluCommand) -> None:
        """Send a velocity from now on; ignored after `end`. From any thread."""

    def repeat(self) -> None:  # noqa: B027 - it is complete
        """Send the last velocity again if nothing was sent since the last call; once a tick."""

    @abstractmethod
    def request_offboard(self) -> Awaitable[None]:
        """Request the mode that follows setpoints."""

    @abstractmethod
    def request_hold(self) -> Awaitable[None]:
        """End the setpoints until the next one, and request hold."""

    @abstractmethod
    def request_hold_blocking(self) -> None:
        """The same from a thread, which waits for the answer."""

    @abstractmethod
    def request_land_blocking(self) -> None:
        """End the setpoints permanently and request landing, from a thread, which waits for the answer."""

    @abstractmethod
    def arm(self) -> Awaitable[None]:
        """Arm."""

    @abstractmethod
    def kill(self) -> Awaitable[None]:
        """Disarm at once, in the air too."""

    @abstractmethod
    def land(self) -> Awaitable[None]:
        """Request landing where the vehicle is."""

    @abstractmethod
    def end(self) -> None:
        """End the setpoints permanently, without a request; from any thread."""
