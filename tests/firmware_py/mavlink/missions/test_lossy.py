"""Plans arrive whole over links that lose, double and swap packets; the client retries as MAVSDK does."""

import pytest

from firmware_py.missions.items import PlanType
from framerunner.wire.dialect import mavlink

RETRY_S, RETRIES = 0.5, 5
STEP_S = 0.02


class Client:
    """A client that repeats its last message until it is answered.

    Args:
        lossy: the bad link.
        plan: MAV_MISSION_TYPE.
    """

    def __init__(self, lossy, plan):
        self.lossy, self.plan = lossy, plan

    def upload(self, items):
        """The result of the upload; None: it timed out."""
        last, waited_s, retries = mavlink.MAVLink_mission_count_message(1, 1, len(items), self.plan), 0.0, 0
        self.lossy.send(last)
        while retries <= RETRIES:
            for message in self._heard():
                if message.get_type() == "MISSION_ACK" and message.mission_type == self.plan:
                    return message.type
                if message.get_type() == "MISSION_REQUEST_INT" and message.mission_type == self.plan:
                    last, waited_s, retries = items[message.seq], 0.0, 0
                    self.lossy.send(last)
            waited_s += STEP_S
            if waited_s >= RETRY_S:
                waited_s, retries = 0.0, retries + 1
                self.lossy.send(last)
        return None

    def download(self):
        """The items; None: it timed out."""
        count = self._asked(
            mavlink.MAVLink_mission_request_list_message(1, 1, self.plan), "MISSION_COUNT", lambda _: True
        )
        items = []
        while count is not None and len(items) < count.count:
            seq = len(items)
            request = mavlink.MAVLink_mission_request_int_message(1, 1, seq, self.plan)
            item = self._asked(request, "MISSION_ITEM_INT", lambda message, seq=seq: message.seq == seq)
            if item is None:
                return None
            items.append(item)
        self.lossy.send(mavlink.MAVLink_mission_ack_message(1, 1, 0, self.plan))
        return None if count is None else items

    def _asked(self, request, answer, fits):
        for _ in range(RETRIES + 1):
            self.lossy.send(request)
            for _ in range(round(RETRY_S / STEP_S)):
                for message in self._heard():
                    if message.get_type() == answer and message.mission_type == self.plan and fits(message):
                        return message
        return None

    def _heard(self):
        return self.lossy.advance(STEP_S, step_us=20_000)


def items_of(plan, count):
    command, params = {0: (16, (0, 0, 0, 0)), 1: (5003, (900, 0, 0, 0)), 2: (5100, (0, 0, 0, 0))}[plan]
    return [
        mavlink.MAVLink_mission_item_int_message(
            1, 1, seq, 3, command, 0, 1, *params, 473977420 + seq, 85455940, 10, plan
        )
        for seq in range(count)
    ]


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize(("plan", "count"), [(0, 60), (1, 30), (2, 20)])
def test_up_and_down(peer, make_lossy_peer, autopilot, plan, count, seed):
    client = Client(make_lossy_peer(peer, seed=seed), plan)
    items = items_of(plan, count)
    assert client.upload(items) == mavlink.MAV_MISSION_ACCEPTED
    assert len(autopilot.missions.plan(PlanType(plan)).items) == count
    read = client.download()
    assert [message.x for message in read] == [message.x for message in items]
    assert client.lossy.up.lost + client.lossy.down.lost > 0
    assert peer.node.failed_messages == 0


def test_one_plan_after_the_other_on_a_very_bad_link(peer, make_lossy_peer, autopilot):
    bad = {"loss": 0.15, "duplicate": 0.15, "reorder": 0.15}
    lossy = make_lossy_peer(peer, seed=3, **bad)
    for turn in range(3):
        for plan in PlanType:
            count = 5 + turn
            assert Client(lossy, int(plan)).upload(items_of(plan, count)) == mavlink.MAV_MISSION_ACCEPTED
            assert len(autopilot.missions.plan(plan).items) == count
