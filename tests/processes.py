"""Helpers of tests that start `framerunner` as a program and speak to it over sockets."""

from __future__ import annotations

import fcntl
import os
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from tests.free_ports import worker_number

ROOT = Path(__file__).parents[1]
UDP_PORTS = (14540, 14550, 14580, 18570, 14030, 14280)
HTTP_PORT = 8100
RESERVED_S = 20.0
_RESERVATIONS = Path(tempfile.gettempdir(), f"framerunner-tests-{os.getuid()}")


def bound(port: int, kind: socket.SocketKind = socket.SOCK_DGRAM) -> socket.socket:
    """A socket that has a port of this machine; OSError if somebody else has it."""
    taken = socket.socket(socket.AF_INET, kind)
    try:
        if kind == socket.SOCK_STREAM:
            taken.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # what just closed is no hindrance
        taken.bind(("127.0.0.1", port))
        if kind == socket.SOCK_STREAM:
            taken.listen()
    except OSError:
        taken.close()
        raise
    return taken


def ports_are_free(instance: int) -> bool:
    """Whether nobody has a port of an instance."""
    with ExitStack() as stack:
        try:
            for port in UDP_PORTS:
                stack.enter_context(bound(port + instance))
            stack.enter_context(bound(HTTP_PORT + instance, socket.SOCK_STREAM))
        except OSError:
            return False
    return True


def free_instance(count: int = 1) -> int:
    """The first of some instances in a row whose ports nobody has.

    For some seconds, until their ports are open, no other process of tests gets them. Who needs several keeps
    each that becomes free until all are; otherwise those who need one would always be first.
    """
    _RESERVATIONS.mkdir(exist_ok=True)
    end_s = time.monotonic() + 120.0
    with (_RESERVATIONS / "several").open("w") as turn:
        if count > 1:  # two that gather would wait for each other
            fcntl.flock(turn, fcntl.LOCK_EX)
        first: int | None = None
        while time.monotonic() < end_s:
            with (_RESERVATIONS / "lock").open("w") as lock:
                fcntl.flock(lock, fcntl.LOCK_EX)
                first = first if first is not None and count > 1 else _best_first(count)
                available = [i for i in range(first, first + count) if _is_available(i)]
                for instance in available:
                    (_RESERVATIONS / str(instance)).write_text(str(os.getpid()), encoding="ascii")
            if len(available) == count:
                return first
            time.sleep(0.5)
    raise RuntimeError(f"no {count} instances of 1 to 9 in a row have all their ports free")


def _best_first(count: int) -> int:
    """The first of those instances of which most are available; each worker prefers one of 1 to 5."""
    single = [worker_number() % 5 + 1, *range(1, 10)]
    firsts = single if count == 1 else range(10 - count, 0, -1)
    return max(firsts, key=lambda first: sum(map(_is_available, range(first, first + count))))


def _is_available(instance: int) -> bool:
    """Whether an instance's ports are free and no other process has reserved them lately."""
    note = _RESERVATIONS / str(instance)
    with suppress(FileNotFoundError):
        age_s = time.time() - note.stat().st_mtime
        if age_s < RESERVED_S and note.read_text(encoding="ascii") != str(os.getpid()):
            return False
    return ports_are_free(instance)


def wait_until(condition: Callable[[], object], limit_s: float) -> bool:
    """Wait for a condition; False if it did not come."""
    end_s = time.monotonic() + limit_s
    while not condition():
        if time.monotonic() > end_s:
            return False
        time.sleep(0.02)
    return True


class Program:
    """`framerunner` running with some arguments; what it says goes to files.

    Args:
        folder: working folder, in which stdout and stderr are kept.
        arguments: after the program's name.
        options: of Popen.
    """

    def __init__(self, folder: Path, *arguments: str, **options: object) -> None:
        self._out, self._err = folder / "stdout.txt", folder / "stderr.txt"
        environment = {**os.environ, "PYTHONPATH": str(ROOT), "PYTHONUNBUFFERED": "1"}
        with self._out.open("wb") as out, self._err.open("wb") as err:
            self.process = subprocess.Popen(
                [sys.executable, "-m", "framerunner", *arguments],
                cwd=folder,
                env=environment,
                stdin=options.pop("stdin", subprocess.DEVNULL),
                stdout=out,
                stderr=err,
                **options,
            )

    @property
    def out(self) -> str:
        return self._out.read_text(encoding="utf-8")

    @property
    def err(self) -> str:
        return self._err.read_text(encoding="utf-8")

    def wait_for(self, text: str, limit_s: float = 20.0) -> None:
        """Wait until it has said something on either stream."""
        seen = wait_until(lambda: text in self.err + self.out or self.process.poll() is not None, limit_s)
        assert seen and text in self.err + self.out, f"not said: {text!r}\n{self.out}{self.err}"

    def end(self, number: signal.Signals = signal.SIGINT, limit_s: float = 20.0) -> int:
        """Send a signal; the exit code."""
        self.process.send_signal(number)
        return self.process.wait(limit_s)

    def children(self) -> list[int]:
        """Process ids of its direct children, running now."""
        task = Path(f"/proc/{self.process.pid}/task/{self.process.pid}/children")
        return [int(pid) for pid in task.read_text(encoding="ascii").split()]


def is_running(pid: int) -> bool:
    """Whether a process is there and no zombie."""
    try:
        state = Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()[0]
    except (FileNotFoundError, ProcessLookupError):
        return False
    return state not in "ZX"


@contextmanager
def program(folder: Path, *arguments: str, **options: object) -> Iterator[Program]:
    """Run `framerunner`; it is gone at the end, whatever happens."""
    running = Program(folder, *arguments, **options)
    try:
        yield running
    finally:
        if running.process.poll() is None:
            running.process.terminate()
            try:
                running.process.wait(10.0)
            except subprocess.TimeoutExpired:
                running.process.kill()
                running.process.wait()


@contextmanager
def simulator(folder: Path, instance: int, *options: str) -> Iterator[Program]:
    """`framerunner sim`, with all its ports open; its ground link goes to a port of its own.

    The environment variable `FRAMERUNNER_TEST_SENSORS` gives its drone a sensor suite.
    """
    ground = ("--ground-remote", f"127.0.0.1:{14550 + instance}")
    suite = os.environ.get("FRAMERUNNER_TEST_SENSORS")
    if suite is not None:
        options = (*options, "--sensors", suite)
    with program(folder, "sim", "--instance", str(instance), *ground, *options) as running:
        running.wait_for("Ctrl-C stops", 60.0)
        yield running
