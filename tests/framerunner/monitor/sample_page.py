"""A page in the monitor's gate, with data that contains markup."""

from fastapi import Request, Response

from framerunner.monitor.pages.table import Page, add_page

EVIL = "</script><script>window.broken = true</script>"


def register(monitor):
    def data(_monitor, _request, visitor):
        return {"text": EVIL, "judge": visitor.may_judge}

    add_page(monitor, Page("/", "Sample", "shell", data))

    @monitor.web.post("/judges-only")
    async def judges_only(request: Request):
        return {"who": monitor.access.require_judge(request).name}

    @monitor.web.post("/pilots-only")
    async def pilots_only(request: Request):
        return Response(status_code=200 if monitor.access.visitor(request).may_fly else 403)

    @monitor.web.post("/size")
    async def size(request: Request):
        return len(await request.body())
