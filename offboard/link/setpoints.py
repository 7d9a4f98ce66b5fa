"""The stream of velocity setpoints that MAVSDK's offboard plugin sends by a thread of its own.

MAVSDK 4.1 sends a setpoint at once when it is set, and goes on with it at 20 Hz. It ends this by itself when
a heartbeat shows another mode than offboard (not in the first three seconds after it has asked for offboard);
the next setpoint begins it anew. So whoever wants fresh setpoints while others have the vehicle sets them
again and again, and a program that stops doing so leaves no stream behind.
"""

from __future__ import annotations

import threading
from math import degrees
from typing import Any

from mavsdk.asyncio.plugins.offboard import OffboardAsync
from mavsdk.plugins.offboard import VelocityBodyYawspeed

from offboard.drone import VelocityCommand


class SetpointStream:
    """Setpoints to one vehicle, until they are ended for good."""

    def __init__(self, plugin: OffboardAsync) -> None:
        """Prepare; nothing is sent yet.

        Args:
            plugin: MAVSDK's.
        """
        self._plugin = plugin
        # The synchronous plugin inside; there is no public access to it. It stores four numbers (5 us); the
        # asyncio one takes an executor job (190 us).
        self._direct: Any = plugin._plugin
        self._setpoint = VelocityBodyYawspeed(0.0, 0.0, 0.0, 0.0)
        self._lock = threading.Lock()  # a watchdog's thread may use what the loop's thread uses
        self._ended = False

    def send(self, command: VelocityCommand) -> None:
        """Send a velocity from now on; passed over when the stream was ended for good."""
        setpoint = self._setpoint
        with self._lock:
            setpoint.forward_m_s = command.forward_m_s
            setpoint.right_m_s = -command.left_m_s
            setpoint.down_m_s = -command.up_m_s
            setpoint.yawspeed_deg_s = -degrees(command.yaw_rate_rad_s)
            if not self._ended:
                self._direct.set_velocity_body(setpoint)

    async def ask_for_offboard(self) -> None:
        """Ask for offboard mode. Raises `MavsdkError`."""
        await self._plugin.start()

    @property
    def can_ask(self) -> bool:
        """Modes can be asked for through the plugin."""
        return not self._ended

    async def ask_for_hold(self) -> None:
        """End the stream until the next setpoint, and ask for hold mode. Raises `MavsdkError`."""
        await self._plugin.stop()

    def ask_for_hold_now(self) -> None:
        """The same from a thread, waiting for the answer. Raises `MavsdkError`."""
        self._direct.stop()

    def end(self) -> None:
        """End the stream for good and ask for nothing; from any thread."""
        with self._lock:
            self._ended = True
            self._direct.destroy()
