"""What differs between autopilots: their modes' names, and how they are commanded.

`MavsdkDrone` asks a dialect for everything that PX4 and ArduPilot do differently. PX4's is here, ArduPilot's
in `ardupilot.py`. To add an autopilot, write its dialect and choose it in `autopilots.py`.
"""

from __future__ import annotations

from collections.abc import Awaitable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Protocol

from mavsdk.asyncio.plugins.offboard import OffboardAsync

from offboard.drone import ResponsePrior, VelocityCommand
from offboard.link.commands import SetpointStream, synchronous


@dataclass(frozen=True, slots=True)
class ModeNames:
    """The flight modes that the app knows, by the names that `TelemetryFeed.mode` has."""

    offboard: str  # follows the app's setpoints
    hold: str  # hovers without setpoints or sticks
    land: str
    pilot: frozenset[str]  # flown by a pilot's sticks


PX4_READY_LIMIT_S = 30.0  # wall time
PX4_MODES = ModeNames(
    offboard="OFFBOARD",
    hold="HOLD",
    land="LAND",
    pilot=frozenset({"MANUAL", "ALTCTL", "POSCTL", "ACRO", "STABILIZED", "RATTITUDE"}),
)


class TickExchange(Protocol):
    """What makes all that app and vehicle send each other arrive while time stands; DroneError: it cannot."""

    async def before_tick(self) -> None:
        """The vehicle has what was sent to it, and a setpoint, when this returns."""

    async def after_tick(self) -> None:
        """What the vehicle has sent has been received when this returns."""


class Dialect(Protocol):
    """Commands to one vehicle. Its coroutines raise `MavsdkError` when the vehicle refuses.

    Attributes:
        modes: the names of its modes.
        numbered_modes: names by HEARTBEAT.custom_mode; empty: MAVSDK's names are used.
        ended: no setpoint is sent any more.
        ready_limit_s: wall time until it can be armed, usually.
        response_prior: how it follows velocities, as far as is known before the flight.
        checks_in_offboard: its pre-arm checks are those of its mode, so it must enter offboard to be ready.
        exchange: of a vehicle whose time waits for this app; None: its time goes on.
    """

    modes: ModeNames
    numbered_modes: Mapping[int, str]
    ended: bool
    response_prior: ResponsePrior
    checks_in_offboard: bool
    ready_limit_s: float

    @property
    def exchange(self) -> TickExchange | None:
        """See above."""

    def request_streams(self) -> Awaitable[None]:
        """Request what the vehicle does not send by itself, as soon as it is connected."""
        ...

    def send(self, command: VelocityCommand) -> None:
        """Send a velocity from now on; ignored after `end`. From any thread."""

    def repeat(self) -> None:
        """Send the last velocity again if nothing was sent since the last call; once a tick."""

    def request_offboard(self) -> Awaitable[None]:
        """Request the mode that follows setpoints."""
        ...

    def request_hold(self) -> Awaitable[None]:
        """End the setpoints until the next one, and request hold."""
        ...

    def request_hold_blocking(self) -> None:
        """The same from a thread, which waits for the answer."""

    def request_land_blocking(self) -> None:
        """End the setpoints permanently and request landing, from a thread, which waits for the answer."""

    def arm(self) -> Awaitable[None]:
        """Arm."""
        ...

    def kill(self) -> Awaitable[None]:
        """Disarm at once, in the air too."""
        ...

    def land(self) -> Awaitable[None]:
        """Request landing where the vehicle is."""
        ...

    def end(self) -> None:
        """End the setpoints permanently, without a request; from any thread."""


class Px4Dialect(SetpointStream):
    """PX4, by MAVSDK's plugins `offboard` and `action`.

    Args:
        offboard: the plugin.
        action: likewise.
        response_prior: framerunner's own autopilot presents itself as PX4, so it is not always PX4's.
    """

    modes = PX4_MODES
    numbered_modes: Mapping[int, str] = MappingProxyType({})
    checks_in_offboard = False
    ready_limit_s = PX4_READY_LIMIT_S
    exchange = None

    def __init__(
        self,
        offboard: OffboardAsync,
        action: Any,  # noqa: ANN401 - MAVSDK is untyped
        response_prior: ResponsePrior = ResponsePrior.OWN,
    ) -> None:
        super().__init__(offboard)
        self._action = action
        self.response_prior = response_prior

    async def request_streams(self) -> None:
        """Nothing: PX4 sends all streams by itself."""

    def repeat(self) -> None:
        """Nothing: MAVSDK's thread repeats setpoints."""

    async def request_hold(self) -> None:
        """End the stream until the next setpoint, and request hold."""
        # Not through the plugin if the watchdog has ended the stream.
        await (self._action.hold() if self.ended else super().request_hold())

    def request_land_blocking(self) -> None:
        """End the stream permanently and request the mode land, from a thread."""
        self.end()
        synchronous(self._action).land()

    async def arm(self) -> None:
        """Arm."""
        await self._action.arm()

    async def kill(self) -> None:
        """Disarm at once, in the air too."""
        await self._action.kill()

    async def land(self) -> None:
        """Request the mode land."""
        await self._action.land()
