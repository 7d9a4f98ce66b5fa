"""A process ends within the notice's context: only one that has left a trace is told of."""

from __future__ import annotations

import os
import pty
import subprocess
import sys
import termios
import tty
from textwrap import dedent

import pytest

PROGRAM = dedent("""\
    import os, sys
    from pathlib import Path
    from framerunner.runs.hang_notice import hang_notice

    trace = Path(sys.argv[1])
    with hang_notice(trace, "error: the app hung"):
        exec(sys.argv[2])
    """)


@pytest.mark.parametrize(
    ("end", "code", "printed"),
    [
        ("trace.write_text('Timeout'); os._exit(1)", 1, "error: the app hung\n"),
        ("os.kill(os.getpid(), 9)", -9, ""),
        ("pass", 0, ""),
    ],
)
def test_a_process_that_has_left_a_trace_is_told_of(tmp_path, end, code, printed):
    command = [sys.executable, "-c", PROGRAM, str(tmp_path / "hang.txt"), end]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (code, printed)


def test_the_terminal_has_lines_and_echo_again(tmp_path):
    ours, terminal = pty.openpty()
    try:
        tty.setcbreak(terminal)
        end = "trace.write_text('Timeout'); os._exit(1)"
        command = [sys.executable, "-c", PROGRAM, str(tmp_path / "hang.txt"), end]
        with subprocess.Popen(command, stdin=terminal, stderr=terminal) as program:
            program.wait()
            printed = b""
            while b"the app hung" not in printed:
                printed += os.read(ours, 1024)
        modes = termios.tcgetattr(terminal)[3]
        assert modes & termios.ICANON
        assert modes & termios.ECHO
    finally:
        os.close(ours)
        os.close(terminal)
