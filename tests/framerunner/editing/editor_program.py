"""`framerunner edit` as a process of its own."""

from __future__ import annotations

import asyncio
import os
import socket
import sys
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path

_START = "from framerunner.cli import main; main()"
_NO_SPARES = "from framerunner.editing.workers import WorkerPool; WorkerPool.prepare = lambda pool: None; "


@dataclass
class EditorProgram:
    """An editor that runs.

    Attributes:
        url: of its pages, with a slash at the end.
        process: its own.
    """

    url: str
    process: asyncio.subprocess.Process

    def page(self, file: str) -> str:
        """The URL of a file's page."""
        return f"{self.url}edit?file={file}"

    async def kill(self) -> None:
        """End it as SIGKILL does: it can write nothing any more."""
        self.process.kill()
        await self.process.wait()


def free_port(kind: int = socket.SOCK_STREAM) -> int:
    """A port of this machine that nothing uses."""
    with socket.socket(socket.AF_INET, kind) as taken:
        taken.bind(("127.0.0.1", 0))
        return taken.getsockname()[1]


@asynccontextmanager
async def editor(mission: Path, *options: str, port: int = 0, spares: bool = True):
    """Run the editor for a mission; yields an `EditorProgram`.

    Without `spares` it makes no worker ready before a flight needs one: each page that is opened would have
    it start one, and most tests of pages do not fly.
    """
    drone = f"udpin://127.0.0.1:{free_port(socket.SOCK_DGRAM)}"
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-c", _START if spares else _NO_SPARES + _START),
        *("edit", str(mission), "--no-browser"),
        *("--port", str(port), "--drone", drone, *options),
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.STDOUT,
        env={**os.environ, "PYTHONUNBUFFERED": "1"},
        cwd=mission.parent,
    )
    try:
        told = ""
        while "editor: http" not in told:
            line = (await process.stdout.readline()).decode()
            assert line, f"the editor does not start: {told}"
            told += line
        url = told.partition("monitor: ")[2].partition("\n")[0].strip()
        reading = asyncio.create_task(process.stdout.read())
        yield EditorProgram(url, process)
        reading.cancel()
    finally:
        if process.returncode is None:
            process.terminate()
            await process.wait()
