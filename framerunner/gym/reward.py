"""What a try is worth to an agent: sparse, and nothing but what the referee says."""

from __future__ import annotations

from scenarios.referee import Referee
from scenarios.result import RefereeReport
from scenarios.verdict import Verdict

CROSSING = 1.0
"""For each frame crossed in its turn."""
LANDING = 2.0
"""For landing on the base after all frames."""
CONTACT = -0.2
"""For each contact with a frame."""
OUTSIDE_PER_S = -0.05
"""For each second outside the arena."""
FAILURE = -1.0
"""For a crash, or a frame crossed before its turn."""


class Scorer:
    """Turns what the referee has seen since it was last asked into a reward.

    Args:
        referee: of a try that has begun.
    """

    def __init__(self, referee: Referee) -> None:
        self._referee = referee
        self._crossed = 0
        self._contacts = 0
        self._penalty_s = 0.0
        self.failed_order = False

    def reward(self) -> float:
        """For what has happened since the last call."""
        snapshot = self._referee.snapshot()
        reward = 0.0  # plus the rest: a reward of -0.0 would puzzle
        reward += CONTACT * (snapshot.contacts - self._contacts)
        reward += OUTSIDE_PER_S * (snapshot.penalty_s - self._penalty_s)
        self._contacts, self._penalty_s = snapshot.contacts, snapshot.penalty_s
        if len(snapshot.crossed) > self._crossed:
            self.failed_order = self._referee.report().verdict is Verdict.WRONG_ORDER
            if not self.failed_order:
                reward += CROSSING * (len(snapshot.crossed) - self._crossed)
            self._crossed = len(snapshot.crossed)
        return reward


def final_reward(report: RefereeReport) -> float:
    """What the verdict adds at the end of a try."""
    if report.completed:
        return LANDING
    return FAILURE if report.verdict in (Verdict.CRASHED, Verdict.WRONG_ORDER) else 0.0
