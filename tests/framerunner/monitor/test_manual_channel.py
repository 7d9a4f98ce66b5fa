"""The WebSocket of the sticks: who is accepted, what is sent, and what closes it."""

import asyncio
import json
import math
from concurrent.futures import CancelledError
from contextlib import contextmanager, suppress
from types import SimpleNamespace

import pytest
from fastapi import FastAPI
from starlette.testclient import TestClient
from starlette.websockets import WebSocketDisconnect

from framerunner.monitor import manual_channel
from framerunner.monitor.access import Role, Visitor
from framerunner.monitor.channel import Allowance, PageMessageError
from framerunner.monitor.manual_channel import FROM_PAGE, SticksMessage
from framerunner.monitor.manual_control import NEUTRAL, Order
from framerunner.monitor.vehicle.commands import Sticks
from tests.framerunner.monitor.manual_fakes import FakeFleet

CENTRED = {"kind": "sticks", "forward": 0, "right": 0, "up": 0, "yaw": 0}
PILOT = Visitor("Ana", Role.JUDGE)


@contextmanager
def connected(visitor=PILOT):
    """A browser's WebSocket and the drones."""
    fleet, web = FakeFleet(), FastAPI()
    access = SimpleNamespace(visitor=lambda _connection: visitor)
    manual_channel.register(SimpleNamespace(fleet=fleet, access=access, web=web, jobs=[]))
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


def test_a_visitor_who_may_not_fly_is_refused_with_a_reason():
    with connected(Visitor()) as (socket, fleet):
        closed = closing_of(socket)
    assert closed.code == 4403 and "log" in closed.reason
    assert fleet.orders == [] and fleet.sent == []


def test_an_order_is_answered_and_all_are_told_who_has_control():
    with connected() as (socket, fleet):
        socket.send_json(order("take"))
        told = socket.receive_json()
        assert told == {"kind": "control", "id": 1, "holder": "Ana", "yours": True, "flying": False}
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


def test_a_refusal_has_the_vehicle_s_reason():
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


def test_the_drone_holds_when_the_websocket_is_closed():
    with connected() as (socket, fleet):
        socket.send_json(order("take"))
        answer_to(socket, "take")
        socket.close()
        socket.portal.call(asyncio.wait_for, fleet.held.wait(), 5.0)
    assert fleet.sent[-1] == (1, NEUTRAL)


def test_a_bad_message_closes_the_websocket_with_the_reason_and_the_drone_holds():
    with connected() as (socket, fleet):
        socket.send_json(order("take"))
        answer_to(socket, "take")
        socket.send_json(CENTRED | {"yaw": 7})
        closed = closing_of(socket)
        socket.portal.call(asyncio.wait_for, fleet.held.wait(), 5.0)
    assert closed.code == 4400 and closed.reason == "sticks.yaw: 7: Input should be less than or equal to 1"


@pytest.mark.parametrize("data", [b"\xff\x00", b"{}", b"[" * 999])
def test_invalid_bytes_close_the_websocket(data):
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


def test_an_internal_fault_is_answered_without_details(caplog):
    with connected() as (socket, fleet):
        fleet.do = None
        socket.send_json(order("arm"))
        reply = answer_to(socket, "arm")
    assert not reply["ok"] and "its log says more" in reply["text"]
    assert "order arm to drone 1" in caplog.text


def test_sticks_and_orders_are_read():
    text = json.dumps(CENTRED | {"forward": 0.5, "yaw": -1})
    sticks = SticksMessage(kind="sticks", forward=0.5, right=0.0, up=0.0, yaw=-1.0)
    assert FROM_PAGE.read(text) == FROM_PAGE.read(text.encode()) == sticks
    assert FROM_PAGE.read('{"kind": "do", "id": 1, "what": "land"}') == Order(id=1, what="land")
    stop = '{"kind": "do", "id": 1, "what": "stop_motors", "confirmed": true}'
    assert FROM_PAGE.read(stop) == Order(id=1, what="stop_motors", confirmed=True)


@pytest.mark.parametrize("value", [1.01, -2, math.nan, math.inf, 10**400, "0.5", None, True, [], {}])
def test_a_deflection_is_a_number_from_minus_one_to_one(value):
    with pytest.raises(PageMessageError, match=r"^sticks\.right: .*Input should be"):
        FROM_PAGE.read(json.dumps(CENTRED | {"right": value}))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "Invalid JSON"),
        ("[" * 900, "Invalid JSON"),
        (b"\xff\xfe", "Invalid JSON"),
        ("[]", "[]: Input should be"),
        ("{}", "discriminator 'kind'"),
        ('{"kind": {"a": 1}}', "'kind'"),
        ('{"kind": "sticks"}', "sticks.forward: "),
        ('{"kind": "do", "what": "land"}', "do.id: "),
        ('{"kind": "do", "id": true, "what": "land"}', "id: True"),
        ('{"kind": "do", "id": 256, "what": "land"}', "id: 256"),
        ('{"kind": "do", "id": 1.5, "what": "land"}', "id: 1.5"),
        ('{"kind": "do", "id": 1, "what": "explode"}', "what: 'explode'"),
        ('{"kind": "do", "id": 1, "what": ["land"]}', "what: "),
        ('{"kind": "do", "id": 1, "what": "land", "confirmed": 1}', "confirmed: 1"),
        ('{"kind": "do", "id": 1, "what": "' + "x" * 1000 + '"}', "at most 1000"),
        ('{"kind": "' + "é" * 500 + '"}', "at most 1000"),
    ],
)
def test_an_invalid_message_is_refused_in_one_short_line(text, words):
    with pytest.raises(PageMessageError) as caught:
        FROM_PAGE.read(text)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value) and len(str(caught.value)) < 250


def test_sixty_messages_a_second_and_a_burst_are_allowed():
    now_s = 0.0
    allowance = Allowance(lambda: now_s)
    assert [allowance.spend() for _ in range(241)] == [True] * 240 + [False]
    now_s += 0.5
    assert [allowance.spend() for _ in range(31)] == [True] * 30 + [False]
    now_s += 1000.0
    assert [allowance.spend() for _ in range(241)] == [True] * 240 + [False]
