"""Simulated time that waits for grants, and images for who grants it, over real sockets."""

import asyncio
import socket
from contextlib import asynccontextmanager, suppress

import numpy as np
from pymavlink.dialects.v20 import common as mavlink

from framerunner.flying.lockstep_drone import LockstepDrone
from scenarios.loader import load_scenario
from sitl.camera import CameraFeed
from sitl.pacing.time_grants import FREE_US, Grant, Held, TimeGrants, parse_answer
from sitl.server import SimulatorServer
from sitl.server_settings import ServerSettings
from sitl.simulation import Simulation
from tests.processes import free_instance, wait_until

SPEED = 20.0
START = (0.0, 0.0, 0.0, 0.0)
LIMIT_S = 20.0


class Caller:
    """The program that grants time."""

    def __init__(self, simulation, reader, writer, port):
        self.simulation = simulation
        self.reader = reader
        self.writer = writer
        self.port = port
        self.images = []  # time of exposure and pixels of each

    def grant(self, until_us, setpoint=None):
        self.writer.write(Grant(until_us, setpoint).line())

    async def held(self):
        async with asyncio.timeout(LIMIT_S):
            while not isinstance(answer := parse_answer(await self.reader.readline()), Held):
                image = answer.image(await self.reader.readexactly(answer.size_bytes))
                self.images.append((answer.time_us, image))
        return answer

    async def stands(self, wall_s=0.3):
        """Whether simulated time stands still."""
        before_us = self.simulation.time_us
        await asyncio.sleep(wall_s)
        return self.simulation.time_us == before_us

    async def runs(self):
        """Whether simulated time advances by itself."""
        later_us = self.simulation.time_us + 200_000
        return await asyncio.to_thread(wait_until, lambda: self.simulation.time_us > later_us, LIMIT_S)


@asynccontextmanager
async def serving():
    """A simulator that waits for grants, and who grants them."""
    here, there = socket.socketpair()
    instance = free_instance()
    simulation = Simulation(load_scenario("test-case-1"))
    settings = ServerSettings(instance=instance, speed=SPEED, ground_remote=f"127.0.0.1:{14550 + instance}")
    task = asyncio.create_task(SimulatorServer(simulation, settings, grants=TimeGrants(there)).run())
    reader, writer = await asyncio.open_connection(sock=here)
    try:
        assert await asyncio.wait_for(reader.readline(), LIMIT_S) == b"up\n"
        yield Caller(simulation, reader, writer, 14580 + instance)
    finally:
        writer.close()
        task.cancel()
        with suppress(asyncio.CancelledError):
            await task


async def test_time_stands_where_a_lockstep_flight_begins_and_then_where_grants_say():
    lockstep = Simulation(load_scenario("test-case-1"))
    await LockstepDrone(lockstep, START).ready()
    async with serving() as caller:
        assert await asyncio.to_thread(wait_until, lambda: caller.simulation.autopilot.status.ready, LIMIT_S)
        assert await caller.stands()
        caller.grant(0)
        began = await caller.held()
        assert began.time_us + 4000 == lockstep.time_us
        for until_us in (began.time_us + 50_000, began.time_us + 51_000, began.time_us + 300_000):
            caller.grant(until_us)
            held = await caller.held()
            assert until_us - 4000 < held.time_us <= until_us
            # Out 50 ms after an exposure, by the true state at the end of the control tick.
            assert held.image_us == (held.time_us + 4000 - 86_000) // 100_000 * 100_000 + 36_000
            assert not held.setpoint_missed
            assert await caller.stands(0.05)
        caller.grant(FREE_US)
        assert await caller.runs()


async def test_the_images_are_those_of_lockstep_from_the_first_one_on():
    scenario = load_scenario("test-case-1")
    simulation, feed, seen = Simulation(scenario), CameraFeed(scenario), []
    async with serving() as caller:
        caller.grant(1_500_000)
        held = await caller.held()
        while simulation.time_us <= held.time_us:
            simulation.tick()
            if (arrived := feed.step(simulation.truth)) is not None:
                seen.append(arrived)
    assert [time_us for time_us, _ in caller.images] == [time_us for time_us, _ in seen]
    assert len(seen) == 15
    for (_, sent), (_, wanted) in zip(caller.images, seen, strict=True):
        np.testing.assert_array_equal(sent, wanted)


async def test_who_listens_only_when_time_stands_hears_all_streams():
    wanted = {"HEARTBEAT", "ATTITUDE", "LOCAL_POSITION_NED", "SYS_STATUS", "EXTENDED_SYS_STATE"}
    heard = {}
    async with serving() as caller:
        assert await asyncio.to_thread(wait_until, lambda: caller.simulation.autopilot.status.ready, LIMIT_S)
        assert await caller.stands()
        now_us = caller.simulation.time_us - 4000
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as app:
            app.bind(("127.0.0.1", caller.port - 40))
            app.setblocking(False)
            parser = mavlink.MAVLink(None)
            async with asyncio.timeout(LIMIT_S):
                while wanted - heard.keys():
                    data = await asyncio.get_running_loop().sock_recv(app, 2048)
                    heard |= {each.get_type(): each for each in parser.parse_buffer(data) or ()}
    assert heard["ATTITUDE"].time_boot_ms * 1000 == now_us
    assert heard["LOCAL_POSITION_NED"].time_boot_ms * 1000 == (now_us - 16_000) // 20_000 * 20_000 + 16_000


async def test_time_waits_for_the_setpoint_that_was_sent():
    async with serving() as caller:
        caller.grant(0)
        began = await caller.held()
        caller.grant(began.time_us + 100_000, (0.5, 0.0, -0.25, 0.125))
        assert await caller.stands()
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            packer = mavlink.MAVLink(None, srcSystem=245)
            for velocity in ((0.5, 0.0, 0.0, 0.125), (0.5, 0.0, -0.25, 0.125)):
                assert await caller.stands(0.1)
                packet = packer.set_position_target_local_ned_encode(
                    *(0, caller.simulation.autopilot.parameters.integer("MAV_SYS_ID"), 1, 8, 0b010111000111),
                    *(0, 0, 0, *velocity[:3], 0, 0, 0, 0, velocity[3]),
                ).pack(packer)
                sender.sendto(packet, ("127.0.0.1", caller.port))
        assert (await caller.held()).time_us > began.time_us + 90_000
        caller.grant(began.time_us + 200_000)
        assert not (await caller.held()).setpoint_missed


async def test_a_setpoint_that_is_never_received_is_reported_and_ends_nothing(monkeypatch):
    monkeypatch.setattr("sitl.pacing.time_grants._POLLS", 100)
    async with serving() as caller:
        caller.grant(0)
        began = await caller.held()
        caller.grant(began.time_us + 100_000, (1.0, 0.0, 0.0, 0.0))
        assert (await caller.held()).setpoint_missed


async def test_time_is_free_after_the_channel_has_closed():
    async with serving() as caller:
        caller.grant(0)
        await caller.held()
        caller.writer.close()
        assert await caller.runs()
