"""Addresses that another room adds: those who may fly may use them, and they end with the monitor."""

import asyncio
from dataclasses import replace

import pytest
from fastapi import APIRouter
from starlette.requests import Request

from framerunner.commands.monitor import equipment as real_equipment
from tests.framerunner.monitor import serving as module
from tests.framerunner.monitor.serving import browser, serving


class Adder:
    def __init__(self):
        self.ended = False

    def router(self, who):
        router = APIRouter()

        @router.get("/api/added")
        def added(request: Request) -> bool:
            return who(request).may_teach

        return router

    async def run(self):
        try:
            await asyncio.Event().wait()
        finally:
            self.ended = True


@pytest.mark.parametrize(("bind", "may_act"), [("127.0.0.1", True), ("0.0.0.0", False)])
async def test_an_extension_is_served_and_told_who_may_act(monkeypatch, bind, may_act):
    adder, equipment = Adder(), module.equipment
    monkeypatch.setattr(module, "equipment", lambda: replace(equipment(), extensions=(adder,)))
    async with (
        serving(monkeypatch, bind=bind) as served,
        browser() as client,
        client.get(f"http://127.0.0.1:{served.port}/api/added") as answer,
    ):
        assert await answer.json() is may_act
    assert adder.ended


async def test_the_monitor_has_the_editor_s_flights(monkeypatch, tmp_path):
    given = real_equipment("udpin://127.0.0.1:0", None, tmp_path)
    monkeypatch.setattr(module, "equipment", lambda: given)
    async with serving(monkeypatch) as served, browser() as client:
        async with client.get(f"{served.url}api/editing/choices") as answer:
            assert "test-case-1" in (await answer.json())["scenarios"]
        async with client.ws_connect(f"{served.url}ws/editing") as socket:
            await socket.send_json({"kind": "watch", "run": "none", "tag": 3})
            assert (await socket.receive_json())["tag"] == 3
