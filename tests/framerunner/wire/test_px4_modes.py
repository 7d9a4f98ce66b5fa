"""PX4's modes by their numbers and names."""

import pytest
from pymavlink import mavutil

from framerunner.wire.dialect import mavlink
from framerunner.wire.px4_modes import HOLD, MODES, OFFBOARD, mode_of, mode_title, mode_words, px4_name


def heartbeat(custom_mode, flags=mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED, autopilot=12):
    return mavlink.MAVLink_heartbeat_message(2, autopilot, flags, custom_mode, 4, 3)


def test_numbers_name_one_mode():
    assert len({mode.custom_mode for mode in MODES}) == len(MODES) == 20
    for mode in MODES:
        assert mode_of(mode.custom_mode) is mode
    assert (OFFBOARD.custom_mode, HOLD.custom_mode) == (0x0006_0000, 0x0304_0000)


@pytest.mark.parametrize("main", range(12))
def test_short_names_are_pymavlinks(main):
    for sub in (*range(7), *range(8, 12)):  # 4/7 is reserved
        custom_mode = main << 16 | sub << 24
        assert px4_name(custom_mode) == mavutil.interpret_px4_mode(0, custom_mode)


@pytest.mark.parametrize("mode", MODES)
def test_flags_are_pymavlinks_where_it_has_them(mode):
    known = mavutil.px4_map.get(mode.px4_name)
    if known is not None and known[1:] == (mode.main, mode.sub) and mode is not OFFBOARD:
        assert mode.flags | mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED == known[0]


def test_an_unknown_mode_is_named_by_its_numbers():
    assert mode_of(0x6304_0000) is None
    assert mode_title(heartbeat(0x6304_0000)) == "mode 4.99"
    assert mode_title(heartbeat(5, autopilot=3)) == "Loiter"
    assert mode_title(heartbeat(5, autopilot=8)) == "mode 5"
    assert mode_title(heartbeat(HOLD.custom_mode, flags=0)) == f"mode {HOLD.custom_mode}"
    assert (mode_words(0x6304_0000), px4_name(0x6304_0000)) == ("mode 4/99", "UNKNOWN")
    assert (mode_title(heartbeat(HOLD.custom_mode)), mode_words(HOLD.custom_mode)) == ("Hold", "hold")
    assert mode_words(0x6302_0000) == "altitude"  # sub modes mean something in few main modes only
