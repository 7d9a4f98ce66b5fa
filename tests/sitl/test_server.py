"""The simulator in paced time, in this process, over real sockets."""

import asyncio
import socket
import time
from contextlib import asynccontextmanager, suppress
from dataclasses import replace

import aiohttp
import pytest

from framerunner.wire.signing import SigningKey
from framerunner.wire.transports.urls import LinkError
from scenarios.loader import load_scenario
from scenarios.task import Task
from sitl.fleet import side_by_side
from sitl.pacing.pacer import LagNotices
from sitl.server import SimulatorServer
from sitl.server_settings import ServerSettings, parse_link
from sitl.simulation import Simulation
from sitl.video import VideoError, standing_place
from sitl.world import CONTROL_PERIOD_US
from tests.processes import bound, free_instance
from tests.waiting import until

GREETING = "Ctrl-C stops"


class SlowSimulation(Simulation):
    """Each tick takes at least two and a half times as long as it should; records the time of each."""

    def __init__(self, scenario):
        super().__init__(scenario)
        self.ticks_us = [self.time_us]

    def tick(self):
        super().tick()
        self.ticks_us.append(self.time_us)
        time.sleep(0.010)


@asynccontextmanager
async def serving(simulation, *, count=1, **options):
    """A server with all its ports open: its notices, and its settings."""
    lines = []
    instance = free_instance(count)
    options = {"ground_remote": f"127.0.0.1:{14550 + instance}", **options}
    settings = ServerSettings(instance=instance, **options)
    task = asyncio.create_task(SimulatorServer(simulation, settings, lines.append).run())
    try:
        for _ in range(1000):
            await asyncio.sleep(0.01)
            if lines or task.done():
                break
        if task.done():
            await task
        assert any(GREETING in line for line in lines)  # it may be ready for take-off already
        yield lines, settings
    finally:
        task.cancel()
        with suppress(asyncio.CancelledError):
            await task


async def referee(settings, query=""):
    return await document(settings, f"referee.json{query}")


async def document(settings, path):
    url = f"http://127.0.0.1:{settings.http_port}/{path}"
    async with aiohttp.ClientSession() as session, session.get(url) as response:
        assert response.status == 200
        return await response.json()


async def test_the_referee_tells_how_the_try_stands():
    simulation = Simulation(load_scenario("test-case-1"))
    async with serving(simulation) as (_, settings):
        answer = await referee(settings)
        assert answer["scenario"] == "test-case-1"
        assert answer["time_us"] == pytest.approx(simulation.time_us, abs=1_000_000)
        assert answer["snapshot"]["next_colour"] == "red"
        assert answer["snapshot"]["motors_on"] is False
        assert answer["report"]["verdict"]

        answer = await referee(settings, "?state=red.turning&ended=pulled%20out")
        assert answer["report"]["verdict"] == "aborted"
        assert "pulled out" in answer["report"]["reason"]
        assert "red.turning" in answer["report"]["reason"]


async def test_the_layout_is_told_only_if_that_was_asked_for():
    scenario = load_scenario("test-case-1")
    async with serving(Simulation(scenario), show_layout=True) as (_, settings):
        assert Task.model_validate(await document(settings, "scenario.json")).scenario == scenario


async def test_who_looks_on_learns_the_task_and_where_the_local_frame_is():
    scenario = load_scenario("test-case-1")
    simulation = Simulation(scenario)
    async with serving(simulation) as (_, settings):
        assert Task.model_validate(await document(settings, "scenario.json")) == Task.of(scenario)
        for _ in range(500):
            if (answer := await referee(settings))["local_frame"] is not None:
                break
            await asyncio.sleep(0.01)
    north_m, east_m, down_m = simulation.autopilot.state.position_ned_m
    x_m, y_m, z_m = answer["local_frame"]["origin_arena_m"]
    assert (answer["source"], answer["lift_m"], answer["local_frame"]["yaw_rad"]) == ("truth", 0.0, 0.0)
    assert (x_m + north_m, y_m - east_m, z_m - down_m) == pytest.approx(
        simulation.truth.position_arena_m, abs=1e-6
    )


async def test_who_looks_on_learns_where_the_drone_stands_while_it_stands_upright():
    simulation = Simulation(load_scenario("test-case-1"))
    async with serving(simulation) as (_, settings):
        answer = await referee(settings)
        place, true = answer["stands_at"], simulation.truth
        assert answer["position_arena_m"] == pytest.approx(true.position_arena_m, abs=0.01)
        assert place["position_arena_m"] == pytest.approx(true.position_arena_m, abs=0.01)
        assert place["yaw_rad"] == pytest.approx(simulation.scenario.start.yaw_rad, abs=0.01)
    upside_down = replace(true, attitude_arena=(0.0, 1.0, 0.0, 0.0))
    assert standing_place(upside_down) is standing_place(replace(true, motors_on=True)) is None


async def test_before_its_origin_is_fixed_the_local_frame_is_nowhere():
    simulation = Simulation(load_scenario("test-case-1"))
    simulation.tick = lambda: None  # the estimator never takes a measurement
    async with serving(simulation) as (_, settings):
        assert (await referee(settings))["local_frame"] is None


async def test_telemetry_goes_out_on_both_links_before_anybody_spoke():
    instance = free_instance()
    with bound(14540 + instance) as app, bound(14550 + instance) as station:
        settings = ServerSettings(instance=instance, ground_remote=f"127.0.0.1:{14550 + instance}")
        task = asyncio.create_task(SimulatorServer(Simulation(load_scenario("empty")), settings).run())
        for link in (app, station):
            link.settimeout(5.0)
            packet, sender = await asyncio.to_thread(link.recvfrom, 300)
            assert packet[0] == 0xFD
            assert sender[1] in (14580 + instance, 18570 + instance)
        task.cancel()
        with suppress(asyncio.CancelledError):
            await task
    await asyncio.sleep(0.05)
    with bound(14580 + instance), bound(18570 + instance):
        pass  # free again


async def test_it_is_said_once_that_the_drone_can_be_armed():
    simulation = Simulation(load_scenario("empty"))
    async with serving(simulation, speed=50.0) as (lines, _):
        start_us = simulation.time_us
        await until(lambda: simulation.time_us > start_us + 5_000_000)
        assert lines.count("Ready for takeoff!") == 1
        assert simulation.autopilot.status.ready


async def test_a_machine_that_is_too_slow_slows_time_and_skips_nothing(monkeypatch):
    monkeypatch.setattr("sitl.pacing.pacer._NOTICE_PERIOD_S", 1.0)
    simulation = SlowSimulation(load_scenario("empty"))
    async with serving(simulation) as (lines, _):
        began_s, began_us = time.monotonic(), simulation.time_us
        for _ in range(200):
            await asyncio.sleep(0.1)
            if len(lines) >= 3:
                break
        factor = (simulation.time_us - began_us) / 1e6 / (time.monotonic() - began_s)
    assert len(lines) >= 3
    assert "cannot keep up" in lines[2] and "nothing was skipped" in lines[2]
    assert factor < 0.45  # a tick of 4 ms takes more than 10 ms
    assert float(lines[2].partition("ran at ")[2].split()[0]) == pytest.approx(factor, abs=0.15)
    steps = {b - a for a, b in zip(simulation.ticks_us, simulation.ticks_us[1:], strict=False)}
    assert steps == {CONTROL_PERIOD_US}


@pytest.mark.parametrize("speed", [0.5, 2.0])
async def test_time_runs_at_the_wanted_speed(speed):
    simulation = Simulation(load_scenario("empty"))
    async with serving(simulation, speed=speed) as (lines, _):
        await asyncio.sleep(0.3)
        factors = []
        while len(factors) < 10 and max(factors, default=0.0) < speed * 0.7:  # a busy machine has quiet ones
            began_s, began_us = time.monotonic(), simulation.time_us
            await asyncio.sleep(1.0)
            factors.append((simulation.time_us - began_us) / 1e6 / (time.monotonic() - began_s))
    assert max(factors) < speed * 1.15
    if len(lines) == 1:  # else the machine was too busy, and the server said so
        assert max(factors) > speed * 0.7


@pytest.mark.parametrize("base", [14580, 18570])
async def test_a_busy_udp_port_is_said_and_nothing_stays_open(base):
    instance = free_instance()
    server = SimulatorServer(Simulation(load_scenario("empty")), ServerSettings(instance=instance))
    with bound(base + instance), pytest.raises(LinkError, match=str(base + instance)):
        await server.run()
    await asyncio.sleep(0.05)  # asyncio closes sockets in its next turn
    with bound(14580 + instance), bound(18570 + instance):
        pass


async def test_a_busy_video_port_ends_it_and_frees_the_links():
    instance = free_instance()
    server = SimulatorServer(Simulation(load_scenario("empty")), ServerSettings(instance=instance))
    with bound(8100 + instance, socket.SOCK_STREAM), pytest.raises(VideoError, match=str(8100 + instance)):
        await asyncio.wait_for(server.run(), 20.0)
    await asyncio.sleep(0.05)
    with bound(14580 + instance), bound(18570 + instance):
        pass


async def test_three_drones_in_one_process_have_their_own_links_and_video():
    scenarios = side_by_side(load_scenario("empty"), 3, 0.3)
    async with serving([Simulation(one) for one in scenarios], count=3) as (lines, settings):
        for _ in range(500):
            await asyncio.sleep(0.01)
            if len(lines) >= 3:
                break
        times_us = []
        for number in range(3):
            answer = await referee(settings.shifted(number))
            times_us.append(answer["time_us"])
            assert str(14540 + settings.instance + number) in lines[number]
    assert min(times_us) > 0
    assert max(times_us) - min(times_us) < 5_000_000


async def test_the_description_of_the_rtp_stream_is_served():
    with bound(0) as listener:
        port = listener.getsockname()[1]
        rtp = {"video_rtp": ("127.0.0.1", port)}
        async with serving(Simulation(load_scenario("empty")), **rtp) as (lines, settings):
            assert f"RTP to UDP {port}" in lines[0]
            url = f"http://127.0.0.1:{settings.http_port}/video.sdp"
            async with aiohttp.ClientSession() as session, session.get(url) as response:
                assert response.content_type == "application/sdp"
                assert f"m=video {port} RTP/AVP 96" in await response.text()
            listener.settimeout(5.0)
            packet = await asyncio.to_thread(listener.recv, 2000)
            assert packet[1] & 127 == 96


async def test_an_open_drone_without_a_key_says_so():
    async with serving(Simulation(load_scenario("empty")), ground_remote="192.0.2.1") as (lines, _):
        assert lines[0] == "other machines can command the drone: MAVLink is unsigned; see --signing-key"


def test_ports_beyond_the_last_are_refused():
    settings = ServerSettings(links=(parse_link("tcpin://127.0.0.1:65534"),))
    settings.check(2)
    with pytest.raises(LinkError, match="65536 of drone 3"):
        settings.check(3)


@pytest.mark.parametrize("bind", ["::1", "::", "fe80::1"])
def test_an_address_from_which_no_mavlink_could_be_sent_is_refused(bind):
    with pytest.raises(
        LinkError, match=f"^--bind {bind}: is no IPv4 address, by which MAVLink is sent; give"
    ):
        ServerSettings(bind=bind).check(1)


def test_who_listens_on_loopback_only_is_not_open():
    assert not ServerSettings().is_open
    assert ServerSettings(bind="0.0.0.0").is_open
    assert ServerSettings(links=(parse_link("tcpin://0.0.0.0:5760"),)).is_open
    assert ServerSettings(ground_remote="192.0.2.1").ground.bind[0] == "0.0.0.0"
    assert not ServerSettings(bind="0.0.0.0", signing_key=SigningKey.from_text("a")).is_open


def test_instances_shift_every_port():
    settings = ServerSettings(instance=3)
    assert (settings.onboard.bind[1], settings.onboard.remote[1]) == (14583, 14543)
    assert (settings.ground.bind[1], settings.ground.remote[1]) == (18573, 14550)  # the same for all
    assert settings.http_port == 8103
    assert ServerSettings(instance=3, video_port=9000).http_port == 9000


def test_notices_come_once_a_period_and_only_with_cause():
    lines = []
    lag_notices = LagNotices(lines.append, 2.0)
    start_s = lag_notices._since_s
    lag_notices.lag(0.0, start_s + 6.0)
    assert lines == []
    lag_notices.lag(1.0, start_s + 8.0)
    assert lines == []  # the period is not over
    lag_notices.lag(0.5, start_s + 12.0)
    assert len(lines) == 1
    assert "ran at 1.50 of real time (wanted 2) for the last 6 s" in lines[0]
    lag_notices.lag(0.0, start_s + 30.0)
    assert len(lines) == 1
