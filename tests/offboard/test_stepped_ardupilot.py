"""ArduCopter's dialect with time that waits, against a protocol fake of MAVSDK's plugin `mavlink_direct`."""

from framerunner.wire.dialect import mavlink
from offboard.drone import VelocityFluCommand
from offboard.link.ardupilot import SteppedArduPilotDialect
from offboard.link.telemetry import TelemetryFeed
from tests.offboard.test_stepped_px4 import FakePlugin

UP = VelocityFluCommand(up_m_s=1.0)


def dialect_of(plugin, **options):
    feed = TelemetryFeed()
    return SteppedArduPilotDialect(plugin, feed, 1, **options), feed


async def test_all_streams_are_requested_before_time_goes_on():
    plugin = FakePlugin()
    dialect, _ = dialect_of(plugin)
    plugin.result = mavlink.MAV_RESULT_FAILED  # what is refused is missing later
    answer = dialect.request_streams()
    assert {fields["command"] for _, fields in plugin.sent} == {mavlink.MAV_CMD_SET_MESSAGE_INTERVAL}
    assert len({fields["param1"] for _, fields in plugin.sent}) == 6
    await answer


async def test_a_climb_on_the_ground_is_a_take_off_and_is_not_disturbed_until_the_drone_is_in_the_air():
    plugin = FakePlugin()
    dialect, feed = dialect_of(plugin, room_above_m=1.0)
    feed.mode, feed.landed = "GUIDED", True
    feed.arming.acknowledge(10_000_000)
    dialect.send(UP)
    ((name, fields),) = plugin.sent
    assert (name, fields["command"], fields["param7"]) == ("COMMAND_LONG", mavlink.MAV_CMD_NAV_TAKEOFF, 0.7)
    plugin.names()
    await dialect.before_tick()
    dialect.send(UP)
    assert plugin.names() == ["PING"]
    feed.landed = False
    await dialect.before_tick()
    await dialect.before_tick()  # without a new velocity the last one is sent again
    assert plugin.names() == ["PING", "SET_POSITION_TARGET_LOCAL_NED", "PING"]
