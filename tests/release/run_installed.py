"""Runs what a user of the wheel types, in an environment and folders outside the repository."""

from __future__ import annotations

import os
import shutil
import signal
import socket
import subprocess
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from tests.framerunner.test_examples import PRINTED
from tests.release.artefacts import ROOT

PROGRAM = """\
import framerunner

result = framerunner.fly("calm-17")
print(f"verdict: {result.verdict}")
print(f"reason: {result.reason}")
print(f"time: {result.try_time_s:.1f} s")
"""
# Help of every command and of those below it, each as the program would show it.
ALL_HELP = """\
import contextlib, io
from framerunner.cli import build_app, run

def commands(app):
    for name, child in app.resolved_commands().items():
        if not name.startswith("-"):
            yield [name]
            yield from ([name, *words] for words in commands(child))

found = list(commands(build_app()))
assert len(found) > 30, found
for words in found:
    shown = io.StringIO()
    with contextlib.redirect_stdout(shown):
        code = run([*words, "--help"])
    assert code == 0 and "Usage" in shown.getvalue(), words
print(len(found), "commands have help")
"""
WITHOUT_EXTRAS = {  # what each says instead of working
    "monitor": "framerunner[monitor]",
    "edit mission.yaml --from example": "framerunner[monitor]",
    "fly test-case-1 --lockstep --record": "framerunner[recording]",
    "replay lockstep": "framerunner[recording]",
    "film lockstep": "framerunner[video]",
    "evaluate --level calm --count 1 --backend ray": "framerunner[ray]",
}
EXAMPLES_NEED = ("framerunner[gym]", "pytest")
_LIMIT_S = 900.0
_READY = "Ready for takeoff!"


class StepError(Exception):
    """A step failed; the message is its output's end."""


@dataclass
class Installed:
    """An environment with the wheel.

    Attributes:
        python: that makes the environment.
        folder: outside the repository.
        wheel: to be installed.
        steps: the names of the steps that were taken, with what each found.
    """

    python: Path
    folder: Path
    wheel: Path
    steps: dict[str, str] = field(default_factory=dict)

    @property
    def site_packages(self) -> Path:
        """Where the packages are."""
        (found,) = (self.folder / "venv" / "lib").glob("python3.*/site-packages")
        return found

    def check(self, say: Callable[[str], None]) -> bool:
        """Take all steps until one fails; whether none did."""
        self.folder.mkdir()
        for name, step in self._all_steps():
            began = time.monotonic()
            try:
                found = step()
            except StepError as error:
                self.steps[name] = "FAILED"
                say(f"  {name}: FAILED\n{error}")
                return False
            took_s = time.monotonic() - began
            self.steps[name] = f"{took_s:.0f} s"
            say(f"  {name}: {found}, {took_s:.0f} s")
        return True

    def make_environment(self) -> None:
        """Make an environment with pip alone."""
        _output([str(self.python), "-m", "venv", str(self.folder / "venv")], self.folder, 0)

    def install(self, *requirements: str) -> None:
        """Install the wheel, with extras if a requirement names some, and other packages."""
        named = [each.replace("framerunner", str(self.wheel), 1) for each in requirements]
        self.run("python", "-m", "pip", "install", "--quiet", "--disable-pip-version-check", *named)

    def run(self, program: str, *arguments: str, code: int = 0) -> str:
        """Run a program of the environment; its output.

        Raises:
            StepError: it ended otherwise than expected, or with a traceback.
        """
        command = [str(self.folder / "venv" / "bin" / program), *arguments]
        return _output(command, self.folder, code)

    def _all_steps(self) -> list[tuple[str, Callable[[], str]]]:
        return [
            ("install", self._install_alone),
            ("program", self._program),
            ("help", self._help),
            ("lockstep", lambda: self._fly("lockstep", "--lockstep")),
            ("real time", lambda: self._fly("real-time", "--speed", "2")),
            ("evaluate", self._evaluate),
            ("replay", self._replay),
            ("sim", lambda: self._start_and_stop(_READY, "sim")),
            ("no extras", self._without_extras),
            ("extras", self._extras),
            ("examples", self._examples),
        ]

    def _install_alone(self) -> str:
        self.make_environment()
        self.install("framerunner")
        version = self.run("framerunner", "--version").strip()
        return f"version {version}, {folder_mb(self.site_packages):.0f} MB with pip"

    def _program(self) -> str:
        (self.folder / "program.py").write_text(PROGRAM, encoding="utf-8")
        shown = self.run("python", "program.py")
        _expect("verdict: clean", shown)
        return shown.splitlines()[0]

    def _help(self) -> str:
        return self.run("python", "-c", ALL_HELP).strip()

    def _fly(self, name: str, *options: str) -> str:
        shown = self.run("framerunner", "fly", "test-case-1", *options, "--out", name)
        _expect("clean after", shown)
        (run,) = (self.folder / name).iterdir()
        missing = [each for each in ("result.json", "track.png") if not (run / each).stat().st_size]
        if missing:
            raise StepError(f"empty: {missing}")
        return next(line for line in shown.splitlines() if line.startswith("clean after"))

    def _evaluate(self) -> str:
        command = ("evaluate", "--level", "calm", "--count", "2", "--jobs", "1", "--out", "evaluation")
        _expect("left in evaluation/: report.html, results.csv", self.run("framerunner", *command))
        return "a report of 2 flights"

    def _replay(self) -> str:
        """The flight in real time, from its log."""
        (run,) = (self.folder / "real-time").iterdir()
        _expect("clean after", self.run("framerunner", "replay", str(run), "--fast", "--no-video"))
        return "shown"

    def _start_and_stop(self, ready: str, *words: str) -> str:
        """Start a command, wait until it says that it is ready, and stop it as Ctrl-C does."""
        command = [str(self.folder / "venv" / "bin" / "framerunner"), *words]
        log = self.folder / f"{words[0]}.log"
        with log.open("w", encoding="utf-8") as output:
            started = subprocess.Popen(
                command, cwd=self.folder, env=_environment(), stdout=output, stderr=subprocess.STDOUT
            )
            deadline = time.monotonic() + 60.0
            while ready not in log.read_text(encoding="utf-8") and started.poll() is None:
                if time.monotonic() > deadline:
                    break
                time.sleep(0.2)
            started.send_signal(signal.SIGINT)
            try:
                code = started.wait(30.0)
            except subprocess.TimeoutExpired:
                started.kill()
                raise StepError(f"{words[0]} did not end") from None
        shown = log.read_text(encoding="utf-8")
        _expect(ready, shown)
        if code != 130 or "Traceback" in shown:
            raise StepError(f"exit code {code}:\n{shown}")
        return "started and stopped"

    def _without_extras(self) -> str:
        for words, wanted in WITHOUT_EXTRAS.items():
            (run,) = (self.folder / "lockstep").iterdir()
            arguments = [str(run) if word == "lockstep" else word for word in words.split()]
            shown = self.run("framerunner", *arguments, code=2)
            _expect(wanted, shown)
            if len(shown.splitlines()) != 1:
                raise StepError(f"not one line: {words}\n{shown}")
        return f"{len(WITHOUT_EXTRAS)} commands name the extra that they need"

    def _extras(self) -> str:
        """Record, fly again and film a flight, and start the monitor."""
        self.install("framerunner[all]")
        self.run("framerunner", "fly", "test-case-1", "--lockstep", "--record", "--out", "recorded")
        (recorded,) = (self.folder / "recorded").iterdir()
        (flown,) = (self.folder / "lockstep").iterdir()
        for run in (recorded, flown):
            _expect("clean after", self.run("framerunner", "replay", str(run), "--fast", "--no-video"))
        self.run("framerunner", "film", str(recorded), "--out", "film.mp4")
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = str(free.getsockname()[1])
        self._start_and_stop(f"monitor: http://127.0.0.1:{port}/", "monitor", "--port", port)
        return "recorded, flown again, filmed; the monitor starts"

    def _examples(self) -> str:
        """Run copies of the examples, with what they need."""
        self.install(*EXAMPLES_NEED)
        shutil.copytree(
            ROOT / "examples", self.folder / "examples", ignore=shutil.ignore_patterns("__pycache__")
        )
        for path in sorted((self.folder / "examples").glob("*.py")):
            if path.name.startswith("test_"):
                _expect("1 passed", self.run("python", "-m", "pytest", "-p", "no:cacheprovider", str(path)))
                continue
            shown = self.run("python", str(path), "1", "offsets.png")
            _expect(PRINTED.get(path.name, "land: "), shown)
        return f"{len(list((self.folder / 'examples').glob('*.py')))} examples"


def folder_mb(folder: Path) -> float:
    """The size of all files below a folder."""
    return sum(each.stat().st_size for each in folder.rglob("*") if each.is_file()) / 1e6


def _expect(wanted: str, shown: str) -> None:
    if wanted not in shown:
        raise StepError(f"{wanted!r} is not in:\n{shown[-2000:]}")


def _environment() -> dict[str, str]:
    """This process's environment without what would let the program find the repository."""
    ours = ("PYTHONPATH", "PYTHONHOME", "VIRTUAL_ENV", "FRAMERUNNER_")
    kept = {name: value for name, value in os.environ.items() if not name.startswith(ours)}
    return kept | {"MPLBACKEND": "Agg", "COLUMNS": "200"}


def _output(command: list[str], folder: Path, code: int) -> str:
    try:
        done = subprocess.run(
            command,
            cwd=folder,
            env=_environment(),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=_LIMIT_S,
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise StepError(f"{' '.join(command)}: did not end within {_LIMIT_S:.0f} s") from None
    if done.returncode != code or "Traceback" in done.stdout:
        raise StepError(f"{' '.join(command)}: exit code {done.returncode}:\n{done.stdout[-3000:]}")
    return done.stdout


def python_versions(names: tuple[str, ...]) -> dict[str, Path | None]:
    """The Pythons that are at hand, on the path or installed by pyenv; None for one that is not."""
    pyenv = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv")) / "versions"
    found: dict[str, Path | None] = {}
    for name in names:
        places = [shutil.which(f"python{name}"), *sorted(pyenv.glob(f"{name}*/bin/python{name}"))]
        found[name] = next((Path(each) for each in places if each and _can_make_venv(Path(each), name)), None)
    return found


def _can_make_venv(python: Path, name: str) -> bool:
    """Whether it is the Python it seems to be (pyenv's shims may not) and has venv with pip."""
    program = "import ensurepip, sys, venv; print('%d.%d' % sys.version_info[:2])"
    done = subprocess.run([str(python), "-c", program], capture_output=True, text=True, check=False)
    return done.returncode == 0 and done.stdout.strip() == name
