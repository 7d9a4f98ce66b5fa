"""Orders, carried out by a real autopilot or refused with its reason."""

import asyncio

import pytest

from firmware_py.status import FlightMode
from framerunner.monitor.vehicle.commands import Sticks, answered
from framerunner.wire.dialect import mavlink
from framerunner.wire.session.session import Session
from scenarios.loader import load_scenario
from tests.framerunner.monitor.simulated_link import SimulatedLink, equipment
from tests.framerunner.monitor.watching import watching

SPEED = 4.0  # heartbeats come four times a second of the clock that orders count by


@pytest.fixture
async def flown():
    """A fleet and a link on which one drone is ready."""
    link = SimulatedLink(load_scenario("empty"), speed=SPEED)
    async with watching(equipment(link)) as watched:
        await watched.until_ready(link)
        yield watched, link


async def in_the_air(watched):
    assert await watched.fleet.do(1, "take_off") == (True, "it takes off")
    await watched.until(lambda: watched.status()["landed"] is False)


async def test_arm_and_disarm_are_confirmed_by_telemetry(flown):
    watched, link = flown
    assert await watched.fleet.do(1, "arm") == (True, "the motors are on")
    assert link.drones[0].simulation.autopilot.status.armed
    assert watched.status()["armed"]
    assert await watched.fleet.do(1, "disarm") == (True, "the motors are off")
    assert not watched.status()["armed"]


async def test_a_flight_by_orders(flown):
    watched, _link = flown
    await in_the_air(watched)
    ok, text = await watched.fleet.do(1, "disarm")
    assert not ok
    assert text == "disarm: refused for now: Disarming denied: not landed"
    assert await watched.fleet.do(1, "take_off") == (False, "it is in the air already")
    assert await watched.fleet.do(1, "hold") == (True, "it holds")
    assert watched.status()["mode"] == "Hold"
    assert await watched.fleet.do(1, "land") == (True, "it lands")
    assert watched.status()["mode"] == "Land"
    await watched.until(lambda: not watched.status()["armed"])
    assert watched.status()["landed"]


async def test_the_sticks_control_the_drone_in_position_mode(flown):
    watched, _link = flown
    await in_the_air(watched)
    watched.fleet.sticks(1, Sticks(0.0, 0.0, 0.0, 0.0))
    await asyncio.sleep(0.1)
    assert await watched.fleet.do(1, "position") == (True, "it follows the sticks")
    watched.fleet.sticks(1, Sticks(0.5, 0.0, 0.0, 0.0))
    await watched.until(lambda: watched.pose()["v"][0] > 0.3)
    assert abs(watched.pose()["v"][1]) < 0.1
    watched.fleet.sticks(1, Sticks(0.0, 0.0, 0.0, 0.5))  # to the right is clockwise, so not to the left
    await watched.until(lambda: watched.pose()["r"] < -0.2)


async def test_offboard_without_an_app_is_refused_with_the_reason(flown):
    watched, _link = flown
    await in_the_air(watched)
    ok, text = await watched.fleet.do(1, "offboard")
    assert not ok
    problem, _, reason = text.removeprefix("offboard: ").partition(": ")
    assert problem == "refused for now"
    assert reason in [message["text"] for message in watched.of_kind("text")]


async def test_stopping_the_motors_in_the_air_is_forced(flown):
    watched, link = flown
    await in_the_air(watched)
    await watched.fleet.do(1, "stop_motors")  # whether it may is the vehicle's choice
    sent = [m for m in link.sent if m.get_type() == "COMMAND_LONG" and m.command == 400]
    assert (sent[-1].param1, sent[-1].param2) == (0.0, 21196.0)


async def test_simultaneous_orders_get_their_own_answers(flown):
    watched, link = flown
    await in_the_air(watched)
    answers = await asyncio.gather(
        watched.fleet.do(1, "hold"), watched.fleet.do(1, "offboard"), watched.fleet.do(1, "disarm")
    )
    assert [ok for ok, _ in answers] == [True, False, False]
    assert answers[1][1].startswith("offboard: ") and answers[2][1].startswith("disarm: ")
    assert link.drones[0].simulation.autopilot.status.mode is FlightMode.HOLD


async def test_a_command_without_an_answer_is_sent_three_times():
    link = SimulatedLink(load_scenario("empty"))
    async with watching(equipment(link)) as watched:
        await watched.until_ready(link)
        link.muted = True
        assert await watched.fleet.do(1, "arm") == (False, "arm: the drone does not answer")
    sent = [m.confirmation for m in link.sent if m.get_type() == "COMMAND_LONG" and m.command == 400]
    assert sent == [0, 1, 2]


async def test_an_unknown_order_is_refused(flown):
    watched, _link = flown
    assert await watched.fleet.do(7, "arm") == (False, "no drone 7 is heard")
    ok, text = await watched.fleet.do(1, "dance")
    assert not ok and "'dance' is no order" in text


def ack(number, result, target=250, component=1):
    message = mavlink.MAVLink_command_ack_message(number, result, 0, 0, target, 190)
    message.get_header().srcSystem, message.get_header().srcComponent = 1, component
    return message


@pytest.fixture
async def ordered():
    """Sends a command, and what was sent; `take` gives the session an answer."""
    session, sent = Session(250, 1), []

    def order(*command, urgent=False):
        return asyncio.create_task(answered(session.command(*command, urgent=urgent), session, sent.append))

    return order, sent, lambda message: session.take(message, asyncio.get_running_loop().time())


async def test_in_progress_extends_the_wait_and_answers_to_others_are_ignored(ordered):
    order, sent, take = ordered
    asked = order(22)
    await asyncio.sleep(0)
    take(ack(22, 0, target=255))  # of another ground station
    take(ack(22, 0, component=100))  # of the camera
    take(ack(400, 0))
    take(ack(22, 5))  # in progress
    await asyncio.sleep(0.8)
    assert not asked.done()
    assert len(sent) == 1
    take(ack(22, 2))
    assert await asked == 2


async def test_an_urgent_command_does_not_wait(ordered):
    order, sent, take = ordered
    arming = order(400, 1.0)
    await asyncio.sleep(0)
    stopping = order(400, 0.0, 21196.0, urgent=True)
    await asyncio.sleep(0)
    assert [(m.param1, m.param2) for m in sent] == [(1.0, 0.0), (0.0, 21196.0)]
    take(ack(400, 0))
    assert await stopping == 0
    assert await arming is None


async def test_an_order_that_is_cancelled_does_not_hinder_the_next(ordered):
    order, sent, take = ordered
    cancelled = order(400, 1.0)
    await asyncio.sleep(0)
    cancelled.cancel()
    await asyncio.sleep(0)
    again = order(400, 1.0)
    await asyncio.sleep(0)
    assert len(sent) == 2
    take(ack(400, 0))
    assert await again == 0
