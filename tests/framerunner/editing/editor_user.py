"""What a person does at the editor's page, with mouse and keyboard."""

from __future__ import annotations

import asyncio
import re

from playwright.async_api import Locator, Page, expect

from tests.chromium import Complaints, until

_BELOW_EDGE_PX = 4
NEW = {"New state": "State state", "New superstate": "State group", "New template": "State group"}
SIZE = {"width": 1700, "height": 1050}


class EditorUser:
    """A person at a page of the editor.

    Args:
        page: a window of the browser.

    Attributes:
        complaints: of the page.
    """

    def __init__(self, page: Page) -> None:
        self.page = page
        self.complaints = Complaints(page)
        self.form = page.locator(".e-form")

    async def open(self, url: str) -> None:
        """Open a mission's page."""
        await self.page.goto(url)
        await expect(self.page.locator(".e-saved")).not_to_be_empty(timeout=30_000)

    def state(self, name: str) -> Locator:
        """A state of the diagram."""
        return self.page.locator(f'.e-state[data-state="{name}"]')

    def transition(self, name: str) -> Locator:
        """The label of a transition of the diagram."""
        return self.page.locator(f'.e-label[data-transition="{name}"]')

    async def press(self, name: str, within: Locator | None = None) -> None:
        """Click a button."""
        await (within or self.page).get_by_role("button", name=name, exact=True).click()

    async def show_tab(self, key: str) -> Locator:
        """Show a tab below the diagram; its panel."""
        await self.page.locator(f"#e-tab-{key}").click()
        return self.page.locator(f"#e-panel-{key}")

    async def field(self, label: str, value: str) -> None:
        """Write into a field of the form and leave it with Enter."""
        box = self.form.get_by_label(label, exact=True)
        await box.click()
        await self.page.keyboard.press("ControlOrMeta+a")
        await self.page.keyboard.type(value)
        await self.page.keyboard.press("Enter")

    def choice(self, label: str) -> Locator:
        """A list of the form."""
        return self.form.get_by_role("combobox", name=label, exact=True)

    async def choose(self, label: str, value: str) -> None:
        """Choose from a list of the form."""
        await self.choice(label).select_option(value)

    async def select(self, name: str) -> None:
        """Show all of the diagram and click a state."""
        await self.press("Show all")
        rect = self.state(name).locator("> rect").first
        width = (await box_of(rect))["width"]
        await rect.click(position={"x": width / 2, "y": _BELOW_EDGE_PX})  # not on a superstate's triangle
        await expect(self.form.locator("h2")).to_have_text(f"State {name.rpartition('.')[2]}")

    async def rename(self, name: str, to: str) -> str:
        """Rename the selected state `name`; its new id."""
        await self.field("Name", to)
        new = ".".join([*name.split(".")[:-1], to])
        await expect(self.state(new)).to_be_attached()
        return new

    async def add(self, button: str, name: str) -> None:
        """A new state at the top, by one of the buttons above the diagram."""
        await self.press(button)
        await expect(self.form.locator("h2")).to_have_text(NEW[button])
        await self.page.keyboard.type(name)  # the name is selected
        await self.page.keyboard.press("Enter")
        await expect(self.state(name)).to_be_attached()

    async def add_inner(self, parent: str, name: str) -> None:
        """A new state in a superstate."""
        await self.select(parent)
        await self.press("New state in it", self.form)
        await expect(self.form.locator("h2")).to_have_text("State state")
        await self.page.keyboard.type(name)
        await self.page.keyboard.press("Enter")
        await expect(self.state(f"{parent}.{name}")).to_be_attached()
        await expect(self.form.locator("h2")).to_have_text(f"State {name}")

    async def do(self, section: str, *actions: str) -> None:
        """Add actions to the selected state or transition."""
        for action in actions:
            await self.field(f"{section}: Add an action", action)
            await expect(self.form.get_by_label(f"Remove: {action}")).to_have_count(1)

    async def join(self, source: str, target: str, when: str = "") -> None:
        """Drag from a state's handle to another state, and write the guard of the new transition."""
        await self.press("Show all")
        handle = await box_of(self.state(source).locator(".e-handle").last)
        await self.page.mouse.move(handle["x"] + handle["width"] / 2, handle["y"] + handle["height"] / 2)
        await self.page.mouse.down()
        box = await box_of(self.state(target).locator("> rect").first)
        await self.page.mouse.move(box["x"] + 3, box["y"] + 3, steps=3)
        await self.page.mouse.up()
        await expect(self.form.locator("h2")).to_have_text(f"Transition {source} → {target}")
        if when:
            await self.page.keyboard.type(when)  # the cursor is in the guard's field
            await self.page.keyboard.press("Enter")
            drawn = f"transition from {source} to {target} when {when}"
            await expect(self.page.locator(f'[aria-label="{drawn}"]')).to_have_count(1)

    async def event(self, event: str) -> None:
        """Choose the event of the selected transition."""
        await self.choose("Event", event)
        await expect(self.choice("Event")).to_have_value(event)

    async def tick(self, label: str) -> None:
        """Tick a box of the form."""
        box = self.form.get_by_label(label, exact=True)
        await box.click()
        await expect(box).to_be_checked()

    async def text(self) -> str:
        """The YAML that is shown, of a mission that is not longer than the window."""
        return "\n".join(await self.page.locator(".cm-line").all_text_contents())

    async def type_at(self, line: int, text: str) -> None:
        """Put the cursor at the end of a line of the YAML, from 1, and type."""
        await self.page.locator(".cm-line").nth(line - 1).click()
        await self.page.keyboard.press("End")
        await self.write(text)

    async def write(self, text: str) -> None:
        """Type at the cursor; the text's own indentation is kept, whatever Enter adds."""
        for number, line in enumerate(text.split("\n")):
            if number:
                await self.page.keyboard.press("Enter")
                await self.page.keyboard.press("Shift+Home")
            await self.page.keyboard.type(line)

    async def saves(self) -> None:
        """Press Control and S, and wait until the file has it."""
        await self.page.keyboard.press("ControlOrMeta+s")
        await expect(self.page.locator(".e-saved")).to_have_text(re.compile("^saved"))

    async def until(self, expression: str, timeout_s: float = 30.0) -> None:
        """Wait until an expression is true in the page."""
        await until(self.page, expression, timeout_s=timeout_s)


async def box_of(part):
    """Where a part is; the page may draw it anew while it is looked for."""
    for _ in range(500):
        box = await part.bounding_box()
        if box is not None:
            return box
        await asyncio.sleep(0.02)
    raise AssertionError(f"{part} is not drawn")
