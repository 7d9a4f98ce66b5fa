"""Labelling pictures: the page in a real browser, and what is written."""

import asyncio
import contextlib
import json
import re
from math import hypot

import cv2
import pytest
from playwright.async_api import expect

from framerunner.cli import run
from framerunner.commands.vision import LabelOptions, _label_head
from framerunner.vision_evaluation.camera_chain import CameraChain
from framerunner.vision_evaluation.label_page import serve_labels
from framerunner.vision_evaluation.label_session import LabelSession
from framerunner.vision_evaluation.labelled_images import labelled_images
from framerunner.vision_evaluation.own_pictures import OwnPictures
from scenarios.random_scenarios import load_level
from tests.chromium import Complaints, chromium

PATIENCE_MS = 30_000


@pytest.fixture
def pictures(tmp_path):
    """A folder with two pictures, and the gate of the first one, near and wholly in view."""
    chosen = (
        (one, gate)
        for one in labelled_images(load_level("calm"), 60, 31, CameraChain())
        for gate in one.gates
        if gate.whole and 1 < gate.distance_m < 2 and gate.angle_deg < 40 and gate.colour == "blue"
    )
    one, gate = next(chosen)
    cv2.imwrite(str(tmp_path / "a.png"), one.image)
    cv2.imwrite(str(tmp_path / "b.png"), one.image[:, ::-1])
    return tmp_path, one, gate


@contextlib.asynccontextmanager
async def opened(session):
    """The page, served; it must complain of nothing."""
    address = asyncio.get_running_loop().create_future()
    serving = asyncio.create_task(serve_labels(session, 0, address.set_result))
    async with chromium() as browser:
        page = await browser.new_page(viewport={"width": 1366, "height": 768})
        page.set_default_timeout(PATIENCE_MS)
        complaints = Complaints(page)
        await page.goto(await address)
        await page.wait_for_selector("#label[data-ready]")
        yield page
        assert complaints == []
    serving.cancel()
    await asyncio.gather(serving, return_exceptions=True)


async def on_canvas(page, place, picture):
    """Where on the screen a column and row of a picture are."""
    box = await page.locator("canvas").bounding_box()
    scale = box["width"] / picture.shape[1]
    return (box["x"] + (place[0] + 0.5) * scale, box["y"] + (place[1] + 0.5) * scale)


@pytest.mark.asyncio
async def test_four_clicks_label_a_frame_and_its_pose_is_shown(pictures):
    folder, one, gate = pictures
    session = LabelSession(folder, _label_head(folder, LabelOptions(focal_px=one.focal_px)))
    middle = (one.calibration.cx_px, one.calibration.cy_px)
    corners = [(x + middle[0], y + middle[1]) for x, y in gate.corners_px]
    async with opened(session) as page:
        await page.select_option(".l-bar select", "blue")
        for number in (2, 0, 3, 1):  # in any order
            await page.mouse.click(*await on_canvas(page, corners[number], one.image))
        pose = page.locator(".l-pose")
        await expect(pose).to_have_text(re.compile(rf"^{gate.distance_m:.1f}\d m away"), timeout=PATIENCE_MS)
        (written,) = OwnPictures.of_folder(folder).images()
        (label,) = written.gates
        assert (label.colour, label.whole) == ("blue", True)
        assert label.distance_m == pytest.approx(gate.distance_m, rel=0.02)
        off_px = [
            hypot(a - c, b - d) for (a, b), (c, d) in zip(label.corners_px, gate.corners_px, strict=True)
        ]
        assert max(off_px) < 0.7  # of a click, which has whole pixels of the screen

        before = await pose.text_content()
        await page.mouse.move(*await on_canvas(page, corners[0], one.image))
        await page.mouse.down()
        await page.mouse.move(*await on_canvas(page, (corners[0][0] - 9, corners[0][1] - 9), one.image))
        await page.mouse.up()
        await expect(pose).not_to_have_text(before, timeout=PATIENCE_MS)
        (moved,) = next(OwnPictures.of_folder(folder).images()).gates
        assert moved.corners_px[0][0] == pytest.approx(gate.corners_px[0][0] - 9, abs=0.7)

        await page.get_by_role("button", name="Next", exact=True).click()
        await page.get_by_role("button", name="No frame in this picture").click()
        await expect(page.locator(".l-list [aria-current]")).to_have_text("b.png (0)", timeout=PATIENCE_MS)
        await page.keyboard.press("r")
        for place in ((50, 50), (60, 50), (70, 50), (80, 50)):  # of no frame
            await page.mouse.click(*await on_canvas(page, place, one.image))
        await expect(pose).to_contain_text("Not written", timeout=PATIENCE_MS)
        await page.reload()
        await page.wait_for_selector("#label[data-ready]")
        await expect(page.locator(".l-list button")).to_have_text(["a.png (1)", "b.png (0)"])
        await expect(pose).to_contain_text("m away")
    labels = json.loads((folder / "labels.json").read_text())
    assert [len(picture["frames"]) for picture in labels["images"]] == [1, 0]


def test_labels_that_were_begun_are_gone_on_with(pictures):
    folder, one, _ = pictures
    options = LabelOptions(focal_px=one.focal_px, corners_of="opening")
    session = LabelSession(folder, _label_head(folder, options))
    assert session.gates(0) is None
    session.keep(1, ())
    again = LabelSession(folder, None)
    assert (again.gates(0), again.gates(1)) == (None, ())
    assert again.head.labels.corners_of == "opening"


def test_what_the_camera_is_is_said_once(pictures, capsys):
    folder, one, _ = pictures
    assert run(["vision", "label", str(folder), "--no-browser"]) == 2
    assert "--calibration or --focal-px" in capsys.readouterr().err
    LabelSession(folder, _label_head(folder, LabelOptions(focal_px=one.focal_px))).keep(0, ())
    assert run(["vision", "label", str(folder), "--focal-px", "100", "--no-browser"]) == 2
    assert "leave out the options" in capsys.readouterr().err
