"""The editor's page in a real browser: diagram and text follow each other, and no work is lost."""

from __future__ import annotations

import asyncio
import json

import pytest
import pytest_asyncio
from playwright.async_api import expect

from benchmarks.editor import drag, large_mission
from tests.framerunner.editing.editor_program import editor, free_port
from tests.framerunner.editing.editor_user import SIZE, EditorUser, box_of

pytestmark = pytest.mark.asyncio(loop_scope="module")
HOVER = """\
name: hover   # ü 😀: a comment
initial: up

states:
  up:
    enter:
      - hover
      - cmd.vel_z = 0.5   # upwards
    transitions:
      - when: imu.z > 1
        to: wait

  wait:
    enter: [hover]
    transitions:
      - {when: seconds_in_state > 5, to: down}
  down:
    enter:
    - land
    final: true
# the end
"""


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def program(tmp_path_factory):
    folder = tmp_path_factory.mktemp("missions")
    async with editor(folder / "first.yaml", spares=False) as running:
        running.folder = folder
        yield running


async def eventually(condition, limit_s):
    """Wait until something holds."""
    loop = asyncio.get_running_loop()
    end_s = loop.time() + limit_s
    while not await condition():
        assert loop.time() < end_s
        await asyncio.sleep(0.05)


class Windows:
    """Windows at one mission's page."""

    def __init__(self, program, context, path):
        self.program = program
        self.context = context
        self.path = path

    async def open(self):
        user = EditorUser(await self.context.new_page())
        user.page.set_default_timeout(10_000)
        await user.open(self.program.page(self.path.name))
        return user


@pytest_asyncio.fixture(loop_scope="module")
async def windows(program, browser, request):
    path = program.folder / f"{request.node.name[:70]}.yaml"
    path.write_bytes(HOVER.encode())
    context = await browser.new_context(viewport=SIZE)
    yield Windows(program, context, path)
    await context.close()


async def test_what_is_typed_changes_the_diagram_and_what_is_drawn_the_text(windows):
    user = await windows.open()
    await user.type_at(11, "\n      - when: imu.z > 3\n        to: down")
    await expect(user.transition("up/tick/1")).to_have_text("2: imu.z > 3")
    await user.select("wait")
    await user.rename("wait", "stay")
    await user.join("stay", "up", "seconds_unseen > 9")
    drawn = HOVER.replace(
        "        to: wait\n", "        to: stay\n      - when: imu.z > 3\n        to: down\n"
    ).replace("  wait:\n", "  stay:\n")
    transition = "      - {when: seconds_in_state > 5, to: down}\n"
    added = "      - when: seconds_unseen > 9\n        to: up\n"
    await user.saves()
    assert windows.path.read_text() == drawn.replace(transition, transition + added)
    assert await user.text() == windows.path.read_text()
    assert not user.complaints


async def test_undoing_all_edits_gives_the_first_bytes_back(windows):
    user = await windows.open()
    await user.add("New state", "other")
    await user.join("other", "down", "imu.x > 1")
    await user.select("up")
    await user.press("Duplicate", user.form)
    await expect(user.state("up_2")).to_be_attached()
    await user.select("wait")
    await user.page.keyboard.press("Delete")
    await expect(user.state("wait")).to_have_count(0)
    await user.type_at(1, " and more")
    await user.until("document.querySelector('.e-saved').textContent === 'not saved'")
    await user.saves()
    assert windows.path.read_bytes() != HOVER.encode()
    undo = user.page.get_by_role("button", name="Undo")
    while await undo.is_enabled():
        await undo.click()
        await user.page.wait_for_timeout(100)
    await user.saves()
    assert windows.path.read_bytes() == HOVER.encode()
    redo = user.page.get_by_role("button", name="Redo")
    await redo.click()
    await expect(user.state("state")).to_be_attached()


async def test_control_z_in_the_text_takes_one_edit_back(windows):
    user = await windows.open()
    await user.select("wait")
    await user.rename("wait", "stay")
    await user.type_at(1, "!")
    await user.page.keyboard.press("ControlOrMeta+z")
    await expect(user.page.locator(".cm-line").first).to_have_text(HOVER.splitlines()[0])
    await expect(user.state("stay")).to_be_attached()
    await user.page.keyboard.press("ControlOrMeta+z")
    await expect(user.state("wait")).to_be_attached()
    assert await user.text() == HOVER


async def test_a_finding_is_shown_in_the_diagram_the_text_and_the_list(windows):
    user = await windows.open()
    await expect(user.page.locator("#e-panel-findings")).not_to_contain_text("nowhere")
    await user.type_at(16, " # a comment\n      - when: imu.w > 1\n        to: up")
    await expect(user.page.locator('[data-transition="wait/tick/1"].e-transition')).to_have_attribute(
        "data-finding", "error"
    )
    await expect(user.page.locator(".cm-lintRange-error")).to_have_text("imu.w > 1")
    row = user.page.locator("#e-panel-findings li[data-severity=error] button")
    await expect(row).to_contain_text("17: ")
    await row.click()
    await expect(user.form.locator("h2")).to_have_text("Transition wait → up")


async def test_an_unsafe_expression_is_an_error_at_once(windows):
    user = await windows.open()
    await user.select("wait")
    await user.do("On entry", "cmd.vel_z = __import__('os').system('touch hacked')")
    await expect(user.state("wait")).to_have_attribute("data-finding", "error", timeout=1000)
    assert not list(windows.path.parent.glob("hacked*"))


async def test_closing_with_unsaved_work_asks(windows):
    user = await windows.open()
    asked = []

    async def stay(dialog):
        asked.append(dialog.type)
        await dialog.dismiss()

    user.page.on("dialog", stay)
    await user.add("New state", "other")
    await user.page.close(run_before_unload=True)
    await asyncio.sleep(0.5)
    assert asked == ["beforeunload"]
    assert not user.page.is_closed()
    await user.saves()
    async with user.page.expect_event("close"):
        await user.page.close(run_before_unload=True)
    assert asked == ["beforeunload"]


async def test_a_file_that_another_program_changed_is_overwritten_only_after_a_question(windows):
    user = await windows.open()
    answers = ["dismiss", "accept"]

    async def answer(dialog):
        await getattr(dialog, answers.pop(0))()

    user.page.on("dialog", answer)
    await user.type_at(2, " # mine")
    others = HOVER + "# of another program\n"
    windows.path.write_text(others)
    await user.page.keyboard.press("ControlOrMeta+s")
    await eventually(lambda: asyncio.sleep(0, answers == ["accept"]), 10.0)
    assert windows.path.read_text() == others
    await user.saves()
    assert "# mine" in windows.path.read_text()


async def test_two_windows_know_of_each_other_and_show_the_same(windows):
    one, two = await windows.open(), await windows.open()
    for user in (one, two):
        await expect(user.page.locator(".e-saved")).to_contain_text("also open in another window")
    await one.add("New state", "other")
    await expect(two.state("other")).to_be_attached()
    await two.type_at(7, " # typed")
    await expect(one.page.locator(".cm-line").nth(6)).to_have_text("      - hover # typed")
    await two.page.close()
    await expect(one.page.locator(".e-saved")).not_to_contain_text("another window")
    assert not one.complaints


async def test_typing_in_two_windows_at_once_ends_in_the_same_text(windows):
    one, two = await windows.open(), await windows.open()
    await one.page.locator(".cm-line").nth(0).click()
    await one.page.keyboard.press("End")
    await two.page.locator(".cm-line").nth(6).click()
    await two.page.keyboard.press("End")
    for number in range(30):
        await one.page.keyboard.type(f"a{number}")
        await two.page.keyboard.type(f"b{number}")

    async def is_same():
        return await one.text() == await two.text()

    await eventually(is_same, 10.0)
    await one.saves()
    assert windows.path.read_text() == await one.text()
    assert not [*one.complaints, *two.complaints]


async def test_a_field_that_is_being_filled_in_is_kept_when_another_window_edits(windows):
    one, two = await windows.open(), await windows.open()
    await one.select("wait")
    await one.form.get_by_label("On exit: Add an action", exact=True).click()
    await one.page.keyboard.type("land")
    await two.type_at(8, " # typed")
    await expect(one.page.locator(".cm-line").nth(7)).to_contain_text("# typed")
    await one.page.keyboard.press("Enter")
    await expect(one.form.get_by_label("Remove: land")).to_have_count(1)


async def move(user, start, end):
    """Drag from one point of the window to another."""
    await user.page.mouse.move(*start)
    await user.page.mouse.down()
    await user.page.mouse.move(*end, steps=4)
    await user.page.mouse.up()


async def corner(user, name, dx=12, dy=10):
    """A point in a state, beside its corner."""
    box = await box_of(user.state(name).locator("> rect").first)
    return box["x"] + dx, box["y"] + dy


def place_in(side, name):
    """Of a state, x and y by a side file; None if it has none."""
    found = json.loads(side.read_text())["states"].get(name) if side.exists() else None
    return found and [found["x"], found["y"]]


async def test_a_move_of_a_box_is_undone_in_order_with_typed_text(windows):
    user = await windows.open()
    side = windows.path.with_suffix(".layout.json")
    place = await user.state("wait").get_attribute("transform")
    await user.type_at(1, "!")
    await expect(user.page.locator(".e-saved")).to_contain_text("not saved")

    async def is_placed():
        return place_in(side, "wait") is not None

    await eventually(is_placed, 5.0)
    first = place_in(side, "wait")
    x, y = await corner(user, "wait")
    await move(user, (x, y), (x + 90, y + 50))

    async def is_kept():
        return place_in(side, "wait") != first

    await eventually(is_kept, 5.0)  # the page draws it before it is written
    await user.page.keyboard.press("ControlOrMeta+z")
    await expect(user.state("wait")).to_have_attribute("transform", place)
    assert place_in(side, "wait") == first
    assert "a comment!" in await user.text()
    # A field of a form that nothing was typed into takes the document's last edit back, too.
    await user.form.get_by_label("Name", exact=True).click()
    await user.page.keyboard.press("ControlOrMeta+z")
    await expect(user.page.locator(".cm-line").first).to_have_text(HOVER.splitlines()[0])


async def test_what_is_drawn_stays_where_it_is_when_states_are_added(windows):
    user = await windows.open()
    names = ("up", "wait", "down")
    before = [await user.state(name).get_attribute("transform") for name in names]
    for name in ("one", "two", "three"):
        await user.add("New state", name)
    await user.page.reload()
    await expect(user.state("three")).to_be_attached()
    assert [await user.state(name).get_attribute("transform") for name in names] == before
    boxes = [
        await box_of(user.state(name).locator("> rect").first) for name in (*names, "one", "two", "three")
    ]
    for number, one in enumerate(boxes):
        for other in boxes[:number]:
            assert (
                one["x"] >= other["x"] + other["width"]
                or other["x"] >= one["x"] + one["width"]
                or one["y"] >= other["y"] + other["height"]
                or other["y"] >= one["y"] + one["height"]
            )


async def test_the_ends_of_a_transition_are_dragged_to_other_states(windows):
    user = await windows.open()
    await user.transition("up/tick/0").click()
    end = await box_of(user.page.locator(".e-end").last)
    await move(user, (end["x"] + 4, end["y"] + 4), await corner(user, "down"))
    await expect(user.form.locator("h2")).to_have_text("Transition up → down")
    start = await box_of(user.page.locator(".e-end").first)
    await move(user, (start["x"] + 4, start["y"] + 4), await corner(user, "wait"))
    await expect(user.form.locator("h2")).to_have_text("Transition wait → down")
    added = "      - when: imu.z > 1\n        to: down\n"
    assert added in await user.text()
    await user.page.keyboard.press("ControlOrMeta+z")
    await expect(user.transition("up/tick/0")).to_be_attached()


async def test_a_transition_to_no_state_is_shown_as_an_error(windows):
    user = await windows.open()
    await user.type_at(11, "ing")
    await expect(user.page.locator(".e-missing")).to_have_text("waiting ?")
    await expect(user.page.locator('[data-transition="up/tick/0"].e-transition')).to_have_attribute(
        "data-finding", "error"
    )
    await expect(user.form.locator("h2")).to_have_text("Transition up → waiting")  # follows the cursor


async def test_a_new_transition_of_the_form_and_a_copy_open_at_their_top(windows):
    user = await windows.open()
    await user.select("wait")
    await user.choose("Add a transition", "up")
    await expect(user.form.locator("h2")).to_have_text("Transition wait → up")
    await user.page.keyboard.type("imu.z > 9")  # the cursor is in the guard's field
    await user.page.keyboard.press("Enter")
    await expect(user.transition("wait/tick/1")).to_have_text("2: imu.z > 9")
    await user.select("wait")
    await user.press("Duplicate", user.form)
    await expect(user.form.locator("h2")).to_have_text("State wait_2")
    await user.page.keyboard.type("copy")
    await user.page.keyboard.press("Enter")
    await expect(user.state("copy")).to_be_attached()


async def test_enter_indents_as_yaml_wants(windows):
    user = await windows.open()
    await user.page.locator(".cm-line").nth(19).click()  # final: true
    await user.page.keyboard.press("End")
    for line in ("transitions:", "- when: imu.z > 5", "to: up", "do:", "- hover", "- land"):
        await user.page.keyboard.press("Enter")
        await user.page.keyboard.type(line)
    written = (
        "    final: true\n    transitions:\n      - when: imu.z > 5\n        to: up\n"
        "        do:\n          - hover\n          - land\n# the end"
    )
    assert written in await user.text()


async def test_a_large_mission_is_drawn_typed_in_and_dragged(windows):
    windows.path.write_text(large_mission(200))
    user = await windows.open()
    await expect(user.page.locator(".e-state")).to_have_count(200)
    await expect(user.page.locator(".e-transition")).to_have_count(398)
    await user.type_at(8, " and frame.a < 5")
    await expect(user.transition("s0/tick/0")).to_have_text("1: frame_seen and frame.d < 1 and fr…")
    await user.press("Show all")
    place = await user.state("s7").get_attribute("transform")
    frames, _ = await drag(user.page, "s7")
    assert frames > 1
    await expect(user.state("s7")).not_to_have_attribute("transform", place)
    assert not user.complaints  # also no request to another host


def journal_of(path):
    """What is kept of a mission's unsaved text."""
    return "".join(each.read_text() for each in path.parent.glob(f".{path.name}.unsaved"))


async def test_a_killed_program_loses_at_most_five_seconds(browser, tmp_path):
    path, port = tmp_path / "hover.yaml", free_port()
    path.write_text(HOVER)
    context = await browser.new_context(viewport=SIZE)
    async with editor(path, port=port, spares=False) as program:
        user = EditorUser(await context.new_page())
        await user.open(program.page(path.name))
        await user.add("New state", "kept")

        async def is_kept():
            return "kept" in journal_of(path)

        await eventually(is_kept, 5.0)
        await program.kill()
        await expect(user.page.locator(".e-message")).to_contain_text("no connection")
        await user.type_at(1, "typed in vain")
        assert "in vain" not in await user.text()
    assert "kept" not in path.read_text()
    async with editor(path, port=port, spares=False) as program:
        await expect(user.page.locator(".e-message")).to_contain_text("is here again", timeout=15_000)
        await expect(user.state("kept")).to_be_attached()
        await expect(user.page.locator(".e-saved")).to_contain_text("not saved")
        await user.saves()
        assert "  kept:\n" in path.read_text()
        assert path.read_text().replace("\n  kept:\n", "", 1) == HOVER
    await context.close()
