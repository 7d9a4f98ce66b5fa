"""What the terminal says when the guard against a hung program ends it; see `offboard.link.watchdog`.

That guard needs no interpreter, so it cannot print: it only writes a trace. A shell whose standard input ends
with this process, however that ends, looks then whether there is a trace.
"""

from __future__ import annotations

import contextlib
import subprocess
from collections.abc import Iterator
from pathlib import Path

_SHELL = "/bin/sh"
_SCRIPT = r"""
read -r _
[ -s "$1" ] || exit 0
if [ -t 2 ]; then
    stty icanon echo <&2 2>/dev/null
    printf '\033[?25h\n' >&2
fi
printf '%s\n' "$2" >&2
"""
"""Who reads the operator's keys leaves a terminal without lines and echo; the live table hides its cursor."""


@contextlib.contextmanager
def hang_notice(trace: Path, line: str) -> Iterator[None]:
    """Have a line printed on standard error if this process ends within the context and has left a trace.

    Args:
        trace: an empty file, to which the guard writes.
        line: what has happened.
    """
    try:
        shell = subprocess.Popen(
            [_SHELL, "-c", _SCRIPT, _SHELL, str(trace), line],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            start_new_session=True,  # Ctrl-C and a closed terminal are for this process
        )
    except OSError:  # a flight needs no notice
        yield
        return
    with shell:  # closes its standard input, and waits until it has ended
        yield
