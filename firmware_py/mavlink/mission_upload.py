"""An upload in progress, and what became of the last one."""

from __future__ import annotations

from dataclasses import dataclass, field

from firmware_py.mavlink.links import Link
from firmware_py.missions.items import MissionItem, PlanType

RETRY_US = 250_000  # an item is asked for again
GIVE_UP_US = 5_000_000  # nothing was heard from the other side


@dataclass(frozen=True, slots=True)
class Partner:
    """Who uploads or downloads.

    Attributes:
        link: by which.
        system: id.
        component: id.
    """

    link: Link
    system: int
    component: int

    @property
    def address(self) -> tuple[int, int]:
        """System and component, as messages name their target."""
        return self.system, self.component

    def is_same(self, other: Partner) -> bool:
        """Whether both are one."""
        return self.link is other.link and self.address == other.address


@dataclass(slots=True)
class Upload:
    """A plan that comes in, item by item.

    Attributes:
        partner: who sends.
        plan_type: of what.
        count: how many items there will be.
        heard_us: when the partner was heard last.
        asked_us: when an item was asked for last.
        as_int: ask for MISSION_ITEM_INT.
        items: what has come.
        current: the item marked as current.
    """

    partner: Partner
    plan_type: PlanType
    count: int
    heard_us: int
    asked_us: int
    as_int: bool = True
    items: list[MissionItem] = field(default_factory=list)
    current: int | None = None

    @property
    def wanted(self) -> int:
        """The item to come next."""
        return len(self.items)

    @property
    def complete(self) -> bool:
        """Whether all have come."""
        return len(self.items) == self.count


@dataclass(frozen=True, slots=True)
class Outcome:
    """How an upload ended, to be said again when its last item comes again.

    Attributes:
        partner: who sent.
        plan_type: of what.
        last_seq: the item that ended it.
        result: MAV_MISSION_RESULT.
        opaque_id: of the new plan.
    """

    partner: Partner
    plan_type: PlanType
    last_seq: int
    result: int
    opaque_id: int
