"""The editor's addresses for documents: the files of its folder, and a WebSocket for each open one."""

from __future__ import annotations

import asyncio
import json
import logging
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated, Literal

from fastapi import APIRouter, Body, HTTPException, Request
from starlette.requests import HTTPConnection
from starlette.responses import PlainTextResponse, Response
from starlette.websockets import WebSocket

from errors import UserError
from framerunner.editing.documents.desk import EditorDesk, SharedDocument
from framerunner.editing.documents.messages import (
    EditMessage,
    LayoutMessage,
    PageMessage,
    PageMessageError,
    SaveMessage,
    StepMessage,
    TypedChange,
    TypeMessage,
    catalogue_message,
    changed_message,
    document_message,
    places_message,
    read_message,
    status_message,
)
from framerunner.editing.documents.open_document import OpenDocument
from monitor.access import refuse
from offboard.authoring import Change, Edit, export_scxml, import_scxml, mermaid_of, parse_edit
from offboard.mission import MAX_FILE_BYTES, list_missions

_Text = Annotated[str, Body(max_length=100)]
_Scxml = Annotated[str, Body(max_length=1_000_000)]
_JOURNAL_PERIOD_S = 2.0
_BAD_MESSAGE_CODE = 4400  # as HTTP's
_MAX_QUEUE = 200
_MAX_REASON_BYTES = 120  # WebSockets allow 123
_CHANGED_ELSEWHERE = (
    "the text was changed in another window at the same time; what you typed last is left out"
)

logger = logging.getLogger(__name__)


class DocumentsDoor:
    """The editor's addresses for documents; implements `monitor.ports.Extension`.

    Args:
        desk: of the folder whose missions are edited.
    """

    def __init__(self, desk: EditorDesk) -> None:
        self._desk = desk

    def router(self, may_act: Callable[[HTTPConnection], bool]) -> APIRouter:
        """The addresses; `may_act` says who may edit."""
        router, desk = APIRouter(), self._desk

        def demand(request: Request) -> None:
            if not may_act(request):
                raise HTTPException(403, "only those who logged in may edit")

        _add_files(router, desk, demand)

        @router.get("/api/edit/export")
        async def export(request: Request, file: str, kind: Literal["scxml", "mermaid"]) -> Response:
            demand(request)
            return _export(desk, file, kind)

        @router.websocket("/ws/edit")
        async def edit(websocket: WebSocket, file: str, language: str = "en") -> None:
            if not may_act(websocket):
                await refuse(websocket, "only those who logged in may edit")
                return
            try:
                shared = desk.open(file)
            except UserError as error:
                await refuse(websocket, str(error).partition("\n")[0])
                return
            shared.opened.speaks_spanish |= language == "es"
            await websocket.accept()
            await _Window(websocket, desk, file, shared).serve()

        return router

    async def run(self) -> None:
        """Write the journals of unsaved documents until cancelled, and then once more."""
        try:
            while True:
                await asyncio.sleep(_JOURNAL_PERIOD_S)
                self._desk.keep()
        finally:
            self._desk.keep()


def _add_files(router: APIRouter, desk: EditorDesk, demand: Callable[[Request], None]) -> None:
    """Add the addresses of the folder's files; `demand` refuses those who may not edit."""

    @router.get("/api/edit/files")
    async def files(request: Request) -> dict[str, object]:
        demand(request)
        return {"files": await asyncio.to_thread(desk.files), "missions": list_missions()}

    @router.post("/api/edit/files")
    async def create(request: Request, name: _Text, source: _Text) -> dict[str, str]:
        demand(request)
        return {"file": await _made(lambda: desk.create(name, source))}

    @router.post("/api/edit/import")
    async def import_(request: Request, name: _Text, scxml: _Scxml) -> dict[str, str]:
        demand(request)
        return {"file": await _made(lambda: desk.write(name, import_scxml(scxml.encode(), name)))}


async def _made(make: Callable[[], str]) -> str:
    try:
        return await asyncio.to_thread(make)
    except UserError as error:
        raise HTTPException(400, str(error)) from None


def _export(desk: EditorDesk, file: str, kind: Literal["scxml", "mermaid"]) -> Response:
    try:
        chart = desk.open(file).opened.document.chart
        desk.close(file)
    except UserError as error:
        raise HTTPException(400, str(error)) from None
    if chart is None:
        raise HTTPException(400, "the mission has mistakes; mend them, then export it")
    text = export_scxml(chart) if kind == "scxml" else mermaid_of(chart)
    name = f"{Path(file).stem}.{'scxml' if kind == 'scxml' else 'mmd'}"
    return PlainTextResponse(text, headers={"Content-Disposition": f'attachment; filename="{name}"'})


class _Window:
    """A page's WebSocket."""

    def __init__(self, websocket: WebSocket, desk: EditorDesk, file: str, shared: SharedDocument) -> None:
        self._websocket = websocket
        self._desk = desk
        self._file = file
        self._shared = shared
        self._outbox: asyncio.Queue[dict[str, object]] = asyncio.Queue(_MAX_QUEUE)
        self._is_slow = asyncio.Event()

    async def serve(self) -> None:
        """Receive and send until the page leaves."""
        self._shared.viewers.append(self._queue)
        opened = self._shared.opened
        self._queue({**document_message(opened), "catalogue": catalogue_message(opened)})
        self._tell_others()
        tasks = [asyncio.create_task(each) for each in (self._receive(), self._send(), self._is_slow.wait())]
        try:
            await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        finally:
            self._shared.viewers.remove(self._queue)
            self._tell_others()
            self._desk.close(self._file)
            for task in tasks:
                task.cancel()
            for failure in await asyncio.gather(*tasks, return_exceptions=True):
                if isinstance(failure, Exception):
                    logger.error("an editor's WebSocket failed", exc_info=failure)

    def _queue(self, message: dict[str, object]) -> None:
        try:
            self._outbox.put_nowait(message)
        except asyncio.QueueFull:
            self._is_slow.set()

    async def _send(self) -> None:
        while True:
            message = await self._outbox.get()
            await self._websocket.send_text(json.dumps(message, ensure_ascii=False))

    async def _receive(self) -> None:
        while True:
            received = await self._websocket.receive()
            if received["type"] == "websocket.disconnect":
                return
            try:
                message = read_message(received.get("text") or received.get("bytes") or "")
            except PageMessageError as error:
                reason = str(error).encode()[:_MAX_REASON_BYTES].decode(errors="ignore")
                await self._websocket.close(_BAD_MESSAGE_CODE, reason)
                return
            self._take(message)
            await asyncio.sleep(0)

    def _take(self, message: PageMessage) -> None:
        """Do what a page asks for, tell all pages, and answer."""
        opened = self._shared.opened
        before, layout = opened.document.text, opened.layout
        answer: dict[str, object] = {"answers": message.number}
        try:
            changes = _carry_out(opened, message)
        except UserError as error:
            answer["refused"] = str(error).partition("\n")[0]
            if isinstance(message, TypeMessage):  # the page has the typed text: it gets the right one
                answer = {**document_message(opened), **answer}
            self._queue({**status_message(opened), **answer})
            return
        if changes:
            told = changed_message(opened, before, changes)
            for viewer in self._shared.viewers:
                if viewer != self._queue:
                    viewer(told)
            own = {**told, "changes": []} if isinstance(message, TypeMessage) else told
            self._queue({**own, **answer, "catalogue": catalogue_message(opened)})
            return
        status = status_message(opened)
        if opened.layout is not layout:
            status["layout"] = places_message(opened)
        for viewer in self._shared.viewers:
            viewer({**status, **answer} if viewer == self._queue else status)

    def _tell_others(self) -> None:
        others = len(self._shared.viewers) - 1
        for viewer in self._shared.viewers:
            viewer({"type": "status", "others": others})


def _carry_out(opened: OpenDocument, message: PageMessage) -> Sequence[Change]:
    """Do what a message asks for; return the changes of the text. Raises `UserError`."""
    if isinstance(message, EditMessage):
        return opened.apply(parse_edit(message.edit))
    if isinstance(message, TypeMessage):
        return _type(opened, message)
    if isinstance(message, StepMessage):
        return opened.undo() if message.type == "undo" else opened.redo()
    if isinstance(message, SaveMessage):
        opened.save(force=message.force)
    elif isinstance(message, LayoutMessage):
        opened.place(dict(message.places), settled=message.settled)
    return ()


def _type(opened: OpenDocument, message: TypeMessage) -> Sequence[Change]:
    if message.revision != opened.revision:
        raise PageMessageError(_CHANGED_ELSEWHERE)
    changes: list[Change] = []
    try:
        for typed in message.changes:
            changes += opened.apply(_replacement(opened, typed))
    except UserError:
        opened.take_back(changes)
        raise
    return changes


def _replacement(opened: OpenDocument, typed: TypedChange) -> Edit:
    text, positions = opened.document.text, opened.document.positions
    last = typed.start + typed.removed
    if len(typed.inserted) > MAX_FILE_BYTES:
        raise PageMessageError("the mission would be larger than 1 MB; a mission is a page or two")
    if last > positions.to_utf16(len(text)):
        raise PageMessageError(f"typed text: {last} is after the end of the text; load the page again")
    start, end = positions.from_utf16(typed.start), positions.from_utf16(last)
    return parse_edit({"kind": "replace_text", "start": start, "end": end, "text": typed.inserted})
