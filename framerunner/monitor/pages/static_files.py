"""The pages' bundled files, compressed once each."""

from __future__ import annotations

import asyncio
import gzip
from pathlib import Path

from starlette.datastructures import Headers
from starlette.responses import FileResponse, Response
from starlette.staticfiles import StaticFiles
from starlette.types import Scope

STATIC = Path(__file__).parents[1] / "static"
_TEXTS = (".js", ".css", ".svg", ".txt")
_HASHED = "chunks/"  # the bundler names these files by their content


class StaticBundles(StaticFiles):
    """Files that a browser revalidates each time, except those that are named by their content."""

    def __init__(self) -> None:
        super().__init__(directory=STATIC)
        self._compressed: dict[tuple[str, str], bytes] = {}  # by path and ETag

    async def get_response(self, path: str, scope: Scope) -> Response:
        """The file, or 304, or 404."""
        response = await super().get_response(path, scope)
        is_hashed = path.startswith(_HASHED)
        response.headers["Cache-Control"] = "public, max-age=31536000, immutable" if is_hashed else "no-cache"
        response.headers["Vary"] = "Accept-Encoding"
        accepted = Headers(scope=scope).get("accept-encoding", "")
        if isinstance(response, FileResponse) and path.endswith(_TEXTS) and "gzip" in accepted:
            return await self._compress(response)
        return response

    async def _compress(self, file: FileResponse) -> Response:
        key = (str(file.path), file.headers["ETag"])
        if key not in self._compressed:
            # In a thread: a large file takes some 30 ms, and poses are sent meanwhile.
            self._compressed[key] = await asyncio.to_thread(_gzip, Path(file.path))
        kept = ("Last-Modified", "Cache-Control", "Vary", "Content-Type")
        headers = {name: file.headers[name] for name in kept}
        headers |= {"Content-Encoding": "gzip", "ETag": f"W/{file.headers['ETag']}"}
        return Response(self._compressed[key], headers=headers)


def _gzip(path: Path) -> bytes:
    return gzip.compress(path.read_bytes(), mtime=0)
