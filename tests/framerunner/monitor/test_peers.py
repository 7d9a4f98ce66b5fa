"""Whose program is at the other end of a connection within this machine."""

import asyncio
import os
import socket
import subprocess
import sys

import aiohttp
import pytest

from framerunner.monitor.visitors.peers import peer_uid
from tests.framerunner.monitor.serving import browser, serving

SAMPLE = "tests.framerunner.monitor.sample_page"
OTHER_UID = 65534
# The head of the table, then a socket of user 1000 from 127.0.0.1:5000 to port 8080, both ends, one that is
# closed, which is listed as root's, and one over IPv6.
TABLE = """  sl  local_address rem_address   st tx_queue rx_queue tr tm->when retrnsmt   uid  timeout inode
   0: 0100007F:1F90 0100007F:1388 01 00000000:00000000 00:00000000 00000000     7        0 11 1 0 20
   1: 0100007F:1388 0100007F:1F90 01 00000000:00000000 00:00000000 00000000  1000        0 12 1 0 20
   2: 0100007F:1389 0100007F:1F90 05 00000000:00000000 00:00000000 00000000     0        0 0 1 0 20
   3: 0100007F:138A 0100007F:1F90 01 00000000:00000000 00:00000000 00000000     0        0 0 1 0 20
"""
TABLE6 = """head
   0: 00000000000000000000000001000000:1388 00000000000000000000000001000000:1F90 01 0:0 0:0 0 1001 0 13
   1: 0000000000000000FFFF00000100007F:138B 0000000000000000FFFF00000100007F:1F90 01 0:0 0:0 0 1002 0 14
"""


@pytest.mark.skipif(sys.byteorder != "little", reason="the table is one of a little-endian machine")
@pytest.mark.parametrize(
    ("host", "port", "uid"),
    [
        *(("127.0.0.1", 5000, 1000), ("::ffff:127.0.0.1", 5000, 1000), ("::1", 5000, 1001)),
        *(("127.0.0.1", 5003, 1002), ("127.0.0.1", 5001, None), ("127.0.0.1", 5002, None)),
        *(("127.0.0.1", 5009, None), ("127.0.0.2", 5000, None), ("a name", 5000, None)),
    ],
)
def test_the_system_s_table_tells_the_user_of_an_open_connection(tmp_path, host, port, uid):
    (tmp_path / "tcp").write_text(TABLE)
    (tmp_path / "tcp6").write_text(TABLE6)
    assert peer_uid((host, port), ("::1" if host == "::1" else "127.0.0.1", 8080), tmp_path) == uid
    assert peer_uid((host, port), ("127.0.0.1", 8080), tmp_path / "none") is None


def test_of_a_connection_of_our_own():
    with socket.create_server(("127.0.0.1", 0)) as server:
        with socket.create_connection(server.getsockname()) as client:
            assert peer_uid(client.getsockname(), server.getsockname()) == os.getuid()
            client_name = client.getsockname()
            accepted, _ = server.accept()
        with accepted:  # the other end is closed, and not root's
            assert peer_uid(client_name, server.getsockname()) is None


async def test_another_account_of_this_machine_is_a_viewer_until_it_logs_in(monkeypatch):
    monkeypatch.setattr("framerunner.monitor.visitors.peers.os.getuid", lambda: OTHER_UID)
    async with (
        serving(monkeypatch, SAMPLE, "framerunner.monitor.operator_channel") as served,
        browser() as client,
    ):
        async with client.post(served.url + "pilots-only") as answer:
            assert answer.status == 403
        async with client.ws_connect(served.url + "ws/operator") as socket:
            message = await socket.receive()
            assert (message.type, message.data) == (aiohttp.WSMsgType.CLOSE, 4403)
        await client.post(served.url + "login", data={"name": "Ada", "secret": served.invitation})
        async with client.post(served.url + "pilots-only") as answer:
            assert answer.status == 200


@pytest.mark.skipif(os.getuid() != 0, reason="only root can become another user")
async def test_a_program_of_another_account_may_not_fly(monkeypatch):
    async with serving(monkeypatch, SAMPLE) as served:
        code = f"""if True:
            import encodings.idna, http.client, os
            os.setgid({OTHER_UID}); os.setuid({OTHER_UID})
            connection = http.client.HTTPConnection("127.0.0.1", {served.port})
            connection.request("POST", "/pilots-only")
            print(connection.getresponse().status)"""
        run = [sys.executable, "-I", "-S", "-c", code]
        done = await asyncio.to_thread(subprocess.run, run, capture_output=True, text=True)
        assert done.stdout.strip() == "403", done.stderr
