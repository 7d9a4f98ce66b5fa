"""The stored plans, shared by the protocol that uploads them and the executor that flies them."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

from firmware_py.missions.items import MissionItem, PlanType, opaque_id

_REACHED_KEPT = 100


@dataclass(frozen=True, slots=True)
class StoredPlan:
    """The items of one upload.

    Attributes:
        items: in order.
        opaque_id: of these items; 0: there are none.
        version: counts uploads and clearings of this type of plan.
    """

    items: tuple[MissionItem, ...] = ()
    opaque_id: int = 0
    version: int = 0


class MissionStore:
    """Mission, fence and rally points in memory, and the mission's progress.

    Attributes:
        current: index of the mission item that is flown now or next.
        selections: counts how often `select` has chosen the current item.
        valid: whether the mission has passed its checks, which need the vehicle and run elsewhere.
        started: whether the mission has been started since its upload.
        finished: whether its last item is done.
    """

    def __init__(self) -> None:
        self._plans = [StoredPlan() for _ in PlanType]
        self._reached: deque[int] = deque(maxlen=_REACHED_KEPT)
        self.current = 0
        self.selections = 0
        self.valid = False
        self.started = False
        self.finished = False

    def plan(self, plan_type: PlanType) -> StoredPlan:
        """The plan of a type."""
        return self._plans[plan_type]

    @property
    def mission(self) -> StoredPlan:
        """The mission."""
        return self._plans[PlanType.MISSION]

    @property
    def fence(self) -> StoredPlan:
        """The fence."""
        return self._plans[PlanType.FENCE]

    @property
    def rally(self) -> StoredPlan:
        """The rally points."""
        return self._plans[PlanType.RALLY]

    def replace(
        self, plan_type: PlanType, items: Sequence[MissionItem], *, current: int | None = None
    ) -> int:
        """Replace a whole plan.

        As in PX4 nothing changes when the items are the same as before, and a new mission continues at the
        old index (or its last item) unless the upload marks an item as the current one.

        Args:
            plan_type: which plan.
            items: numbered 0, 1, 2, ...
            current: index of the item marked as current.

        Returns:
            The plan's opaque id.
        """
        kept = tuple(items)
        identity = opaque_id(kept)
        old = self._plans[plan_type]
        if kept and identity == old.opaque_id:
            return identity
        self._plans[plan_type] = StoredPlan(kept, identity, old.version + 1)
        if plan_type is PlanType.MISSION:
            wanted = self.current if current is None else current
            self.current = max(0, min(wanted, len(kept) - 1))
            self.valid = self.started = self.finished = False
        return identity

    def clear(self, plan_type: PlanType) -> None:
        """Remove a plan."""
        self.replace(plan_type, (), current=0)

    def select(self, seq: int) -> bool:
        """Choose the item to fly next; False when there is no such item."""
        if not 0 <= seq < len(self.mission.items):
            return False
        self.current = seq
        self.selections += 1
        self.finished = False
        return True

    def report_reached(self, seq: int) -> None:
        """Note that an item is done, for `take_reached`."""
        self._reached.append(seq)

    def take_reached(self) -> list[int]:
        """The items done since the last call, oldest first."""
        if not self._reached:
            return []
        reached = list(self._reached)
        self._reached.clear()
        return reached
