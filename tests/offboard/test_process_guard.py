"""A process with a guard is stopped, hangs, is killed, or ends in order."""

from __future__ import annotations

import os
import pty
import signal
import subprocess
import sys
import termios
import time
import tty
from textwrap import dedent

import pytest

from offboard.link.process_guard import ProcessGuard

LIMIT_S = 0.3
PROGRAM = dedent("""\
    import ctypes, os, signal, sys, time
    from pathlib import Path
    from offboard.link.process_guard import ProcessGuard

    folder, limit_s = Path(sys.argv[1]), float(sys.argv[2])
    names = {"trace": folder / "hang.txt", "unfinished": folder / "unfinished", "result": folder / "result"}
    with ProcessGuard(hung="error: it hung", ended="error: it was ended", **names) as guard:
        guard.expect(limit_s)
        names["unfinished"].write_text("what was flown")
        print("ready", flush=True)
        exec(sys.argv[3])
    names["unfinished"].unlink()
    """)
HANGS = "ctypes.PyDLL(None).sleep(20)"  # keeps the interpreter's lock
BEATS = (
    "end_s = time.monotonic() + 1.5\nwhile time.monotonic() < end_s: guard.expect(limit_s); time.sleep(0.05)"
)


def started(folder, end, limit_s=LIMIT_S, **options):
    command = [sys.executable, "-c", PROGRAM, str(folder), str(limit_s), end]
    return subprocess.Popen(command, stdout=subprocess.PIPE, text=True, **options)


@pytest.mark.parametrize(
    ("end", "limit_s", "code", "printed"),
    [
        (HANGS, LIMIT_S, -signal.SIGKILL, "error: it hung\n"),
        ("os.kill(os.getpid(), 9)", LIMIT_S, -signal.SIGKILL, "error: it was ended\n"),
        ("guard.expect(0); os._exit(1)", LIMIT_S, 1, "error: it was ended\n"),
        ("os._exit(1)", 0.0, 1, ""),
        ("guard.expect(0); time.sleep(3 * limit_s)", LIMIT_S, 0, ""),
    ],
    ids=["hangs", "killed", "ended after the flight", "ended before it", "ends in order"],
)
def test_a_process_that_does_not_end_in_order_is_told_of(tmp_path, end, limit_s, code, printed):
    with started(tmp_path, end, limit_s, stderr=subprocess.PIPE) as program:
        _, told = program.communicate()
    assert (program.returncode, told) == (code, printed)
    left = sorted(path.name for path in tmp_path.iterdir())
    trace = ["hang.txt"] if end == HANGS or code == 0 else []
    assert left == [*trace, *(["result"] if printed else ["unfinished"] if code else [])]
    if end == HANGS:
        assert "most recent call first" in (tmp_path / "hang.txt").read_text()


def test_a_process_that_is_stopped_and_continued_goes_on(tmp_path):
    with started(tmp_path, BEATS) as program:
        assert program.stdout.readline() == "ready\n"
        program.send_signal(signal.SIGSTOP)
        time.sleep(3 * LIMIT_S)
        program.send_signal(signal.SIGCONT)
    assert program.returncode == 0


def test_a_guard_that_somebody_ends_is_started_again(tmp_path):
    end = f"os.kill(guard._process.pid, 9); time.sleep(0.1); guard.expect(limit_s); {HANGS}"
    with started(tmp_path, end) as program:
        program.communicate()
    assert program.returncode == -signal.SIGKILL


def test_the_terminal_has_lines_and_echo_again(tmp_path):
    ours, terminal = pty.openpty()
    try:
        tty.setcbreak(terminal)
        with started(tmp_path, "os._exit(1)", stdin=terminal, stderr=terminal) as program:
            program.communicate()
            printed = b""
            while b"it was ended" not in printed:
                printed += os.read(ours, 1024)
        modes = termios.tcgetattr(terminal)[3]
        assert modes & termios.ICANON
        assert modes & termios.ECHO
    finally:
        os.close(ours)
        os.close(terminal)


def test_a_flight_goes_on_without_a_guard_that_cannot_be_started(tmp_path, monkeypatch, caplog):
    monkeypatch.setattr(sys, "executable", str(tmp_path / "none"))
    with ProcessGuard(trace=tmp_path / "none" / "hang.txt") as guard:
        for _ in range(2):
            guard.expect(LIMIT_S)
    (warning,) = caplog.messages
    assert "cannot be started (No such file or directory)" in warning
