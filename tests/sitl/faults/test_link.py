"""A faulty link: lost and late packets, also on the real link to an app."""

import asyncio
import socket

import pytest

from firmware_py.autopilot import Autopilot
from firmware_py.mavlink.node import MavlinkNode
from firmware_py.mavlink.telemetry.profiles import GROUND, ONBOARD
from framerunner.vehicle.airframe import load_airframe
from framerunner.vehicle.geodesy import GeodeticPoint
from scenarios.faults.declaration import parse_fault
from sitl.faults.link import LinkFault
from sitl.link_hub import LinkHub
from sitl.links import UdpAddresses

PACKETS = 2000


def sent(text):
    """Which of many numbered packets arrive, and with what delay, when one is sent at each tick."""
    way = LinkFault(parse_fault(text), seed=3).up
    arrived = []
    for number in range(PACKETS):
        now_us = number * 4000
        way.send(now_us, number)
        arrived += [(each, number - each) for each in way.all(now_us)]
    return arrived


def test_nothing_passes_a_link_that_is_off():
    assert sent("link off at 0 s") == []


def test_a_lossy_link_loses_the_declared_share_at_once_or_never():
    arrived = sent("link lossy 0.3 at 0 s")
    assert len(arrived) / PACKETS == pytest.approx(0.7, abs=0.04)
    assert {late for _, late in arrived} == {0}
    assert arrived == sent("link lossy 0.3 at 0 s")


def test_a_late_link_keeps_all_in_order():
    arrived = sent("link delayed 0.1 s at 0 s")
    assert [number for number, _ in arrived] == list(range(PACKETS - 25))
    assert {late for _, late in arrived} == {25}


async def test_only_the_link_to_the_app_fails():
    receivers = [socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(2)]
    for each in receivers:
        each.bind(("127.0.0.1", 0))
        each.setblocking(False)
    faults = []
    autopilot = Autopilot(load_airframe("abejorro"), GeodeticPoint(47.0, 8.0, 400.0))
    hub = LinkHub(MavlinkNode(autopilot, ()), fault=lambda: faults[0] if faults else None)
    for profile, receiver in zip((ONBOARD, GROUND), receivers, strict=True):
        await hub.open_udp(profile, UdpAddresses(("127.0.0.1", 0), receiver.getsockname()))
    time_us = 0

    async def heard(seconds):
        """Datagrams on both links in so many seconds of vehicle time."""
        nonlocal time_us
        for _ in range(round(seconds * 50)):
            time_us += 20_000
            hub.update(time_us)
        await asyncio.sleep(0.05)
        counts = []
        for receiver in receivers:
            count = 0
            while True:
                try:
                    receiver.recv(65_536)
                except BlockingIOError:
                    break
                count += 1
            counts.append(count)
        return counts

    assert min(await heard(1.0)) > 0
    faults.append(LinkFault(parse_fault("link off at 0 s"), seed=0))
    onboard, ground = await heard(1.0)
    assert onboard == 0
    assert ground > 0
    faults[0] = LinkFault(parse_fault("link delayed 0.5 s at 0 s"), seed=0)
    assert (await heard(0.4))[0] == 0
    assert (await heard(0.6))[0] > 0
    faults.clear()
    assert min(await heard(1.0)) > 0
    hub.close()
    for receiver in receivers:
        receiver.close()
