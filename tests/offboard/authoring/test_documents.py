"""Documents: opened and saved to the byte, whatever they hold; random edits and their undoing."""

from __future__ import annotations

import sys
from dataclasses import replace
from random import Random

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from offboard.authoring import Document, EditError, EditSession, check_document, diagram
from offboard.authoring.text import MissionText, Positions
from offboard.chart.problems import MissionError
from offboard.mission import MISSIONS, list_missions
from tests.offboard.authoring.oracle import check_lines, check_meaning
from tests.offboard.authoring.random_missions import random_edit, random_mission

SEEDS = st.integers(0, 2**32)
CAREFUL = settings(deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])


@pytest.mark.parametrize("name", list_missions())
def test_a_shipped_mission_is_saved_to_the_byte(tmp_path, name):
    data = (MISSIONS / f"{name}.yaml").read_bytes()
    for written in (data, data.replace(b"\n", b"\r\n"), data.rstrip(b"\n"), b"\xef\xbb\xbf" + data):
        path = tmp_path / "mission.yaml"
        path.write_bytes(written)
        document = Document.open(path)
        assert document.data == written
        assert document.unreadable is None


@settings(CAREFUL, max_examples=100)
@given(SEEDS)
def test_a_generated_mission_is_saved_to_the_byte(seed):
    data = random_mission(Random(seed)).encode()
    document = Document.from_bytes(data, "m.yaml")
    assert document.data == data
    assert document.unreadable is None
    assert diagram(document).nodes


@given(
    st.text(st.characters(exclude_characters="\0", codec="utf-8"), max_size=80)
    | st.text(alphabet="a: -\n\r\t#'\"{}[]&*!|>", max_size=80)
)
def test_any_text_is_a_document_and_is_saved_to_the_byte(text):
    document = Document.from_bytes(text.encode(), "m.yaml")
    assert document.data == text.encode()
    assert check_document(document)  # no mission: it says where and why
    diagram(document)


def test_what_is_no_text_is_refused_in_one_line(tmp_path):
    with pytest.raises(MissionError, match=r"m\.yaml: cannot be read: is UTF-16 text, or no text"):
        Document.from_bytes(b"\xff\xfe\x00", "m.yaml")
    with pytest.raises(MissionError, match=r"m\.yaml:2: cannot be read: is not UTF-8 text"):
        Document.from_bytes(b"name: a\n# \xe9", "m.yaml")
    with pytest.raises(MissionError, match="is larger than 1 MB"):
        Document.from_bytes(b"#" * 1_000_001, "m.yaml")
    with pytest.raises(MissionError, match=r"none\.yaml: cannot be read: No such file"):
        Document.open(tmp_path / "none.yaml")


@settings(CAREFUL, max_examples=25)
@given(SEEDS)
def test_an_edit_changes_what_it_says_and_no_line_outside(seed):
    random = Random(seed)
    session = EditSession(Document.from_bytes(random_mission(random).encode(), "m.yaml"))
    applied = 0
    for _ in range(15):
        before = session.document
        edit = random_edit(before, random, text=False)
        refused = ""
        try:
            session.apply(edit)
        except EditError as error:
            refused = str(error)
        if refused:
            assert "\n" not in refused
            assert session.document is before
            continue
        applied += 1
        check_meaning(before, edit, session.document)
        check_lines(before, edit, session.document)
    assert applied


def test_many_edits_and_as_many_undos_give_the_first_bytes():
    random = Random(0)
    data = random_mission(random).encode()
    session = EditSession(Document.from_bytes(data, "m.yaml"))
    count, states = 0, []
    while count < 60:
        try:
            changed = session.apply(random_edit(session.document, random, text=count % 20 == 19))
        except EditError:
            if session.document.unreadable is not None:  # typed text broke it
                session.undo()
                count -= 1
            continue
        count += bool(changed)
        states.append(session.document.data)
    last = session.document.data
    for _ in range(60):
        session.undo()
    assert session.document.data == data
    assert not session.can_undo
    for _ in range(60):
        session.redo()
    assert session.document.data == last
    with pytest.raises(EditError, match="nothing to do again"):
        session.redo()


@given(st.text(alphabet="ab\r\n😀\ufeff", max_size=30), st.data())
def test_a_change_and_its_inverse(written, data):
    text = MissionText.of(written)
    start = data.draw(st.integers(0, len(text.text)))
    end = data.draw(st.integers(start, len(text.text)))
    (change,) = text.changes([(start, end, data.draw(st.text(alphabet="x\r\n", max_size=5)))])
    changed = text.changed(change)
    assert len(changed.line_ends) == changed.text.count("\n")
    assert changed.changed(change.inverse) == text
    assert text.written == written


@given(st.text(alphabet="ab\r\n😀", max_size=30), st.data())
def test_typed_changes_are_one_change_that_keeps_the_line_ends_of_other_lines(written, data):
    text = one = MissionText.of(written)
    typed = []
    for _ in range(data.draw(st.integers(0, 6))):
        positions = Positions(one.text)
        start = data.draw(st.integers(0, len(one.text)))
        end = data.draw(st.integers(start, len(one.text)))
        new = data.draw(st.text(alphabet="x\r\n😀", max_size=5))
        first = positions.to_utf16(start)
        typed.append((first, positions.to_utf16(end) - first, new))
        (change,) = one.changes([(start, end, new)])
        # A line's usual end is that of the text before all that was typed.
        one = one.changed(replace(change, inserted_ends=(text.usual_end,) * change.inserted.count("\n")))
    change = text.typed(typed)
    assert text.changed(change) == one
    assert one.changed(change.inverse) == text


def test_many_parts_are_one_change():
    text = MissionText.of("a\r\nb\n" * 30)
    parts = [(4 * line, 4 * line + 1, "xy") for line in reversed(range(30))]
    (change,) = text.changes(parts)
    assert text.changed(change).written == "xy\r\nb\n" * 30


def test_what_is_kept_to_be_undone_is_limited(monkeypatch):
    monkeypatch.setattr(sys.modules["offboard.authoring.apply"], "_MAX_KEPT", 100)
    session = EditSession(Document.from_text(""))
    for number in range(50):
        session.type([(number * 10, 0, "0123456789")])
    for _ in range(10):
        session.undo()
    assert not session.can_undo
    assert len(session.document.text) == 400


def test_offsets_as_javascript_counts_them():
    positions = Positions("a😀b\nc")
    assert [positions.to_utf16(offset) for offset in range(6)] == [0, 1, 3, 4, 5, 6]
    assert [positions.line_column(offset) for offset in (0, 2, 4)] == [(1, 1), (1, 3), (2, 1)]
