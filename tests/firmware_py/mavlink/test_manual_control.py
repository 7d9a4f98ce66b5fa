import pytest

from framerunner.wire.dialect import mavlink


def joystick(x=0, y=0, z=500, r=0, target=1):
    return mavlink.MAVLink_manual_control_message(target, x, y, z, r, 0)


def channels(*pulses, target=1):
    return mavlink.MAVLink_rc_channels_override_message(target, 1, *pulses, *[0] * (8 - len(pulses)))


def only(autopilot):
    ((name, sticks),) = autopilot.calls
    assert name == "manual_input"
    return (sticks.forward, sticks.right, sticks.up, sticks.yaw)


def test_a_joystick_is_a_pilot(autopilot, peer):
    peer.send(joystick(500, -1000, 750, 250))
    assert only(autopilot) == (0.5, -1.0, 0.5, 0.25)


def test_what_is_out_of_range_is_a_stick_let_go(autopilot, peer):
    peer.send(joystick(0x7FFF, -1001, -1, 1001))
    assert only(autopilot) == (0.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize("message", [joystick(target=2), channels(1500, 1500, 1500, 1500, target=2)])
def test_other_vehicles_sticks_are_not_ours(autopilot, peer, message):
    autopilot.parameters.set("COM_RC_IN_MODE", 2)
    peer.send(message)
    assert autopilot.calls == []


def test_channels_are_roll_pitch_throttle_yaw(autopilot, peer):
    autopilot.parameters.set("COM_RC_IN_MODE", 2)
    peer.send(channels(2000, 1250, 1000, 1600))
    assert only(autopilot) == pytest.approx((0.5, 1.0, -1.0, 0.2))


@pytest.mark.parametrize("pulse", [0, 700, 65535])
def test_a_channel_that_is_not_given_is_no_pilot(autopilot, peer, pulse):
    autopilot.parameters.set("COM_RC_IN_MODE", 2)
    peer.send(channels(1500, 1500, pulse, 1500))
    assert autopilot.calls == []


@pytest.mark.parametrize(
    ("mode", "joystick_heard", "channels_heard"),
    [(0, False, True), (1, True, False), (2, True, True), (3, True, True), (4, False, False)],
)
def test_a_parameter_selects_the_source_of_sticks(autopilot, peer, mode, joystick_heard, channels_heard):
    autopilot.parameters.set("COM_RC_IN_MODE", mode)
    peer.send(joystick())
    assert bool(autopilot.calls) == joystick_heard
    autopilot.calls.clear()
    peer.send(channels(1500, 1500, 1500, 1500))
    assert bool(autopilot.calls) == channels_heard


def test_channels_of_a_remote_control_are_streamed_while_they_are_received(peer):
    peer.send(channels(1500, 1600, 1100, 1400, 2000))
    told = [m for on, m in peer.advance(0.4) if on == "ground" and m.get_type() == "RC_CHANNELS"]
    assert len(told) >= 7
    assert (told[0].chancount, told[0].chan2_raw, told[0].chan5_raw, told[0].chan6_raw) == (
        5,
        1600,
        2000,
        65535,
    )
    peer.advance(0.2)
    assert "RC_CHANNELS" not in {m.get_type() for _, m in peer.advance(0.5)}


@pytest.mark.parametrize(
    "message", [channels(*[1500] * 8, target=2), channels(*[0] * 8), channels(*[65535] * 8)]
)
def test_channels_of_others_or_released_are_not_streamed(peer, message):
    peer.send(message)
    assert "RC_CHANNELS" not in {m.get_type() for _, m in peer.advance(0.5)}
