"""The mission protocol: plans up and down, for missions, fences and rally points.

It answers as PX4 does. Differences, all for links that lose, double or swap packets, or for plain speech:

* Items may be read in any order and without the list first; PX4 breaks off at a request out of turn.
* An upload that is given up is ended by an acknowledgement (OPERATION_CANCELLED); PX4 says so as text only.
* The acknowledgement of a refused upload is repeated when the refused item comes again.
* Partial lists and unknown types of plan are answered UNSUPPORTED; PX4 is silent to the first.
* Places that are nowhere on Earth and circles without a radius are refused.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial

from firmware_py.autopilot import Autopilot
from firmware_py.mavlink.missions.execution import MissionExecution
from firmware_py.mavlink.missions.messages import Refusal, item_message, mission_ack, mission_count, read_item
from firmware_py.mavlink.service import Service
from firmware_py.missions.geofence import fence_fault
from firmware_py.missions.items import MissionItem, PlanType
from firmware_py.missions.store import Plan
from wire.dialect import Message, mavlink
from wire.exchange import Exchange
from wire.link import Link

_RETRY_US = 250_000  # an item is asked for again
_GIVE_UP_US = 5_000_000  # nothing was heard from the other side
_MAX_ITEMS = {PlanType.MISSION: 10_000, PlanType.FENCE: 64, PlanType.RALLY: 32}  # PX4's SITL has the same
_PLAN_TYPES = {int(plan_type): plan_type for plan_type in PlanType}
_MISSION_PLANNER = 190  # MAV_COMP_ID_MISSIONPLANNER, which PX4 takes for itself here
_CRITICAL = mavlink.MAV_SEVERITY_CRITICAL
_MAX_DOWNLOADS = 32

_DownloadKey = tuple[str, int, int, PlanType]


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


class MissionService(Service):
    """Missions, fences and rally points over MAVLink; one upload at a time on all links together."""

    def __init__(self, autopilot: Autopilot, exchange: Exchange, execution: MissionExecution) -> None:
        self._autopilot = autopilot
        self._exchange = exchange
        self._execution = execution
        self._store = autopilot.missions
        self._upload: Upload | None = None
        self._outcome: Outcome | None = None
        self._downloads: dict[_DownloadKey, tuple[Plan, int]] = {}  # what is read, and when it was last
        self.handlers = {
            message_id: partial(self._receive, work)
            for message_id, work in {
                mavlink.MAVLINK_MSG_ID_MISSION_COUNT: self._count,
                mavlink.MAVLINK_MSG_ID_MISSION_ITEM: self._item,
                mavlink.MAVLINK_MSG_ID_MISSION_ITEM_INT: self._item,
                mavlink.MAVLINK_MSG_ID_MISSION_ACK: self._ack,
                mavlink.MAVLINK_MSG_ID_MISSION_REQUEST_LIST: self._request_list,
                mavlink.MAVLINK_MSG_ID_MISSION_REQUEST: self._request,
                mavlink.MAVLINK_MSG_ID_MISSION_REQUEST_INT: self._request,
                mavlink.MAVLINK_MSG_ID_MISSION_REQUEST_PARTIAL_LIST: self._partial_list,
                mavlink.MAVLINK_MSG_ID_MISSION_WRITE_PARTIAL_LIST: self._partial_list,
                mavlink.MAVLINK_MSG_ID_MISSION_CLEAR_ALL: self._clear_all,
                mavlink.MAVLINK_MSG_ID_MISSION_SET_CURRENT: self._set_current,
            }.items()
        }

    def update(self) -> None:
        """Ask again for what has not come, give up on who is silent."""
        now_us, upload = self._exchange.time_us, self._upload
        if upload is not None:
            if now_us - upload.heard_us > _GIVE_UP_US:
                self._autopilot.say(_CRITICAL, "Operation timeout")
                self._end(upload, mavlink.MAV_MISSION_OPERATION_CANCELLED)
            elif now_us - upload.asked_us > _RETRY_US:
                self._ask(upload)
        if self._downloads:
            self._forget_downloads(now_us)

    def _receive(self, work: Callable[[Partner, Message], None], link: Link, message: Message) -> None:
        """Act on a message that is for us."""
        if message.target_component == _MISSION_PLANNER:
            for_us = message.target_system == self._exchange.system_id
        else:
            for_us = self._exchange.is_for_us(message)
        if for_us:
            work(Partner(link, message.get_srcSystem(), message.get_srcComponent()), message)

    # Uploads

    def _count(self, partner: Partner, message: Message) -> None:
        plan_type = _PLAN_TYPES.get(message.mission_type)
        upload, now_us = self._upload, self._exchange.time_us
        if plan_type is None:
            self._answer(partner, mavlink.MAV_MISSION_UNSUPPORTED, message.mission_type)
        elif upload is not None and not upload.partner.is_same(partner):
            self._say("WPM: IGN MISSION_COUNT: Busy with another upload")
            self._answer(partner, mavlink.MAV_MISSION_ERROR, plan_type)
        elif upload is not None and _repeats(upload, plan_type, message.count, now_us):
            self._ask(upload)
        elif message.count > _MAX_ITEMS[plan_type]:
            self._upload = None
            self._say(f"Too many items: {message.count}, there is room for {_MAX_ITEMS[plan_type]}")
            self._answer(partner, mavlink.MAV_MISSION_NO_SPACE, plan_type)
        elif message.count == 0:
            self._upload = None
            self._clear(plan_type)
            self._answer(partner, mavlink.MAV_MISSION_ACCEPTED, plan_type)
        else:
            self._upload = Upload(partner, plan_type, message.count, now_us, now_us)
            self._ask(self._upload)

    def _ask(self, upload: Upload) -> None:
        """Ask for the item that is wanted next."""
        upload.asked_us = self._exchange.time_us
        build = (
            mavlink.MAVLink_mission_request_int_message
            if upload.as_int
            else mavlink.MAVLink_mission_request_message
        )
        self._exchange.send(
            upload.partner.link, build(*upload.partner.address, upload.wanted, int(upload.plan_type))
        )

    def _item(self, partner: Partner, message: Message) -> None:
        upload = self._upload
        if self._repeat_outcome(partner, message):
            return
        if upload is None:
            self._say("IGN MISSION_ITEM: No transfer")
            self._answer(partner, mavlink.MAV_MISSION_ERROR, message.mission_type)
        elif not upload.partner.is_same(partner):
            self._say("REJ. MIS ITEM: partner id mismatch")
        elif message.mission_type != upload.plan_type:
            self._answer(partner, mavlink.MAV_MISSION_ERROR, message.mission_type)
        else:
            upload.heard_us = self._exchange.time_us
            if message.seq == upload.wanted:
                self._take(upload, message)

    def _take(self, upload: Upload, message: Message) -> None:
        """The wanted item has come."""
        item = read_item(message, upload.plan_type)
        if isinstance(item, Refusal):
            self._say(f"IGN MISSION_ITEM: Invalid item {message.seq + 1}: {item.reason}")
            self._end(upload, item.result)
            return
        upload.items.append(item)
        if message.current:
            upload.current = item.seq
        if upload.complete:
            self._finish(upload)
        else:
            self._ask(upload)

    def _finish(self, upload: Upload) -> None:
        """All items have come: the new plan replaces the old one, or nothing changes."""
        fault = fence_fault(upload.items) if upload.plan_type is PlanType.FENCE else None
        if fault is not None:
            self._say(fault)
            self._end(upload, mavlink.MAV_MISSION_ERROR)
            return
        opaque_id = self._store.replace(upload.plan_type, upload.items, current=upload.current)
        self._end(upload, mavlink.MAV_MISSION_ACCEPTED, opaque_id)
        self._execution.check()

    def _end(self, upload: Upload, result: int, opaque_id: int = 0) -> None:
        last_seq = upload.wanted - 1 if upload.complete else upload.wanted
        self._upload = None
        self._outcome = Outcome(upload.partner, upload.plan_type, last_seq, result, opaque_id)
        self._answer(upload.partner, result, upload.plan_type, opaque_id)

    def _repeat_outcome(self, partner: Partner, message: Message) -> bool:
        """Whether an item is the one that ended the last upload; then its acknowledgement got lost."""
        outcome = self._outcome
        if outcome is None or not outcome.partner.is_same(partner):
            return False
        if (message.mission_type, message.seq) != (outcome.plan_type, outcome.last_seq):
            return False
        upload = self._upload
        if upload is not None and upload.partner.is_same(partner) and upload.plan_type is outcome.plan_type:
            return False  # it belongs to the upload that goes on
        self._answer(partner, outcome.result, outcome.plan_type, outcome.opaque_id)
        return True

    def _ack(self, partner: Partner, message: Message) -> None:
        """The other side cancels, or wants to be asked in the other form; or it has read all."""
        upload = self._upload
        plan_type = _PLAN_TYPES.get(message.mission_type)
        if plan_type is not None:
            self._downloads.pop(_key(partner, plan_type), None)
        if upload is None or not upload.partner.is_same(partner) or plan_type is not upload.plan_type:
            return
        if message.type == mavlink.MAV_MISSION_OPERATION_CANCELLED:
            self._upload = None
        elif message.type == mavlink.MAV_MISSION_UNSUPPORTED:
            upload.as_int = not upload.as_int
            self._ask(upload)

    # Downloads

    def _request_list(self, partner: Partner, message: Message) -> None:
        plan_type = _PLAN_TYPES.get(message.mission_type)
        if plan_type is None:
            self._answer(partner, mavlink.MAV_MISSION_UNSUPPORTED, message.mission_type)
            return
        plan = self._store.plan(plan_type)
        self._downloads[_key(partner, plan_type)] = (plan, self._exchange.time_us)
        if len(self._downloads) > _MAX_DOWNLOADS:
            self._downloads.pop(next(iter(self._downloads)))
        count = mission_count(partner.address, len(plan.items), plan_type, plan.opaque_id)
        self._exchange.send(partner.link, count)

    def _request(self, partner: Partner, message: Message) -> None:
        plan_type = _PLAN_TYPES.get(message.mission_type)
        if plan_type is None:
            self._answer(partner, mavlink.MAV_MISSION_UNSUPPORTED, message.mission_type)
            return
        key = _key(partner, plan_type)
        plan, _ = self._downloads.get(key, (self._store.plan(plan_type), 0))
        if message.seq >= len(plan.items):
            self._say(f"WPM: REJ. CMD: Req. WP was unexpected: {message.seq} of {len(plan.items)}")
            self._answer(partner, mavlink.MAV_MISSION_ERROR, plan_type)
            return
        if key in self._downloads:
            self._downloads[key] = (plan, self._exchange.time_us)
        current = plan_type is PlanType.MISSION and message.seq == self._store.current
        as_int = message.get_msgId() == mavlink.MAVLINK_MSG_ID_MISSION_REQUEST_INT
        answer = item_message(
            plan.items[message.seq], partner.address, plan_type, current=current, as_int=as_int
        )
        self._exchange.send(partner.link, answer)

    def _forget_downloads(self, now_us: int) -> None:
        for key in [key for key, (_, used_us) in self._downloads.items() if now_us - used_us > _GIVE_UP_US]:
            del self._downloads[key]

    def _partial_list(self, partner: Partner, message: Message) -> None:
        self._answer(partner, mavlink.MAV_MISSION_UNSUPPORTED, message.mission_type)

    # The rest

    def _clear_all(self, partner: Partner, message: Message) -> None:
        upload = self._upload
        result = mavlink.MAV_MISSION_ACCEPTED
        if message.mission_type == mavlink.MAV_MISSION_TYPE_ALL:
            cleared = tuple(PlanType)
        else:
            plan_type = _PLAN_TYPES.get(message.mission_type)
            cleared = () if plan_type is None else (plan_type,)
        if not cleared:
            result = mavlink.MAV_MISSION_UNSUPPORTED
        elif upload is not None and not upload.partner.is_same(partner):
            self._say("WPM: IGN CLEAR CMD: Busy")
            result, cleared = mavlink.MAV_MISSION_ERROR, ()
        else:
            self._upload = None
        for plan_type in cleared:
            self._clear(plan_type)
        self._answer(partner, result, message.mission_type)

    def _clear(self, plan_type: PlanType) -> None:
        self._store.clear(plan_type)
        self._execution.check()

    def _set_current(self, partner: Partner, message: Message) -> None:
        if self._upload is not None:
            self._say("WPM: IGN WP CURR CMD: Busy")
        elif self._store.select(message.seq):
            self._execution.tell_current()
        else:
            count = len(self._store.mission.items)
            self._say(f"WPM: WP CURR CMD: Not in list: {message.seq} of {count}")

    def _answer(self, partner: Partner, result: int, mission_type: int, opaque_id: int = 0) -> None:
        self._exchange.send(partner.link, mission_ack(partner.address, result, mission_type, opaque_id))

    def _say(self, text: str) -> None:
        self._autopilot.say(_CRITICAL, text)


def _key(partner: Partner, plan_type: PlanType) -> _DownloadKey:
    return (partner.link.profile.name, partner.system, partner.component, plan_type)


def _repeats(upload: Upload, plan_type: PlanType, count: int, now_us: int) -> bool:
    """Whether MISSION_COUNT came twice; the same after a silence is a client that starts again."""
    same = (plan_type, count) == (upload.plan_type, upload.count)
    return same and now_us - upload.heard_us <= _RETRY_US
