"""`/ws/competition`: tells pages that the contest changed; what it is they then ask for."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Awaitable, Callable

from fastapi import FastAPI
from starlette.websockets import WebSocket, WebSocketDisconnect

from monitor.addresses import Places, client_address
from monitor.competition.service import CompetitionService, Message

MOST_WATCHERS = 300
MOST_WATCHERS_PER_ADDRESS = 90
_TOO_MANY = 1013  # "try again later"


def add_channel(web: FastAPI, service: CompetitionService) -> None:
    """Add the WebSocket."""
    places = Places(MOST_WATCHERS, MOST_WATCHERS_PER_ADDRESS)

    @web.websocket("/ws/competition")
    async def live(websocket: WebSocket) -> None:
        await websocket.accept()
        address = client_address(websocket.scope)
        if places.take(address):
            await websocket.close(_TOO_MANY, "too many are watching")
            return
        try:
            await _serve_watcher(service, websocket)
        finally:
            places.give_back(address)


class _Watcher:
    """What a page is still to be told: of each kind the newest."""

    def __init__(self) -> None:
        self._newest: dict[str, str] = {}
        self._arrived = asyncio.Event()

    def put(self, message: Message) -> None:
        """Queue a message; never waits."""
        self._newest[message["kind"]] = json.dumps(message)
        self._arrived.set()

    async def send(self, send_text: Callable[[str], Awaitable[None]]) -> None:
        """Send what comes, until cancelled or the page is gone."""
        while True:
            await self._arrived.wait()
            self._arrived.clear()
            while self._newest:
                await send_text(self._newest.pop(next(iter(self._newest))))


async def _serve_watcher(service: CompetitionService, websocket: WebSocket) -> None:
    watcher = _Watcher()
    unsubscribe = service.subscribe(watcher.put)
    for message in service.news():
        watcher.put(message)
    sending = asyncio.create_task(watcher.send(websocket.send_text))
    try:
        while (await websocket.receive())["type"] != "websocket.disconnect":
            pass  # nothing is expected of a page
    except (WebSocketDisconnect, RuntimeError):
        pass
    finally:
        unsubscribe()
        sending.cancel()
        await asyncio.gather(sending, return_exceptions=True)
