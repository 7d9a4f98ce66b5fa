"""How fast the editor's page is with a large mission, in headless Chromium.

    python -m benchmarks.editor [--states 200]

The mission has so many states and twice as many transitions. `framerunner edit` runs in a process of its own.
Printed are medians of several tries:

- first page: from the request until the diagram stands, with an empty cache, and the bytes over the wire, as
  compressed; of the page of an empty mission, too;
- text to diagram: from the last key pressed in the text, from the message that this sends 80 ms later, and
  from the answer's arrival, until the frame in which the new diagram is drawn;
- dragging: frames a second (`requestAnimationFrame`) while the mouse moves a state, and its longest frame.
"""

from __future__ import annotations

import argparse
import asyncio
import os
import shutil
import statistics
import tempfile
from pathlib import Path

from playwright.async_api import Browser, Page, async_playwright

from benchmarks.page_load import load
from tests.framerunner.editing.editor_program import editor

TRIES = 5
DRAG_S = 3.0
SIZE = {"width": 1700, "height": 1050}
# Notes when a key is pressed, a message is sent, an answer arrives, and the next frame after a new diagram.
WATCH = """
window.seen = {};
const send = WebSocket.prototype.send;
WebSocket.prototype.send = function (data) {
  if (data.includes('"kind":"type"')) window.seen.sent = performance.now();
  return send.call(this, data);
};
const handler = Object.getOwnPropertyDescriptor(WebSocket.prototype, "onmessage");
Object.defineProperty(WebSocket.prototype, "onmessage", { ...handler, set(hear) {
  handler.set.call(this, (event) => {
    if (String(event.data).startsWith('{"kind":"changed"')) window.seen.arrived ??= performance.now();
    hear(event);
  });
} });
addEventListener("keydown", () => { window.seen = { key: performance.now() }; }, true);
window.watchDiagram = () => new MutationObserver(() => {
  const { seen } = window;
  requestAnimationFrame(() => setTimeout(() => { seen.drawn ??= performance.now(); }));
}).observe(document.querySelector(".e-diagram g"), { childList: true, subtree: true });
"""
COUNT_FRAMES = """
() => {
  window.frames_ms = [];
  let last = performance.now();
  const next = (now) => {
    window.frames_ms.push(now - last);
    last = now;
    window.counting = requestAnimationFrame(next);
  };
  window.counting = requestAnimationFrame(next);
}
"""


def large_mission(states: int) -> str:
    """A mission with a number of states and twice as many transitions, with time-outs and an end."""
    lines = ["name: large", "initial: s0", "states:"]
    for number in range(states - 1):
        lines += [
            *(f"  s{number}:", "    enter:", "      - hover", "    transitions:"),
            f"      - when: frame_seen and frame.d < {number % 5 + 1}",
            f"        to: s{(number * 37 + 11) % states}",
            f"      - when: seconds_in_state > {number % 7 + 1}",
            f"        to: s{number + 1}",
        ]
    return "\n".join([*lines, f"  s{states - 1}:", "    enter:", "      - land", "    final: true", ""])


async def type_to_diagram(page: Page) -> dict[str, float]:
    """Milliseconds from a key, from its message and from the answer to the new diagram."""
    await page.keyboard.press("x")
    for _ in range(500):
        seen = await page.evaluate("window.seen")
        if "drawn" in seen:
            return {name: seen["drawn"] - seen[name] for name in ("key", "sent", "arrived")}
        await asyncio.sleep(0.02)
    raise RuntimeError(f"the diagram does not follow the text: {seen}")


async def drag(page: Page, state: str) -> tuple[float, float]:
    """Frames a second while a state is dragged, and the longest frame, ms."""
    box = await page.locator(f'.e-state[data-state="{state}"] > rect').first.bounding_box()
    assert box is not None
    x, y = box["x"] + box["width"] / 3, box["y"] + box["height"] / 2
    await page.mouse.move(x, y)
    await page.mouse.down()
    await page.evaluate(COUNT_FRAMES)
    loop = asyncio.get_running_loop()
    end_s, step = loop.time() + DRAG_S, 0
    while loop.time() < end_s:
        step += 1
        await page.mouse.move(x + 2 * (step % 60), y + 3 * (step % 40))
        await asyncio.sleep(0.005)
    frames = await page.evaluate("() => { cancelAnimationFrame(window.counting); return window.frames_ms; }")
    await page.mouse.up()
    return 1000 * len(frames) / sum(frames), max(frames)


async def measure(browser: Browser, states: int) -> None:
    """Measure and print."""
    with tempfile.TemporaryDirectory() as folder:
        mission = Path(folder) / "large.yaml"
        mission.write_text(large_mission(states), encoding="utf-8")
        async with editor(mission) as program:
            (Path(folder) / "small.yaml").write_text(large_mission(3), encoding="utf-8")
            for name in ("small.yaml", "large.yaml"):
                url = program.page(name)
                await load(browser, url, ".e-state")  # the server's first answer takes longer
                loads = [await load(browser, url, ".e-state") for _ in range(TRIES)]
                content_s = statistics.median(each.content_s for each in loads)
                received = statistics.median(each.received_bytes for each in loads)
                print(
                    f"first page, {name}: {content_s:.2f} s, {received / 1e6:.2f} MB over the wire",
                    flush=True,
                )
            page = await browser.new_page(viewport=SIZE)
            await page.add_init_script(WATCH)
            await page.goto(program.page("large.yaml"))
            await page.wait_for_selector(".e-state")
            await page.evaluate("window.watchDiagram()")
            await page.locator(".cm-line").first.click()
            await page.keyboard.press("End")
            tries = [await type_to_diagram(page) for _ in range(TRIES)]
            for name in ("key", "sent", "arrived"):
                print(
                    f"text to diagram, from {name}: {statistics.median(each[name] for each in tries):.0f} ms"
                )
            for state in ("s0", f"s{states // 2}"):
                frames, longest = await drag(page, state)
                print(f"dragging {state}: {frames:.0f} frames a second, longest {longest:.0f} ms", flush=True)


async def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--states", type=int, default=200)
    states = parser.parse_args().states
    async with async_playwright() as playwright:
        path = os.environ.get("FRAMERUNNER_CHROMIUM") or shutil.which("chromium")
        browser = await playwright.chromium.launch(
            executable_path=path, args=["--no-sandbox", "--disable-gpu"]
        )
        await measure(browser, states)
        await browser.close()


if __name__ == "__main__":
    asyncio.run(main())
