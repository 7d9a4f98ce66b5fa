"""Decoys, poles and walls in the arena of the live page: from above on a plain canvas, and in 3-D."""

import cv2
import numpy as np
import pytest

from scenarios.loader import load_scenario
from tests.chromium import until
from tests.framerunner.monitor.test_live_page import WITHOUT_WEBGL, chart, fake, status, visit, world

__all__ = ["fake"]
pytestmark = pytest.mark.asyncio(loop_scope="session")
CROWDED = load_scenario("crowded-17").model_dump(mode="json")
COUNT_PIXELS = """(colour) => {
  const canvas = document.querySelector(".m-topview");
  const pixels = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
  let count = 0;
  for (let index = 0; index < pixels.length; index += 4)
    if (colour.every((value, channel) => Math.abs(pixels[index + channel] - value) < 12)) count += 1;
  return count;
}"""


async def test_obstacles_are_drawn_from_above(chromium, fake):
    fake.welcome = [world(scenario=CROWDED), chart(), {"kind": "status", "drones": [status()]}]
    page, complaints = await visit(chromium, fake, script=WITHOUT_WEBGL)
    await page.wait_for_selector(".m-topview")
    for colour, least in (([120, 70, 180], 100), ([0, 255, 255], 10), ([255, 0, 255], 10)):
        await until(page, f"(colour) => ({COUNT_PIXELS})(colour) >= {least}", arg=colour)
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
