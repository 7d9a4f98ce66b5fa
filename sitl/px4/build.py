"""A PX4 that the user has built: found, started, watched and ended."""

from __future__ import annotations

import asyncio
import contextlib
import ctypes
import os
import signal
import sys
from asyncio.subprocess import DEVNULL, Process
from collections.abc import Callable, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory

from errors import SettingError, UserError
from sitl.px4.parameters import Value, text_of

MODEL = "none_iris"
"""The start-up script of PX4's that waits for a simulator on TCP; its parameters are overwritten by ours."""
_PLACES = ("", "build/px4_sitl_default", "px4_sitl_default")
_PARENT_DEATH_SIGNAL = 1  # PR_SET_PDEATHSIG
_LAST_BYTES = 2000


class Px4EndedError(UserError):
    """PX4 has ended; the message is one line for people."""


def environment(parameters: Mapping[str, Value]) -> dict[str, str]:
    """The variables by which an unmodified PX4 takes these parameters at its start, and the model."""
    chosen = {f"PX4_PARAM_{name}": text_of(value) for name, value in parameters.items()}
    return {"PX4_SIM_MODEL": MODEL, **chosen}


def find_build(folder: Path) -> Path:
    """The folder with bin/px4 and etc: the given one, or a build for SITL in PX4's sources.

    Raises:
        SettingError: there is none.
    """
    for place in _PLACES:
        build = folder / place
        if os.access(build / "bin" / "px4", os.X_OK) and (build / "etc").is_dir():
            return build.resolve()
    raise SettingError(
        f"--px4 {folder}: has no bin/px4; give PX4's folder after `make px4_sitl_default`, or its build"
    )


class Px4Process:
    """PX4 as a child process, which never outlives this one.

    Args:
        build: as `find_build` returns.
        instance: shifts its ports and its system id.
        folder: where it runs and keeps parameters and logs; its output is in px4.log there. None: a temporary
            one, which is removed in the end.
        parameters: for its start.
    """

    def __init__(
        self, build: Path, instance: int, folder: Path | None, parameters: Mapping[str, Value]
    ) -> None:
        self._build, self._instance = build, instance
        self._temporary = TemporaryDirectory(prefix="framerunner-px4-") if folder is None else None
        self._folder = Path(self._temporary.name) if self._temporary is not None else folder or Path()
        self._parameters = parameters
        self._process: Process | None = None

    @property
    def log(self) -> Path:
        """What it prints."""
        return self._folder / "px4.log"

    async def start(self) -> None:
        """Start it; one that ran before has ended.

        Raises:
            SettingError: it cannot be started.
        """
        self._folder.mkdir(parents=True, exist_ok=True)
        command = [
            *(str(self._build / "bin" / "px4"), "-d", "-i", str(self._instance)),
            *("-w", str(self._folder), str(self._build / "etc")),
        ]
        inherited = {
            name: value for name, value in os.environ.items() if not name.startswith(("PX4_", "PYTHON"))
        }
        try:
            with self.log.open("wb") as output:
                self._process = await asyncio.create_subprocess_exec(
                    *command,
                    cwd=self._folder,
                    env=inherited | environment(self._parameters),
                    stdin=DEVNULL,
                    stdout=output,
                    stderr=output,
                    start_new_session=True,
                    preexec_fn=_end_with_parent(),
                )
        except OSError as error:
            raise SettingError(f"--px4 {self._build}: cannot be started ({error.strerror})") from None

    async def ended(self) -> str:
        """Wait until it ends; how, in words."""
        assert self._process is not None, "start() comes first"
        code = await self._process.wait()
        if code < 0:
            return f"PX4 was ended by signal {-code}"
        return f"PX4 ended with code {code}{self._last_words()}"

    async def stop(self) -> None:
        """End it and its start-up script at once; its flight log is complete from disarming on."""
        if self._process is None:
            return
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(self._process.pid, signal.SIGKILL)
        await self._process.wait()
        self._process = None

    def _last_words(self) -> str:
        """Its last error or line, for the end of a message."""
        with contextlib.suppress(OSError):
            text = self.log.read_bytes()[-_LAST_BYTES:].decode(errors="replace")
            lines = [line.strip() for line in text.splitlines() if line.strip()]
            errors = [line for line in lines if "ERROR" in line]
            if lines:
                return f": {(errors or lines)[-1]}"
        return ""


def _end_with_parent() -> Callable[[], None] | None:
    """What the child calls before it becomes PX4: Linux ends it when this process ends."""
    if sys.platform != "linux":
        return None
    call = ctypes.CDLL(None).prctl
    return lambda: call(_PARENT_DEATH_SIGNAL, signal.SIGKILL, 0, 0, 0)
