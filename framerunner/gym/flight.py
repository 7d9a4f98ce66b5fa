"""One try, step by step: a simulation, its drone and its eyes. Knows nothing of Gymnasium."""

from __future__ import annotations

from collections.abc import Coroutine

from framerunner.flying.lockstep import LockstepVehicle
from framerunner.flying.plan import FlightPlan
from offboard.drone import DroneError, DroneState, VelocityCommand
from scenarios.models import COLOURS, is_over_base
from scenarios.referee import Referee
from scenarios.result import RefereeReport
from vision.types import Detections, Image

TAKEN_OFF_M = 0.3
"""Rise above the start from which on coming down to the base is a landing."""
STOP_ABOVE_BASE_M = 0.1
"""Height of the drone's underside above the base at which the motors are stopped."""


class SteppedFlight:
    """A try that has begun: the drone stands on its start with its motors on.

    Args:
        plan: what is flown; an agent takes the place of the mission.

    Attributes:
        state: of the drone, as telemetry told it at the present tick.
        ended: why the drone can no longer be flown; empty while it can.

    Raises:
        DroneError: the drone does not get ready.
    """

    def __init__(self, plan: FlightPlan) -> None:
        vehicle = LockstepVehicle(plan, self._take)
        self._plan = plan
        self._simulation, self._drone, self._eyes = vehicle.simulation, vehicle.drone, vehicle.eyes
        self._image: Image | None = None
        self._taken_off = False
        self._colours = tuple(
            colour for colour in COLOURS if colour in {frame.colour for frame in plan.scenario.frames}
        )
        self.ended = ""
        run_through(self._drone.ready())
        run_through(self._drone.motors_on())
        self.state: DroneState = self._drone.next_state()

    def _take(self, _time_us: int, image: Image) -> None:
        self._image = image

    @property
    def referee(self) -> Referee:
        """What judges this try."""
        return self._simulation.referee

    @property
    def over(self) -> bool:
        """Nothing more can be flown."""
        return bool(self.ended) or self.referee.over

    @property
    def image(self) -> Image:
        """The latest image that has arrived: BGR, shape (height, width, 3), uint8. Not to be written to."""
        assert self._image is not None, "the camera gives its first image while the drone gets ready"
        return self._image

    def report(self) -> RefereeReport:
        """What the try was worth; what the vehicle said counts where the referee has not the last word."""
        return self.referee.report(ended=None if self.referee.over else self.ended or None)

    def detections(self) -> Detections:
        """What the latest image showed."""
        return self._eyes.latest(self.state.time_us)

    def step(self, command: VelocityCommand) -> None:
        """Fly a velocity for a tick of 50 ms, or land if this is one; see `_is_landing`.

        Args:
            command: within the limits.
        """
        try:
            if self._is_landing(command):
                run_through(self._drone.motors_off())
                self.ended = "landed"
            else:
                self._drone.command(command)
                self.state = self._drone.next_state()
                self._taken_off = self._taken_off or self.state.z > self._plan.start_pose[2] + TAKEN_OFF_M
        except DroneError as error:
            self.ended = str(error)
        if self.ended:
            run_through(self._drone.close())
            self._drone.settle()

    def _is_landing(self, command: VelocityCommand) -> bool:
        """Whether to stop the motors now, as the paper's navigator does just above the base.

        That is when all frames are crossed and the drone, which has taken off, is a hand's breadth above the
        base or lower, and is told to go down.
        """
        state = self.state
        underside_m = state.z - self._plan.airframe.envelope_m[2] / 2
        base = self._plan.scenario.base
        return (
            command.up_m_s < 0.0
            and self._taken_off
            and underside_m < base.top_m + STOP_ABOVE_BASE_M
            and is_over_base(base, state.x, state.y)
            and len(self.referee.crossed) == len(self._colours)
        )


def run_through(coroutine: Coroutine[object, None, None]) -> None:
    """Run a coroutine of the lockstep drone, none of which ever waits, without an event loop.

    Args:
        coroutine: not yet begun.

    Raises:
        RuntimeError: it waits after all.
    """
    try:
        coroutine.send(None)
    except StopIteration:
        return
    coroutine.close()
    raise RuntimeError("a coroutine of the lockstep drone waits for something; nothing can come of it here")
