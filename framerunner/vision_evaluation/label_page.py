"""The page on which pictures are labelled, for this machine only.

    GET  /                      the page
    GET  /api/pictures          camera, gates, and for each picture its name and labels, see `Overview`
    GET  /api/pictures/N.png    a picture as a detector gets it
    GET  /api/pictures/N/shown  what its labels say, see `Kept`
    POST /api/pictures/N        {"frames": as in labels.json}: writes them; what they say, see `Kept`

Errors are `{"detail": one line}`.
"""

from __future__ import annotations

from collections.abc import Callable
from secrets import token_urlsafe

import cv2
from fastapi import FastAPI, HTTPException
from fastapi.responses import HTMLResponse, Response
from pydantic import BaseModel, ConfigDict, Field
from starlette.requests import Request
from starlette.responses import JSONResponse

from framerunner.errors import UserError
from framerunner.monitor.access import Visitor
from framerunner.monitor.pages.static_files import StaticBundles
from framerunner.monitor.pages.table import Page, render_page
from framerunner.monitor.run import listen, serve_web
from framerunner.monitor.security import SecurityMiddleware
from framerunner.monitor.settings import MonitorSettings
from framerunner.vision_evaluation.label_session import LabelSession, ShownGate
from framerunner.vision_evaluation.own_pictures import LabelledGate

_PAGE = Page("/", "Label pictures", "label", here="", template="local.html.j2")
_MOST_GATES = 100


class Demand(BaseModel):
    """The gates of a picture."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    frames: tuple[LabelledGate, ...] = Field(max_length=_MOST_GATES)


class Kept(BaseModel):
    """What was said of them: those with a problem are not written."""

    shown: list[ShownGate]


class OnePicture(BaseModel):
    """A picture of the folder; `frames` is None if it was not labelled yet."""

    image: str
    frames: tuple[LabelledGate, ...] | None


class Overview(BaseModel):
    """All pictures, and which corners are labelled: "outline" or "opening"."""

    pictures: list[OnePicture]
    corners_of: str


async def serve_labels(session: LabelSession, port: int, started: Callable[[str], None]) -> None:
    """Serve the page until cancelled; `started` is told its address.

    Raises:
        MonitorError: the port is taken.
    """
    settings = MonitorSettings("127.0.0.1", port)
    with listen(settings.bind, settings.port) as listener:
        address = f"http://127.0.0.1:{listener.getsockname()[1]}/"
        await serve_web(_web(session, settings), settings, listener, lambda: started(address))


def _web(session: LabelSession, settings: MonitorSettings) -> FastAPI:
    web = FastAPI(title="framerunner", docs_url=None, redoc_url=None, openapi_url=None)
    web.add_middleware(SecurityMiddleware, local_only=True, limits=settings.limits)
    web.mount("/static", StaticBundles())
    instance = token_urlsafe(9)

    @web.exception_handler(UserError)
    async def refuse(_request: Request, error: UserError) -> JSONResponse:
        return JSONResponse({"detail": str(error)}, status_code=409)

    def check(number: int) -> None:
        if not 0 <= number < len(session.pictures):
            raise HTTPException(404, f"there is no picture {number}")

    @web.get("/")
    async def page() -> HTMLResponse:
        return render_page(_PAGE, Visitor(), instance, _PAGE.title, {})

    @web.get("/api/pictures")
    async def overview() -> Overview:
        pictures = [
            OnePicture(image=name, frames=session.gates(number))
            for number, name in enumerate(session.pictures)
        ]
        return Overview(pictures=pictures, corners_of=session.head.labels.corners_of)

    @web.get("/api/pictures/{number}.png")
    def picture(number: int) -> Response:
        check(number)
        data = cv2.imencode(".png", session.image(number))[1].tobytes()
        return Response(data, media_type="image/png", headers={"Cache-Control": "no-store"})

    @web.get("/api/pictures/{number}/shown")
    async def shown(number: int) -> Kept:
        check(number)
        return Kept(shown=session.shown(number, session.gates(number) or ()))

    @web.post("/api/pictures/{number}")
    async def keep(number: int, demand: Demand) -> Kept:
        check(number)
        return Kept(shown=session.keep(number, demand.frames))

    return web
