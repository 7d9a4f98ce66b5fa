"""Open documents: the journal, saving, the folder's files, and the router to them, without a browser."""

from __future__ import annotations

import asyncio
import gc
import json
import os
import resource
import time
from contextlib import contextmanager
from string import Formatter

import pytest
from fastapi import FastAPI
from starlette.websockets import WebSocketDisconnect

from framerunner.editing import words
from framerunner.editing.documents.document_messages import catalogue_message, document_message
from framerunner.editing.documents.open_document import OpenDocument, SaveRefusedError
from framerunner.editing.documents.router import DocumentsRouter
from framerunner.editing.documents.session import EditorSession, SessionError
from framerunner.editing.words import SaidError
from framerunner.monitor.access import Role, Visitor
from offboard.authoring import read_layout
from offboard.authoring.edit_texts import EditText
from offboard.authoring.edits import AddState
from offboard.chart.mission_texts import texts_of
from offboard.mission import MISSIONS, list_missions
from offboard.pilot import Pilot
from offboard.pilot_file import PilotFile
from tests.framerunner.editing.page_socket import ORGANISER, served

HOVER = "name: hover\ninitial: up\nstates:\n  up:\n    enter: [hover]\n    final: true  # ü 😀\n"
CRLF = HOVER.replace("\n", "\r\n").encode()


@pytest.fixture
def path(tmp_path):
    made = tmp_path / "hover.yaml"
    made.write_text(HOVER, encoding="utf-8")
    return made


def test_what_is_not_saved_is_found_again_after_a_kill(path):
    opened = OpenDocument.open(path)
    opened.apply(AddState(name="down"))
    opened.keep()
    again = OpenDocument.open(path)  # of another process: the first one was killed
    assert again.restored
    assert not again.is_saved
    assert again.document.text == opened.document.text
    assert path.read_text() == HOVER
    again.undo()
    assert again.is_saved
    again.keep()
    assert not OpenDocument.open(path).restored
    assert [each.name for each in path.parent.iterdir()] == ["hover.yaml"]


def test_saving_ends_the_journal_and_keeps_the_files_mode(path):
    path.chmod(0o640)
    opened = OpenDocument.open(path)
    opened.apply(AddState(name="down"))
    opened.keep()
    opened.save()
    assert opened.is_saved
    assert path.read_bytes() == opened.document.data
    assert path.stat().st_mode & 0o777 == 0o640
    assert not OpenDocument.open(path).restored
    assert [each.name for each in path.parent.iterdir()] == ["hover.yaml"]


@pytest.mark.parametrize("rest", [b"\xff\xfe not text", b"", HOVER.encode()])
def test_a_journal_that_says_nothing_is_no_obstacle(path, rest):
    opened = OpenDocument.open(path)
    opened.journal.write_bytes(rest)
    assert OpenDocument.open(path).document.text in (HOVER, rest.decode(errors="ignore"))


def test_a_file_that_another_program_changed_is_not_overwritten_unless_wanted(path):
    opened = OpenDocument.open(path)
    opened.apply(AddState(name="down"))
    path.write_text("name: other\n")
    with pytest.raises(SaveRefusedError, match=r"hover\.yaml was changed by another program"):
        opened.save()
    assert path.read_text() == "name: other\n"
    opened.save(force=True)
    assert path.read_bytes() == opened.document.data


def test_a_deleted_file_is_written_again_and_a_lost_folder_is_told(path):
    opened = OpenDocument.open(path)
    opened.apply(AddState(name="down"))
    path.unlink()
    opened.save()
    assert path.read_bytes() == opened.document.data
    path.unlink()
    path.parent.rmdir()
    opened.apply(AddState(name="other"))
    opened.keep()
    with pytest.raises(SaveRefusedError, match="cannot be written"):
        opened.save()


@pytest.mark.parametrize(
    "name", ["../x.yaml", "/etc/x.yaml", "a/b.yaml", ".hidden.yaml", "x.txt", "x.yaml\n", "", "\0.yaml"]
)
def test_pages_name_files_of_the_folder_and_no_others(tmp_path, name):
    folder = tmp_path / "missions"
    folder.mkdir()
    (tmp_path / "x.yaml").write_text(HOVER)
    with pytest.raises(SessionError, match="is no mission file of this folder"):
        asyncio.run(EditorSession(folder).open(name))


@pytest.mark.parametrize("name", ["../x", "X", "", "a b", "a" * 61, "x.yaml", "ü"])
def test_a_new_missions_name_is_one_word(tmp_path, name):
    with pytest.raises(SessionError, match="use small letters"):
        EditorSession(tmp_path).create(name, "empty")
    assert not list(tmp_path.iterdir())


def test_new_missions_are_made_from_an_empty_chart_an_example_or_a_copy(tmp_path):
    session = EditorSession(tmp_path / "new")
    assert session.files() == []
    assert [session.create(name, name) for name in ("empty", "example")] == ["empty.yaml", "example.yaml"]
    session.create("mine", "frame_challenge")
    shipped = (MISSIONS / "frame_challenge.yaml").read_text()
    copied = (session.folder / "mine.yaml").read_text()
    assert copied == shipped.replace("name: frame_challenge\n", "name: mine\n")
    for file in session.files():
        assert OpenDocument.open(session.folder / file).document.text
    with pytest.raises(SessionError, match="is there already"):
        session.create("mine", "empty")
    with pytest.raises(SessionError, match="unknown source"):
        session.create("other", "../x")


def test_a_link_to_a_mission_stays_a_link(path):
    link = path.with_name("link.yaml")
    link.symlink_to(path)
    opened = OpenDocument.open(link)
    opened.apply(AddState(name="down"))
    opened.save()
    assert link.is_symlink()
    assert path.read_bytes() == opened.document.data


def test_only_those_who_may_act_reach_the_documents(path):
    with served(path.parent, visitor=Visitor("Bo", Role.JUDGE)) as server:
        for answer in (
            server.http.get("/api/edit/files"),
            server.http.post("/api/edit/files", json={"name": "x", "source": "empty"}),
        ):
            assert answer.status_code == 403
        with pytest.raises(WebSocketDisconnect) as closed, server.window("hover.yaml"):
            pass
        assert closed.value.code == 4403
    assert [each.name for each in path.parent.iterdir()] == ["hover.yaml"]


@pytest.mark.parametrize("name", ["../x.yaml", "none.yaml", ".hover.yaml.unsaved"])
def test_a_file_that_is_not_there_closes_with_one_line(path, name):
    with served(path.parent) as server:
        with pytest.raises(WebSocketDisconnect) as closed, server.window(name):
            pass
        assert closed.value.code == 4403
        assert closed.value.reason
        assert "\n" not in closed.value.reason


@pytest.mark.parametrize(
    "message",
    [
        "no JSON",
        "[]",
        '{"kind": "run", "number": 1}',
        '{"kind": "edit", "number": -1, "edit": {}}',
        '{"kind": "save", "number": 1, "path": "/etc/passwd"}',
        '{"kind": "layout", "number": 1, "places": {"up": {"x": "left", "y": 0}}}',
        "[" * 100_000,
        '{"kind": "edit", "number": 1, "edit": ' + '{"a": ' * 100_000,
    ],
    ids=lambda message: message[:40],
)
def test_a_message_that_no_page_sends_closes_with_one_line(path, message):
    with served(path.parent) as server:
        with server.http.websocket_connect("/ws/edit?file=hover.yaml") as socket:
            socket.receive_json()
            socket.send_text(message)
            socket.receive_json()  # that no other window is there
            with pytest.raises(WebSocketDisconnect) as closed:
                socket.receive_json()
        assert closed.value.code == 4400
        assert closed.value.reason
        assert "\n" not in closed.value.reason
        with server.window("hover.yaml") as window:
            assert window.document["text"] == HOVER


async def test_a_page_that_was_closed_leaves_no_traceback(path, caplog):
    web = FastAPI()
    web.include_router(DocumentsRouter(EditorSession(path.parent)).router(lambda _: ORGANISER))
    came = iter([{"type": "websocket.connect"}])

    async def receive():
        for message in came:
            return message
        return await asyncio.Event().wait()  # the server has not heard yet that the page was closed

    async def send(message):
        if message["type"] == "websocket.send":
            raise OSError  # as uvicorn does

    scope = {"type": "websocket", "path": "/ws/edit", "query_string": b"file=hover.yaml", "headers": []}
    async with asyncio.timeout(10.0):
        await web(scope, receive, send)
    assert caplog.records == []


def test_a_refused_edit_changes_nothing_and_says_why_in_one_line(path):
    with served(path.parent) as server, server.window("hover.yaml") as window:
        for edit in (
            {"kind": "rename_state", "state": "up", "name": "Ü"},
            {"kind": "delete_state", "state": "nowhere"},
            {"kind": "replace_text", "start": 5, "end": 10_000, "text": ""},
            {"kind": "save"},
            {},
        ):
            refused = window.ask("edit", edit=edit)["refused"]
            assert refused
            assert "\n" not in refused
        assert window.ask("save")["saved"]
    assert path.read_text() == HOVER


@pytest.mark.parametrize("name", list_missions())
def test_opening_and_saving_changes_no_byte(tmp_path, name):
    shipped = (MISSIONS / f"{name}.yaml").read_bytes()
    (tmp_path / "copy.yaml").write_bytes(shipped)
    with served(tmp_path) as server, server.window("copy.yaml") as window:
        assert "refused" not in window.ask("save")
    assert (tmp_path / "copy.yaml").read_bytes() == shipped


def test_line_ends_and_wide_characters_survive_typing(path):
    path.write_bytes(CRLF)
    with served(path.parent) as server, server.window("hover.yaml") as window:
        text = window.document["text"]
        assert "\r" not in text
        at = len(text[: text.index("😀") + 1].encode("utf-16-le")) // 2
        answer = window.type(at, "😀\n    # more", revision=0)
        assert "refused" not in answer
        assert window.ask("save")["saved"]
        assert path.read_bytes() == CRLF.replace("😀".encode(), "😀😀\r\n    # more".encode())
        assert window.ask("undo")["changes"] == [
            {"start": at, "removed": len("😀\n    # more") + 1, "inserted": ""}
        ]
        window.ask("save")
    assert path.read_bytes() == CRLF


def test_two_windows_share_a_document(path):
    with served(path.parent) as server, server.window("hover.yaml") as one:
        with server.window("hover.yaml") as two:
            assert two.receive("status")["others"] == 1
            one.edit("add_state", name="down")
            changed = two.receive("changed")
            assert "down" in [node["id"] for node in changed["diagram"]["nodes"]]
            late = two.type(0, "# late\n", revision=0)
            assert "another window" in late["refused"]
            assert "down:" in late["text"]
            assert "late" not in late["text"]
            assert "refused" not in two.type(0, "# now\n", revision=late["revision"])
            assert one.receive("changed")["changes"][0]["inserted"] == "# now\n"
        while one.receive("status").get("others") != 0:
            pass


def test_typed_letters_are_undone_together_a_line_at_most(path):
    opened = OpenDocument.open(path)
    end = len(HOVER.encode("utf-16-le")) // 2
    for letter in "# ab\n# c":
        opened.type([(end, 0, letter)])
        end += 1
    opened.type([(0, 0, "#")])
    texts = []
    while opened.session.can_undo:
        opened.undo()
        texts.append(opened.document.text)
    assert texts == [HOVER + "# ab\n# c", HOVER + "# ab\n", HOVER + "# ab", HOVER]


def test_deleted_letters_are_undone_together(path):
    opened = OpenDocument.open(path)
    end = HOVER.index("\n")
    for number in range(5):  # backwards
        opened.type([(end - number - 1, 1, "")])
    for _ in range(3):  # forwards
        opened.type([(0, 1, "")])
    opened.undo()
    assert opened.document.text == HOVER.replace("hover", "", 1)
    opened.undo()
    assert opened.document.text == HOVER


def test_a_move_of_boxes_is_undone_in_the_side_file_and_told_to_all_windows(path):
    side = path.with_name("hover.layout.json")
    with (
        served(path.parent) as server,
        server.window("hover.yaml") as one,
        server.window("hover.yaml") as two,
    ):
        assert not one.ask("layout", places={"up": {"x": 1, "y": 1}}, settled=True)["can_undo"]
        one.type(0, "#", revision=0)
        one.ask("layout", places={"up": {"x": 2, "y": 2}})
        assert read_layout(path).states["up"].x == 2
        undone = one.ask("undo")
        assert undone["layout"] == {"up": {"x": 1, "y": 1}}
        assert undone["can_undo"]  # the typed letter
        assert read_layout(path).states["up"].x == 1
        while two.receive("status").get("layout") != {"up": {"x": 1, "y": 1}}:
            pass
        assert one.ask("redo")["layout"] == {"up": {"x": 2, "y": 2}}
        assert one.ask("undo")["layout"] == {"up": {"x": 1, "y": 1}}
        assert one.ask("undo")["changes"] == [{"start": 0, "removed": 1, "inserted": ""}]
        assert not one.ask("layout", places={"gone": {"x": 1, "y": 1}}, settled=True)["can_undo"]
    assert list(read_layout(path).states) == ["up"]
    assert side.exists()


def test_a_page_that_left_finds_its_text_again(path):
    with served(path.parent) as server:
        with server.window("hover.yaml") as window:
            window.edit("add_state", name="down")
        with server.window("hover.yaml") as window:
            assert "down:" in window.document["text"]
            assert window.document["restored"]
            assert not window.document["saved"]


def test_typed_changes_of_which_one_is_impossible_are_refused_together(path):
    with served(path.parent) as server, server.window("hover.yaml") as window:
        changes = [{"start": at, "removed": 0, "inserted": "#"} for at in (0, 10**6)]
        answer = window.ask("type", revision=0, changes=changes)
        assert answer["refused"]
        assert answer["text"] == HOVER
        assert answer["saved"]


BOMB = "a: &a [x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"{name}: &{name} [{', '.join([f'*{before}'] * 9)}]\n"
    for before, name in zip("abcdefgh", "bcdefghi", strict=True)
)
HOSTILE = {
    "alias bomb": BOMB + "name: x\nstates: *i\n",
    "merge bomb": BOMB + "name: x\n<<: *i\n",
    "deep brackets": "name: x\nstates: " + "[" * 100_000,
    "deep braces": "name: x\nstates: " + "{a: " * 100_000 + "}" * 100_000,
    "deep lines": "\n".join(" " * depth + "a:" for depth in range(1200)),
    "many states": "name: x\nstates:\n" + "".join(f"  s{i}: {{to: s{i}}}\n" for i in range(1_500)),
    "python object": "name: !!python/object/apply:os.system ['touch hacked']\nstates: {}\n",
    "huge": "#" * 1_100_000,
    "one long line": "name: " + "x " * 400_000,
    "long expression": HOVER + "    during: [" + "cmd.vel_z = 1" + " + 1" * 200_000 + "]\n",
    "deep expression": HOVER + "    during: ['cmd.vel_z = " + "(" * 100_000 + "1" + ")" * 100_000 + "']\n",
    "unsafe call": HOVER + "    during: [\"cmd.vel_z = __import__('os').system('touch hacked')\"]\n",
    "unsafe attribute": HOVER + "    during: ['cmd.vel_z = imu.__class__.__mro__[1].__subclasses__()']\n",
    "power": HOVER + "    during: ['cmd.vel_z = 9**9**9**9']\n",
    "colours": HOVER + "    during: ['cmd.vel_z = \"a\" * 10**10']\n",
}


@pytest.mark.parametrize("hostile", HOSTILE)
def test_hostile_text_is_answered_within_a_second_and_does_nothing(path, hostile, monkeypatch):
    monkeypatch.chdir(path.parent)
    with served(path.parent) as server, server.window("hover.yaml") as window:
        began_s = time.process_time()
        answer = window.type(0, HOSTILE[hostile], revision=0, removed=len(HOVER) + 1)
        took_s = time.process_time() - began_s
        problems = [each for each in answer.get("findings", []) if each["severity"] == "error"]
        assert answer.get("refused") or problems, answer
        assert took_s < 1.0
        assert len(str(problems)) < 100_000
        with server.window("hover.yaml") as other:  # the server lives
            assert "refused" not in other.ask("undo") or answer.get("refused")
    assert not list(path.parent.glob("hacked*"))


@contextmanager
def no_space():
    """Files cannot grow beyond some bytes, as on a full disk."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (10, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def test_on_a_full_disk_nothing_is_lost_and_it_is_told_in_one_line(path):
    opened = OpenDocument.open(path)
    opened.apply(AddState(name="down"))
    assert opened.keep() is None
    journal = opened.journal.read_bytes()
    opened.apply(AddState(name="other"))
    with no_space():
        assert opened.keep().code == "journal.not_written"
        assert opened.keep() is None  # told once
        with pytest.raises(SaveRefusedError, match=r"cannot be written .*; .* save again"):
            opened.save()
    assert path.read_text() == HOVER
    assert opened.journal.read_bytes() == journal  # the last that fitted
    assert sorted(each.name for each in path.parent.iterdir()) == [opened.journal.name, path.name]
    assert opened.keep() is None
    assert opened.journal.read_bytes() == opened.document.data
    opened.save()
    assert path.read_bytes() == opened.document.data


def test_a_mission_that_cannot_be_written_is_not_half_made(tmp_path):
    with no_space(), pytest.raises(SessionError, match="cannot be written"):
        EditorSession(tmp_path).create("mine", "frame_challenge")
    assert not list(tmp_path.iterdir())


def test_a_full_disk_is_told_to_the_page_in_its_language(path):
    with served(path.parent) as server, server.window("hover.yaml", "&language=es") as window:
        window.edit("add_state", name="down")
        with no_space():
            refused = window.ask("save")
        assert refused["refused"].startswith("hover.yaml: no se puede escribir")
        assert refused["code"] == "session.not_written"
        refused = window.edit("delete_state", state="nowhere")["refused"]
        assert refused == "no hay ningún estado 'nowhere' en este documento"


def test_what_a_lost_connection_took_can_be_sent_again_and_is_done_once(path):
    with served(path.parent) as server:
        with server.window("hover.yaml", "&client=me") as window:
            session = window.document["session"]
            window.edit("add_state", name="down")
        with server.window("hover.yaml", "&client=me") as window:
            assert (window.document["answered"], window.document["revision"]) == (1, 1)
            assert window.document["session"] == session
            assert not window.document["restored"]
            window.edit("add_state", name="other")  # has the number 1 again: it was done already
            assert window.ask("undo")["can_redo"]  # the history is kept, too
            assert window.ask("save")["saved"]
    assert path.read_text() == HOVER


def test_a_file_that_changed_while_nobody_had_it_open_is_read_again(path):
    with served(path.parent) as server:
        with server.window("hover.yaml"):
            pass
        path.write_text("name: other\n")
        with server.window("hover.yaml") as window:
            assert window.document["text"] == "name: other\n"


def test_every_text_of_the_server_is_in_both_languages():
    for table in (words.Said.table, EditText.table):
        for code, text in texts_of(table).items():
            assert set(text) == {"en", "es"}, code
            english, spanish = ({part[1] for part in Formatter().parse(text[each])} for each in ("en", "es"))
            assert english == spanish, code


PILOT = """
from offboard.pilot import Pilot
class Mine(Pilot):
    @property
    def my_answer(self) -> float:
        "The answer."
        return 42.0
"""


def test_a_contestants_names_are_offered_and_checked(path):
    kind = PilotFile("mine.py", PILOT).pilot_class()
    path.write_text(HOVER.replace("final: true", "transitions: [{when: my_answer > 1, to: up}]"))
    for pilot_class, errors in ((kind, 0), (Pilot, 1)):
        opened = OpenDocument.open(path, pilot_class)
        values = [each.name for each in catalogue_message(opened).values]
        assert ("my_answer" in values) is (pilot_class is kind)
        found = [each.code for each in document_message(opened)["findings"]]
        assert found.count("name.unknown") == errors


def test_a_message_of_many_changes_takes_linear_time(tmp_path):
    text = HOVER + "".join(f"# é {line}\n" for line in range(20_000))
    (tmp_path / "long.yaml").write_text(text)
    changes = [{"start": number, "removed": 0, "inserted": "#"} for number in range(5500)]
    with served(tmp_path) as server, server.window("long.yaml") as window:
        started_s = time.process_time()
        answer = window.ask("type", revision=0, changes=changes)
        assert "refused" not in answer
        assert time.process_time() - started_s < 4.0  # it was more than a minute
        assert not window.ask("undo")["can_undo"]  # one step


def test_a_pipe_stops_nothing_and_is_refused(tmp_path):
    os.mkfifo(tmp_path / "pipe.yaml")
    os.mkfifo(tmp_path / "hover.layout.json")
    os.mkfifo(tmp_path / ".hover.yaml.unsaved")
    (tmp_path / "hover.yaml").write_text(HOVER)
    with served(tmp_path) as server:
        assert server.http.get("/api/edit/files").json()["files"] == ["hover.yaml"]
        with pytest.raises(WebSocketDisconnect) as refused, server.window("pipe.yaml"):
            pass
        assert "it is no regular file" in refused.value.reason
        with server.window("hover.yaml") as window:
            assert "hover.layout.json: cannot be read: it is no regular file" in window.document["problem"]
            window.type(0, "#", revision=0)
            assert "refused" not in window.ask("save")


def test_links_lead_to_files_of_the_folder_only(tmp_path):
    folder = tmp_path / "missions"
    folder.mkdir()
    outside = tmp_path / "secret.yaml"
    outside.write_text("name: secret")
    (folder / "secret.yaml").symlink_to(outside)
    (folder / "hover.yaml").write_text(HOVER)
    (folder / "again.yaml").symlink_to("hover.yaml")
    (folder / ".hover.yaml.unsaved").symlink_to(outside)
    (folder / ".hover.yaml.part").symlink_to(outside)
    (folder / "hover.layout.json").symlink_to(tmp_path / "new.json")
    with served(folder) as server:
        assert server.http.get("/api/edit/files").json()["files"] == ["again.yaml", "hover.yaml"]
        with pytest.raises(WebSocketDisconnect) as refused, server.window("secret.yaml"):
            pass
        assert "leads out of this folder" in refused.value.reason
        with server.window("again.yaml") as window:
            assert window.document["text"] == HOVER
        with server.window("hover.yaml") as window:
            assert window.document["text"] == HOVER  # and not what the journal's link leads to
            assert "leads out" in window.ask("layout", places={"up": {"x": 1, "y": 1}})["refused"]
            window.type(0, "#", revision=0)
            window.ask("save")
    assert outside.read_text() == "name: secret"
    assert (folder / "hover.yaml").read_text() == "#" + HOVER
    assert not (tmp_path / "new.json").exists()


def test_a_pupil_sees_and_changes_own_files_only_until_the_log_in_ends(tmp_path):
    for name in ("lesson_1_ada.yaml", "lesson_1_bo.yaml", "hover.yaml"):
        (tmp_path / name).write_text(HOVER)
    visitors = [Visitor("Ada", Role.PUPIL, "ada")]
    with served(tmp_path, visitor=lambda: visitors[-1]) as server:
        assert server.http.get("/api/edit/files").json()["files"] == ["lesson_1_ada.yaml"]
        made = server.http.post("/api/edit/files", json={"name": "mine", "source": "empty"}).json()
        assert made == {"file": "mine-ada.yaml"}
        for name in ("lesson_1_bo.yaml", "hover.yaml"):
            export = server.http.get("/api/edit/export", params={"file": name, "kind": "scxml"})
            assert (export.status_code, "not yours" in export.json()["detail"]) == (403, True)
            with pytest.raises(WebSocketDisconnect) as refused, server.window(name):
                pass
            assert (refused.value.code, "not yours" in refused.value.reason) == (4403, True)
        with server.window("lesson_1_ada.yaml") as window:
            window.type(0, "#", revision=0)
            visitors.append(Visitor())
            with pytest.raises(WebSocketDisconnect) as refused:
                window.ask("save")
            assert refused.value.code == 4403
    assert (tmp_path / "lesson_1_ada.yaml").read_text() == HOVER


def test_a_pupil_reads_no_others_mission_by_extending_it(tmp_path):
    (tmp_path / "lesson_1_bo.yaml").write_text(HOVER.replace("up", "veiled"))
    (tmp_path / "lesson_1_ada.yaml").write_text("name: mine\nextends: lesson_1_bo.yaml\n")
    teacher, ada = Visitor("Teacher", Role.ORGANISER), Visitor("Ada", Role.PUPIL, "ada")
    visitors, told = [], []
    with served(tmp_path, visitor=lambda: visitors[-1]) as server:
        for visitor in (teacher, ada):
            visitors.append(visitor)
            params = {"file": "lesson_1_ada.yaml", "kind": "scxml"}
            export = server.http.get("/api/edit/export", params=params).text
            with server.window("lesson_1_ada.yaml") as window:
                told.append(export + json.dumps(window.document))
    assert ["veiled" in each for each in told] == [True, False]
    assert "here a mission extends one of the package" in told[1]


async def test_names_that_are_asked_for_take_no_memory(tmp_path):
    def locks():
        gc.collect()
        return sum(isinstance(each, asyncio.Lock) for each in gc.get_objects())

    session, before = EditorSession(tmp_path), locks()
    for number in range(20):
        with pytest.raises(SaidError):
            await session.open(f"none-{number}.yaml")
    assert locks() < before + 20
