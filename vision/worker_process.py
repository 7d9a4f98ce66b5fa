"""The process that decodes images, as its parent sees it; `worker` runs in it and does not import this."""

from __future__ import annotations

import asyncio
import contextlib
import mmap
import os
import socket
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator
from dataclasses import dataclass
from typing import BinaryIO, cast

import numpy as np

from vision.types import Image
from vision.worker import ANSWER, MAX_IMAGE_BYTES, REQUEST, Problem, WorkerReply, WorkerRequest

_START_LIMIT_S = 10.0


class WorkerEndedError(Exception):
    """The process has crashed, run out of memory or time, or sent an invalid answer."""


@dataclass(frozen=True, slots=True)
class WorkerAnswer:
    """What the process has answered."""

    reply: WorkerReply
    image: Image | None  # BGR, shape (height, width, 3), uint8; None unless `reply` is `WorkerReply.IMAGE`
    received_s: float  # monotonic wall time at which a captured image arrived, seconds
    problem: Problem = Problem.UNKNOWN  # with `WorkerReply.NOT_OPENED`


class CameraProcess:
    """The process as its parent sees it. There is none before `start` and after `end`."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None
        self._link: socket.socket | None = None
        self._memory: mmap.mmap | None = None

    @property
    def pid(self) -> int | None:
        """Process id, while there is a process."""
        return None if self._process is None else self._process.pid

    async def start(self) -> None:
        """Start the process, if there is none, and wait until it is ready. Raises `WorkerEndedError`."""
        if self._process is not None:
            return
        with self._ended_by_errors("does not start"):
            self._spawn()
            async with asyncio.timeout(_START_LIMIT_S):
                await self._answer()

    async def request(self, kind: WorkerRequest, data: bytes = b"") -> WorkerAnswer:
        """Send one request and wait for its answer. Cancelling the wait ends the process.

        Raises:
            WorkerEndedError: the process has ended, or was ended because its answer was invalid.
        """
        await self.start()
        assert self._link is not None
        with self._ended_by_errors("has ended"):
            head = REQUEST.pack(kind, len(data))
            await asyncio.get_running_loop().sock_sendall(self._link, head + data)
            return await self._answer()

    def end(self) -> None:
        """Kill the process."""
        process, self._process = self._process, None
        if self._link is not None:
            self._link.close()
            self._link = None
        if self._memory is not None:
            self._memory.close()
            self._memory = None
        if process is not None:
            process.kill()
            # The system needs a moment to take back its memory; the event loop does not wait for that.
            threading.Thread(target=process.wait, daemon=True).start()

    @contextlib.contextmanager
    def _ended_by_errors(self, problem: str) -> Iterator[None]:
        """End the process after any error, also a cancelled wait: the next request would get its answer."""
        try:
            yield
        except BaseException as error:
            self.end()
            if isinstance(error, OSError):
                raise WorkerEndedError(f"the process that decodes images {problem}: {error}") from error
            raise

    async def _answer(self) -> WorkerAnswer:
        """Wait for the next answer."""
        assert self._link is not None
        answer = bytearray()
        while len(answer) < ANSWER.size:
            size = ANSWER.size - len(answer)
            chunk = await asyncio.get_running_loop().sock_recv(self._link, size)
            if not chunk:
                raise ConnectionResetError("connection closed")
            answer += chunk
        return self._checked(bytes(answer))

    def _spawn(self) -> None:
        ours, theirs = socket.socketpair()
        ours.setblocking(False)
        with theirs, _shared_file() as file:
            descriptors = (theirs.fileno(), file.fileno())
            self._process = subprocess.Popen(
                [sys.executable, "-m", "vision.worker", *map(str, descriptors)],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,  # an image can make a decoder print anything
                pass_fds=descriptors,
                start_new_session=True,  # a Ctrl-C in the terminal is handled by the flight
                env={**os.environ, "OPENCV_IO_MAX_IMAGE_PIXELS": str(MAX_IMAGE_BYTES // 3)},
            )
            self._link = ours
            self._memory = mmap.mmap(file.fileno(), MAX_IMAGE_BYTES, prot=mmap.PROT_READ)

    def _checked(self, answer: bytes) -> WorkerAnswer:
        """Check an answer: an image may have taken control of the process."""
        assert self._memory is not None
        kind, width, height, received_s = ANSWER.unpack(answer)
        size_fits = 0 < width * height * 3 <= MAX_IMAGE_BYTES
        known = kind in tuple(WorkerReply) and (kind != WorkerReply.NOT_OPENED or width in tuple(Problem))
        if not known or (kind == WorkerReply.IMAGE and not size_fits):
            raise WorkerEndedError("the process that decodes images sent an invalid answer")
        image: Image | None = None
        if kind == WorkerReply.IMAGE:
            shared = np.frombuffer(self._memory, np.uint8, width * height * 3)
            image = shared.reshape(height, width, 3).copy()
        problem = Problem(width) if kind == WorkerReply.NOT_OPENED else Problem.UNKNOWN
        return WorkerAnswer(WorkerReply(kind), image, received_s, problem)


def _shared_file() -> BinaryIO:
    """A file of `MAX_IMAGE_BYTES` without a name; only pages that are written take memory."""
    if hasattr(os, "memfd_create"):
        file: BinaryIO = os.fdopen(os.memfd_create("framerunner-image"), "r+b")
    else:
        file = cast(BinaryIO, tempfile.TemporaryFile(prefix="framerunner-"))  # noqa: SIM115 - the caller closes it
    file.truncate(MAX_IMAGE_BYTES)
    return file
