"""Whose datagrams count on a port that serves one program."""

import socket
from contextlib import closing

import pytest

from sitl.ardupilot.sole_sender import Sign, SoleSender


def sender(address="127.0.0.1"):
    """A socket that is bound as ArduPilot's is: to all addresses, and others may bind its port."""
    opened = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    opened.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    opened.bind(("0.0.0.0", 0))
    return opened, (address, opened.getsockname()[1])


@pytest.fixture
def two():
    first, other = sender(), sender()
    with closing(first[0]), closing(other[0]):
        yield first, other


def test_the_first_sender_counts_and_others_are_reported_once(two):
    (_, first), (_, other) = two
    said = []
    sole = SoleSender("ArduPilot", 9002, said.append, clock=lambda: 0.0)
    assert sole.select([("a", first), ("b", other), ("c", first)]) == ["a", "c"]
    assert sole.select([("d", other)]) == []
    assert sole.address == first
    assert len(said) == 1
    assert f"what 127.0.0.1:{other[1]} sends to UDP 9002 is ignored" in said[0]
    assert f"ArduPilot at 127.0.0.1:{first[1]} is connected" in said[0]


def test_another_sender_is_connected_when_the_port_of_the_first_is_closed(two):
    (opened, first), (_, other) = two
    sole = SoleSender("ArduPilot", 9002, lambda line: None, clock=lambda: 0.0)
    sole.select([("a", first)])
    opened.close()
    assert sole.select([("b", first), ("c", other)]) == ["b"]  # what it has sent before counts
    assert sole.select([("d", other)]) == ["d"]
    assert sole.address == other


@pytest.mark.parametrize(("host", "now_s", "taken"), [("127.0.0.1", 3.0, False), ("192.0.2.1", 3.6, True)])
def test_a_sender_that_is_silent_for_long_has_gone(two, host, now_s, taken):
    (_, first), (_, other) = two
    time_s = [0.0]
    sole = SoleSender("ArduPilot", 9002, lambda line: None, 3.5, clock=lambda: time_s[0])
    sole.select([("a", (host, first[1]))])
    time_s[0] = now_s
    assert sole.select([("b", other)]) == (["b"] if taken else [])


def test_after_forgetting_the_next_sender_counts(two):
    (_, first), (_, other) = two
    sole = SoleSender("ArduPilot", 9002, lambda line: None)
    sole.select([("a", first)])
    sole.forget()
    assert sole.select([("b", other)]) == ["b"]


def test_a_sender_without_the_sign_of_the_program_does_not_take_its_place(two):
    (_, stranger), (_, genuine) = two
    said = []
    sole = SoleSender("ArduPilot", 9002, said.append)
    sole.sign = Sign(lambda item: item == "genuine", "frame of ArduPilot")
    assert sole.select([("noise", stranger)]) == sole.select([("noise", stranger)]) == []
    assert sole.address is None
    assert len(said) == 1
    assert (
        f"what 127.0.0.1:{stranger[1]} sends to UDP 9002 is ignored: it is no frame of ArduPilot" in said[0]
    )
    assert sole.select([("noise", stranger), ("genuine", genuine), ("later", genuine)]) == [
        "genuine",
        "later",
    ]
    assert sole.address == genuine
