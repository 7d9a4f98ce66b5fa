"""A vehicle that is never armed: everything else of a flight happens, with the propellers off."""

from __future__ import annotations

from collections.abc import AsyncGenerator
from dataclasses import replace

from offboard.drone import DroneError, DroneState, LimitedCommand, VelocityFluCommand
from offboard.mavsdk_drone import MavsdkDrone


class DryRunDrone(MavsdkDrone):
    """The adapter without anything that arms, stops motors or lands.

    Offboard is requested as for a flight, and the mission's setpoints are sent, which a disarmed vehicle does
    not follow. Once the mission has switched its motors on, the ticks show the vehicle as armed, so that the
    mission's chart runs. A vehicle that somebody arms meanwhile ends the dry run.
    """

    _runs = False

    async def ticks(self) -> AsyncGenerator[DroneState, None]:
        """States at 20 Hz; see the class."""
        async for state in super().ticks():
            if self._runs and state.armed:
                raise DroneError("the vehicle was armed by others in a dry run; disarm it")
            yield replace(state, armed=True, offboard=True) if self._runs else state

    async def motors_on(self, *, confirmed: bool = True) -> None:
        """Enter offboard with zero setpoints; nothing is armed."""
        await self._stream_before_offboard()
        await self._requester.request(
            "offboard mode",
            self._stream.request_offboard(),
            lambda: self._feed.mode == self._stream.kind.modes.offboard,
        )
        self._runs = True

    async def motors_off(self) -> None:
        """End the setpoints."""
        await self._end()

    async def land(self) -> None:
        """End the setpoints."""
        await self._end()

    async def hold(self) -> None:
        """End the setpoints."""
        await self._end()

    async def land_now(self, *, demanded: bool = False) -> None:
        """End the setpoints."""
        await self._end()

    async def refuse(self) -> None:
        """Nobody gives the vehicle back."""

    def command(self, command: VelocityFluCommand, at: DroneState | None = None) -> LimitedCommand:
        """Send the setpoint that would be flown."""
        limited = self._limits.limit(command, at or self._latest)
        if self._runs:
            self._send(limited.command)
        return limited

    async def close(self) -> None:
        """Leave offboard and close."""
        await self._end()
        await super().close()

    async def _end(self) -> None:
        if self._runs:
            self._runs = False
            await self._hold_on_ground()
