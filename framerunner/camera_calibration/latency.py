"""Measures the delay of a camera: a light blinks, on the terminal or as an LED, and the camera films it."""

from __future__ import annotations

import asyncio
import random
import shutil
import sys
import time
from collections.abc import Callable, Coroutine, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path

from framerunner.errors import SettingError, write_advice
from vision.calibration.latency import (
    MAX_DELAY_S,
    Latency,
    Series,
    blink_intervals,
    cells_of,
    measure_latency,
)
from vision.sources import open_source

_HIDE, _SHOW = "\x1b[?25l\x1b[2J", "\x1b[0m\x1b[?25h\x1b[2J\x1b[H"
_LIT, _DARK = "\x1b[107m", "\x1b[40m"


Switch = Callable[[bool], None]
"""Switches a light on and off."""


@contextmanager
def terminal_light() -> Iterator[Switch]:
    """The whole terminal, white or black. Raises `SettingError` if the output is no terminal."""
    if not sys.stdout.isatty():
        raise SettingError("the output is no terminal that can blink; run it in one, or give --led")
    sys.stdout.write(_HIDE)

    def switch(lit: bool) -> None:
        columns, rows = shutil.get_terminal_size()
        line = " " * columns
        sys.stdout.write((_LIT if lit else _DARK) + "\x1b[H" + "\r\n".join([line] * rows))
        sys.stdout.flush()

    try:
        yield switch
    finally:
        sys.stdout.write(_SHOW)
        sys.stdout.flush()


@contextmanager
def led_light(path: Path) -> Iterator[Switch]:
    """An LED that a file switches: 1 is lit, 0 dark, as `/sys/class/leds/NAME/brightness` of Linux.

    Raises:
        SettingError: the file cannot be written.
    """

    def switch(lit: bool) -> None:
        try:
            path.write_text("1" if lit else "0", encoding="ascii")
        except OSError as error:
            raise SettingError(
                f"--led {path}: cannot be written to ({error.strerror}); {write_advice(error)}"
            ) from error

    switch(False)
    try:
        yield switch
    finally:
        switch(False)


async def film(
    light: AbstractContextManager[Switch], source: str, duration_s: float, say: Callable[[str], None]
) -> Latency:
    """Let a light blink while the camera films it, and find the delay.

    Args:
        light: is entered once the camera has sent an image.
        source: as for `open_source`.
        duration_s: how long to film.
        say: called with lines for people.

    Raises:
        CameraError: the camera cannot be opened or has failed.
        LatencyError: the images do not tell the delay.
        SettingError: the light cannot be switched.
    """
    switches: list[tuple[float, bool]] = []
    received_s: list[float] = []
    cells: list[Series] = []

    async def watch() -> None:
        async with open_source(source) as camera:
            async for frame in camera.frames():
                received_s.append(frame.received_s)
                cells.append(cells_of(frame.image))
                first.set()

    first = asyncio.Event()
    watching = asyncio.create_task(watch())
    try:
        await _first_of(watching, first.wait())
        say(f"the light blinks for {duration_s:.0f} s; a third of the camera's image must be the light")
        with light as switch:
            lit = False
            for interval_s in blink_intervals(duration_s, random.randrange(1 << 30)):
                switch(lit)
                switches.append((time.monotonic(), lit))
                await _first_of(watching, asyncio.sleep(interval_s))
                lit = not lit
    finally:
        watching.cancel()
        await asyncio.gather(watching, return_exceptions=True)
    start_s, end_s = switches[0][0] + MAX_DELAY_S, switches[-1][0]
    used = [number for number, at_s in enumerate(received_s) if start_s < at_s < end_s]
    return measure_latency(switches, [received_s[each] for each in used], [cells[each] for each in used])


async def _first_of(watching: asyncio.Task[None], work: Coroutine[object, object, object]) -> None:
    """Wait for work while the camera is watched; raises the camera's error."""
    waiting = asyncio.create_task(_done(work))
    await asyncio.wait((watching, waiting), return_when=asyncio.FIRST_COMPLETED)
    if watching.done():
        waiting.cancel()
        watching.result()
        raise SettingError("the camera's video ended; give a live camera")


async def _done(work: Coroutine[object, object, object]) -> None:
    await work
