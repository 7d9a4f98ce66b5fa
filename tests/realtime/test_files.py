"""Files and flight logs, fetched by MAVSDK and by pymavlink's FTP client from a running simulator."""

import asyncio
import random
from types import SimpleNamespace

import pytest
from mavsdk.asyncio.plugins.action import ActionAsync
from mavsdk.asyncio.plugins.ftp import FtpAsync, FtpError, FtpResult
from mavsdk.asyncio.plugins.log_files import LogFilesAsync, LogFilesError, LogFilesResult
from mavsdk.asyncio.plugins.telemetry import TelemetryAsync
from pymavlink.mavftp import MAVFTP, MAVFTPSettings
from pyulog import ULog

from tests.realtime.conftest import mavsdk_system

pytestmark = pytest.mark.realtime


# pymavlink's own, but it need not wait for 3.7 s to see that nothing more comes.
QUICK = MAVFTPSettings(
    [
        *(("debug", int, 0), ("pkt_loss_tx", int, 0), ("pkt_loss_rx", int, 0), ("max_backlog", int, 5)),
        *(("burst_read_size", int, 80), ("write_size", int, 80), ("write_qsize", int, 5)),
        *(("idle_detection_time", float, 0.6), ("read_retry_time", float, 0.5), ("retry_time", float, 0.3)),
    ]
)


async def until(condition, tries=200):
    for _ in range(tries):
        if await condition():
            return
        await asyncio.sleep(0.1)
    raise AssertionError(f"not within {tries} tries: {condition.__name__}")


async def outcome(transfer):
    """The last result of a transfer; its progress is left out."""
    async with asyncio.timeout(30.0):
        return [result async for result, _ in transfer][-1]


async def names(ftp, folder):
    return [entry.name for entry in (await ftp.list_directory(folder)).entries]


@pytest.fixture
async def drone(sim, instance):
    async with mavsdk_system(sim.process, instance) as system:
        yield SimpleNamespace(
            ftp=FtpAsync(system),
            logs=LogFilesAsync(system),
            action=ActionAsync(system),
            telemetry=TelemetryAsync(system),
        )


@pytest.fixture
def document(tmp_path):
    path = tmp_path / "document.bin"
    path.write_bytes(random.Random(4).randbytes(100_001))
    return path


async def test_mavsdk_lists_uploads_compares_downloads_and_removes(drone, document, tmp_path):
    ftp = drone.ftp
    assert await names(ftp, "/") == ["etc"]
    await ftp.create_directory("/mine")
    with pytest.raises(FtpError):
        await ftp.create_directory("/mine/no/such/parent")
    assert await outcome(ftp.upload(str(document), "/mine")) == FtpResult.SUCCESS
    assert await names(ftp, "/mine") == ["document.bin"]
    assert await ftp.are_files_identical(str(document), "/mine/document.bin")
    await ftp.rename("/mine/document.bin", "/mine/renamed.bin")
    for use_burst in (True, False):
        folder = tmp_path / f"burst-{use_burst}"
        folder.mkdir()
        assert await outcome(ftp.download("/mine/renamed.bin", str(folder), use_burst)) == FtpResult.SUCCESS
        assert (folder / "renamed.bin").read_bytes() == document.read_bytes()
    await ftp.remove_file("/mine/renamed.bin")
    await ftp.remove_directory("/mine")
    assert await names(ftp, "/") == ["etc"]
    with pytest.raises(FtpError):
        await outcome(ftp.download("/../../etc/passwd", str(tmp_path), False))
    with pytest.raises(FtpError):
        await outcome(ftp.upload(str(document), "/etc/extras"))


async def test_mavsdk_downloads_the_log_of_a_flight_and_erases_it(drone, tmp_path):
    with pytest.raises(LogFilesError, match="NO_LOGFILES"):
        await drone.logs.get_entries()

    async def armable():
        try:
            await drone.action.arm()
        except Exception:
            return False
        return True

    await until(armable)
    await asyncio.sleep(2.0)
    await drone.action.disarm()
    (entry,) = await drone.logs.get_entries()
    assert entry.date.startswith("20")
    path = tmp_path / "flight.ulg"
    assert await outcome(drone.logs.download_log_file(entry, str(path))) == LogFilesResult.SUCCESS
    assert path.stat().st_size == entry.size_bytes
    log = ULog(str(path))
    assert not log.file_corruption
    assert log.last_timestamp - log.start_timestamp > 1_500_000
    await drone.logs.erase_all_log_files()

    async def gone():
        try:
            return not await drone.logs.get_entries()
        except LogFilesError:
            return True

    await until(gone)


def test_pymavlinks_client_puts_gets_lists_and_removes(peer, document, tmp_path):
    ftp = MAVFTP(peer.link, peer.link.target_system, 1, QUICK)

    def done(answer):
        assert answer.error_code == 0, answer.error_code

    def get(remote, local):
        done(ftp.cmd_get([remote, str(local)]))
        done(ftp.process_ftp_reply("OpenFileRO", timeout=30))

    done(ftp.cmd_mkdir(["/mine"]))
    ftp.cmd_put([str(document), "/mine/document.bin"])
    done(ftp.process_ftp_reply("CreateFile", timeout=30))
    get("/mine/document.bin", tmp_path / "back.bin")
    assert (tmp_path / "back.bin").read_bytes() == document.read_bytes()
    get("/etc/extras/component_general.json.xz", tmp_path / "general.xz")
    assert (tmp_path / "general.xz").read_bytes()[:6] == b"\xfd7zXZ\0"
    done(ftp.cmd_crc(["/mine/document.bin"]))
    done(ftp.cmd_rename(["/mine/document.bin", "/mine/other.bin"]))
    done(ftp.cmd_rm(["/mine/other.bin"]))
    done(ftp.cmd_rmdir(["/mine"]))
