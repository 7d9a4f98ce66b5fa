"""The tables of docs/faults.md: `python -m scenarios.faults.page` prints them, a test compares them."""

from __future__ import annotations

from collections.abc import Iterator

from scenarios.faults.declaration import SIZES, FaultKind
from scenarios.faults.table import TABLE, FaultEnd, FaultRow

_ENDS = {
    FaultEnd.FLIES_ON: "flies on",
    FaultEnd.DISPLACED: "flies on by the wrong position: it may miss frames and base, or touch them",
    FaultEnd.LANDS: "descends, lands and disarms",
    FaultEnd.TERMINATES: "stops the motors until it is disarmed",
    FaultEnd.APP_ENDS: "the app ends the flight: the drone holds, or its own failsafe follows",
    FaultEnd.TIME_LIMIT: "flies until the time limit",
}
_SAMPLE_KINDS = {
    FaultKind.OFF: "delivers nothing",
    FaultKind.STUCK: "repeats one value, with new times",
    FaultKind.WRONG: "SIZE is added",
    FaultKind.SCALED: "SIZE is a factor",
    FaultKind.NOISY: "white noise with the standard deviation SIZE is added",
    FaultKind.DELAYED: "samples come SIZE later, with the times at which they were true",
    FaultKind.LOSSY: "the share SIZE of all samples is lost",
}


def kinds_table() -> Iterator[str]:
    """What each part's faults are, and the default of each size."""
    yield "| part | faults and the default of SIZE |"
    yield "|---|---|"
    for part, kinds in SIZES.items():
        words = []
        for kind, meant in kinds.items():
            size = "" if meant is None else f" {meant.default:g} {meant.unit}".rstrip()
            words.append(f"`{kind}`{size}")
        yield f"| `{part}` | {', '.join(words)} |"


def rows_table() -> Iterator[str]:
    """How flights end: the rows of the fault table."""
    yield "| fault | flown with | what is noticed | after | what it says | how the flight ends |"
    yield "|---|---|---|---|---|---|"
    for row in TABLE:
        yield _line(row)


def _line(row: FaultRow) -> str:
    text = str(row.fault).replace(" at 0 s", "")
    after = "–" if row.within_s is None else f"{row.within_s:g} s"
    says = f"`{row.reaction}`" if row.reaction else "–"
    flown = f"`{row.sensors}`, `{row.airframe}`"
    return f"| {text} | {flown} | {row.notices} | {after} | {says} | {_ENDS[row.end]} |"


def sensor_kinds() -> Iterator[str]:
    """What each kind of fault does to the samples of a sensor."""
    for kind, words in _SAMPLE_KINDS.items():
        yield f"| `{kind}` | {words} |"


if __name__ == "__main__":
    print("\n".join([*sensor_kinds(), "", *kinds_table(), "", *rows_table()]))
