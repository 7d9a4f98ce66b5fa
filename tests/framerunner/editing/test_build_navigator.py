"""The paper's navigator is built in the editor by mouse and keyboard, checked, saved and flown."""

from __future__ import annotations

import re

import pytest
from playwright.async_api import expect

from offboard.mission import load_mission
from tests.chromium import chromium
from tests.framerunner.editing.editor_program import editor
from tests.framerunner.editing.editor_user import SIZE, EditorUser

LANDED = re.compile("The drone did everything and landed on its base after")
RATE = ("look_to_frame", "cmd.vel_x = (frame.d - 0.3) / 8")
# State, what it does on entry and during, and its transitions: guard and target.
CROSS_FRAME = {
    "go_to_center": (
        ["goal_m = (0, 0, 2)"],
        ["fly_to_goal"],
        [("frame_seen", "frame_visible"), ("distance_to_goal_m < 0.2", "turning")],
    ),
    "turning": (["hover", "cmd.rot_z = 1"], [], [("frame_seen", "frame_visible")]),
    "frame_visible": (
        ["hover"],
        ["look_to_frame", "cmd.vel_x = (frame.d - 0.4) / 2"],
        [("frame.d < 0.45", "frame_close"), ("not frame_seen", "go_to_center")],
    ),
    "frame_close": (["hover", "memory.alpha0 = frame.a"], [], [("", "shift_left")]),
    "shift_left": (
        ["cmd.vel_y = 0.1"],
        RATE,
        [
            ("frame.a < 3", "crossing"),
            ("frame.a > memory.alpha0", "shift_right"),
            ("seconds_unseen > 0.5", "lost"),
        ],
    ),
    "shift_right": (
        ["cmd.vel_y = -0.1"],
        RATE,
        [("frame.a < 3", "crossing"), ("seconds_unseen > 0.5", "lost")],
    ),
    "lost": (
        ["hover"],
        [],
        [("frame_seen", "frame_visible"), ("seconds_in_state >= 1", "go_to_center")],
    ),
    "crossing": (["hover", "cmd.vel_x = 0.3"], ["look_to_frame"], [("seconds_in_state >= 4", "going_up")]),
    "going_up": (["hover", "cmd.vel_z = 0.3"], [], [("seconds_in_state >= 2", "end")]),
    "end": ([], [], []),
}
TAKE_OFF = {
    "start": (["hover"], [], [("", "set_base")]),
    "set_base": (
        ["memory.x0 = imu.x", "memory.y0 = imu.y", "goal_m = (memory.x0, memory.y0, 1)"],
        ["fly_to_goal"],
        [("distance_to_goal_m < 0.1", "end")],
    ),
    "end": ([], [], []),
}
LANDING = {
    "go_to_base": (
        ["goal_m = (memory.x0, memory.y0, 0.6)"],
        ["fly_to_goal"],
        [("distance_to_goal_m < 0.05", "stop")],
    ),
    "stop": (["motors_off"], [], []),
}


async def fill(user: EditorUser, parent: str, states: dict) -> None:
    """Make the states of a superstate, whose first one is there already, then their transitions."""
    first, *others = states
    await user.select(f"{parent}.first")
    await user.rename(f"{parent}.first", first)
    for name, (enter, during, leads) in states.items():
        if name in others:
            await user.add_inner(parent, name)
        await user.do("On entry", *enter)
        await user.do("During", *during)
        if not leads:
            await user.tick("final: the end")
    for name, (_, _, leads) in states.items():
        for when, target in leads:
            await user.join(f"{parent}.{name}", f"{parent}.{target}", when)


async def lead(user: EditorUser, source: str, target: str, event: str) -> None:
    """Draw a transition that is looked at on another event than a tick."""
    await user.join(source, target)
    await user.event(event)
    # Applied and drawn: before that, states may still move away from the mouse.
    await expect(user.transition(f"{source}/{event}/0")).to_have_count(1)


async def build(user: EditorUser) -> None:
    """The paper's navigator, from an empty chart."""
    await user.page.locator("svg.e-diagram").click(position={"x": 5, "y": 300})
    for name in ("x0", "y0", "alpha0"):
        await user.field("Add a variable", name)
        await expect(user.form.get_by_label(name, exact=True)).to_have_value("0")
    await user.add("New superstate", "take_off")
    await fill(user, "take_off", TAKE_OFF)

    await user.add("New template", "red")
    await user.field("Name of the template", "cross_frame")
    await fill(user, "red", CROSS_FRAME)
    await lead(user, "red.going_up", "red.going_up", "resume")
    await lead(user, "red", "red.go_to_center", "resume")
    await user.select("red")
    await user.do("On entry", "colour = 'red'")

    for before, name in (("red", "green"), ("green", "blue")):
        await user.select(before)
        await user.press("Duplicate", user.form)
        await expect(user.form.locator("h2")).to_have_text(f"State {before}_2")
        await user.page.keyboard.type(name)
        await user.page.keyboard.press("Enter")
        await expect(user.state(name)).to_be_attached()
        await user.field("colour", f"'{name}'")

    await user.add("New superstate", "landing")
    await fill(user, "landing", LANDING)
    for source, target in (("take_off", "red"), ("red", "green"), ("green", "blue"), ("blue", "landing")):
        await lead(user, source, target, "done")
    await user.select("take_off")
    await user.tick("starts here")
    await user.select("start")
    await user.page.keyboard.press("Delete")
    await expect(user.state("start")).to_have_count(0)


@pytest.mark.asyncio
async def test_the_papers_navigator_is_built_by_hand_checked_saved_and_flown(tmp_path):
    mission = tmp_path / "mine.yaml"
    async with editor(mission, spares=False) as program, chromium() as browser:
        user = EditorUser(await browser.new_page(viewport=SIZE))
        user.page.set_default_timeout(10_000)
        await user.open(program.page(mission.name))
        await build(user)
        await expect(user.page.locator("#e-tab-findings")).not_to_contain_text("✗")
        await user.saves()
        assert meaning("frame_challenge") == meaning(mission)
        await user.page.get_by_role("tab", name="Fly").click()
        await user.page.get_by_role("combobox", name="Speed").select_option(label="fastest")
        await user.press("Fly", user.page.locator(".e-tabs .e-tab:not([hidden])"))
        line = user.page.locator(".e-tabs .e-tab:not([hidden]) .e-run-line")
        await expect(line).to_have_text(LANDED, timeout=60_000)
        assert not user.complaints


def meaning(mission):
    """What is flown, without the mission's name."""
    spec = load_mission(mission).spec
    return spec.initial, spec.states
