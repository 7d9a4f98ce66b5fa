"""Counts whether the machine kept up with a flight in real time."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scenarios.result import Timing

if TYPE_CHECKING:
    from framerunner.simulator_clock import SimulatorClock
    from offboard.eyes import CameraEyes
    from offboard.mavsdk_drone import MavsdkDrone

SLOW_FACTOR = 0.95  # of the wanted speed; below, vehicle time had to wait


class FlightTiming:
    """Counts what came late in a real-time flight.

    Args:
        drone: what is flown.
        clock: of a simulator whose time waits for this program; None: vehicle time does not wait.
    """

    def __init__(self, drone: MavsdkDrone, clock: SimulatorClock | None) -> None:
        self._drone = drone
        self._clock = clock
        self._eyes: CameraEyes | None = None

    def look_through(self, eyes: CameraEyes) -> None:
        """Take the age of images from these."""
        self._eyes = eyes
        if self._clock is not None:
            self._clock.look_through(eyes)

    def report(self, real_time_factor: float | None, speed: float) -> Timing:
        """What the flight's result says of it.

        Args:
            real_time_factor: vehicle time a wall time; None before two ticks.
            speed: the wanted one.
        """
        clock = self._clock
        late = {
            "late_ticks": self._drone.late_ticks,
            "late_images": 0 if clock is None else clock.images_missed,
            "late_setpoints": 0 if clock is None else clock.setpoints_missed,
        }
        slow = real_time_factor is not None and real_time_factor < SLOW_FACTOR * speed
        return Timing(
            kept_up=not slow and not any(late.values()),
            vehicle_time_waits=clock is not None,
            speed=speed if real_time_factor is None else real_time_factor / speed,
            **late,
            oldest_image_s=0.0 if self._eyes is None else self._eyes.oldest_s,
        )
