"""What was late in a flight in real time, in numbers and in words."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scenarios.result import Timing

if TYPE_CHECKING:  # these are imported when a flight begins, as they are slow to import
    from framerunner.flying.simulator_process import SimulatorClock
    from offboard.mavsdk_drone import MavsdkDrone
    from offboard.perception import CameraPerception

SLOW_FACTOR = 0.95  # of the requested speed; below, vehicle time had to wait


def flight_timing(
    drone: MavsdkDrone,
    perception: CameraPerception,
    clock: SimulatorClock | None,
    factor: float | None,
    speed: float,
    *,
    fused: bool,
    repeats: bool = True,
) -> Timing:
    """What was late, and so whether the machine was fast enough for the requested speed.

    Args:
        drone: that was flown.
        perception: through which it saw.
        clock: of a simulator whose time waits for this program; None: vehicle time does not wait.
        factor: vehicle time per wall time; None before two ticks.
        speed: the requested factor.
        fused: the mission's navigator uses images by their time stamps.
        repeats: of a vehicle whose time waits, the flight depends on nothing else than its seed.
    """
    ticks, late = drone.ticks_in_flight
    slow = factor is not None and factor < SLOW_FACTOR * speed
    images = 0 if clock is None else clock.images_missed
    setpoints = 0 if clock is None else clock.setpoints_missed
    timing = Timing(
        kept_up=not (slow or late or images or setpoints),
        vehicle_time_waits=clock is not None,
        speed=speed if factor is None else factor / speed,
        ticks=ticks,
        late_ticks=late,
        late_share=late / max(ticks, 1),
        late_images=images,
        late_setpoints=setpoints,
        oldest_image_s=perception.oldest_s,
    )
    return timing.model_copy(update={"words": in_words(timing, fused=fused, repeats=repeats)})


def in_words(timing: Timing, *, fused: bool, repeats: bool) -> str:
    """One line for people if the machine was too slow; empty if it was not. See `flight_timing`."""
    if timing.kept_up:
        return ""
    late = []
    if timing.late_ticks:
        late.append(f"{100 * timing.late_share:.1f} % of ticks were late")
    for count, what in ((timing.late_images, "image"), (timing.late_setpoints, "setpoint")):
        if count:
            late.append(f"{count} {what}{'s' if count > 1 else ''} came late")
    if late:
        oldest = f"the oldest image was {timing.oldest_image_s:.2f} s old"
        still = "was still fused by time stamps" if fused else "may differ from one on a free machine"
        return f"the machine did not keep up: {', '.join(late)}, {oldest}; the flight {still}"
    pace = f"the machine did not keep up: vehicle time ran at {timing.speed:.2f} of the requested speed"
    if timing.vehicle_time_waits and repeats:
        return f"{pace}; it waited for the app, so the flight is the same as on a free machine"
    if timing.vehicle_time_waits:
        return f"{pace}; it waited for the app, but the flight may differ from one on a free machine"
    return f"{pace}; nothing came late to the app"
