"""A MAVSDK program tested in pytest: each test has a fresh drone, by the fixture `framerunner_sim`."""

import asyncio

import pytest
from mavsdk.asyncio import ComponentType, Configuration, Mavsdk
from mavsdk.asyncio.plugins.action import ActionAsync


async def take_off(url: str) -> None:
    """The program to test."""
    async with Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION)) as mavsdk:
        await mavsdk.add_any_connection(url)
        action = ActionAsync(await mavsdk.first_autopilot(10.0))
        await action.set_takeoff_altitude(2.0)
        await action.arm()
        await action.takeoff()
        await asyncio.sleep(2.0)


@pytest.mark.framerunner("open-field", speed=4)
def test_the_drone_takes_off(framerunner_sim) -> None:
    ground_m = framerunner_sim.truth().position_arena_m[2]
    asyncio.run(take_off(framerunner_sim.drone_url))
    assert framerunner_sim.truth().position_arena_m[2] > ground_m + 1.0
