"""Decoys, poles and walls in the arena of the live page: from above on a plain canvas, and in 3-D."""

import cv2
import numpy as np
import pytest
from playwright.async_api import expect

from scenarios.loader import load_scenario
from tests.chromium import until
from tests.framerunner.monitor.test_live_page import WITHOUT_WEBGL, chart, fake, status, visit, world

__all__ = ["fake"]
pytestmark = pytest.mark.asyncio(loop_scope="session")
CROWDED = load_scenario("crowded-17").model_dump(mode="json")


async def test_obstacles_are_drawn_from_above(chromium, fake):
    fake.welcome = [world(scenario=CROWDED), chart(), {"kind": "status", "drones": [status()]}]
    page, complaints = await visit(chromium, fake, script=WITHOUT_WEBGL)
    await page.wait_for_selector(".m-topview")
    await expect(page.locator(".t-solid")).not_to_have_count(0)
    for colour in ("cyan", "magenta"):
        await expect(page.locator(f'.t-frame[data-colour="{colour}"]')).not_to_have_count(0)
    assert complaints == []


async def test_obstacles_are_drawn_in_three_dimensions(solid_chromium, fake):
    fake.welcome[0] = world(scenario=CROWDED)
    page, complaints = await visit(solid_chromium, fake)
    arena = page.locator(".m-arena")
    await until(page, "document.querySelector('.m-arena').dataset.frames > 0")

    async def violet_pixels():
        picture = cv2.imdecode(np.frombuffer(await arena.screenshot(), np.uint8), cv2.IMREAD_COLOR)
        blue, green, red = np.moveaxis(picture.astype(int), 2, 0)
        return int(np.sum((blue - green > 30) & (red - green > 5)))

    for _ in range(100):  # pictures that are drawn when the machine has time
        if await violet_pixels() >= 500:
            break
    assert await violet_pixels() >= 500
    assert complaints == []
