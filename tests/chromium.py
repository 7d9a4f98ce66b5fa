"""A real browser, without a screen."""

from __future__ import annotations

import asyncio
import os
import shutil
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import pytest
from playwright.async_api import Browser, Error, Page, async_playwright

POLITE = Path(__file__).with_name("polite_browser.sh")
# The first one, the same engine without a browser's windows, takes a third of the processor time for a page.
NAMES = ("chromium-headless-shell", "chromium", "chromium-browser", "google-chrome")
# The first line for containers and machines without a graphics card; the others keep it from calling home.
FLAGS = (
    *("--no-sandbox", "--mute-audio"),
    *("--disable-quic", "--no-first-run", "--disable-background-networking"),
    *("--disable-component-update", "--disable-sync", "--disable-default-apps"),
)

SOLID = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader")
FLAT = ("--disable-gpu",)


def find_chromium() -> str:
    """The browser's path: $FRAMERUNNER_CHROMIUM or what is installed; without one the test is skipped."""
    named = os.environ.get("FRAMERUNNER_CHROMIUM")
    found = named or next(filter(None, map(shutil.which, NAMES)), None)
    if not found and not os.environ.get("CI"):
        pytest.skip("no Chromium: install Debian's package chromium, or name it in FRAMERUNNER_CHROMIUM")
    assert found, "no Chromium was installed"
    return found


@asynccontextmanager
async def chromium(*, solid: bool = False) -> AsyncIterator[Browser]:
    """A browser of its own.

    Args:
        solid: it draws WebGL, by the processor, which takes a third more of it; else it has none.
    """
    flags = [*FLAGS, *(SOLID if solid else FLAT)]
    async with async_playwright() as playwright:
        browser = await playwright.chromium.launch(
            executable_path=POLITE, args=flags, env={**os.environ, "POLITE_BROWSER": find_chromium()}
        )
        try:
            yield browser
        finally:
            await browser.close()


async def until(page: Page, expression: str, *, arg: object = None, timeout_s: float = 30.0) -> None:
    """Wait until an expression or function is true in a page.

    Playwright's `wait_for_function` evaluates a text in the page each time, which our pages' policy forbids.
    """
    async with asyncio.timeout(timeout_s):
        while True:
            try:
                if await page.evaluate(expression, arg):
                    return
            except Error as error:
                if "context was destroyed" not in str(error):  # the page is loaded again
                    raise
            await asyncio.sleep(0.03)


class Complaints(list):
    """What a page complained of: errors in its console, exceptions, requests to other hosts.

    Args:
        page: is listened to from now on.
    """

    def __init__(self, page: Page) -> None:
        super().__init__()
        page.on("console", lambda message: self._console(message.type, message.text))
        page.on("pageerror", lambda error: self.append(f"exception: {error}"))
        page.on("request", lambda request: self._request(request.url))

    def _console(self, kind: str, text: str) -> None:
        if kind == "error":
            self.append(f"console: {text}")

    def _request(self, url: str) -> None:
        if not url.startswith(("http://127.0.0.1:", "ws://127.0.0.1:", "data:", "blob:", "about:")):
            self.append(f"request to {url}")
