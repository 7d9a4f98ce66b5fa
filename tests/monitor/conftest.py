"""A browser for the tests of pages."""

import pytest

from tests.chromium import chromium as open_chromium


@pytest.fixture
async def chromium():
    """A headless Chromium of its own, a playwright `Browser`."""
    async with open_chromium() as browser:
        yield browser


@pytest.fixture
async def solid_chromium():
    """The same with WebGL."""
    async with open_chromium(solid=True) as browser:
        yield browser
