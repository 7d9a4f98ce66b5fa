"""Asks a vehicle to hold, over links that may lose the request, its answer or the heartbeat that shows it."""

from __future__ import annotations

from collections.abc import Awaitable, Callable

from offboard.drone import DroneError

ATTEMPTS = 3
SHOWN_S = 1.5  # wall time until a heartbeat, one a second, shows the new mode


async def leave_offboard(
    ask: Callable[[], Awaitable[None]], left: Callable[[float], Awaitable[bool]]
) -> None:
    """Ask for hold until the vehicle has left offboard, for whatever mode.

    The first request must end the setpoints: a vehicle that hears none of the requests then leaves offboard
    by its own failsafe.

    Args:
        ask: asks once; raises `DroneError` when refused or not answered.
        left: waits at most so many seconds; whether telemetry shows another mode than offboard.

    Raises:
        DroneError: the last refusal; or telemetry shows offboard all the time.
    """
    refusal: DroneError | None = None
    for _ in range(ATTEMPTS):
        try:
            await ask()
            refusal = None
        except DroneError as error:
            refusal = error
        if await left(SHOWN_S):
            return
    raise refusal or DroneError(
        f"asked for {ATTEMPTS} times and acknowledged, but telemetry still shows offboard; setpoints have "
        "ended, so the vehicle's failsafe for that has to act"
    )
