from math import nan

import pytest

from firmware_py.mavlink.exchange import Exchange
from firmware_py.mavlink.parameter_storage import preflight_storage
from firmware_py.status import CommandResult


@pytest.fixture
def exchange(autopilot):
    autopilot.parameters.set("MIS_TAKEOFF_ALT", 7.0)
    return Exchange(autopilot, {}, 1)


@pytest.mark.parametrize("action", [2.0, 4.0])
def test_reset_gives_defaults_again(autopilot, exchange, action):
    assert preflight_storage(exchange, action) is CommandResult.ACCEPTED
    assert autopilot.parameters.changed() == {}


@pytest.mark.parametrize("action", [0.0, 3.0])
def test_what_needs_nothing_done_is_accepted(autopilot, exchange, action):
    assert preflight_storage(exchange, action) is CommandResult.ACCEPTED
    assert autopilot.parameters.changed() == {"MIS_TAKEOFF_ALT": 7.0}


def test_saving_asks_who_keeps_them(autopilot, exchange):
    asked = []
    autopilot.parameters.on_save(lambda: asked.append(True))
    assert preflight_storage(exchange, 1.0) is CommandResult.ACCEPTED
    assert asked == [True]


def test_saving_without_a_file_fails_in_words(autopilot, exchange):
    assert preflight_storage(exchange, 1.0) is CommandResult.FAILED
    (said,) = autopilot.texts
    assert said.text == "Parameters are not saved: start it with --parameters FILE"


@pytest.mark.parametrize("action", [nan, -1.0, 0.5, 99.0])
def test_what_is_no_action_is_denied(exchange, action):
    assert preflight_storage(exchange, action) is CommandResult.DENIED


def test_not_while_armed(autopilot, exchange):
    autopilot.status.armed = True
    assert preflight_storage(exchange, 2.0) is CommandResult.TEMPORARILY_REJECTED
    assert autopilot.parameters.changed() == {"MIS_TAKEOFF_ALT": 7.0}
