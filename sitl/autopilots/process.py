"""A genuine autopilot that the user has built: started, watched and ended."""

from __future__ import annotations

import asyncio
import contextlib
import ctypes
import hashlib
import os
import signal
import sys
from abc import ABC, abstractmethod
from asyncio.subprocess import DEVNULL, Process
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from framerunner.errors import SettingError, UserError
from sitl.temporary_folder import TemporaryFolder

_PARENT_DEATH_SIGNAL = 1  # PR_SET_PDEATHSIG
_LAST_BYTES = 2000


class AutopilotEndedError(UserError):
    """A genuine autopilot has ended; the message is one line for people."""


class AutopilotProcess(ABC):
    """An autopilot as a child process, which never outlives this one.

    Args:
        name: of the autopilot, for messages.
        option: of the command line that names its build, for messages.
        folder: where it runs and keeps parameters and logs. None: a temporary one, removed in the end.
        environment: its variables besides the inherited ones.
        processor: the one that it may run on, where a system can set that; None: any.
    """

    def __init__(
        self,
        name: str,
        option: str,
        folder: Path | None,
        environment: Mapping[str, str],
        processor: int | None = None,
    ) -> None:
        self._name, self._option = name, option
        self._is_kept = folder is not None
        if folder is None:
            self._temporary = TemporaryFolder(f"framerunner-files-{name.lower()}-")
            folder = self._temporary.path
        self.folder = folder.absolute()
        self._environment = dict(environment)
        self._processor = processor
        self._process: Process | None = None
        self._started = False
        self._log_start = 0  # where the output of the present start begins

    @property
    def process_id(self) -> int | None:
        """Of the one that was started; None: none has been."""
        return None if self._process is None else self._process.pid

    @property
    def log(self) -> Path:
        """What it prints; one that is restarted goes on with the same file."""
        return self.folder / f"{self._name.lower()}.log"

    @property
    def where_its_output_is(self) -> str:
        """For the end of a message, in brackets."""
        return f"its output: {self.log}" if self._is_kept else "--storage DIR keeps its output"

    @abstractmethod
    def command(self) -> list[str]:
        """By which it is started, in `folder`, which exists."""

    def inherits(self, name: str) -> bool:
        """Whether it gets this variable of the environment."""
        return not name.startswith("PYTHON")

    async def start(self) -> None:
        """Start it; one that ran before has ended.

        Raises:
            SettingError: it cannot be started.
        """
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            command = self.command()
            output = self.log.open("ab" if self._started else "wb")
            self._log_start, self._started = output.tell(), True
        except OSError as error:
            advice = "name another folder by --storage"
            raise SettingError(f"{self.folder}: cannot be written to ({error.strerror}); {advice}") from None
        inherited = {name: value for name, value in os.environ.items() if self.inherits(name)}
        try:
            with output:
                self._process = await asyncio.create_subprocess_exec(
                    *command,
                    cwd=self.folder,
                    env=inherited | self._environment,
                    stdin=DEVNULL,
                    stdout=output,
                    stderr=output,
                    start_new_session=True,
                    preexec_fn=_before_start(self._processor),
                )
        except OSError as error:
            message = f"{self._option} {command[0]}: cannot be started ({error.strerror})"
            raise SettingError(message) from None

    async def ended(self) -> str:
        """Wait until it ends; how, in words."""
        assert self._process is not None, "start() comes first"
        code = await self._process.wait()
        if code < 0:  # its last line says nothing of that
            return f"{self._name} was ended by signal {-code}"
        return f"{self._name} ended with code {code}{self._last_words()}"

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
            text = self.log.read_bytes()[self._log_start :][-_LAST_BYTES:].decode(errors="replace")
            lines = [line.strip() for line in text.splitlines() if line.strip()]
            errors = [line for line in lines if "ERROR" in line]
            if lines:
                return f": {(errors or lines)[-1]}"
        return ""


def version_of(name: str, program: Path) -> str:
    """An autopilot and the hash of its program, which differs between builds."""
    with program.open("rb") as file:
        return f"{name} {hashlib.file_digest(file, 'sha256').hexdigest()[:12]}"


@dataclass(frozen=True, slots=True)
class AutopilotStart:
    """How an autopilot is started; without a process the user starts it."""

    process: AutopilotProcess | None
    command: str  # by which a user starts it


def may_use_real_time() -> bool:
    """Whether a program that is started here may give its threads real-time priorities; Linux only."""
    if sys.platform != "linux":
        return False
    policy, parameters = os.sched_getscheduler(0), os.sched_getparam(0)
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(os.sched_get_priority_max(os.SCHED_FIFO)))
    except OSError:
        return False
    os.sched_setscheduler(0, policy, parameters)
    return True


def _before_start(processor: int | None) -> Callable[[], None] | None:
    """What the child calls before it becomes the autopilot: Linux ends it when this process ends."""
    if sys.platform != "linux":
        return None
    call = ctypes.CDLL(None).prctl

    def prepare() -> None:
        call(_PARENT_DEATH_SIGNAL, signal.SIGKILL, 0, 0, 0)
        if processor is not None:
            with contextlib.suppress(OSError):  # it may run anywhere then
                os.sched_setaffinity(0, {processor})

    return prepare
