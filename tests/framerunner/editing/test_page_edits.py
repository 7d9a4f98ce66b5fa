"""Missions and edits drawn at random, through the page's socket: bytes survive, edits stay local."""

from __future__ import annotations

from contextlib import suppress
from random import Random

import pytest

from offboard.authoring import Document
from tests.framerunner.editing.page_socket import served
from tests.offboard.authoring.oracle import check_lines
from tests.offboard.authoring.random_missions import random_edit, random_mission

GENERATED = 50
EDITS = 200
MISSIONS = 4  # on which the edits are made


def test_opening_and_saving_generated_missions_changes_no_byte(tmp_path):
    random = Random(15)
    texts = {f"m{number}.yaml": random_mission(random).encode() for number in range(GENERATED)}
    for name, data in texts.items():
        (tmp_path / name).write_bytes(data)
    assert sum(b"#" in data for data in texts.values()) > GENERATED // 2  # comments
    with served(tmp_path) as server:
        for name in texts:
            with server.window(name) as window:
                assert "refused" not in window.ask("save")
    assert {name: (tmp_path / name).read_bytes() for name in texts} == texts


@pytest.mark.parametrize("number", range(MISSIONS))
def test_edits_stay_in_their_lines_and_as_many_undos_give_the_first_bytes_back(tmp_path, number):
    random = Random(1500 + number)
    path = tmp_path / "drawn.yaml"
    data = random_mission(random).encode()
    path.write_bytes(data)
    document, done = Document.open(path), 0
    with served(tmp_path) as server, server.window(path.name) as window:
        for _ in range(20 * EDITS // MISSIONS):
            if done == EDITS // MISSIONS:
                break
            with suppress(IndexError, ValueError):  # nothing is left to edit in this way
                edit = random_edit(document, random, text=False)
                answer = window.ask("edit", edit=edit.model_dump(mode="json"))
                if "refused" in answer or not answer.get("changes"):
                    continue
                before, document = document, changed(document, answer["changes"])
                done += 1
                check_lines(before, edit, document)
        assert done == EDITS // MISSIONS
        for _ in range(done):
            assert "refused" not in window.ask("undo")
        assert not window.ask("save")["can_undo"]
    assert path.read_bytes() == data


def changed(document: Document, changes: list[dict]) -> Document:
    """A document after the changes that a page was told."""
    text = document.text
    for each in changes:
        units = text.encode("utf-16-le")
        start, end = 2 * each["start"], 2 * (each["start"] + each["removed"])
        text = (units[:start] + each["inserted"].encode("utf-16-le") + units[end:]).decode("utf-16-le")
    return Document.from_text(text, document.path)
