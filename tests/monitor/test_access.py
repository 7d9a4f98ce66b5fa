from pathlib import Path

import pytest
from starlette.requests import HTTPConnection

from monitor.access import (
    MAX_NAME_LENGTH,
    SESSION_S,
    TRIES_A_MINUTE,
    Access,
    LoginRefusedError,
    SessionFile,
    Visitor,
    session_path,
)
from tests.monitor.serving import browser, serving

SAMPLE = "tests.monitor.sample_page"
PASSWORD = "correct horse"


@pytest.fixture(autouse=True)
def _no_waiting(monkeypatch):
    monkeypatch.setattr("monitor.access.FAILURE_DELAY_S", 0.0)


class Clock:
    now_s = 0.0

    def __call__(self):
        return self.now_s


def connection(access, session_id):
    headers = [(b"cookie", f"{access.cookie}={session_id}".encode())]
    return HTTPConnection({"type": "http", "headers": headers})


async def test_a_password_opens_a_session_that_ends():
    clock = Clock()
    access = Access(PASSWORD, all_may_fly=False, clock=clock)
    session_id = await access.log_in("Ada", PASSWORD, "10.0.0.1")
    judge = connection(access, session_id)
    assert access.visitor(judge) == Visitor("Ada", may_judge=True, may_fly=True)
    clock.now_s = SESSION_S
    assert access.visitor(judge) == Visitor("", may_judge=False, may_fly=False)


async def test_a_restart_keeps_judges_logged_in_until_their_session_ends(tmp_path):
    wall, path = Clock(), tmp_path / "contest.db.sessions"
    wall.now_s = 1e9

    def start(password=PASSWORD, cookie="judge-8080"):
        # The clock starts at 0 each time, as a machine's does; Unix time goes on.
        kept = SessionFile(path, cookie, wall)
        return Access(password, all_may_fly=False, clock=Clock(), cookie=cookie, kept=kept)

    before = start()
    ada = await before.log_in("Ada", PASSWORD, "10.0.0.1")
    bob = await before.log_in("Bob", PASSWORD, "10.0.0.1")
    before.log_out(connection(before, bob))
    assert ada not in path.read_text()
    assert path.stat().st_mode & 0o077 == 0
    after = start()
    assert after.visitor(connection(after, ada)) == Visitor("Ada", may_judge=True, may_fly=True)
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
    access = Access(PASSWORD, all_may_fly=False, cookie="judge", kept=SessionFile(path, "judge"))
    session_id = await access.log_in("Ada", PASSWORD, "10.0.0.1")
    again = Access(PASSWORD, all_may_fly=False, cookie="judge", kept=SessionFile(path, "judge"))
    assert again.visitor(connection(again, session_id)).may_judge


async def test_judges_can_log_in_when_sessions_cannot_be_written(tmp_path):
    kept = SessionFile(tmp_path / "missing" / "contest.db.sessions", "judge")
    access = Access(PASSWORD, all_may_fly=False, cookie="judge", kept=kept)
    session_id = await access.log_in("Ada", PASSWORD, "10.0.0.1")
    assert access.visitor(connection(access, session_id)).may_judge


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


async def test_tries_are_limited_for_each_address():
    clock = Clock()
    access = Access(PASSWORD, all_may_fly=False, clock=clock)
    for _ in range(TRIES_A_MINUTE):
        with pytest.raises(LoginRefusedError, match="not the password"):
            await access.log_in("Eve", "guess", "2001:db8::1")
    with pytest.raises(LoginRefusedError, match="wait a minute") as refused:
        await access.log_in("Eve", PASSWORD, "2001:db8::2")  # a neighbour of its own
    assert refused.value.status == 429
    assert await access.log_in("Ada", PASSWORD, "10.0.0.1")
    clock.now_s = 60.0
    assert await access.log_in("Eve", PASSWORD, "2001:db8::2")


async def test_a_one_time_link_is_valid_once_and_is_replaced():
    links = []
    access = Access(None, all_may_fly=True, hear_invitation=links.append)
    with pytest.raises(LoginRefusedError):
        await access.log_in("Eve", "", "a")  # before there is any
    access.invite()
    await access.log_in("Ada", links[0], "a")
    with pytest.raises(LoginRefusedError, match="used before"):
        await access.log_in("Bob", links[0], "b")
    await access.log_in("Bob", links[1], "b")
    assert len(set(links)) == 3
    assert min(len(link) for link in links) >= 43  # 256 bits


@pytest.mark.parametrize("name", ["", "  ", "x" * (MAX_NAME_LENGTH + 1), "a\nb", "a\u202eb", "a\x00b"])
async def test_a_name_that_cannot_be_read_is_refused(name):
    access = Access(PASSWORD, all_may_fly=True)
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
            assert "This is not the password." in await answer.text()
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
    async with serving(monkeypatch, SAMPLE) as served:
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
