"""The peers' own environment: made when it is first wanted, used again after that, never the project's.

Each peer is installed by itself, so that one that cannot be had does not keep the others away.
"""

from __future__ import annotations

import subprocess
import sys
from collections import deque
from collections.abc import Callable
from pathlib import Path

FOLDER = ".venv-bench"
REQUIREMENTS = {"mujoco": "mujoco>=3.3", "pyflyt": "PyFlyt>=0.29"}
_UNREACHABLE = (
    "NewConnectionError",
    "NameResolutionError",
    "ConnectTimeoutError",
    "ProxyError",
    "Temporary failure in name resolution",
    "Network is unreachable",
)

Say = Callable[[str], None]


class PeerMissingError(Exception):
    """A peer cannot be installed here; the message is one line that says why and what to do."""


def ensure(peer: str, root: Path, say: Say) -> Path:
    """Have a peer installed, and return the interpreter that runs it.

    Args:
        peer: a key of `REQUIREMENTS`.
        root: the folder that holds the environment's folder.
        say: told what goes on, a line at a time.

    Raises:
        PeerMissingError: it cannot be installed.
    """
    folder = root / FOLDER
    interpreter = folder / "bin" / "python"
    stamp = folder / f"installed-{peer}"
    requirement = REQUIREMENTS[peer]
    if interpreter.exists() and stamp.exists() and stamp.read_text(encoding="utf-8") == requirement:
        return interpreter
    if not (folder / "bin" / "pip").exists() or not interpreter.exists():
        _make(folder, say)
    _install(interpreter, requirement, folder / f"pip-{peer}.log", say)
    stamp.write_text(requirement, encoding="utf-8")
    return interpreter


def _make(folder: Path, say: Say) -> None:
    say(f"making {folder.name}")
    code, tail = run_and_tell([sys.executable, "-m", "venv", str(folder)], folder.parent / "venv.log", say)
    (folder.parent / "venv.log").unlink(missing_ok=True)
    if code != 0:
        words = tail[-1] if tail else f"code {code}"
        raise PeerMissingError(
            f"{folder.name} could not be made ({words}). On Debian and Ubuntu: sudo apt install python3-venv"
        )


def _install(interpreter: Path, requirement: str, log: Path, say: Say) -> None:
    say(f"installing {requirement}")
    options = ["--disable-pip-version-check", "--no-input", "--prefer-binary", "--progress-bar", "off"]
    command = [str(interpreter), "-m", "pip", "install", *options, "--retries", "2", requirement]
    code, tail = run_and_tell(command, log, say)
    if code != 0:
        raise PeerMissingError(why_not_installed(requirement, tail, log))


def why_not_installed(requirement: str, lines: list[str], log: Path) -> str:
    """Say in one line why pip failed.

    Args:
        requirement: what was asked for.
        lines: what pip wrote, or the end of it.
        log: where all of it is.
    """
    place = f"{log.parent.name}/{log.name}"
    if any(mark in line for mark in _UNREACHABLE for line in lines):
        return (
            f"{requirement} could not be installed: no connection to the package index. "
            f"Connect once and run this again; pip's words are in {place}"
        )
    errors = [line for line in lines if line.startswith(("ERROR:", "error:"))]
    last = (errors or lines or ["pip said nothing"])[-1]
    return f"{requirement} could not be installed: {last.removeprefix('ERROR: ')}; pip's words are in {place}"


def run_and_tell(command: list[str], log: Path, say: Say) -> tuple[int, list[str]]:
    """Run a command to its end, its output into a log and on to `say`.

    Returns:
        Its exit code and the last lines of its output.
    """
    tail: deque[str] = deque(maxlen=200)
    with (
        log.open("w", encoding="utf-8") as file,
        subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors="replace",
        ) as process,
    ):
        assert process.stdout is not None
        try:
            for line in process.stdout:
                file.write(line)
                words = line.strip()
                if words:
                    tail.append(words)
                    say(words)
        except BaseException:
            process.terminate()
            raise
    return process.returncode, list(tail)
