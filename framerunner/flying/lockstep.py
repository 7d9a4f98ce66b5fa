"""A flight in lockstep: world, autopilot, camera, vision and mission in one process, in simulated time.

Nothing here reads a clock, so a flight is a pure function of its plan: the same scenario, mission and seed
give the same flight to the last bit, however busy the machine is and whatever was flown before.
"""

from __future__ import annotations

import asyncio
import hashlib
from collections.abc import Callable, Sequence
from struct import Struct

from framerunner.flying.fly import Flown, fly
from framerunner.flying.lockstep_drone import LockstepDrone, TruthObserver
from framerunner.flying.plan import FlightPlan
from offboard.app import Moment, Observer
from offboard.perception import CAMERA_DEAD_S, CameraLostError
from scenarios.models import Scenario, TrueState
from scenarios.result import RefereeReport, RefereeSnapshot
from sitl.camera import CameraFeed
from sitl.simulation import Simulation
from vision.detector import detect
from vision.types import Detections, Image

ImageObserver = Callable[[int, Image], None]

_ROW = Struct("<12d")  # time in us, position, velocity, attitude, motors on
_ROW_BYTES = _ROW.size
_CHUNK_BYTES = _ROW_BYTES * 1000


def fly_lockstep(
    plan: FlightPlan, *, observers: Sequence[Observer] = (), on_image: ImageObserver | None = None
) -> Flown:
    """Fly a plan as fast as the machine can; see `lockstep_flight`, which does it within an event loop."""
    return asyncio.run(lockstep_flight(plan, observers=observers, on_image=on_image))


async def lockstep_flight(
    plan: FlightPlan, *, observers: Sequence[Observer] = (), on_image: ImageObserver | None = None
) -> Flown:
    """Fly a plan as fast as the machine can.

    Args:
        plan: with a mission; its seed is recorded, nothing is random yet.
        observers: called at every tick of the mission.
        on_image: called with time of exposure (microseconds) and each image as it arrives.

    Raises:
        DroneError: the drone does not get ready.
    """
    states = StateHash()
    vehicle = LockstepVehicle(plan, on_image, observers=(states.add,))
    return await fly(
        plan,
        vehicle.drone,
        vehicle.eyes,
        _SimulationJudge(vehicle),
        observers,
        measured=lambda: {"state_sha256": states.hexdigest()},
    )


class LockstepVehicle:
    """A plan's drone on its start, with its eyes: one simulation in this process.

    Args:
        plan: whose drone it is.
        on_image: called with time of exposure (microseconds) and image as each arrives.
        observers: called with the truth of every control tick.

    Attributes:
        simulation: moves on only while the drone is asked for something.
        drone: the port by which it is flown.
        eyes: what its camera shows.
    """

    def __init__(
        self,
        plan: FlightPlan,
        on_image: ImageObserver | None = None,
        *,
        observers: Sequence[TruthObserver] = (),
    ) -> None:
        self.simulation = Simulation(plan.scenario, plan.airframe)
        self.eyes = LockstepEyes(plan.scenario, on_image)
        self.drone = LockstepDrone(self.simulation, plan.start_pose, observers=(*observers, self.eyes.follow))


class _SimulationJudge:
    """The simulation's own referee, which has seen the truth of every control tick."""

    source = "truth"

    def __init__(self, vehicle: LockstepVehicle) -> None:
        self._vehicle = vehicle

    def see(self, moment: Moment) -> None:
        """The referee sees for itself."""

    async def standing(self) -> RefereeSnapshot:
        """How the try stands now."""
        return self._vehicle.simulation.referee.snapshot()

    async def report(self, mission_state: str, ended: str | None) -> RefereeReport:
        """The report, when the drone has come to rest."""
        self._vehicle.drone.settle()
        return self._vehicle.simulation.referee.report(mission_state, ended)


class LockstepEyes:
    """Sees each image when the camera's latency is over; fed with the truth of every control tick.

    Args:
        scenario: camera settings and what is to be seen.
        on_image: called with time of exposure (microseconds) and image as each arrives.
    """

    def __init__(self, scenario: Scenario, on_image: ImageObserver | None = None) -> None:
        self._feed = CameraFeed(scenario)
        self._on_image = on_image
        self._arrived: tuple[int, Image] | None = None
        self._image_us = 0
        self._detections = Detections()

    def follow(self, truth: TrueState) -> None:
        """Let the camera take the control tick that has just passed."""
        if truth.time_us < self._feed.next_us:
            return
        arrived = self._feed.step(truth)
        if arrived is not None:
            self._arrived = arrived
            if self._on_image is not None:
                self._on_image(*arrived)

    async def open(self) -> None:
        """Nothing to wait for: images come while the drone gets ready."""

    def latest(self, time_us: int) -> Detections:
        """What the latest image showed; the detector looks only at images that are asked for.

        Args:
            time_us: vehicle time now.

        Raises:
            CameraLostError: the last image is older than a second.
        """
        if self._arrived is not None:
            self._image_us, image = self._arrived
            self._arrived = None
            self._detections = detect(image, self._image_us)
        age_s = (time_us - self._image_us) / 1e6
        if age_s > CAMERA_DEAD_S:
            raise CameraLostError(f"the camera is dead: no image for {age_s:.1f} s")
        return self._detections

    async def close(self) -> None:
        """Nothing to let go of."""


class StateHash:
    """One number for a whole flight, equal only if every true state was equal to the last bit.

    SHA-256 over the states as little-endian float64s; whole microseconds are exact in them.
    """

    __slots__ = ("_filled", "_rows", "_sha256")

    def __init__(self) -> None:
        self._sha256 = hashlib.sha256()
        self._rows = bytearray(_CHUNK_BYTES)
        self._filled = 0

    def add(self, truth: TrueState) -> None:
        """Take the next state."""
        _ROW.pack_into(
            self._rows,
            self._filled,
            truth.time_us,
            *truth.position_arena_m,
            *truth.velocity_arena_m_s,
            *truth.attitude_arena,
            truth.motors_on,
        )
        self._filled += _ROW_BYTES
        if self._filled == _CHUNK_BYTES:
            self._sha256.update(self._rows)
            self._filled = 0

    def hexdigest(self) -> str:
        """The sum of all states so far."""
        so_far = self._sha256.copy()
        so_far.update(memoryview(self._rows)[: self._filled])
        return so_far.hexdigest()
