"""Recorded flights over HTTP: `/api/runs`, a run, its images."""

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

from monitor.ports import RunError, RunLibrary, RunNotReadError
from monitor.reading_queue import BusyError, ReadingQueue

if TYPE_CHECKING:
    from monitor.server import Monitor

_KEPT_ANSWERS = 4
_QUICK = 5  # of gzip: the best costs ten times as long for a tenth less
_LONGEST_INDEX = 9
_NO_RUNS = "there is no folder of runs; start the monitor with --runs FOLDER"


def register(monitor: Monitor) -> None:
    """Add the addresses of recorded flights."""
    answers = _Answers(monitor.equipment.runs)
    monitor.jobs.append(answers.close_at_end)

    @monitor.web.get("/api/runs")
    async def runs(request: Request) -> Response:
        return await answers.listing(request)

    @monitor.web.get("/api/runs/{name}")
    async def run(request: Request, name: str) -> Response:
        return await answers.run(request, name)

    @monitor.web.get("/api/runs/{name}/result.json")
    async def result(request: Request, name: str) -> Response:
        return await answers.result(request, name)

    @monitor.web.get("/api/runs/{name}/image/{number}.jpg")
    async def image(name: str, number: str) -> Response:
        return await answers.image(name, number)


class _Answers:
    """Answers from a library; what was answered is kept packed, so that many viewers cost little.

    Args:
        library: the runs; None if there are none.
    """

    def __init__(self, library: RunLibrary | None) -> None:
        self._library = library
        self._queue = None if library is None else ReadingQueue(library)
        self._packed: OrderedDict[str, tuple[object, bytes, str]] = OrderedDict()

    async def close_at_end(self) -> None:
        """Wait until cancelled, then have the library break off what it reads."""
        try:
            await asyncio.Event().wait()
        finally:
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
            return _sorry(error)
        # The library gives the same object for the same run until that changes.
        known = self._packed.get(name)
        if known is None or known[0] is not recording:
            body, tag = await asyncio.to_thread(_pack, recording)
            known = (recording, body, tag)
            self._packed[name] = known
        self._packed.move_to_end(name)
        while len(self._packed) > _KEPT_ANSWERS:
            self._packed.popitem(last=False)
        return _answer(request, known[1], known[2])

    async def _recording(self, name: str) -> Mapping[str, Any]:
        """One run from the library. Raises `RunError`."""
        if self._queue is None:
            raise RunError(_NO_RUNS)
        return await self._queue.recording(name)

    async def result(self, request: Request, name: str) -> Response:
        """What stands in a run's `result.json`."""
        try:
            recording = await self._recording(name)
        except RunError as error:
            return _sorry(error)
        if recording["result"] is None:
            return _sorry(RunError(f"run '{name}': was not judged, so it has no result"))
        return _answer(request, *_pack(recording["result"]))

    async def image(self, name: str, number: str) -> Response:
        """An image of a run's camera."""
        if not (number.isascii() and number.isdigit() and len(number) <= _LONGEST_INDEX):
            return _sorry(RunError(f"image '{number[:40]}': must be a whole number"))
        try:
            data = await self._image(name, int(number))
        except RunError as error:
            return _sorry(error)
        # A run that is still being flown may get other images under the same numbers.
        return Response(data, media_type="image/jpeg", headers={"Cache-Control": "private, max-age=60"})

    async def _image(self, name: str, index: int) -> bytes:
        if self._library is None:
            raise RunError(_NO_RUNS)
        try:
            return await asyncio.to_thread(self._library.image, name, index)
        except RunNotReadError:
            await self._recording(name)
        return await asyncio.to_thread(self._library.image, name, index)


def _pack(content: object) -> tuple[bytes, str]:
    """JSON in gzip, and a name for just this content."""
    text = json.dumps(content, allow_nan=False, separators=(",", ":")).encode()
    return gzip.compress(text, _QUICK, mtime=0), f'"{hashlib.sha256(text).hexdigest()[:24]}"'


def _answer(request: Request, body: bytes, tag: str) -> Response:
    headers = {"ETag": tag, "Cache-Control": "no-cache", "Vary": "Accept-Encoding"}
    known = {each.strip().removeprefix("W/") for each in request.headers.get("if-none-match", "").split(",")}
    if tag in known:
        return Response(status_code=304, headers=headers)
    if "gzip" in request.headers.get("accept-encoding", ""):
        return Response(body, media_type="application/json", headers={**headers, "Content-Encoding": "gzip"})
    return Response(gzip.decompress(body), media_type="application/json", headers=headers)


def _sorry(error: RunError) -> Response:
    if isinstance(error, BusyError):
        return PlainTextResponse(f"{error}\n", 503, {"Retry-After": "60"})
    return PlainTextResponse(f"{error}\n", 404)
