"""The WebSocket of the sticks: who is let in, what is said, and what has it closed."""

import asyncio
import json
from concurrent.futures import CancelledError
from contextlib import contextmanager, suppress
from types import SimpleNamespace

import pytest
from fastapi import FastAPI
from starlette.testclient import TestClient
from starlette.websockets import WebSocketDisconnect

from monitor import pilot
from monitor.access import Visitor
from monitor.pilot_seat import NEUTRAL
from monitor.sticks import Sticks
from tests.monitor.pilot_fakes import FakeFleet

CENTRED = {"kind": "sticks", "forward": 0, "right": 0, "up": 0, "yaw": 0}
PILOT = Visitor("Ana", may_judge=False, may_fly=True)


@contextmanager
def connected(visitor=PILOT):
    """A browser's WebSocket and the drones."""
    fleet, web = FakeFleet(), FastAPI()
    access = SimpleNamespace(visitor=lambda _connection: visitor)
    pilot.register(SimpleNamespace(fleet=fleet, access=access, web=web, jobs=[]))
    end = suppress(CancelledError)  # of the endpoint, when the test is over
    with TestClient(web) as client, end, client.websocket_connect("/ws/pilot") as socket:
        yield socket, fleet


def order(what, **more):
    return {"kind": "do", "id": 1, "what": what} | more


def answer_to(socket, what):
    """The answer to an order; sticks are sent meanwhile, as a page does."""
    for _ in range(200):
        message = socket.receive_json()
        if message["kind"] == "reply" and message["what"] == what:
            return message
        socket.send_json(CENTRED)
    raise AssertionError(f"no answer to {what}")


def closing_of(socket):
    for _ in range(100):
        try:
            socket.receive_json()
        except WebSocketDisconnect as closed:
            return closed
    raise AssertionError("it was not closed")


def test_who_may_not_fly_is_refused_with_a_reason():
    with connected(Visitor("", may_judge=False, may_fly=False)) as (socket, fleet):
        closed = closing_of(socket)
    assert closed.code == 4403 and "log" in closed.reason
    assert fleet.orders == [] and fleet.sent == []


def test_an_order_is_answered_and_all_are_told_who_has_the_sticks():
    with connected() as (socket, fleet):
        socket.send_json(order("take"))
        seat = socket.receive_json()
        assert seat == {"kind": "seat", "id": 1, "pilot": "Ana", "yours": True, "flying": False}
        reply = answer_to(socket, "take")
        assert reply == {
            "kind": "reply",
            "what": "take",
            "ok": True,
            "text": "you have the sticks of drone 1",
        }
        socket.send_json(CENTRED | {"right": 0.25})
        socket.send_json(order("arm"))
        assert answer_to(socket, "arm")["ok"]
        assert (1, Sticks(0.0, 0.25, 0.0, 0.0)) in fleet.sent
        assert fleet.orders == ["position", "arm"]


def test_a_refused_order_comes_back_in_the_vehicles_words():
    with connected() as (socket, fleet):
        fleet.refuse["arm"] = "Arming denied: low battery"
        socket.send_json(order("arm"))
        reply = answer_to(socket, "arm")
    assert reply == {"kind": "reply", "what": "arm", "ok": False, "text": "Arming denied: low battery"}


def test_stopping_the_motors_without_confirmation_is_refused():
    with connected() as (socket, fleet):
        socket.send_json(order("stop_motors"))
        assert not answer_to(socket, "stop_motors")["ok"]
        assert fleet.orders == []
        socket.send_json(order("stop_motors", confirmed=True))
        assert answer_to(socket, "stop_motors")["ok"]
        assert fleet.orders == ["stop_motors"]


def test_a_closed_websocket_has_the_drone_hold():
    with connected() as (socket, fleet):
        socket.send_json(order("take"))
        answer_to(socket, "take")
        socket.close()
        socket.portal.call(asyncio.wait_for, fleet.held.wait(), 5.0)
    assert fleet.sent[-1] == (1, NEUTRAL)


def test_a_bad_message_closes_the_websocket_with_the_reason_and_has_the_drone_hold():
    with connected() as (socket, fleet):
        socket.send_json(order("take"))
        answer_to(socket, "take")
        socket.send_json(CENTRED | {"yaw": 7})
        closed = closing_of(socket)
        socket.portal.call(asyncio.wait_for, fleet.held.wait(), 5.0)
    assert closed.code == 4400 and closed.reason == "yaw: 7; it must be a number from -1 to 1"


@pytest.mark.parametrize("data", [b"\xff\x00", b"{}", b"[" * 999])
def test_bytes_that_are_no_message_close_it_as_well(data):
    with connected() as (socket, _fleet):
        socket.send_bytes(data)
        assert closing_of(socket).code == 4400


def test_a_long_reason_is_cut_to_what_a_websocket_allows():
    with connected() as (socket, _fleet):
        socket.send_text(json.dumps({"kind": "é" * 50}))
        closed = closing_of(socket)
    assert closed.code == 4400 and len(closed.reason.encode()) <= 123


def test_a_flood_closes_the_websocket():
    with connected() as (socket, _fleet):
        for _ in range(500):
            socket.send_json(CENTRED)
        closed = closing_of(socket)
    assert closed.code == 4429 and closed.reason == "too many messages a second"


def test_a_fault_within_is_answered_and_not_told_in_detail(caplog):
    with connected() as (socket, fleet):
        fleet.do = None
        socket.send_json(order("arm"))
        reply = answer_to(socket, "arm")
    assert not reply["ok"] and "its log says more" in reply["text"]
    assert "order arm to drone 1" in caplog.text
