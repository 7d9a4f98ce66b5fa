"""The mission protocol: upload and download of missions, fences and rally points.

It answers as PX4 does. Differences, all for links that lose, double or swap packets, or for clear answers:

* Items may be requested in any order and without the list first; PX4 ends the download then.
* An upload that times out is ended by an acknowledgement (OPERATION_CANCELLED); PX4 only sends a text.
* The acknowledgement of a refused upload is repeated when the refused item is received again.
* Partial lists and unknown types of plan are answered UNSUPPORTED; PX4 does not answer the first.
* Positions that are not on Earth and circles without a radius are refused.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from weakref import WeakSet

from firmware_py.autopilot import Autopilot
from firmware_py.mavlink.missions.execution import MissionExecution
from firmware_py.mavlink.missions.item_messages import (
    ItemRefusal,
    item_message,
    mission_ack,
    mission_count,
    read_item,
)
from firmware_py.mavlink.service import AutopilotService
from firmware_py.missions.geofence import fence_fault
from firmware_py.missions.items import MissionItem, PlanType
from firmware_py.missions.store import StoredPlan
from framerunner.wire.dialect import Message, mavlink
from framerunner.wire.exchange import Exchange
from framerunner.wire.link import Link

_RETRY_US = 250_000  # until an item is requested again
_TIMEOUT_US = 5_000_000  # of the other side
_MAX_ITEMS = {PlanType.MISSION: 10_000, PlanType.FENCE: 64, PlanType.RALLY: 32}  # PX4's SITL has the same
_PLAN_TYPES = {int(plan_type): plan_type for plan_type in PlanType}
_MISSION_PLANNER = 190  # MAV_COMP_ID_MISSIONPLANNER, which PX4 accepts as its own id here
_CRITICAL = mavlink.MAV_SEVERITY_CRITICAL
_MAX_DOWNLOADS = 32
_FORMS = {
    mavlink.MAVLINK_MSG_ID_MISSION_REQUEST: False,
    mavlink.MAVLINK_MSG_ID_MISSION_ITEM: False,
    mavlink.MAVLINK_MSG_ID_MISSION_REQUEST_INT: True,
    mavlink.MAVLINK_MSG_ID_MISSION_ITEM_INT: True,
}
"""Messages that show whether the other side uses the integer form."""


@dataclass(frozen=True, slots=True)
class _Partner:
    """The other side of an upload or download."""

    link: Link
    address: tuple[int, int]  # system and component id


@dataclass(slots=True)
class _Upload:
    """A plan that is received item by item."""

    partner: _Partner
    plan_type: PlanType
    count: int  # of all items
    received_us: int  # vehicle time of the partner's last message
    requested_us: int  # vehicle time of the last request for an item
    items: list[MissionItem] = field(default_factory=list)  # received so far
    current: int | None = None  # the item marked as current

    @property
    def next_seq(self) -> int:
        """The next item to receive."""
        return len(self.items)

    @property
    def complete(self) -> bool:
        return len(self.items) == self.count


@dataclass(frozen=True, slots=True)
class _Outcome:
    """How an upload ended; repeated when its last item is received again."""

    partner: _Partner
    plan_type: PlanType
    last_seq: int  # the item that ended it
    result: int  # MAV_MISSION_RESULT
    opaque_id: int  # of the new plan


class MissionService(AutopilotService):
    """Missions, fences and rally points over MAVLink; one upload at a time on all links together."""

    def __init__(self, autopilot: Autopilot, exchange: Exchange, execution: MissionExecution) -> None:
        super().__init__(autopilot, exchange)
        self._execution = execution
        self._store = autopilot.missions
        self._upload: _Upload | None = None
        self._outcome: _Outcome | None = None
        self._float_links: WeakSet[Link] = WeakSet()  # whose other side last used the form with floats
        # The plan that is read, and the time of the last request.
        self._downloads: dict[tuple[_Partner, PlanType], tuple[StoredPlan, int]] = {}
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
        """Repeat a request that was not answered, and end transfers whose other side is silent."""
        now_us, upload = self._exchange.time_us, self._upload
        if upload is not None:
            if now_us - upload.received_us > _TIMEOUT_US:
                self._say("Operation timeout")
                self._end(upload, mavlink.MAV_MISSION_OPERATION_CANCELLED)
            elif now_us - upload.requested_us > _RETRY_US:
                self._request_next(upload)
        if self._downloads:
            self._forget_downloads(now_us)

    def _receive(self, work: Callable[[_Partner, Message], None], link: Link, message: Message) -> None:
        """Handle a message that is for us."""
        if message.target_component == _MISSION_PLANNER:
            for_us = message.target_system == self._exchange.system_id
        else:
            for_us = self._exchange.is_for_us(message)
        if not for_us:
            return
        as_int = _FORMS.get(message.get_msgId())
        if as_int is not None:
            (self._float_links.discard if as_int else self._float_links.add)(link)
        work(_Partner(link, (message.get_srcSystem(), message.get_srcComponent())), message)

    # Uploads

    def _count(self, partner: _Partner, message: Message) -> None:
        plan_type = _PLAN_TYPES.get(message.mission_type)
        upload, now_us = self._upload, self._exchange.time_us
        if plan_type is None:
            self._answer(partner, mavlink.MAV_MISSION_UNSUPPORTED, message.mission_type)
        elif upload is not None and upload.partner != partner:
            self._say("WPM: IGN MISSION_COUNT: Busy with another upload")
            self._answer(partner, mavlink.MAV_MISSION_ERROR, plan_type)
        elif upload is not None and _repeats(upload, plan_type, message.count, now_us):
            self._request_next(upload)
        elif message.count > _MAX_ITEMS[plan_type]:
            self._upload = None
            self._say(f"Too many items: {message.count}, there is room for {_MAX_ITEMS[plan_type]}")
            self._answer(partner, mavlink.MAV_MISSION_NO_SPACE, plan_type)
        elif message.count == 0:
            self._upload = None
            self._clear(plan_type)
            self._answer(partner, mavlink.MAV_MISSION_ACCEPTED, plan_type)
        else:
            self._upload = _Upload(partner, plan_type, message.count, now_us, now_us)
            self._request_next(self._upload)

    def _request_next(self, upload: _Upload) -> None:
        """Request the next item."""
        upload.requested_us = self._exchange.time_us
        link = upload.partner.link
        as_float = link in self._float_links
        build = (
            mavlink.MAVLink_mission_request_message
            if as_float
            else mavlink.MAVLink_mission_request_int_message
        )
        self._exchange.send(link, build(*upload.partner.address, upload.next_seq, int(upload.plan_type)))

    def _item(self, partner: _Partner, message: Message) -> None:
        upload = self._upload
        if self._repeat_outcome(partner, message):
            return
        if upload is None:
            self._say("IGN MISSION_ITEM: No transfer")
            self._answer(partner, mavlink.MAV_MISSION_ERROR, message.mission_type)
        elif upload.partner != partner:
            self._say("REJ. MIS ITEM: partner id mismatch")
        elif message.mission_type != upload.plan_type:
            self._answer(partner, mavlink.MAV_MISSION_ERROR, message.mission_type)
        else:
            upload.received_us = self._exchange.time_us
            if message.seq == upload.next_seq:
                self._take(upload, message)

    def _take(self, upload: _Upload, message: Message) -> None:
        """Take the requested item."""
        item = read_item(message, upload.plan_type)
        if isinstance(item, ItemRefusal):
            self._say(f"IGN MISSION_ITEM: Invalid item {message.seq + 1}: {item.reason}")
            self._end(upload, item.result)
            return
        upload.items.append(item)
        if message.current:
            upload.current = item.seq
        if upload.complete:
            self._finish(upload)
        else:
            self._request_next(upload)

    def _finish(self, upload: _Upload) -> None:
        """Replace the old plan by the complete upload, if it is valid."""
        fault = fence_fault(upload.items) if upload.plan_type is PlanType.FENCE else None
        if fault is not None:
            self._say(fault)
            self._end(upload, mavlink.MAV_MISSION_ERROR)
            return
        opaque_id = self._store.replace(upload.plan_type, upload.items, current=upload.current)
        self._end(upload, mavlink.MAV_MISSION_ACCEPTED, opaque_id)
        self._execution.check()

    def _end(self, upload: _Upload, result: int, opaque_id: int = 0) -> None:
        last_seq = upload.next_seq - 1 if upload.complete else upload.next_seq
        self._upload = None
        self._outcome = _Outcome(upload.partner, upload.plan_type, last_seq, result, opaque_id)
        self._answer(upload.partner, result, upload.plan_type, opaque_id)

    def _repeat_outcome(self, partner: _Partner, message: Message) -> bool:
        """Whether an item is the one that ended the last upload; then its acknowledgement was lost."""
        outcome = self._outcome
        if outcome is None or outcome.partner != partner:
            return False
        if (message.mission_type, message.seq) != (outcome.plan_type, outcome.last_seq):
            return False
        upload = self._upload
        if upload is not None and upload.partner == partner and upload.plan_type is outcome.plan_type:
            return False  # it belongs to the present upload
        self._answer(partner, outcome.result, outcome.plan_type, outcome.opaque_id)
        return True

    def _ack(self, partner: _Partner, message: Message) -> None:
        """The other side cancels an upload, requires the other form of requests, or ends a download."""
        upload = self._upload
        plan_type = _PLAN_TYPES.get(message.mission_type)
        if plan_type is not None:
            self._downloads.pop((partner, plan_type), None)
        if upload is None or upload.partner != partner or plan_type is not upload.plan_type:
            return
        if message.type == mavlink.MAV_MISSION_OPERATION_CANCELLED:
            self._upload = None
        elif message.type == mavlink.MAV_MISSION_UNSUPPORTED:
            self._float_links.symmetric_difference_update({partner.link})
            self._request_next(upload)

    # Downloads

    def _request_list(self, partner: _Partner, message: Message) -> None:
        plan_type = _PLAN_TYPES.get(message.mission_type)
        if plan_type is None:
            self._answer(partner, mavlink.MAV_MISSION_UNSUPPORTED, message.mission_type)
            return
        plan = self._store.plan(plan_type)
        self._downloads[(partner, plan_type)] = (plan, self._exchange.time_us)
        if len(self._downloads) > _MAX_DOWNLOADS:
            self._downloads.pop(next(iter(self._downloads)))
        count = mission_count(partner.address, len(plan.items), plan_type, plan.opaque_id)
        self._exchange.send(partner.link, count)

    def _request(self, partner: _Partner, message: Message) -> None:
        plan_type = _PLAN_TYPES.get(message.mission_type)
        if plan_type is None:
            self._answer(partner, mavlink.MAV_MISSION_UNSUPPORTED, message.mission_type)
            return
        key = (partner, plan_type)
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
        for key in [key for key, (_, used_us) in self._downloads.items() if now_us - used_us > _TIMEOUT_US]:
            del self._downloads[key]

    def _partial_list(self, partner: _Partner, message: Message) -> None:
        self._answer(partner, mavlink.MAV_MISSION_UNSUPPORTED, message.mission_type)

    # Other requests

    def _clear_all(self, partner: _Partner, message: Message) -> None:
        upload = self._upload
        result = mavlink.MAV_MISSION_ACCEPTED
        if message.mission_type == mavlink.MAV_MISSION_TYPE_ALL:
            cleared = tuple(PlanType)
        else:
            plan_type = _PLAN_TYPES.get(message.mission_type)
            cleared = () if plan_type is None else (plan_type,)
        if not cleared:
            result = mavlink.MAV_MISSION_UNSUPPORTED
        elif upload is not None and upload.partner != partner:
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

    def _set_current(self, _partner: _Partner, message: Message) -> None:
        if self._upload is not None:
            self._say("WPM: IGN WP CURR CMD: Busy")
        elif self._store.select(message.seq):
            self._execution.broadcast_current()
        else:
            count = len(self._store.mission.items)
            self._say(f"WPM: WP CURR CMD: Not in list: {message.seq} of {count}")

    def _answer(self, partner: _Partner, result: int, mission_type: int, opaque_id: int = 0) -> None:
        self._exchange.send(partner.link, mission_ack(partner.address, result, mission_type, opaque_id))

    def _say(self, text: str) -> None:
        self._autopilot.say(_CRITICAL, text)


def _repeats(upload: _Upload, plan_type: PlanType, count: int, now_us: int) -> bool:
    """Whether MISSION_COUNT was received twice; after a pause it is a client that restarts its upload."""
    same = (plan_type, count) == (upload.plan_type, upload.count)
    return same and now_us - upload.received_us <= _RETRY_US
