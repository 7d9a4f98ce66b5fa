"""PX4's dialect with time that waits, against a protocol fake of MAVSDK's plugin `mavlink_direct`."""

import asyncio
import json
from types import SimpleNamespace

import pytest

from framerunner.wire.dialect import mavlink
from offboard.drone import DroneError, VelocityFluCommand
from offboard.link import px4, stepped
from offboard.link.direct import CommandRefusedError
from offboard.link.px4 import SteppedPx4Dialect

FORWARD = VelocityFluCommand(forward_m_s=1.0, left_m_s=0.5, up_m_s=0.25, yaw_rate_rad_s=0.1)


class FakePlugin:
    """Answers as PX4 does: PINGs at once, commands with `result`; while `deaf`, nothing."""

    def __init__(self):
        self.sent, self.result, self.deaf = [], mavlink.MAV_RESULT_ACCEPTED, False
        self.callbacks = {}
        self._plugin = self  # the synchronous one inside the asyncio one

    def subscribe_message(self, name, callback):
        self.callbacks[name] = callback

    def send_message(self, message):
        fields = json.loads(message.fields_json)
        self.sent.append((message.message_name, fields))
        if self.deaf:
            return
        if message.message_name == "PING":
            self.receive("PING", {**fields, "target_system": 0})  # one of PX4's own
            self.receive("PING", {**fields, "target_system": 245})
        if message.message_name == "COMMAND_LONG":
            self.receive("COMMAND_ACK", {"command": fields["command"], "result": self.result})

    def receive(self, name, fields):
        self.callbacks[name](
            SimpleNamespace(system_id=1, component_id=1, fields_json=json.dumps(fields)), None
        )

    def names(self):
        names = [name for name, _ in self.sent]
        self.sent.clear()
        return names


@pytest.fixture
async def plugin():
    return FakePlugin()


@pytest.fixture
async def dialect(plugin):
    return SteppedPx4Dialect(plugin, 1)


async def test_a_velocity_is_sent_once_and_time_goes_on_when_it_has_been_taken(plugin, dialect):
    dialect.send(FORWARD)
    await dialect.before_tick()
    (name, fields), (ping, _) = plugin.sent
    assert (name, ping) == ("SET_POSITION_TARGET_LOCAL_NED", "PING")
    assert (fields["vx"], fields["vy"], fields["vz"], fields["yaw_rate"]) == (1.0, -0.5, -0.25, -0.1)
    assert fields["coordinate_frame"] == mavlink.MAV_FRAME_BODY_NED
    plugin.names()
    await dialect.after_tick()
    assert plugin.names() == ["PING"]


async def test_without_a_new_velocity_the_last_one_keeps_offboard_alive_until_another_mode(plugin, dialect):
    dialect.send(FORWARD)
    await dialect.before_tick()
    plugin.names()
    await dialect.before_tick()
    assert plugin.names() == ["SET_POSITION_TARGET_LOCAL_NED", "PING"]
    await dialect.land()
    plugin.names()
    await dialect.before_tick()
    assert plugin.names() == ["PING"]


async def test_a_request_is_sent_when_it_is_made_not_when_it_is_awaited(plugin, dialect):
    answer = dialect.arm()
    assert plugin.names() == ["COMMAND_LONG"]
    await answer


async def test_a_refusal_is_named(plugin, dialect):
    plugin.result = mavlink.MAV_RESULT_TEMPORARILY_REJECTED
    with pytest.raises(CommandRefusedError, match="TEMPORARILY_REJECTED"):
        await dialect.request_offboard()


async def test_px4_that_stands_still_is_waited_for(plugin, dialect, monkeypatch):
    monkeypatch.setattr(stepped, "_ECHO_AGAIN_S", 0.02)
    plugin.deaf = True
    waiting = asyncio.create_task(dialect.before_tick())
    await asyncio.sleep(0.1)
    assert not waiting.done()
    plugin.deaf = False
    await asyncio.wait_for(waiting, 1.0)


async def test_px4_that_never_answers_is_an_error(plugin, dialect, monkeypatch):
    monkeypatch.setattr(stepped, "_ECHO_AGAIN_S", 0.02)
    monkeypatch.setattr(stepped, "ECHO_LIMIT_S", 0.05)
    plugin.deaf = True
    with pytest.raises(DroneError, match="PX4 has not returned a PING"):
        await dialect.before_tick()


async def test_streams_are_requested_one_a_tick_without_an_echo_before_time_goes_on(
    plugin, dialect, monkeypatch
):
    monkeypatch.setattr(px4, "_TAKEN_S", 0.0)
    requested = asyncio.create_task(dialect.request_streams())
    await asyncio.sleep(0)
    for _ in px4.STREAMS_HZ:
        assert not requested.done()
        await dialect.before_tick()
        assert plugin.names() == ["COMMAND_LONG"]
    await dialect.before_tick()
    assert plugin.names() == ["PING"]
    await asyncio.wait_for(requested, 1.0)
