"""How long a browser takes for each page of the monitor, and how much goes over the wire.

    python -m benchmarks.page_load

A monitor without drones and a headless Chromium run on this machine. Each page is opened with an empty cache.
Printed are the medians of several loads: the time until the page's own content stands, and until everything
was loaded that the page loads by itself; the requests; and the bytes received, with heads, as compressed.
"""

from __future__ import annotations

import asyncio
import os
import shutil
import socket
import statistics
import sys
import tempfile
import time
from contextlib import asynccontextmanager
from dataclasses import dataclass, field

from playwright.async_api import async_playwright

# Each page, and what its own script makes of it.
PAGES = {
    "/": "#live .m-grid",
    "/chart": "#chart .m-chart",
    "/pilot": "#pilot .p-state",
    "/competition": "#competition > *",
    "/ranking": "#ranking > *",
    "/stage": "#stage .s-head",
    "/replay": "#replay > *",
    "/login": "main h1",
}
LOADS = 5
QUIET_S = 1.0
POLL_S = 0.02
LONGEST_S = 20.0


@dataclass
class Load:
    """One load of a page."""

    content_s: float = 0.0
    all_s: float = 0.0
    requests: int = 0
    received_bytes: int = 0
    last_s: float = field(default_factory=time.monotonic)


@asynccontextmanager
async def running_monitor():
    """A monitor in a process of its own; yields its URL."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        drone_port = taken.getsockname()[1]
    options = ("--port", "0", "--drone", f"udpin://127.0.0.1:{drone_port}", "--database", "sqlite://")
    with tempfile.TemporaryDirectory() as runs:
        code = "from framerunner.cli import main; main()"
        monitor = await asyncio.create_subprocess_exec(
            *(sys.executable, "-c", code, "monitor", *options, "--runs", runs),
            stdout=asyncio.subprocess.PIPE,
            stderr=asyncio.subprocess.STDOUT,
            env={**os.environ, "PYTHONUNBUFFERED": "1"},
        )
        try:
            while b"monitor: http" not in (line := await monitor.stdout.readline()):
                if not line:
                    raise RuntimeError("the monitor does not start")
            yield line.decode().partition("monitor: ")[2].strip().rstrip("/")
        finally:
            monitor.terminate()
            await monitor.wait()


async def load(browser, url: str, content: str) -> Load:
    """Open a page with an empty cache."""
    context = await browser.new_context(viewport={"width": 1366, "height": 768})
    page = await context.new_page()
    network = await context.new_cdp_session(page)
    await network.send("Network.enable")
    result = Load()

    def count(event):
        result.requests += 1
        result.received_bytes += event.get("encodedDataLength", 0)
        result.last_s = time.monotonic()

    network.on("Network.loadingFinished", count)
    begin_s = time.monotonic()
    await page.goto(url, wait_until="commit")
    await page.wait_for_selector(content, state="attached")
    result.content_s = time.monotonic() - begin_s
    for _ in range(round(LONGEST_S / POLL_S)):
        await asyncio.sleep(POLL_S)
        if time.monotonic() - result.last_s > QUIET_S:
            break
    result.all_s = result.last_s - begin_s
    await context.close()
    return result


async def main() -> None:
    """Measure all pages and print a table."""
    async with running_monitor() as url, async_playwright() as playwright:
        flags = ["--no-sandbox", "--disable-gpu"]
        path = os.environ.get("FRAMERUNNER_CHROMIUM") or shutil.which("chromium")
        browser = await playwright.chromium.launch(executable_path=path, args=flags)
        print("| page | content | all loaded | requests | over the wire |\n|---|---|---|---|---|")
        for page, content in PAGES.items():
            await load(browser, url + page, content)  # the server's first answer takes longer
            loads = [await load(browser, url + page, content) for _ in range(LOADS)]
            median = {
                name: statistics.median(getattr(each, name) for each in loads)
                for name in ("content_s", "all_s", "requests", "received_bytes")
            }
            print(
                f"| `{page}` | {median['content_s']:.2f} s | {median['all_s']:.2f} s "
                f"| {median['requests']:.0f} | {median['received_bytes'] / 1e6:.2f} MB |",
                flush=True,
            )
        await browser.close()


if __name__ == "__main__":
    asyncio.run(main())
