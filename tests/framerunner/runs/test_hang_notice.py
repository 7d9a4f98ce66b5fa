"""A process ends within the notice's context: only one that has left a trace is told of."""

from __future__ import annotations

import subprocess
import sys
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
