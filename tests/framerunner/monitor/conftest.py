"""A browser for the tests of pages: started once by each worker, with separate windows for each test."""

import pytest_asyncio

from tests.chromium import chromium as open_chromium


@pytest_asyncio.fixture(scope="session", loop_scope="session")
async def flat_browser():
    async with open_chromium() as browser:
        yield browser


@pytest_asyncio.fixture(scope="session", loop_scope="session")
async def solid_browser():
    async with open_chromium(solid=True) as browser:
        yield browser


@pytest_asyncio.fixture(loop_scope="session")
async def chromium(flat_browser):
    """A headless Chromium, a playwright `Browser`; a test that uses it runs in the session's event loop."""
    yield flat_browser
    await close_windows(flat_browser)


@pytest_asyncio.fixture(loop_scope="session")
async def solid_chromium(solid_browser):
    """The same with WebGL."""
    yield solid_browser
    await close_windows(solid_browser)


async def close_windows(browser):
    for context in list(browser.contexts):
        await context.close()
