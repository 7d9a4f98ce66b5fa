"""The process for images of unknown origin, as its parent sees it: asked for images, ended at any moment.

OpenCV and its codecs are native code. A hostile image can make them hang, crash or take all memory, and a
thread in them cannot be stopped; a process can.
"""

from __future__ import annotations

import asyncio
import mmap
import os
import socket
import subprocess
import sys
import tempfile
import threading
from dataclasses import dataclass
from typing import BinaryIO, cast

import numpy as np

from vision.types import Image
from vision.worker_protocol import ANSWER, MAX_IMAGE_BYTES, REQUEST, Reply, Request

_START_S = 10.0


class WorkerEndedError(Exception):
    """The process has crashed, run out of memory or time, or answered nonsense."""


@dataclass(frozen=True, slots=True)
class Answer:
    """What the process has answered.

    Attributes:
        reply: what it is.
        image: the image, if it is one; BGR, shape (height, width, 3), uint8.
        received_s: monotonic wall time at which a captured image arrived, seconds.
    """

    reply: Reply
    image: Image | None
    received_s: float


class WorkerProcess:
    """The process; there is none before `start` and after `end`."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None
        self._link: socket.socket | None = None
        self._memory: mmap.mmap | None = None

    @property
    def pid(self) -> int | None:
        """Of the process, while there is one."""
        return None if self._process is None else self._process.pid

    async def start(self) -> None:
        """Start the process, if there is none, and wait until it can work.

        Raises:
            WorkerEndedError: it cannot be started, or not in time.
        """
        if self._process is not None:
            return
        try:
            self._spawn()
            async with asyncio.timeout(_START_S):
                await self._answer()
        except (OSError, TimeoutError) as error:
            self.end()
            raise WorkerEndedError(f"the process that decodes images does not start: {error}") from error

    async def ask(self, request: Request, data: bytes = b"") -> Answer:
        """Ask and wait for the answer, one at a time. If the waiting is cancelled the process is ended.

        Args:
            request: what is asked.
            data: what belongs to it.

        Raises:
            WorkerEndedError: the process has ended, or was ended for its answer made no sense.
        """
        await self.start()
        assert self._link is not None
        try:
            head = REQUEST.pack(request, len(data))
            await asyncio.get_running_loop().sock_sendall(self._link, head + data)
            return await self._answer()
        except OSError as error:
            self.end()
            raise WorkerEndedError("the process that decodes images has ended") from error
        except BaseException:  # also a cancelled wait: its answer would be taken for the next request's
            self.end()
            raise

    async def _answer(self) -> Answer:
        """Wait for the next answer."""
        assert self._link is not None
        loop = asyncio.get_running_loop()
        answer = bytearray()
        try:
            while len(answer) < ANSWER.size:
                chunk = await loop.sock_recv(self._link, ANSWER.size - len(answer))
                if not chunk:
                    raise ConnectionResetError("it has ended")
                answer += chunk
            return self._checked(bytes(answer))
        except BaseException:
            self.end()
            raise

    def end(self) -> None:
        """End the process at once, whatever it does."""
        process, self._process = self._process, None
        if self._link is not None:
            self._link.close()
            self._link = None
        if self._memory is not None:
            self._memory.close()
            self._memory = None
        if process is not None:
            process.kill()
            # It takes the system a moment to give back its memory; the event loop does not wait for that.
            threading.Thread(target=process.wait, daemon=True).start()

    def _spawn(self) -> None:
        ours, theirs = socket.socketpair()
        ours.setblocking(False)
        with theirs, _shared_file() as file:
            descriptors = (theirs.fileno(), file.fileno())
            self._process = subprocess.Popen(
                [sys.executable, "-m", "vision.worker", *map(str, descriptors)],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,  # decoders print what an image makes them say
                pass_fds=descriptors,
                start_new_session=True,  # a Ctrl-C in the terminal is handled by the flight
                env={**os.environ, "OPENCV_IO_MAX_IMAGE_PIXELS": str(MAX_IMAGE_BYTES // 3)},
            )
            self._link = ours
            self._memory = mmap.mmap(file.fileno(), MAX_IMAGE_BYTES, prot=mmap.PROT_READ)

    def _checked(self, answer: bytes) -> Answer:
        """Check the answer: a process that was overcome by an image may say anything."""
        assert self._memory is not None
        kind, width, height, received_s = ANSWER.unpack(answer)
        try:
            reply = Reply(kind)
        except ValueError:
            raise WorkerEndedError("the process that decodes images answers nonsense") from None
        if reply is not Reply.IMAGE:
            return Answer(reply, None, received_s)
        if not 0 < width * height * 3 <= MAX_IMAGE_BYTES:
            raise WorkerEndedError("the process that decodes images answers nonsense")
        shared = np.frombuffer(self._memory, np.uint8, width * height * 3)
        image: Image = shared.reshape(height, width, 3).copy()
        return Answer(reply, image, received_s)


def _shared_file() -> BinaryIO:
    """A file of `MAX_IMAGE_BYTES` that has no name; only the pages which are written take memory."""
    if hasattr(os, "memfd_create"):
        file: BinaryIO = os.fdopen(os.memfd_create("framerunner-image"), "r+b")
    else:
        file = cast(BinaryIO, tempfile.TemporaryFile(prefix="framerunner-"))  # noqa: SIM115 - the caller closes it
    file.truncate(MAX_IMAGE_BYTES)
    return file
