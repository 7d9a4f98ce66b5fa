"""The contest over HTTP: who may do what, and how bad requests are answered."""

import asyncio
import csv
import io
import json
import re

import pytest

from tests.framerunner.monitor.competition.harness import contest, event

POSTS = {
    "teams": {"name": "Falken"},
    "teams/1": {"members": "Ann"},
    "next": {"team": 1},
    "next/undo": {"call": 1},
    "queue": {"seen": 0, "teams": [1]},
    "draw": {"pool": ["case-1", "case-2", "case-3"]},
    "pool": {"scenario": "case-9"},
    "settings": {"limit_s": 180.0, "missing_frame_s": 60.0, "scenarios": 3, "counting": "best"},
    "tries/1/judgement": {"seen": 0, "contacts": 3},
    "tries/1/team": {"seen": 0, "team": 1},
}


JUDGING, LAST = ("tries/1/judgement", "tries/1/team"), ("tries/1/team",)


@pytest.fixture
async def running(tmp_path, monkeypatch):
    async with contest(f"sqlite:///{tmp_path}/contest.db", monkeypatch) as running:
        yield running


async def test_a_viewer_may_read_everything_and_change_nothing(running):
    await running.log_in()
    team = (await running.post("teams", {"name": "Falken"}))[1]["team"]
    await running.fly("k", team)
    await running.http.post("/logout")
    before = (await running.get("state"))[1]
    for path in ("state", "teams", "tries", "tries/1", "ranking", "ranking.csv", "tries.csv"):
        assert (await running.get(path))[0] == 200
    for path, form in POSTS.items():
        status, answer = await running.post(path, form)
        who = "judges and organisers" if path in JUDGING else "organisers"
        assert (status, answer) == (403, {"detail": f"only {who} may do this; log in at /login"}), path
        assert (await running.post(path, None, data=b"rubbish"))[0] == 403, path
    assert (await running.get("state"))[1] == before


async def test_a_judge_corrects_tries_and_organises_nothing(running):
    await running.log_in()
    await running.post("teams", {"name": "Falken"})
    await running.fly("k", 1)
    judge = await running.judge("Bob")
    for path, form in POSTS.items():
        status, answer = await running.post(path, {**form, "seen": int(path in LAST)}, session=judge)
        assert status == (200 if path in JUDGING else 403), (path, answer)
    await judge.close()


async def test_an_organiser_may_do_all_of_it(running):
    await running.log_in("Ada")
    await running.post("teams", {"name": "Falken"})
    await running.fly("k", 1)
    call = {"call": 3}  # after that of the try and its end
    forms = {**POSTS, "teams": {"name": "Adler"}, "next/undo": call, "tries/1/team": {"seen": 1, "team": 1}}
    for path, form in forms.items():
        status, answer = await running.post(path, form)
        assert status == 200, (path, answer)
    status, detail = await running.get("tries/1")
    assert [entry["who"] for entry in detail["history"]] == ["Ada", "Ada"]
    assert detail["try"]["result"]["contacts"] == 3 and detail["correction"]["contacts"] == 3


async def test_other_sites_cannot_use_a_judges_cookie(running):
    await running.log_in()
    body = json.dumps({"name": "Evil"}).encode()
    for headers in (
        {"Content-Type": "application/json", "Origin": "http://evil.example"},
        {"Content-Type": "text/plain"},
        {"Content-Type": "application/x-www-form-urlencoded"},
        {"Content-Type": "application/json", "Sec-Fetch-Site": "cross-site"},
    ):
        status, _ = await running.post("teams", None, data=body, headers=headers)
        assert status in (403, 415), headers
    assert (await running.get("teams"))[1] == []


BAD = [
    ("teams", {"name": ""}, 'name "" shows nothing; give 1 to 60'),
    ("teams", {"name": "x" * 61}, "61 characters; use 60"),
    ("teams", {"name": "a\u0000b"}, "control characters"),
    ("teams", {"name": "\ud800"}, "JSON"),
    ("teams", {"name": 7}, 'name "7" cannot be taken; give 1 to 60 characters'),
    ("teams", {}, "name is missing; give 1 to 60"),
    ("teams", {"name": "A", "members": "x" * 301}, "members .* 301 characters; use 300"),
    ("teams", {"name": "A", "<b>": 1}, '"<b>" is not a field; known are name, members'),
    ("teams", [1, 2], "is not an object"),
    ("next", {"team": 1.5}, 'team "1.5" cannot be taken'),
    ("next", {"team": 2**40}, "team .* cannot be taken"),
    ("next", {"team": True}, "team"),
    ("next", {"team": None, "scenario": "../../etc/passwd"}, "is no name"),
    ("next", {"team": None, "scenario": "nowhere"}, "unknown; choose one"),
    ("next/undo", {}, "call is missing; give the id of the last call"),
    ("queue", {"teams": []}, "seen is missing; .*queue's `number`"),
    ("queue", {"seen": 0, "teams": ["x"]}, "teams .* numbers of teams"),
    ("queue", {"seen": 0, "teams": [1] * 501}, "teams .* at most 500"),
    ("queue", {"seen": 0, "teams": [], "shuffle": 1}, "shuffle"),
    ("draw", {"pool": []}, "pool .* give a list of 1 to 200"),
    ("draw", {"pool": ["case-1"] * 201}, "pool"),
    ("draw", {"pool": ["case-1"], "count": 0}, 'count "0" cannot be taken; give a whole number from 1 to 10'),
    ("draw", {"pool": ["case-1"], "count": 2}, "count 2 is more than the 1"),
    ("draw", {"pool": ["x" * 81]}, "pool"),
    ("pool", {"scenario": "nowhere"}, "unknown; choose one of the list, LEVEL-SEED"),
    ("pool", {"scenario": "../my.yaml"}, "is no name"),
    ("pool", {"scenario": "two-1"}, "cannot be drawn: it has only the red and the green frame"),
    ("settings", {"limit_s": 0, "missing_frame_s": 1, "scenarios": 3, "counting": "best"}, 'limit_s "0'),
    (
        "settings",
        {"limit_s": 1, "missing_frame_s": 1, "scenarios": 3, "counting": "worst"},
        '"best" or "last"',
    ),
    ("settings", {"limit_s": 1, "missing_frame_s": 1, "scenarios": 11, "counting": "best"}, "scenarios"),
    ("tries/1/judgement", {"contacts": 1}, "seen is missing"),
    ("tries/1/judgement", {"seen": 0, "contacts": -1}, 'contacts "-1" .* from 0 to 1000'),
    ("tries/1/judgement", {"seen": 0, "contacts": "2"}, 'contacts "2" cannot'),
    ("tries/1/judgement", {"seen": 0, "penalty_s": -0.5}, "penalty_s"),
    ("tries/1/judgement", {"seen": 0, "try_time_s": 1e9}, "try_time_s"),
    ("tries/1/judgement", {"seen": 0, "crossed": ["mauve"]}, "crossed"),
    ("tries/1/judgement", {"seen": 0, "completed": "yes"}, "completed"),
    ("tries/1/judgement", {"seen": 0, "remarks": "x" * 1001}, "1001 characters; use 1000"),
    ("tries/1/team", {"seen": 0, "team": 0}, "team"),
]


async def test_bad_input_is_refused_in_one_line(running):
    await running.log_in()
    await running.fly("k")
    before = (await running.get("state"))[1]
    for path, form, words in BAD:
        status, answer = await running.post(path, form)
        assert status == 422, (form, answer)
        assert len(answer["detail"].splitlines()) == 1 and len(answer["detail"]) < 300
        assert re.search(words, answer["detail"]), answer["detail"]
    assert (await running.get("state"))[1] == before


async def test_what_is_no_json_is_refused(running):
    await running.log_in()
    nested = [b"[" * 50_000, b'{"a":' * 9000]
    for body in (b"", b"{", b"null", b"\xff\xfe", b'{"name": NaN}', b'{"name": 1e999}', *nested):
        headers = {"Content-Type": "application/json"}
        status, answer = await running.post("teams", None, data=body, headers=headers)
        assert status == 422 and len(answer["detail"].splitlines()) == 1, body[:20]


async def test_large_bodies_are_refused(running):
    await running.log_in()
    for size in (70_000, 2_000_000):
        body = json.dumps({"name": "x" * size}).encode()
        status, _ = await running.post("teams", None, data=body, headers={"Content-Type": "application/json"})
        assert status == 413


async def test_what_does_not_exist_is_404(running):
    await running.log_in()
    for path in (
        "tries/99",
        "tries/0",
        "tries/abc",
        "tries/-1",
        "tries/99999999999999999999",
        "ranking?round=7",
    ):
        status, answer = await running.get(path)
        assert status == 404 and len(answer["detail"].splitlines()) == 1, path
    for path in ("tries/99/judgement", "tries/x/judgement", "tries/99/team"):
        assert (await running.post(path, {"seen": 0, **({"team": 1} if path.endswith("team") else {})}))[
            0
        ] == 404
    assert (await running.post("teams/99", {"members": ""}))[0] == 404
    assert (await running.post("next", {"team": 99}))[0] == 404


async def test_viewers_see_who_is_called_and_the_queue(running):
    await running.log_in()
    teams = [(await running.post("teams", {"name": name}))[1]["team"] for name in ("A", "B", "C")]
    assert (await running.post("queue", {"seen": 0, "teams": teams, "shuffle": True}))[0] == 200
    await running.http.post("/logout")
    state, ranking = (await running.get("state"))[1], (await running.get("ranking"))[1]
    queue = state["board"]["queue"]
    assert sorted(each["team"] for each in queue["teams"]) == teams and ranking["queue"] == queue
    await running.log_in()
    assert (await running.post("queue", {"seen": 0, "teams": []}))[0] == 409
    first = queue["teams"][0]["team"]
    await running.post("next", {"team": first})
    running.fleet.tell(event("began", "k", time_s=0.0))
    ranking = await running.until("ranking", lambda state: state["running"])
    assert ranking["called"]["team"] == ranking["running"][0]["team"] == first
    assert ranking["called"]["try"] == 1 and len(ranking["queue"]["teams"]) == 2
    call = (await running.get("state"))[1]["board"]["last_call"]
    assert call["tries"] == [1]
    assert (await running.post("next/undo", {"call": call["id"]}))[0] == 200
    assert (await running.post("next/undo", {"call": call["id"]}))[0] == 409
    assert (await running.get("tries/1"))[1]["try"]["team"] is None


async def test_the_first_of_two_requests_wins(running):
    await running.log_in("Ada")
    bob = await running.judge("Bob")
    await running.fly("k")
    answers = await asyncio.gather(
        running.post("tries/1/judgement", {"seen": 0, "contacts": 1}),
        running.post("tries/1/judgement", {"seen": 0, "contacts": 2}, session=bob),
    )
    await bob.close()
    assert sorted(status for status, _ in answers) == [200, 409]
    assert "another judge" in next(answer for status, answer in answers if status == 409)["detail"]
    history = (await running.get("tries/1"))[1]["history"]
    assert len(history) == 1


async def test_pages_get_changes_and_a_running_try(running):
    await running.log_in()
    async with running.http.ws_connect("/ws/competition") as socket:
        first = [await socket.receive_json(timeout=5) for _ in range(2)]
        assert [message["kind"] for message in first] == ["changed", "running"]
        await running.post("teams", {"name": "Falken"})
        version = first[0]["version"]
        while (message := await socket.receive_json(timeout=5))["kind"] != "changed":
            pass
        assert message["version"] > version
        running.fleet.tell(event("began", "k", time_s=0.0))
        running.fleet.tell(event("running", "k", time_s=7.5))
        while not (
            message["kind"] == "running" and message["tries"] and message["tries"][0]["try_time_s"] == 7.5
        ):
            message = await socket.receive_json(timeout=5)


async def test_the_exports_are_csv_in_utf8(running):
    await running.log_in()
    team = (await running.post("teams", {"name": "=Ñandú 🚁"}))[1]["team"]
    await running.fly("k", team)
    for path in ("ranking.csv", "tries.csv"):
        async with running.http.get(f"/api/competition/{path}") as answer:
            assert answer.headers["Content-Type"] == "text/csv; charset=utf-8"
            assert f'filename="{path}"' in answer.headers["Content-Disposition"]
            rows = list(csv.DictReader(io.StringIO((await answer.read()).decode())))
            assert [row["team"] for row in rows] == ["'=Ñandú 🚁"]


async def test_a_later_round_and_the_one_before(running):
    await running.log_in()
    team = (await running.post("teams", {"name": "Falken"}))[1]["team"]
    assert (await running.post("draw", {"pool": ["case-1"], "count": 1}))[1] == {"round": 1}
    await running.fly("k", team)
    assert (await running.post("draw", {"pool": ["case-2"], "count": 1}))[1] == {"round": 2}
    now, before = (await running.get("ranking"))[1], (await running.get("ranking?round=1"))[1]
    assert now["rounds"] == before["rounds"] == [2, 1]
    assert now["ranking"]["scenarios"] == ["case-2", "", ""]
    assert before["ranking"]["rows"][0]["cells"][0] == {
        **{"scenario": "case-1", "counted_s": 40.0, "state": "completed", "try": 1, "missing": 0, "tries": 1}
    }
