from math import inf, nan

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_py.mavlink.commands.maintenance import MaintenanceCommands
from firmware_py.mavlink.service import VehicleCommand
from firmware_py.parameters import Parameters
from firmware_py.status import CommandResult

ACCEPTED, DENIED, UNSUPPORTED = CommandResult.ACCEPTED, CommandResult.DENIED, CommandResult.UNSUPPORTED


class Breaker:
    """Breaks motors only."""

    def __init__(self):
        self.injected = []

    def inject(self, unit, kind, instance):
        if unit != 101:
            return None
        self.injected.append((unit, kind, instance))
        return f"motor {instance} off"


def inject_failure(autopilot, breaker, *numbers):
    command = VehicleCommand(None, (*numbers, 0.0))
    return MaintenanceCommands(autopilot, breaker).commands[420](command)


@pytest.fixture
def breaker():
    return Breaker()


def test_it_is_denied_until_a_parameter_allows_it(autopilot, breaker):
    assert inject_failure(autopilot, breaker, 101, 1, 1) is DENIED
    assert breaker.injected == []
    autopilot.parameters.set("SYS_FAILURE_EN", 1)
    assert inject_failure(autopilot, breaker, 101, 1, 1) is ACCEPTED
    assert breaker.injected == [(101, 1, 1)]
    assert [text.text for text in autopilot.texts] == ["Injected failure: motor 1 off"]


def test_repairing_and_all_of_a_unit(autopilot, breaker):
    autopilot.parameters.set("SYS_FAILURE_EN", 1)
    assert inject_failure(autopilot, breaker, 101, 0, nan) is ACCEPTED
    assert breaker.injected == [(101, 0, 0)]


@pytest.mark.parametrize(
    "numbers", [(4, 1, 0), (nan, 1, 0), (101, nan, 0), (101, -1, 0), (101, 1, -1), (1e9, 1, 0), (inf, inf, 0)]
)
def test_what_cannot_be_done_is_unsupported(autopilot, breaker, numbers):
    autopilot.parameters.set("SYS_FAILURE_EN", 1)
    assert inject_failure(autopilot, breaker, *numbers) is UNSUPPORTED
    assert breaker.injected == []


def test_without_a_failure_sink_nothing_can_be_broken(autopilot):
    autopilot.parameters.set("SYS_FAILURE_EN", 1)
    assert inject_failure(autopilot, None, 101, 1, 1) is UNSUPPORTED


def test_the_command_reaches_who_breaks(autopilot, make_peer):
    breaker = Breaker()
    peer = make_peer(autopilot, node_options={"failures": breaker})
    autopilot.parameters.set("SYS_FAILURE_EN", 1)
    answers = peer.ask(peer.long(420, 101, 1, 3))
    assert [(m.command, m.result) for m in answers if m.get_type() == "COMMAND_ACK"] == [(420, 0)]
    assert breaker.injected == [(101, 1, 3)]


class Vehicle:
    """Has parameters and keeps its texts."""

    def __init__(self):
        self.parameters = Parameters()
        self.parameters.set("SYS_FAILURE_EN", 1)

    def say(self, severity, text):
        assert text.isascii()


VEHICLE = Vehicle()


@given(st.floats(), st.floats(), st.floats())
def test_any_numbers_get_an_answer(unit, kind, instance):
    breaker = Breaker()
    assert inject_failure(VEHICLE, breaker, unit, kind, instance) in (ACCEPTED, UNSUPPORTED)
    assert all(0 <= number <= 0xFFFF for call in breaker.injected for number in call)
