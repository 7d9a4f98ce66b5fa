"""What a pilot's browser may say."""

import json
import math

import pytest

from monitor.pilot_messages import Allowance, Order, PilotMessageError, read_message
from monitor.sticks import Sticks

CENTRED = {"kind": "sticks", "forward": 0, "right": 0, "up": 0, "yaw": 0}


def test_sticks_and_orders_are_read():
    text = json.dumps(CENTRED | {"forward": 0.5, "yaw": -1})
    assert read_message(text) == Sticks(0.5, 0.0, 0.0, -1.0)
    assert read_message(text.encode()) == Sticks(0.5, 0.0, 0.0, -1.0)
    assert read_message('{"kind": "do", "id": 1, "what": "land"}') == Order(1, "land")
    stop = '{"kind": "do", "id": 1, "what": "stop_motors", "confirmed": true}'
    assert read_message(stop) == Order(1, "stop_motors", confirmed=True)


@pytest.mark.parametrize("value", [1.01, -2, math.nan, math.inf, 10**400, "0.5", None, True, [], {}])
def test_a_deflection_is_a_number_from_minus_one_to_one(value):
    with pytest.raises(PilotMessageError, match=r"^right: .*; it must be a number from -1 to 1$"):
        read_message(json.dumps(CENTRED | {"right": value}))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "not JSON"),
        ("[" * 900, "not JSON"),
        (b"\xff\xfe", "not JSON"),
        ("[]", "not a JSON object"),
        ("{}", "kind: None"),
        ('{"kind": {"a": 1}}', "kind: "),
        ('{"kind": "sticks"}', "forward: None"),
        ('{"kind": "do", "what": "land"}', "id: None"),
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
def test_what_no_page_of_ours_sends_is_refused_in_one_short_line(text, words):
    with pytest.raises(PilotMessageError) as caught:
        read_message(text)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value) and len(str(caught.value)) < 150


def test_sixty_messages_a_second_are_taken_and_some_that_were_held_back():
    now_s = 0.0
    allowance = Allowance(lambda: now_s)
    assert [allowance.spend() for _ in range(241)] == [True] * 240 + [False]
    now_s += 0.5
    assert [allowance.spend() for _ in range(31)] == [True] * 30 + [False]
    now_s += 1000.0
    assert [allowance.spend() for _ in range(241)] == [True] * 240 + [False]
