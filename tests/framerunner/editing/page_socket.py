"""A page's end of the editor's WebSockets, and servers with their routers, without a browser."""

from __future__ import annotations

import asyncio
from concurrent.futures import CancelledError
from contextlib import asynccontextmanager, contextmanager, suppress
from types import SimpleNamespace

from fastapi import FastAPI
from starlette.testclient import TestClient

from framerunner.editing.documents.router import DocumentsRouter
from framerunner.editing.documents.session import EditorSession
from framerunner.monitor.access import Role, Visitor

ORGANISER = Visitor(role=Role.ORGANISER)


class Socket:
    """A page's end of a document's WebSocket."""

    def __init__(self, socket):
        self._socket = socket
        self._number = 0
        self.document = self.receive("document")

    def receive(self, kind):
        """The next message of a type."""
        while (message := self._socket.receive_json())["kind"] != kind:
            pass
        return message

    def ask(self, kind, **fields):
        """Ask for something; the answer."""
        self._number += 1
        self._socket.send_json({"kind": kind, "number": self._number, **fields})
        while (message := self._socket.receive_json()).get("answers") != self._number:
            pass
        return message

    def edit(self, kind, **fields):
        return self.ask("edit", edit={"kind": kind, **fields})

    def type(self, start, inserted, *, revision, removed=0):
        change = {"start": start, "removed": removed, "inserted": inserted}
        return self.ask("type", revision=revision, changes=[change])


@contextmanager
def flights_socket(router, role=Role.ORGANISER):
    """A page's end of the WebSocket of flights, and a server with its router."""

    @asynccontextmanager
    async def lifespan(_):
        running = asyncio.create_task(router.run())
        yield
        running.cancel()
        await asyncio.gather(running, return_exceptions=True)

    web = FastAPI(lifespan=lifespan)
    web.include_router(router.router(lambda _: Visitor("Ada", role, "ada")))
    # The test client cancels what the server still does when a page has left.
    left = suppress(CancelledError)
    with TestClient(web) as client, left, client.websocket_connect("/ws/editing") as socket:
        yield socket


@contextmanager
def served(folder, *, visitor=ORGANISER):
    """A client of a server with the documents' router."""
    web = FastAPI()
    web.include_router(
        DocumentsRouter(EditorSession(folder)).router(lambda _: visitor() if callable(visitor) else visitor)
    )
    with TestClient(web) as client:

        @contextmanager
        def window(name, query=""):
            # The test client cancels what the server still does when a page has left.
            with suppress(CancelledError), client.websocket_connect(f"/ws/edit?file={name}{query}") as socket:
                yield Socket(socket)

        yield SimpleNamespace(http=client, window=window)
