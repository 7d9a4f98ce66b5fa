"""A flight in lockstep: world, autopilot, camera, vision and mission in one process, in simulated time.

Nothing here reads a clock, so a flight is a pure function of its plan: the same scenario, mission and seed
give the same flight to the last bit, however busy the machine is and whatever was flown before.
"""

from __future__ import annotations

import asyncio
import hashlib
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import replace
from struct import Struct

import numpy as np

from framerunner.flying.detector import others_of, plan_detector
from framerunner.flying.fly import FinishedFlight, fly
from framerunner.flying.judges import Judge
from framerunner.flying.lockstep_drone import LockstepDrone, TruthObserver
from framerunner.flying.plan import FlightPlan
from framerunner.flying.response import LateResponse
from offboard.app import Observer, TickHook
from offboard.perception import CAMERA_DEAD_S, IMAGES_KEPT, CameraSilentError, ImageChoice
from offboard.safety.rules import SIMULATED, SafetyRules
from scenarios.models import Scenario, TrueState
from scenarios.result import FaultFacts, RefereeReport
from sitl.camera import CameraFeed, Exposure
from sitl.faults.images import new_feed
from sitl.simulation import Simulation
from vision.base.detector import BaseExpectations, expect_base
from vision.detectors import Detector, new_detector
from vision.types import Detections, Image

ImageObserver = Callable[[int, Image], None]
"""Called with time of exposure (microseconds) and each image as it arrives."""

_ROW = Struct("<12d")  # time in us, position, velocity, attitude, motors on


def fly_lockstep(
    plan: FlightPlan, *, observers: Sequence[Observer] = (), on_image: ImageObserver | None = None
) -> FinishedFlight:
    """Fly a plan as fast as the machine can; see `lockstep_flight`, which does it within an event loop."""
    flight = lockstep_flight(plan, observers=observers, on_image=on_image)
    try:
        if not _in_event_loop():
            return asyncio.run(flight)
        with ThreadPoolExecutor(1) as apart:  # of a notebook
            return apart.submit(asyncio.run, flight).result()
    finally:
        flight.close()  # if a signal came before the event loop had started it; otherwise nothing is left


def _in_event_loop() -> bool:
    with suppress(RuntimeError):
        return asyncio.get_running_loop() is not None
    return False


async def lockstep_flight(
    plan: FlightPlan,
    *,
    observers: Sequence[Observer] = (),
    on_image: ImageObserver | None = None,
    truth_observers: Sequence[TruthObserver] = (),
    before_tick: TickHook | None = None,
    safety: SafetyRules = SIMULATED,
) -> FinishedFlight:
    """Fly a plan as fast as the machine can; its seed is of wind and of what else is random.

    Args:
        plan: with a mission.
        observers: called at every tick, in this order; must be quick.
        on_image: called with each image.
        truth_observers: called with the true state of every control tick; must be quick.
        before_tick: awaited before each tick, while simulated time stands still; see `RunControl`.
        safety: the operator, and what the drone does when the flight is aborted.

    Raises:
        DroneError: the drone does not get ready.
        ValueError: the plan has no mission.
    """
    states = StateHash()
    vehicle = LockstepVehicle(plan, on_image, observers=(states.add, *truth_observers))
    return await fly(
        plan,
        vehicle.drone,
        vehicle.perception,
        _SimulationJudge(vehicle),
        observers,
        measured=lambda: {"state_sha256": states.hexdigest()},
        before_tick=before_tick,
        safety=safety,
    )


class LockstepVehicle:
    """A plan's drone and its perception: a simulation that advances only while the drone is used.

    Its observers are called with the true state of every control tick.
    """

    def __init__(
        self,
        plan: FlightPlan,
        on_image: ImageObserver | None = None,
        *,
        observers: Sequence[TruthObserver] = (),
    ) -> None:
        self.simulation = Simulation(plan.scenario, plan.airframe, plan.seed or 0)
        detector = plan_detector(plan)
        feed = new_feed(plan.scenario, self.simulation.faults, plan.seed or 0)
        self.perception = LockstepPerception(
            plan.scenario, on_image, detector, feed, remembers=others_of(plan) is not None or plan.alone
        )
        self.drone = LockstepDrone(
            self.simulation,
            plan.start_pose,
            observers=(*observers, self.perception.follow),
            response=None if plan.response is None else LateResponse(plan.response, plan.seed or 0),
            limits=plan.velocity_limits(),
            reports_place=plan.alone,
        )


class _SimulationJudge(Judge):
    """The simulation's own referee, which sees the true state of every control tick."""

    def __init__(self, vehicle: LockstepVehicle) -> None:
        super().__init__(vehicle.simulation.referee)
        self._vehicle = vehicle

    async def report(self, mission_state: str, ended: str | None) -> RefereeReport:
        self._vehicle.drone.settle()
        return await super().report(mission_state, ended)

    async def faults(self) -> FaultFacts:
        return self._vehicle.simulation.fault_facts()


class LockstepPerception:
    """The camera's images, each when its latency is over; `follow` is called at every control tick.

    With `remembers` the detector may keep something from image to image, so it gets equal ones too.
    """

    def __init__(
        self,
        scenario: Scenario,
        on_image: ImageObserver | None = None,
        detector: Detector | None = None,
        feed: CameraFeed | None = None,
        *,
        remembers: bool = False,
    ) -> None:
        self._remembers = remembers
        self._feed = feed or CameraFeed(scenario)
        self._on_image = on_image
        self._detector = detector or new_detector("boxes")
        self._choice = ImageChoice()
        self._arrived: Exposure | None = None  # the latest, processed or not
        self._chosen: Exposure | None = None  # the latest to be processed, until it is
        self._untaken: deque[Exposure] = deque(maxlen=IMAGES_KEPT)
        self._found: deque[Detections] = deque(maxlen=IMAGES_KEPT)  # processed, and not taken
        self._processed_us = -1
        self._detections = Detections()
        self._last: tuple[Image, Detections] | None = None  # the image that was processed last

    @property
    def image(self) -> Image | None:
        """The latest: BGR, shape (height, width, 3), uint8; None before the first."""
        return None if self._arrived is None else self._arrived.image

    def follow(self, truth: TrueState) -> None:
        """Let the camera see the control tick that has just passed."""
        if truth.time_us < self._feed.next_us:
            return
        arrived = self._feed.arrival(truth)
        if arrived is None:
            return
        self._arrived = arrived
        if self._choice.takes(arrived.time_us):
            self._chosen = arrived
            self._untaken.append(arrived)
        if self._on_image is not None:
            self._on_image(arrived.time_us, arrived.image)

    async def open(self) -> None:
        """Nothing to wait for: images arrive while the drone gets ready."""

    def latest(self, time_us: int) -> Detections:
        """What the latest chosen image showed; the detector processes an image only when this is called.

        Raises:
            CameraSilentError: the last image is older than a second of vehicle time.
        """
        if self._chosen is not None:
            if self._remembers:  # it gets all images in their order
                self._found.extend(map(self._detect, self._untaken))
                self._untaken.clear()
                self._detections = self._found[-1]
            else:
                self._detections = self._detect(self._chosen)
            self._processed_us, self._chosen = self._chosen.time_us, None
        image_us = 0 if self._arrived is None else self._arrived.time_us
        age_s = (time_us - image_us) / 1e6
        if age_s > CAMERA_DEAD_S:
            raise CameraSilentError(age_s)
        return self._detections

    def take(self) -> tuple[Detections, ...]:
        """What each chosen image since the last call showed; `latest` has processed the last one already."""
        images, found = tuple(self._untaken), tuple(self._found)
        self._untaken.clear()
        self._found.clear()
        return found + tuple(
            self._detections if each.time_us == self._processed_us else self._detect(each) for each in images
        )

    def _detect(self, exposure: Exposure) -> Detections:
        """What an exposure shows; a drone that stands takes the same image again and again."""
        image, last = exposure.image, self._last
        if last is not None and not self._remembers and _are_same(image, last[0]):
            return replace(last[1], time_us=exposure.time_us)
        found = self._detector(image, exposure.time_us)
        self._last = (image, found)
        return found

    def space_images(self, period_s: float) -> None:
        """From now on process at most one image in this time, vehicle time; 0: all of them."""
        self._choice.period_s = period_s

    def expect_base(self, expected: BaseExpectations) -> None:
        """Say where in an image the base is to be looked for."""
        expect_base(self._detector, expected)

    async def close(self) -> None:
        """Nothing to close."""


def _are_same(one: Image, other: Image) -> bool:
    """Whether two images are equal; the row in the middle tells nearly always that they are not."""
    middle = len(one) // 2
    return np.array_equal(one[middle], other[middle]) and np.array_equal(one, other)


class StateHash:
    """One hash for a whole flight, equal only if every true state was equal to the last bit.

    SHA-256 over the states as little-endian float64s, which hold whole microseconds exactly.
    """

    def __init__(self) -> None:
        self._sha256 = hashlib.sha256()

    def add(self, truth: TrueState) -> None:
        """Add the next state."""
        x, y, z = truth.position_arena_m  # unpacking them in the call takes twice as long
        vx, vy, vz = truth.velocity_arena_m_s
        qw, qx, qy, qz = truth.attitude_arena
        self._sha256.update(_ROW.pack(truth.time_us, x, y, z, vx, vy, vz, qw, qx, qy, qz, truth.motors_on))

    def hexdigest(self) -> str:
        """Return the hash of all states so far."""
        return self._sha256.hexdigest()
