"""One try, step by step, and its reward, which depends on the referee only. It does not use Gymnasium."""

from __future__ import annotations

from collections.abc import Coroutine

from framerunner.flying.lockstep import LockstepVehicle
from framerunner.flying.plan import FlightPlan
from offboard.drone import DroneError, DroneState, VelocityFluCommand
from scenarios.models import is_over_base
from scenarios.referee import Referee
from scenarios.result import RefereeReport
from scenarios.verdict import Verdict
from vision.types import Detections, Image

TAKEN_OFF_M = 0.3  # above the start; from there on a descent to the base is a landing
STOP_ABOVE_BASE_M = 0.1  # of the drone's underside; there the motors are stopped
# Rewards.
CROSSING = 1.0  # for each gate crossed in order
LANDING = 2.0  # on the base after all gates
CONTACT = -0.2  # for each contact with a gate
OUTSIDE_PER_S = -0.05  # for each second outside the arena
FAILURE = -1.0  # for a crash, or a gate crossed in the wrong order


class SteppedFlight:
    """A try that has begun: the drone stands on its start, motors on; an agent replaces the mission."""

    def __init__(self, plan: FlightPlan) -> None:
        vehicle = LockstepVehicle(plan)
        self._plan = plan
        self._drone, self._perception = vehicle.drone, vehicle.perception
        self._taken_off = False
        self._gates = len({gate.colour for gate in plan.scenario.frames})
        self._crossed = self._contacts = 0
        self._penalty_s = 0.0
        self.referee: Referee = vehicle.simulation.referee
        self.ended = ""  # why the drone can no longer be flown; empty while it can
        self.failed_order = False  # a gate was crossed in the wrong order
        run_through(self._drone.ready())
        run_through(self._drone.motors_on(confirmed=False))
        self.state: DroneState = self._drone.next_state()  # by telemetry, as of the present tick

    @property
    def over(self) -> bool:
        """Nothing more can be flown."""
        return bool(self.ended) or self.referee.over

    @property
    def image(self) -> Image:
        """The latest image that has arrived: BGR, shape (height, width, 3), uint8. Not to be written to."""
        assert self._perception.image is not None, "the first image arrives while the drone gets ready"
        return self._perception.image

    def report(self) -> RefereeReport:
        """The referee's report; the vehicle's reason for the end is used if the referee has none."""
        return self.referee.report(ended=None if self.referee.over else self.ended or None)

    def detections(self) -> Detections:
        """What the latest image showed."""
        return self._perception.latest(self.state.time_us)

    def step(self, command: VelocityFluCommand) -> None:
        """Fly a velocity within the limits for a tick of 50 ms, or land; see `_is_landing`."""
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

    def reward(self) -> float:
        """For what has happened since the last call."""
        now = self.referee.snapshot()
        reward = 0.0  # so that a sum of zeros is not -0.0
        reward += CONTACT * (now.contacts - self._contacts)
        reward += OUTSIDE_PER_S * (now.penalty_s - self._penalty_s)
        self._contacts, self._penalty_s = now.contacts, now.penalty_s
        if len(now.crossed) > self._crossed:
            self.failed_order = self.referee.report().verdict is Verdict.WRONG_ORDER
            if not self.failed_order:
                reward += CROSSING * (len(now.crossed) - self._crossed)
            self._crossed = len(now.crossed)
        return reward

    def _is_landing(self, command: VelocityFluCommand) -> bool:
        """Whether to stop the motors now, as the paper's navigator does just above the base.

        That is when all gates are crossed and the drone, which has taken off, is `STOP_ABOVE_BASE_M` above
        the base or lower, and is commanded to descend.
        """
        state = self.state
        underside_m = state.z - self._plan.airframe.envelope_m[2] / 2
        base = self._plan.scenario.base
        return (
            command.up_m_s < 0.0
            and self._taken_off
            and underside_m < base.top_m + STOP_ABOVE_BASE_M
            and is_over_base(base, state.x, state.y)
            and len(self.referee.crossed) == self._gates
        )


def final_reward(report: RefereeReport) -> float:
    """What the verdict adds at the end of a try."""
    if report.completed:
        return LANDING
    return FAILURE if report.verdict in (Verdict.CRASHED, Verdict.WRONG_ORDER) else 0.0


def run_through(coroutine: Coroutine[object, None, None]) -> None:
    """Run a new coroutine of the lockstep drone, which never waits, without an event loop.

    Raises:
        RuntimeError: it waits after all.
    """
    try:
        coroutine.send(None)
    except StopIteration:
        return
    coroutine.close()
    raise RuntimeError("a coroutine of the lockstep drone waits for an event, which needs an event loop")
