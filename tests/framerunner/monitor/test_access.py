import json
from pathlib import Path

import pytest
from starlette.requests import HTTPConnection

from framerunner.monitor.access import (
    MAX_NAME_LENGTH,
    SESSION_S,
    Access,
    LoginRefusedError,
    Role,
    Secrets,
    SessionFile,
    Visitor,
    session_path,
)
from framerunner.monitor.visitors.login_limit import ALL_ADDRESSES, LONGEST_WAIT_S, ONE_ADDRESS, LoginLimit
from framerunner.monitor.visitors.pupils import PupilBook
from tests.framerunner.monitor.serving import browser, serving

SAMPLE = "tests.framerunner.monitor.sample_page"
PASSWORD = "correct horse"


class Clock:
    now_s = 0.0

    def __call__(self):
        return self.now_s

    async def wait(self, seconds):
        self.now_s += seconds


def connection(access, session_id):
    headers = [(b"cookie", f"{access.cookie}={session_id}".encode())]
    return HTTPConnection({"type": "http", "headers": headers})


def judges(**more):
    return Access(Secrets(judge=PASSWORD), **more)


async def test_a_password_opens_a_session_that_ends():
    clock = Clock()
    access = judges(clock=clock)
    session_id, _ = await access.log_in("Ada", PASSWORD, "10.0.0.1")
    judge = connection(access, session_id)
    assert access.visitor(judge) == Visitor("Ada", Role.JUDGE)
    clock.now_s = SESSION_S
    assert access.visitor(judge) == Visitor()


RIGHTS = ("may_learn", "may_fly", "may_judge", "may_organise", "may_teach")


@pytest.mark.parametrize(
    ("visitor", "rights"),
    [
        (Visitor(), ()),
        (Visitor("Ada", Role.PUPIL, "ada"), ("may_learn",)),
        (Visitor("Bo", Role.JUDGE), ("may_fly", "may_judge")),
        (Visitor("Cy", Role.ORGANISER), RIGHTS),
        (Visitor(role=Role.ORGANISER), ("may_learn", "may_fly", "may_teach")),  # this machine's user
    ],
)
def test_what_a_role_may_do(visitor, rights):
    assert tuple(right for right in RIGHTS if getattr(visitor, right)) == rights


def test_a_pupil_edits_own_files_only():
    pupil = Visitor("Ada", Role.PUPIL, "ada")
    assert all(pupil.may_edit(file) for file in ("lesson_1_ada.yaml", "mine-ada.yaml"))
    others = (
        "lesson_1_bo.yaml",
        "lesson_1_b_ada.yaml",
        "lesson_1_ada_b.yaml",
        "mine.yaml",
        "mine-b_ada.yaml",
    )
    assert not any(pupil.may_edit(file) for file in (*others, "x/lesson_1_ada.yaml", "", "a-b-ada.yaml"))


async def test_a_pupil_joins_with_the_class_s_word_and_goes_on_with_the_own_one(tmp_path):
    book = PupilBook(tmp_path / "class" / "pupils.json", "our class")
    access = Access(Secrets(class_code="our class"), pupils=book)
    _, ada = await access.log_in("Ada", "Our Class ", "10.0.0.1")
    _, other = await access.log_in("A-da!", "our class", "10.0.0.1")
    assert (ada.role, ada.key, other.name) == (Role.PUPIL, "ada", "A-da!")
    assert len({ada.key, other.key, (await access.log_in("ada!", "our class", "a"))[1].key}) == 3
    word = access.code_word(ada)
    with pytest.raises(
        LoginRefusedError, match=r"Ada has joined already\. If that is you, give your own code word"
    ):
        await access.log_in("ADA", "our class", "10.0.0.2")
    for wrong in ("", "our clas", access.code_word(other)):
        with pytest.raises(LoginRefusedError, match="not the password or code word"):
            await access.log_in("Ada", wrong, "10.0.0.2")
    again = Access(
        Secrets(class_code="our class"), pupils=PupilBook(tmp_path / "class/pupils.json", "our class")
    )
    assert (await again.log_in("ada", word, "10.0.0.2"))[1] == ada
    assert (tmp_path / "class" / "pupils.json").stat().st_mode & 0o077 == 0


async def test_a_pupil_s_name_gives_no_file_that_is_there_already(tmp_path):
    for name in ("my-mission.yaml", "lesson_1_ada.yaml"):
        (tmp_path / name).write_text("name: x")
    access = Access(Secrets(class_code="our class"), pupils=PupilBook(tmp_path / "pupils.json", "our class"))
    _, pupil = await access.log_in("Mission", "our class", "10.0.0.1")
    assert not pupil.may_edit("my-mission.yaml")
    assert pupil.may_edit(f"my-{pupil.key}.yaml")
    _, ada = await access.log_in("Ada", "our class", "10.0.0.1")
    assert ada.may_edit("lesson_1_ada.yaml")  # from before there was a class


async def test_a_file_of_pupils_that_cannot_be_read_is_left_as_it_is(tmp_path):
    path = tmp_path / "pupils.json"
    path.write_text('{"pupils": [{"name": "Ada"}]}')
    access = Access(Secrets(class_code="our class"), pupils=PupilBook(path, "our class"))
    with pytest.raises(LoginRefusedError, match=r"pupils\.json cannot be read"):
        await access.log_in("Bo", "our class", "10.0.0.1")
    assert path.read_text() == '{"pupils": [{"name": "Ada"}]}'


async def test_a_teachers_additions_to_the_file_of_pupils_are_kept(tmp_path):
    path = tmp_path / "pupils.json"
    ada = {"name": "Ada", "key": "ada", "word": "nano-bimo-17", "desk": 4}
    path.write_text(json.dumps({"school": "South", "pupils": [ada]}))
    access = Access(Secrets(class_code="our class"), pupils=PupilBook(path, "our class"))
    _, bo = await access.log_in("Bo", "our class", "10.0.0.1")
    kept = json.loads(path.read_text())
    assert (kept["school"], kept["pupils"][0]) == ("South", ada)
    path.write_text("damaged while Bo is logged in")
    assert access.code_word(bo) == ""  # the page Course is shown without it


async def test_a_restart_keeps_judges_logged_in_until_their_session_ends(tmp_path):
    wall, path = Clock(), tmp_path / "contest.db.sessions"
    wall.now_s = 1e9

    def start(password=PASSWORD, cookie="judge-8080"):
        # The clock starts at 0 each time, as a machine's does; Unix time goes on.
        kept = SessionFile(path, cookie, wall)
        return Access(Secrets(judge=password), clock=Clock(), cookie=cookie, kept=kept)

    before = start()
    ada, _ = await before.log_in("Ada", PASSWORD, "10.0.0.1")
    bob, _ = await before.log_in("Bob", PASSWORD, "10.0.0.1")
    before.log_out(connection(before, bob))
    assert ada not in path.read_text()
    assert path.stat().st_mode & 0o077 == 0
    after = start()
    assert after.visitor(connection(after, ada)) == Visitor("Ada", Role.JUDGE)
    assert not after.visitor(connection(after, bob)).may_judge
    other = start(cookie="judge-8081")
    await other.log_in("Eve", PASSWORD, "10.0.0.1")
    assert not other.visitor(connection(other, ada)).may_judge
    assert start().visitor(connection(after, ada)).may_judge  # the other monitor left them alone
    renamed = start(password="another password")
    assert not renamed.visitor(connection(renamed, ada)).may_judge
    wall.now_s += SESSION_S
    late = start()
    assert not late.visitor(connection(late, ada)).may_judge


@pytest.mark.parametrize("content", ["", "[]", '{"cookies": {"judge": {"x": {"name": 1}}}}', "[" * 100_000])
async def test_an_invalid_file_of_sessions_is_ignored_and_replaced(tmp_path, content):
    path = tmp_path / "contest.db.sessions"
    path.write_text(content)
    access = judges(cookie="judge", kept=SessionFile(path, "judge"))
    session_id, _ = await access.log_in("Ada", PASSWORD, "10.0.0.1")
    again = judges(cookie="judge", kept=SessionFile(path, "judge"))
    assert again.visitor(connection(again, session_id)).may_judge


async def test_judges_can_log_in_when_sessions_cannot_be_written(tmp_path):
    kept = SessionFile(tmp_path / "missing" / "contest.db.sessions", "judge")
    access = judges(cookie="judge", kept=kept)
    session_id, _ = await access.log_in("Ada", PASSWORD, "10.0.0.1")
    assert access.visitor(connection(access, session_id)).may_judge


async def test_many_log_ins_of_one_pupil_end_nobody_else_s(tmp_path):
    book = PupilBook(tmp_path / "pupils.json", "our class")
    access = Access(Secrets(judge=PASSWORD, class_code="our class"), pupils=book)
    judge, _ = await access.log_in("Bo", PASSWORD, "a")
    first, ada = await access.log_in("Ada", "our class", "a")
    for _ in range(30):
        newest, _ = await access.log_in("Ada", book.find("Ada").word, "a")
    assert access.visitor(connection(access, judge)).may_judge
    assert access.visitor(connection(access, newest)) == ada
    assert access.visitor(connection(access, first)) == Visitor()


@pytest.mark.parametrize(
    ("database", "path"),
    [
        ("sqlite:///framerunner.db", "framerunner.db.sessions"),
        ("sqlite:////srv/our contest.db?timeout=5", "/srv/our contest.db.sessions"),
        ("postgresql+psycopg://judge:secret@host/contest", "framerunner.db.sessions"),
        ("sqlite://", None),
        ("sqlite:///:memory:", None),
    ],
)
def test_sessions_are_stored_beside_the_database(database, path):
    assert session_path(database) == (None if path is None else Path(path))


async def test_wrong_tries_of_an_address_slow_it_down_and_do_not_shut_the_right_password_out():
    clock = Clock()
    access = judges(clock=clock, limit=LoginLimit(clock, clock.wait))
    for _ in range(3 * ONE_ADDRESS.at_once):
        with pytest.raises(LoginRefusedError, match="not the password"):
            await access.log_in("Eve", "guess", "2001:db8::1")
    assert clock.now_s == pytest.approx(2 * ONE_ADDRESS.at_once * ONE_ADDRESS.period_s)
    before_s = clock.now_s
    assert await access.log_in("Ada", PASSWORD, "10.0.0.1")
    assert clock.now_s == before_s
    assert await access.log_in("Eve", PASSWORD, "2001:db8::2")  # a neighbour waits for its turn
    assert clock.now_s <= before_s + ONE_ADDRESS.period_s
    for _ in range(100):  # a class behind one address; what is right does not count
        await access.log_in("Ada", PASSWORD, "10.0.0.1")
    assert clock.now_s <= before_s + ONE_ADDRESS.period_s


async def test_tries_of_all_addresses_are_limited_and_a_one_time_link_is_not():
    clock, links = Clock(), {}

    async def wait_for_others(_seconds):  # they all try at the same moment
        pass

    access = judges(
        clock=clock,
        limit=LoginLimit(clock, wait_for_others),
        hear_invitation=lambda role, secret: links.update({role: secret}),
    )
    access.invite()
    refused = 0
    for number in range(1000):
        with pytest.raises(LoginRefusedError) as error:
            await access.log_in("Eve", "guess", f"10.1.{number // 250}.{number % 250}")
        refused += error.value.status == 429
    assert 1000 - refused == ALL_ADDRESSES.at_once + LONGEST_WAIT_S / ALL_ADDRESSES.period_s
    _, visitor = await access.log_in("Ada", links[Role.ORGANISER], "10.2.0.1")
    assert visitor.may_organise
    clock.now_s = 60.0
    assert await access.log_in("Bo", PASSWORD, "10.2.0.1")


async def test_a_one_time_link_is_valid_once_for_its_role_and_is_replaced():
    links = []
    access = Access(Secrets(), hear_invitation=lambda role, secret: links.append((role, secret)))
    with pytest.raises(LoginRefusedError):
        await access.log_in("Eve", "", "a")  # before there is any
    access.invite()
    (_, for_judges), (_, for_organisers) = links
    assert (await access.log_in("Ada", for_judges, "a"))[1] == Visitor("Ada", Role.JUDGE)
    with pytest.raises(LoginRefusedError, match="used before"):
        await access.log_in("Bob", for_judges, "b")
    assert (await access.log_in("Bob", links[2][1], "b"))[1] == Visitor("Bob", Role.JUDGE)
    assert (await access.log_in("Cy", for_organisers, "c"))[1] == Visitor("Cy", Role.ORGANISER)
    assert [role for role, _ in links] == ["judge", "organiser", "judge", "judge", "organiser"]
    assert min(len(secret) for _, secret in links) >= 43  # 256 bits


@pytest.mark.parametrize("name", ["", "  ", "x" * (MAX_NAME_LENGTH + 1), "a\nb", "a\u202eb", "a\x00b"])
async def test_a_name_that_cannot_be_read_is_refused(name):
    access = judges()
    with pytest.raises(LoginRefusedError) as refused:
        await access.log_in(name, PASSWORD, "a")
    assert refused.value.status == 400
    assert "\n" not in str(refused.value)


async def test_a_judge_logs_in_and_out_by_the_form(monkeypatch):
    async with serving(monkeypatch, SAMPLE, password=PASSWORD) as served, browser() as client:
        url = served.url
        assert not any("token" in line for line in served.lines)
        async with client.post(url + "judges-only") as answer:
            assert answer.status == 403
            assert "only judges" in (await answer.json())["detail"]
        async with client.post(url + "login", data={"name": "Ada", "secret": "wrong password"}) as answer:
            assert answer.status == 403
            assert "This is not the password or code word" in await answer.text()
        form = {"name": "Ada <b>", "secret": PASSWORD}
        async with client.post(url + "login", data=form, allow_redirects=False) as answer:
            assert answer.status == 303
            cookie = answer.headers["Set-Cookie"].lower()
        assert "httponly" in cookie and "samesite=lax" in cookie and "path=/" in cookie
        async with client.post(url + "judges-only") as answer:
            assert await answer.json() == {"who": "Ada <b>"}
        async with client.get(url) as answer:
            text = await answer.text()
        assert "Ada &lt;b&gt;" in text and "Ada <b>" not in text and '"judge": true' in text
        async with client.post(url + "logout", allow_redirects=False) as answer:
            assert answer.status == 303
        async with client.post(url + "judges-only") as answer:
            assert answer.status == 403


async def test_a_one_time_link_works_by_the_form_and_only_once(monkeypatch):
    async with serving(monkeypatch, SAMPLE, judge_password=None) as served:
        secret = served.invitation
        async with browser() as preview, preview.get(f"{served.url}login?token={secret}") as answer:
            assert secret in await answer.text()  # looking at it does not use it
        async with browser() as client:
            async with client.post(served.url + "login", data={"name": "", "secret": secret}) as answer:
                assert answer.status == 400
                assert secret in await answer.text()  # a name forgotten does not cost the link
            data = {"name": "Ada", "secret": secret}
            async with client.post(served.url + "login", data=data, allow_redirects=False) as answer:
                assert answer.status == 303
            async with client.post(served.url + "judges-only") as answer:
                assert await answer.json() == {"who": "Ada"}
        assert served.invitation != secret
        async with browser() as other:
            async with other.post(served.url + "login", data={"name": "Eve", "secret": secret}) as answer:
                assert answer.status == 403
                assert "used before" in await answer.text()
            async with other.post(served.url + "judges-only") as answer:
                assert answer.status == 403


@pytest.mark.parametrize(("bind", "status"), [("127.0.0.1", 200), ("0.0.0.0", 403)])
async def test_flying_is_free_on_this_machine_and_needs_a_login_elsewhere(monkeypatch, bind, status):
    async with serving(monkeypatch, SAMPLE, bind=bind) as served, browser() as client:
        url = f"http://127.0.0.1:{served.port}/"
        async with client.post(url + "pilots-only") as answer:
            assert answer.status == status
        data = {"name": "Ada", "secret": served.invitation}
        async with client.post(url + "login", data=data, allow_redirects=False) as answer:
            assert answer.status == 303
        async with client.post(url + "pilots-only") as answer:
            assert answer.status == 200


async def test_the_login_form_escapes_its_input(monkeypatch):
    async with serving(monkeypatch, SAMPLE, password=PASSWORD) as served, browser() as client:
        evil = '"><script>x</script>'
        async with client.post(served.url + "login", data={"name": evil, "secret": "wrong"}) as answer:
            assert "<script>x" not in await answer.text()
        async with client.post(served.url + "login", data={"name": "a", "secret": "x" * 2000}) as answer:
            assert answer.status == 422
