"""The commands of a flight recorded from PX4 v1.17 (SIH), sent again to the x500: the same answers in turn.

The tables hold what was measured there: seconds since switched on, the peer 245/191 on the onboard link.
PX4 acknowledges DO_SET_MODE twice, here it is acknowledged once.
"""

from math import nan

import pytest

from firmware_py.mavlink.node import MavlinkNode
from firmware_py.mavlink.telemetry.profiles import ONBOARD
from framerunner.wire.dialect import mavlink
from framerunner.wire.framing import PacketReader
from scenarios.loader import load_scenario
from sitl.simulation import Simulation
from tests.node_input import deliver

COMMANDS = [  # time, command, params
    (8.04, 512, (148, 0, 0, 0, 0, 0, 0)),
    (10.05, 400, (1, 0, 0, 0, 0, 0, 0)),
    (12.11, 22, (nan, nan, nan, nan, nan, nan, None)),  # 10 m over home
    (38.87, 176, (1, 6, 0, 0, 0, 0, 0)),
    (134.15, 176, (1, 4, 3, 0, 0, 0, 0)),
    (137.16, 21, (0, 0, 0, nan, 0, 0, 0)),
]
ACKNOWLEDGED = [(512, 0), (400, 0), (22, 0), (176, 0), (176, 0), (21, 0)]
SLOWEST_ACK_S = 0.017
HEARTBEATS = [  # base mode, custom mode, state, in the order in which they changed
    (29, 0x03040000, 0),
    (29, 0x03040000, 3),
    (157, 0x03040000, 4),
    (157, 0x02040000, 4),
    (157, 0x03040000, 4),
    (145, 0x00060000, 4),
    (157, 0x03040000, 4),
    (157, 0x06040000, 4),
    (29, 0x03040000, 3),
]
LANDED_STATES = [1, 3, 2, 4, 1]
REST = (0.0, 0.0, 0.0, 0.0)
SETPOINTS = [  # from when on, forward, right, down in m/s, yaw rate in rad/s; at 20 Hz, until 135.15
    (37.37, REST),
    (43.88, (3.0, 0.0, 0.0, 0.0)),
    (49.96, REST),
    (53.96, (0.0, 2.0, 0.0, 0.0)),
    (58.97, REST),
    (61.97, (-2.0, -1.0, 0.0, 0.0)),
    (66.98, REST),
    (69.98, (0.0, 0.0, -1.0, 0.0)),
    (73.99, REST),
    (76.99, (0.0, 0.0, 1.0, 0.0)),
    (81.00, REST),
    (84.00, (0.0, 0.0, 0.0, 0.5236)),
    (90.01, REST),
    (93.01, (0.0, 0.0, 0.0, -0.7854)),
    (97.02, REST),
    (100.02, (2.0, 0.0, 0.0, 0.5236)),
    (112.10, REST),
    (116.11, (15.0, 0.0, 0.0, 0.0)),
    (122.13, REST),
    (128.14, (0.0, 0.0, 0.0, 6.2832)),
    (131.14, REST),
]
SETPOINTS_END_S = 135.15
SETPOINT_PERIOD_S = 0.05


class Replay:
    """Sends what is due at each tick of a simulation and keeps what is received, with its time."""

    def __init__(self):
        self.simulation = Simulation(load_scenario("open-field"))
        self.node = MavlinkNode(self.simulation.autopilot, (ONBOARD,))
        self.received = []
        self._peer = mavlink.MAVLink(None, 245, 191)
        self._reader = PacketReader()
        self._setpoint_due_s = SETPOINTS[0][0]

    def fly(self, until_s):
        commands = list(COMMANDS)
        while (now_s := self.simulation.time_us / 1e6) < until_s:
            if commands and commands[0][0] <= now_s:
                self._command(*commands.pop(0)[1:])
            if self._setpoint_due_s <= now_s < SETPOINTS_END_S:
                self._setpoint_due_s += SETPOINT_PERIOD_S
                self._setpoint(now_s)
            self.simulation.tick()
            self.node.update(self.simulation.autopilot.state.time_us)
            self.received += [
                (now_s, message) for _, data in self.node.take_output() for message in self._reader.feed(data)
            ]

    def _command(self, number, params):
        home_m = self.simulation.scenario.origin.altitude_m
        params = [home_m + 10.0 if value is None else value for value in params]
        self._send(mavlink.MAVLink_command_long_message(1, 1, number, 0, *params))

    def _setpoint(self, now_s):
        forward, right, down, yaw_rate = next(value for start, value in reversed(SETPOINTS) if start <= now_s)
        self._send(
            mavlink.MAVLink_set_position_target_local_ned_message(
                *(0, 1, 1, mavlink.MAV_FRAME_BODY_NED, 0x5C7),
                *(0, 0, 0, forward, right, down, 0, 0, 0, 0, yaw_rate),
            )
        )

    def _send(self, message):
        deliver(self.node, ONBOARD.name, message.pack(self._peer))

    def of(self, kind):
        """The messages received of a kind, each with its time."""
        return [(time_s, message) for time_s, message in self.received if message.get_type() == kind]


@pytest.fixture(scope="module")
def replay():
    replay = Replay()
    replay.fly(165.0)
    return replay


def changes(values):
    values = list(values)
    return [value for index, value in enumerate(values) if index == 0 or value != values[index - 1]]


def test_each_command_gets_the_recorded_answer_within_the_recorded_time(replay):
    acks = replay.of("COMMAND_ACK")
    assert [(ack.command, ack.result) for _, ack in acks] == ACKNOWLEDGED
    assert {(ack.target_system, ack.target_component) for _, ack in acks} == {(245, 191)}
    for (sent_s, *_), (came_s, _) in zip(COMMANDS, acks, strict=True):
        assert came_s - sent_s <= SLOWEST_ACK_S


def test_the_asked_for_message_comes(replay):
    ((came_s, version),) = replay.of("AUTOPILOT_VERSION")
    assert came_s - COMMANDS[0][0] <= SLOWEST_ACK_S
    assert version.flight_sw_version == 0x011100FF


def test_heartbeats_and_landed_states_go_through_what_was_recorded(replay):
    heartbeats = [beat for _, beat in replay.of("HEARTBEAT") if beat.autopilot == mavlink.MAV_AUTOPILOT_PX4]
    assert changes((b.base_mode, b.custom_mode, b.system_status) for b in heartbeats) == HEARTBEATS
    assert changes(state.landed_state for _, state in replay.of("EXTENDED_SYS_STATE")) == LANDED_STATES


@pytest.mark.parametrize(("start_s", "end_s", "wanted"), [
    (48.9, 49.9, (3.0, 0.0, 0.0)),
    (57.9, 58.9, (0.0, 2.0, 0.0)),
    (65.9, 66.9, (-2.0, -1.0, 0.0)),
    (72.9, 73.9, (0.0, 0.0, -1.0)),
    (79.9, 80.9, (0.0, 0.0, 1.0)),
])  # fmt: skip
def test_velocities_are_flown(replay, start_s, end_s, wanted):
    """PX4's own SIH reaches 80 to 107 % of them; the yaw is still that of the start, north."""
    positions = [place for time_s, place in replay.of("LOCAL_POSITION_NED") if start_s < time_s < end_s]
    mean = [sum(getattr(place, axis) for place in positions) / len(positions) for axis in ("vx", "vy", "vz")]
    assert mean == pytest.approx(wanted, abs=0.1)
