"""The editor's tab Simulator: a flight with MAVLink and video is started, lights the chart, is stopped."""

from __future__ import annotations

import pytest
from playwright.async_api import expect

from framerunner.course.lessons import find_lesson
from tests.chromium import chromium
from tests.framerunner.editing.editor_program import editor
from tests.framerunner.editing.editor_user import SIZE, EditorUser

pytestmark = [pytest.mark.asyncio, pytest.mark.realtime, pytest.mark.alone]


# Alone: the editor takes the first instance whose ports are free.
async def test_a_flight_in_the_simulator_is_started_and_stopped(tmp_path):
    mission = tmp_path / "short.yaml"
    mission.write_text(find_lesson("1").start)
    async with editor(mission) as program, chromium() as browser:
        user = EditorUser(await browser.new_page(viewport=SIZE))
        await user.open(program.page(mission.name))
        live = await user.show_tab("live")
        await live.get_by_role("combobox", name="Speed").select_option("5")
        await user.press("Fly in the simulator", live)
        lit = user.page.locator(".e-active")
        await expect(lit).to_have_attribute("data-state", "rise", timeout=30_000)
        await expect(live.locator(".t-drone")).to_be_visible()
        await user.press("Stop", live)
        await expect(live.locator(".e-run-line")).to_have_text("stopped")
        await expect(lit).to_have_count(0, timeout=15_000)
        await expect(live.locator(".e-run-line")).to_have_text("stopped")
        await expect(live.get_by_role("button", name="Fly in the simulator")).to_be_enabled()
        assert not user.complaints
