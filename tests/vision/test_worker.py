"""The process that decodes images of unknown origin: it can be ended, and it ends with its parent."""

import asyncio
import contextlib
import os
import signal
import subprocess
import sys

import cv2
import numpy as np
import pytest

from tests.vision.hostile_images import progressive_of_many_scans
from vision.decoder import ImageDecoder
from vision.jpeg import ImageError
from vision.worker import WorkerReply, WorkerRequest
from vision.worker_process import CameraProcess, WorkerEndedError

IMAGE = np.arange(30 * 40 * 3, dtype=np.uint8).reshape(30, 40, 3)
PNG = bytes(cv2.imencode(".png", IMAGE)[1])
ENDLESS = progressive_of_many_scans(30_000)


async def gone(pid: int) -> None:
    """Wait until a process has ended; it may not have been waited for yet."""
    async with asyncio.timeout(10):
        while True:
            try:
                with open(f"/proc/{pid}/stat") as file:  # noqa: ASYNC230 - not a real file
                    if file.read().rpartition(")")[2].split()[0] == "Z":
                        return
            except FileNotFoundError:
                return
            await asyncio.sleep(0.02)


async def test_images_come_back_in_order() -> None:
    worker = CameraProcess()
    try:
        for _ in range(3):
            answer = await worker.request(WorkerRequest.DECODE, PNG)
            assert np.array_equal(answer.image, IMAGE)
            assert (await worker.request(WorkerRequest.DECODE, b"garbage")).reply is WorkerReply.NO_IMAGE
    finally:
        worker.end()


async def test_an_image_that_takes_too_long_ends_its_process_while_the_loop_turns() -> None:
    decoder = ImageDecoder()
    try:
        assert np.array_equal(await decoder.decode_file(PNG), IMAGE)
        pid = decoder._worker.pid
        turns = 0

        async def turn() -> None:
            nonlocal turns
            while True:
                await asyncio.sleep(0.01)
                turns += 1

        turning = asyncio.create_task(turn())
        with pytest.raises(ImageError, match=r"takes longer than 0.5 s to decode"):
            await decoder.decode_file(ENDLESS)
        turning.cancel()
        assert turns > 5  # of 50; a machine may be busy
        await gone(pid)
        assert np.array_equal(await decoder.decode_file(PNG), IMAGE)
    finally:
        decoder.close()


async def test_a_process_that_dies_is_replaced() -> None:
    worker = CameraProcess()
    try:
        await worker.start()
        os.kill(worker.pid, signal.SIGKILL)
        with pytest.raises(WorkerEndedError):
            await worker.request(WorkerRequest.DECODE, PNG)
        assert np.array_equal((await worker.request(WorkerRequest.DECODE, PNG)).image, IMAGE)
    finally:
        worker.end()


async def test_closing_ends_a_process_at_work() -> None:
    decoder = ImageDecoder()
    await decoder._worker.start()
    pid = decoder._worker.pid
    waiting = asyncio.create_task(decoder.decode_file(ENDLESS))
    await asyncio.sleep(0.1)
    waiting.cancel()
    with contextlib.suppress(asyncio.CancelledError):
        await waiting
    assert decoder._worker.pid is None
    await gone(pid)


PARENT = """
import asyncio, sys
from vision.worker import WorkerRequest
from vision.worker_process import CameraProcess
async def main():
    worker = CameraProcess()
    await worker.start()
    print(worker.pid, flush=True)
    await worker.request(WorkerRequest.DECODE, sys.stdin.buffer.read())
asyncio.run(main())
"""


async def test_it_does_not_outlive_its_parent() -> None:
    with subprocess.Popen(  # noqa: ASYNC220 - it only starts, and is killed
        [sys.executable, "-c", PARENT], stdin=-1, stdout=-1
    ) as parent:
        pid = int(parent.stdout.readline())
        parent.stdin.write(ENDLESS)
        parent.stdin.close()
        parent.kill()
    await gone(pid)
