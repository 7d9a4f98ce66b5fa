"""A page in the monitor's frame, with a module and with data that contains markup."""

from fastapi import Request, Response
from nicegui import ui

from monitor.pages.shell import shell, use_module

EVIL = "</script><script>window.broken = true</script>"


def register(monitor):
    @ui.page("/")
    def home(request: Request):
        with shell(monitor, request, "Sample", "/") as visitor:
            ui.label(f"may judge: {visitor.may_judge}")
            ui.label(EVIL)
        use_module("camera.js", text=EVIL)

    @monitor.web.post("/judges-only")
    async def judges_only(request: Request):
        return {"who": monitor.access.require_judge(request).name}

    @monitor.web.post("/pilots-only")
    async def pilots_only(request: Request):
        return Response(status_code=200 if monitor.access.visitor(request).may_fly else 403)

    @monitor.web.post("/size")
    async def size(request: Request):
        return len(await request.body())
