"""Whether a vehicle is armed, when its acknowledgement comes before the heartbeat that shows it."""

from __future__ import annotations

import pytest

from offboard.arming import Arming

LIMIT_US = 6_000_000


@pytest.fixture
def arming():
    """Of a vehicle that has shown itself disarmed and then acknowledged, at 0."""
    arming = Arming()
    arming.see_heartbeat(False)
    assert not arming.is_armed(0)
    arming.acknowledge(LIMIT_US)
    return arming


def test_an_acknowledgement_holds_until_its_limit_whatever_heartbeats_say(arming):
    arming.see_heartbeat(False)  # was under way
    assert arming.shown is False
    assert arming.is_armed(LIMIT_US)
    assert not arming.is_overdue(LIMIT_US)
    assert not arming.is_armed(LIMIT_US + 1)
    assert arming.is_overdue(LIMIT_US + 1)


@pytest.mark.parametrize("shown_first", [False, True])
def test_once_a_heartbeat_has_shown_it_only_heartbeats_count(shown_first):
    arming = Arming()
    steps = [lambda: arming.acknowledge(LIMIT_US), lambda: arming.see_heartbeat(True)]
    for step in reversed(steps) if shown_first else steps:
        step()
    assert arming.is_armed(LIMIT_US + 1)
    assert not arming.is_overdue(LIMIT_US + 1)
    arming.see_heartbeat(False)
    assert not arming.is_armed(1)


def test_a_request_to_disarm_ends_an_acknowledgement_and_what_heartbeats_said_before_it(arming):
    arming.forget()
    assert arming.shown is None
    assert not arming.is_armed(1)
    assert not arming.is_overdue(LIMIT_US + 1)


def test_a_request_to_disarm_does_not_change_what_a_heartbeat_has_shown(arming):
    arming.see_heartbeat(True)
    arming.forget()
    assert arming.shown is True
