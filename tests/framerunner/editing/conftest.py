"""What the tests of the editor's pages share."""

import pytest_asyncio

from tests.chromium import chromium


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def browser():
    async with chromium() as opened:
        yield opened
