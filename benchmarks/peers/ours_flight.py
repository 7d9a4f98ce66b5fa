"""Our flight in the comparison: the mission with everything, as `framerunner fly --lockstep` flies it.

Unlike the peers, it also searches the images, runs the navigator's chart and judges the flight. Timed from
motors on: design of the stabiliser and start-up of the drone are not counted, nor is the peers' loading.
"""

from __future__ import annotations

from importlib import metadata

from benchmarks.peers.job import CannotFlyError, Flight, Job, Stopwatch, answer, keep_image, pin_to_one_core
from framerunner.flying.lockstep import fly_lockstep
from framerunner.flying.plan import FlightPlan
from offboard.app import Moment
from offboard.mission import load_mission
from scenarios.loader import load_scenario
from sitl.world import PHYSICS_RATE_HZ, STEPS_PER_CONTROL
from vision.types import Image

WARM_UP_S = 1.0


class Timing:
    """Observes a flight; reads the clocks only at its beginning and its end."""

    def __init__(self, seconds: float) -> None:
        self._seconds = seconds
        self._stopwatch: Stopwatch | None = None
        self._began_s = 0.0
        self.result: tuple[float, float, float] | None = None
        self.images = 0
        self.image: Image | None = None
        self.path: list[tuple[float, ...]] = []

    def see(self, moment: Moment) -> None:
        """Take one tick of the mission."""
        time_s, state = moment.flight_time_s, moment.state
        if time_s <= 0.0 or self.result is not None:
            return
        if self._stopwatch is None:
            self._began_s = time_s
            self._stopwatch = Stopwatch()
        self.path.append((time_s - self._began_s, state.x, state.y, state.z, state.yaw))
        if time_s - self._began_s >= self._seconds:
            self.result = (time_s - self._began_s, *self._stopwatch.read())

    def see_image(self, _time_us: int, image: Image) -> None:
        """Take one image."""
        if self._stopwatch is not None and self.result is None:
            self.images += 1
            self.image = image


def fly(job: Job) -> Flight:
    """Fly once to warm up and once for the time."""
    pin_to_one_core()
    import cv2

    cv2.setNumThreads(1)
    for seconds in (WARM_UP_S, job.seconds):
        timing = fly_once(job, seconds)
    if timing.result is None or timing.image is None:
        raise CannotFlyError(f"the flight was over before {job.seconds:g} s; choose another scenario")
    simulated_s, processor_s, wall_s = timing.result
    return Flight(
        metadata.version("framerunner"),
        f"{PHYSICS_RATE_HZ}/{PHYSICS_RATE_HZ // STEPS_PER_CONTROL} Hz",
        "OpenCV",
        simulated_s,
        processor_s,
        wall_s,
        timing.images,
        keep_image(job, timing.image[:, :, ::-1]),
        path=tuple(timing.path),
    )


def fly_once(job: Job, seconds: float) -> Timing:
    """Fly the scenario of the job for some seconds and half a second more."""
    scenario = load_scenario(job.scenario)
    camera = scenario.camera.model_copy(update={"rate_hz": job.image_rate_hz})
    scenario = scenario.model_copy(update={"camera": camera, "try_limit_s": seconds + 0.5})
    timing = Timing(seconds)
    plan = FlightPlan(scenario, load_mission("frame_challenge"))
    fly_lockstep(plan, observers=(timing.see,), on_image=timing.see_image)
    return timing


if __name__ == "__main__":
    answer(fly)
