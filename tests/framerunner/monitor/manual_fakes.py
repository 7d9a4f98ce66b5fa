"""Fake drones for the tests of manual control."""

import asyncio

MISSION = {
    "name": "frame_challenge",
    "state": "red.turning",
    "seconds": 3.0,
    "transitions": 2,
    "paused": True,
    "flying": True,
    "finished": False,
    "alive": True,
}


class FakeFleet:
    """In place of `Fleet`: two drones that carry out orders at once, unless the test sets something else.

    Attributes:
        status: of each, by number; may be changed.
        orders: all that came.
        sent: the sticks that came, with the number.
        refuse: orders that are refused, with the words.
        gates: orders that wait for an event.
        held: set when hold was ordered.
        notices: that were told.
        pilots: who has which.
    """

    def __init__(self, _equipment=None):
        self.status = {number: self.drone(number) for number in (1, 2)}
        self.orders = []
        self.sent = []
        self.notices = []
        self.watchers = []
        self.pilots = {}
        self.refuse = {}
        self.gates = {}
        self.held = asyncio.Event()

    @staticmethod
    def drone(number):
        return {
            "id": number,
            "name": f"drone {number}",
            "mode": "Offboard",
            "armed": True,
            "landed": False,
            "battery_percent": 87,
            "voltage_v": 15.9,
            "link": {"state": "live", "age_s": 0.0, "loss_percent": 0.0, "rate_hz": 50.0},
            "mission": None,
            "pilot": "",
            "figures": None,
            "video": False,
        }

    def drone_ids(self):
        return list(self.status)

    def status_message(self):
        return {"kind": "status", "drones": list(self.status.values())}

    async def do(self, drone_id, what):
        self.orders.append(what)
        if what == "hold":
            self.held.set()
        if what in self.gates:
            await self.gates[what].wait()
        if what in self.refuse:
            return False, self.refuse[what]
        modes = {"position": "Position", "offboard": "Offboard", "hold": "Hold", "land": "Land"}
        modes["take_off"] = "Takeoff"
        self.status[drone_id]["mode"] = modes.get(what, self.status[drone_id]["mode"])
        return True, f"{what} done"

    async def run(self):
        await asyncio.Event().wait()

    def welcome(self):
        return [self.status_message()]

    def pose_message(self):
        return {"kind": "pose", "drones": []}

    def subscribe(self, hear):
        self.watchers.append(hear)
        return lambda: self.watchers.remove(hear)

    def on_try(self, hear):
        pass

    def video_url(self, drone_id):
        return None

    def sticks(self, drone_id, sticks):
        self.sent.append((drone_id, sticks))

    def set_pilot(self, drone_id, name):
        self.pilots[drone_id] = name

    def notice(self, drone_id, level, text):
        self.notices.append((drone_id, level, text))
        for hear in list(self.watchers):
            hear({"kind": "notice", "id": drone_id, "level": level, "text": text})
