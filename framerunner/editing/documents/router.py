"""The editor's addresses for documents: the files of its folder, and a WebSocket for each open one."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from fastapi import APIRouter, Body, HTTPException, Request
from pydantic_core import to_json
from starlette.requests import HTTPConnection
from starlette.responses import PlainTextResponse, Response
from starlette.websockets import WebSocket

from framerunner.editing.documents.document_messages import (
    PAGE_MESSAGE,
    EditMessage,
    LayoutMessage,
    PageMessage,
    SaveMessage,
    StepMessage,
    TypeMessage,
    catalogue_message,
    changed_message,
    document_message,
    places_message,
    status_message,
)
from framerunner.editing.documents.open_document import OpenDocument
from framerunner.editing.documents.session import EditorSession, SharedDocument
from framerunner.editing.words import Said, SaidError, language_of, reason
from framerunner.errors import UserError
from framerunner.monitor.access import Visitor
from framerunner.monitor.channel import REFUSED_CODE, Channel, ChannelEndError, ChannelTerms, refuse
from offboard.authoring import TextChange, export_scxml, import_scxml, mermaid_of, parse_edit
from offboard.chart.mission_texts import Language
from offboard.mission import list_missions

_Text = Annotated[str, Body(max_length=100)]
_Scxml = Annotated[str, Body(max_length=1_000_000)]
_JOURNAL_PERIOD_S = 2.0
_MAX_CLIENT = 40  # characters
_FROM_PAGE: ChannelTerms[PageMessage] = ChannelTerms(
    PAGE_MESSAGE,
    max_bytes=100_000_000,  # the server itself takes less; a text that is too long is refused in words
    is_limited=False,  # typed text is never dropped
)


class DocumentsRouter:
    """The editor's addresses for documents; implements `framerunner.monitor.ports.Extension`.

    Args:
        session: of the folder whose missions are edited.
    """

    def __init__(self, session: EditorSession) -> None:
        self._session = session

    def router(self, who: Callable[[HTTPConnection], Visitor]) -> APIRouter:
        """The addresses; `who` tells who asks, and which files they may edit."""
        router, session = APIRouter(), self._session

        def demand(request: Request, file: str | None = None) -> Visitor:
            visitor = who(request)
            if not (visitor.may_learn if file is None else visitor.may_edit(file)):
                raise HTTPException(403, _refusal(visitor).text(language_of(request)))
            return visitor

        _add_files(router, session, demand)

        @router.get("/api/edit/export")
        async def export(request: Request, file: str, kind: Literal["scxml", "mermaid"]) -> Response:
            package_only = not demand(request, file).may_teach
            return await _export(session, file, kind, language_of(request), package_only=package_only)

        @router.websocket("/ws/edit")
        async def edit(websocket: WebSocket, file: str, client: str = "") -> None:
            language = language_of(websocket)
            visitor = who(websocket)
            if not visitor.may_edit(file):
                await refuse(websocket, _refusal(visitor).text(language))
                return
            try:
                shared = await session.open(file, package_only=not visitor.may_teach)
            except UserError as error:
                await refuse(websocket, reason(error, language))
                return
            try:
                shared.opened.speaks_spanish |= language == "es"
                await websocket.accept()
                window = _Window(websocket, session, shared, client[:_MAX_CLIENT])
                await window.show(lambda: who(websocket).may_edit(file))
            finally:
                shared.leave()

        return router

    async def run(self) -> None:
        """Write the journals of unsaved documents until cancelled, and then once more."""
        try:
            while True:
                await asyncio.sleep(_JOURNAL_PERIOD_S)
                await self._session.keep()
        finally:
            await self._session.keep()


def _refusal(visitor: Visitor) -> Said:
    return Said("access.own" if visitor.may_learn else "access.edit")


def _add_files(router: APIRouter, session: EditorSession, demand: Callable[[Request], Visitor]) -> None:
    """Add the addresses of the folder's files; `demand` refuses those who may not edit."""

    @router.get("/api/edit/files")
    async def files(request: Request) -> dict[str, object]:
        visitor = demand(request)
        files = [each for each in await session.work(session.files) if visitor.may_edit(each)]
        return {"files": files, "missions": list_missions()}

    @router.post("/api/edit/files")
    async def create(request: Request, name: _Text, source: _Text) -> dict[str, str]:
        owner = demand(request).key
        return await made(request, lambda: session.create(name, source, owner))

    @router.post("/api/edit/import")
    async def import_(request: Request, name: _Text, scxml: _Scxml) -> dict[str, str]:
        owner = demand(request).key
        return await made(request, lambda: session.write(name, import_scxml(scxml.encode(), name), owner))

    async def made(request: Request, make: Callable[[], str]) -> dict[str, str]:
        try:
            return {"file": await session.work(make)}
        except UserError as error:
            raise HTTPException(400, reason(error, language_of(request))) from None


async def _export(
    session: EditorSession,
    file: str,
    kind: Literal["scxml", "mermaid"],
    language: Language,
    *,
    package_only: bool,
) -> Response:
    def export(opened: OpenDocument) -> str:
        chart = opened.document.chart
        if chart is None:
            raise SaidError("export.mistakes")
        return export_scxml(chart) if kind == "scxml" else mermaid_of(chart)

    try:
        shared = await session.open(file, package_only=package_only)
        try:
            async with shared.lock:
                text = await session.work(lambda: export(shared.opened))
        finally:
            shared.leave()
    except UserError as error:
        raise HTTPException(400, reason(error, language)) from None
    name = f"{Path(file).stem}.{'scxml' if kind == 'scxml' else 'mmd'}"
    return PlainTextResponse(text, headers={"Content-Disposition": f'attachment; filename="{name}"'})


@dataclass(frozen=True, slots=True)
class _Told:
    """What is told after a message: the page that sent it, and the others; None: nothing."""

    own: str
    others: str | None = None
    warning: Said | None = None


class _Window(Channel[PageMessage, Mapping[str, object]]):
    """A page's WebSocket; a viewer of its document."""

    def __init__(
        self, websocket: WebSocket, session: EditorSession, shared: SharedDocument, client: str
    ) -> None:
        super().__init__(websocket, _FROM_PAGE)
        self.language = language_of(websocket)
        self._session = session
        self._shared = shared
        self._client = client

    async def show(self, may_edit: Callable[[], bool]) -> None:
        """Receive and send until the page leaves, or its person may not edit any more."""
        shared = self._shared
        async with shared.lock:
            self.put(await self._session.work(self._first))
            shared.viewers.append(self)
        self._tell_others()

        async def take(message: PageMessage) -> None:
            if not may_edit():
                raise ChannelEndError(REFUSED_CODE, Said("access.edit").text(self.language))
            await asyncio.shield(self._take(message))  # what has begun is carried out, whatever the page does

        def left() -> None:
            shared.viewers.remove(self)
            self._tell_others()

        await self.serve(take, left=left)

    def warn(self, what: Said) -> None:
        """Tell the person something."""
        self.put(_json({"kind": "status", "warning": what.text(self.language)}))

    def _first(self) -> str:
        """The whole document. A new page is told of what is not saved; one that was here knows."""
        shared, opened = self._shared, self._shared.opened
        answered = shared.answered.get(self._client, 0)
        message = document_message(opened)
        if not answered:
            message["restored"] = not opened.is_saved and not shared.viewers
        return _json({**message, "answered": answered, "catalogue": catalogue_message(opened)})

    async def _take(self, message: PageMessage) -> None:
        """Do what a page asks for, tell all pages, and answer."""
        shared = self._shared
        async with shared.lock:
            others = [each for each in shared.viewers if each is not self]
            told = await self._session.work(lambda: self._do(message, tells_others=bool(others)))
            self.put(told.own)
            if told.others is not None:
                for viewer in others:
                    viewer.put(told.others)
            if told.warning is not None:
                self.warn(told.warning)

    def _do(self, message: PageMessage, *, tells_others: bool) -> _Told:
        """In a thread, with the lock: carry out a message."""
        shared, opened = self._shared, self._shared.opened
        answer: dict[str, object] = {"answers": message.number}
        if self._client and message.number <= shared.answered.get(self._client, 0):
            return _Told(_json({**status_message(opened), **answer}))
        before, layout = opened.document.text, opened.layout
        warning: Said | None = None
        changes: Sequence[TextChange] = ()
        try:
            if isinstance(message, SaveMessage):
                warning = opened.save(force=message.force)
            else:
                changes = _carry_out(opened, message)
        except UserError as error:
            shared.note(self._client, message.number)
            answer["refused"] = reason(error, self.language)
            answer["code"] = error.message.code if isinstance(error, SaidError) else ""
            # The page has the typed text: it gets the right one.
            whole = document_message(opened) if isinstance(message, TypeMessage) else status_message(opened)
            return _Told(_json({**whole, **answer}))
        shared.note(self._client, message.number)
        if not changes:
            status = status_message(opened)
            if opened.layout is not layout:
                status["layout"] = places_message(opened)
            return _Told(_json({**status, **answer}), _json(status), warning)
        told = changed_message(opened, before, changes)
        own = {**told, "changes": []} if isinstance(message, TypeMessage) else told
        own = {**own, **answer, "catalogue": catalogue_message(opened)}
        return _Told(_json(own), _json(told) if tells_others else None)

    def _tell_others(self) -> None:
        others = len(self._shared.viewers) - 1
        for viewer in self._shared.viewers:
            viewer.put(_json({"kind": "status", "others": others}))


def _json(message: dict[str, object]) -> str:
    return to_json(message, inf_nan_mode="null").decode()


def _carry_out(opened: OpenDocument, message: PageMessage) -> Sequence[TextChange]:
    """Do what a message asks for; return the changes of the text. Raises `UserError`."""
    if isinstance(message, EditMessage):
        return opened.apply(parse_edit(message.edit))
    if isinstance(message, TypeMessage):
        return _type(opened, message)
    if isinstance(message, StepMessage):
        return opened.undo() if message.kind == "undo" else opened.redo()
    if isinstance(message, LayoutMessage):
        opened.place(dict(message.places), settled=message.settled)
    return ()


def _type(opened: OpenDocument, message: TypeMessage) -> Sequence[TextChange]:
    if message.revision != opened.revision:
        raise SaidError("typed.elsewhere")
    return opened.type([(each.start, each.removed, each.inserted) for each in message.changes])
