"""Recorded flights over HTTP: `/api/runs`, a run, its result, its images."""

from __future__ import annotations

import asyncio
import gzip
import hashlib
import json
from collections import OrderedDict
from collections.abc import Mapping
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response

from framerunner.monitor.ports import RunError, RunLibrary, RunNotReadError

if TYPE_CHECKING:
    from framerunner.monitor.server import Monitor

MAX_READING = 2  # runs that are read at the same time
MAX_WAITING = 2
_MAX_PACKED = 4
_GZIP_LEVEL = 5  # level 9 takes ten times as long for a tenth less
_MAX_INDEX_DIGITS = 9
_NO_RUNS = "there is no folder of runs; start the monitor with --runs FOLDER"


class BusyError(RunError):
    """Too many runs wait to be read."""


def register(monitor: Monitor) -> None:
    """Add the addresses of recorded flights."""
    answers = _Answers(monitor.equipment.runs)
    monitor.at_end(answers.close)
    monitor.web.add_api_route("/api/runs", answers.listing)
    monitor.web.add_api_route("/api/runs/{name}", answers.run)
    monitor.web.add_api_route("/api/runs/{name}/result.json", answers.result)
    monitor.web.add_api_route("/api/runs/{name}/image/{number}.jpg", answers.image)


class _ReadingQueue:
    """Reads two runs at a time, so that a long one does not delay the others; requests for a run share it."""

    def __init__(self, library: RunLibrary) -> None:
        self._library = library
        self._tasks: dict[str, asyncio.Task[Mapping[str, Any]]] = {}
        self._places = asyncio.Semaphore(MAX_READING)

    async def recording(self, name: str) -> Mapping[str, Any]:
        """One run, at once if it was read before. Raises `BusyError` if the queue is full, and `RunError`."""
        known = await asyncio.to_thread(self._library.kept, name)
        if known is not None:
            return known
        task = self._tasks.get(name)
        if task is None:
            if len(self._tasks) >= MAX_READING + MAX_WAITING:
                raise BusyError(f"{len(self._tasks)} flights are being read; try again in a minute")
            task = self._tasks[name] = asyncio.create_task(self._read(name))
            task.add_done_callback(lambda done: self._remove(name, done))
        return await asyncio.shield(task)  # others may wait for it when this request is cancelled

    async def _read(self, name: str) -> Mapping[str, Any]:
        async with self._places:
            return await asyncio.to_thread(self._library.recording, name)

    def _remove(self, name: str, done: asyncio.Task[Mapping[str, Any]]) -> None:
        del self._tasks[name]
        if not done.cancelled():
            done.exception()  # marks it as retrieved: the requests that waited may be gone


class _Answers:
    """Answers from a library; the newest answers are kept compressed, so that many viewers cost little.

    Args:
        library: the runs; None if there are none.
    """

    def __init__(self, library: RunLibrary | None) -> None:
        self._library = library
        self._queue = None if library is None else _ReadingQueue(library)
        self._packed: OrderedDict[str, tuple[object, bytes, str]] = OrderedDict()

    def close(self) -> None:
        """Stop what the library is reading."""
        if self._library is not None:
            self._library.close()

    async def listing(self, request: Request) -> Response:
        """All runs, newest first; none if there is no library."""
        library = self._library
        found = [] if library is None else await asyncio.to_thread(library.runs)
        body, tag = await asyncio.to_thread(_pack, [asdict(each) for each in found])
        return _answer(request, body, tag)

    async def run(self, request: Request, name: str) -> Response:
        """One run, whole."""
        try:
            recording = await self._recording(name)
        except RunError as error:
            return _refusal(error)
        # The library gives the same object for the same run until that changes.
        known = self._packed.get(name)
        if known is None or known[0] is not recording:
            body, tag = await asyncio.to_thread(_pack, recording)
            known = self._packed[name] = (recording, body, tag)
        self._packed.move_to_end(name)
        while len(self._packed) > _MAX_PACKED:
            self._packed.popitem(last=False)
        return _answer(request, known[1], known[2])

    async def result(self, request: Request, name: str) -> Response:
        """A run's `result.json`."""
        try:
            recording = await self._recording(name)
        except RunError as error:
            return _refusal(error)
        if recording["result"] is None:
            return _refusal(RunError(f"run '{name}': was not judged, so it has no result"))
        return _answer(request, *_pack(recording["result"]))

    async def image(self, name: str, number: str) -> Response:
        """An image of a run's camera."""
        if not (number.isascii() and number.isdigit() and len(number) <= _MAX_INDEX_DIGITS):
            return _refusal(RunError(f"image '{number[:40]}': must be a whole number"))
        try:
            data = await self._image(name, int(number))
        except RunError as error:
            return _refusal(error)
        # A run that is still being flown may get other images under the same numbers.
        return Response(data, media_type="image/jpeg", headers={"Cache-Control": "private, max-age=60"})

    async def _recording(self, name: str) -> Mapping[str, Any]:
        if self._queue is None:
            raise RunError(_NO_RUNS)
        return await self._queue.recording(name)

    async def _image(self, name: str, index: int) -> bytes:
        if self._library is None:
            raise RunError(_NO_RUNS)
        try:
            return await asyncio.to_thread(self._library.image, name, index)
        except RunNotReadError:
            await self._recording(name)
        return await asyncio.to_thread(self._library.image, name, index)


def _pack(content: object) -> tuple[bytes, str]:
    """Compressed JSON, and its ETag."""
    text = json.dumps(content, allow_nan=False, separators=(",", ":")).encode()
    return gzip.compress(text, _GZIP_LEVEL, mtime=0), f'"{hashlib.sha256(text).hexdigest()[:24]}"'


def _answer(request: Request, body: bytes, tag: str) -> Response:
    headers = {"ETag": tag, "Cache-Control": "no-cache", "Vary": "Accept-Encoding"}
    known = {each.strip().removeprefix("W/") for each in request.headers.get("if-none-match", "").split(",")}
    if tag in known:
        return Response(status_code=304, headers=headers)
    if "gzip" in request.headers.get("accept-encoding", ""):
        return Response(body, media_type="application/json", headers={**headers, "Content-Encoding": "gzip"})
    return Response(gzip.decompress(body), media_type="application/json", headers=headers)


def _refusal(error: RunError) -> Response:
    if isinstance(error, BusyError):
        return PlainTextResponse(f"{error}\n", 503, {"Retry-After": "60"})
    return PlainTextResponse(f"{error}\n", 404)
