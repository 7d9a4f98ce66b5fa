"""A flight in lockstep: world, autopilot, camera, vision and mission in one process, in simulated time.

Nothing here reads a clock, so a flight is a pure function of its inputs: the same scenario, mission and seed
give the same flight to the last bit, however busy the machine is and whatever was flown before.
"""

from __future__ import annotations

import asyncio
from dataclasses import dataclass

from framerunner.flight_result import flight_result
from framerunner.lockstep_drone import LockstepDrone
from framerunner.lockstep_eyes import ImageObserver, LockstepEyes
from framerunner.pictures import Track
from framerunner.recorder import TrackRecorder
from framerunner.state_hash import StateHash
from offboard.app import MissionEnd, Moment, Observer, fly_mission
from offboard.keep_in_box import flight_box
from offboard.mission import Mission
from scenarios.ground import start_position
from scenarios.models import Scenario
from scenarios.result import FlightResult
from sitl.simulation import Simulation


@dataclass(frozen=True, slots=True)
class Flown:
    """A flight that is over.

    Attributes:
        result: without wall times.
        outcome: how the mission ended.
        track: where the drone was, 20 times a second.
    """

    result: FlightResult
    outcome: MissionEnd
    track: Track


def fly_lockstep(
    scenario: Scenario,
    mission: Mission,
    *,
    seed: int = 0,
    observer: Observer | None = None,
    on_image: ImageObserver | None = None,
) -> Flown:
    """Fly a mission as fast as the machine can; see `lockstep_flight`, which does it within an event loop."""
    flight = lockstep_flight(scenario, mission, seed=seed, observer=observer, on_image=on_image)
    return asyncio.run(flight)


async def lockstep_flight(
    scenario: Scenario,
    mission: Mission,
    *,
    seed: int = 0,
    observer: Observer | None = None,
    on_image: ImageObserver | None = None,
) -> Flown:
    """Fly a mission as fast as the machine can.

    Args:
        scenario: what is flown.
        mission: checked.
        seed: of everything random; recorded, nothing is random yet.
        observer: called at every tick of the mission.
        on_image: called with time of exposure (microseconds) and each image as it arrives.

    Raises:
        DroneError: the drone does not get ready.
    """
    simulation = Simulation(scenario)
    eyes = LockstepEyes(scenario, on_image)
    states = StateHash()
    x_m, y_m, surface_m = start_position(scenario)
    z_m = surface_m + simulation.world.airframe.envelope_m[2] / 2
    drone = LockstepDrone(
        simulation, (x_m, y_m, z_m, scenario.start.yaw_rad), observers=(states.add, eyes.follow)
    )
    recorder = TrackRecorder()

    def observe(moment: Moment) -> None:
        recorder.see(moment)
        if observer is not None:
            observer(moment)

    limit_s, box = scenario.try_limit_s, flight_box(scenario)
    outcome = await fly_mission(drone, None, mission, limit_s=limit_s, observer=observe, eyes=eyes, box=box)
    drone.settle()
    track = recorder.track(simulation.referee.snapshot().began_us)
    ended = None if outcome.ended == "finished" else outcome.reason
    report = simulation.referee.report(outcome.mission_state, ended)
    result = flight_result(
        scenario,
        mission,
        report,
        outcome,
        track,
        judged_by="truth",
        seed=seed,
        state_sha256=states.hexdigest(),
    )
    return Flown(result, outcome, track)
