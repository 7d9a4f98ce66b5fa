"""The page a person reads: the drone, what was found, its streams, what it says."""

from __future__ import annotations

from collections.abc import Iterator

from rich.columns import Columns
from rich.console import Console, Group, RenderableType
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from framerunner.doctor import names
from framerunner.doctor.checks import Finding, Level, can_fly
from framerunner.doctor.record import Record

_MARKS = {Level.GOOD: "[green]ok[/]", Level.NOTE: "[yellow]note[/]", Level.MISSING: "[red]MISSING[/]"}
_STREAMS = (
    "HEARTBEAT",
    "ATTITUDE",
    "ATTITUDE_QUATERNION",
    "LOCAL_POSITION_NED",
    "GLOBAL_POSITION_INT",
    "SYS_STATUS",
    "EXTENDED_SYS_STATE",
    "BATTERY_STATUS",
    "DISTANCE_SENSOR",
    "ODOMETRY",
    "POSITION_TARGET_LOCAL_NED",
    "ESTIMATOR_STATUS",
)
_SEVERITIES = ("emergency", "alert", "critical", "error", "warning", "notice", "info", "debug")


def print_page(console: Console, url: str, record: Record, findings: list[Finding]) -> None:
    """Print all that is to be said.

    Args:
        console: where to.
        url: on which the drone was heard.
        record: what it told.
        findings: what was made of it.
    """
    console.print(Group(*_page(url, record, findings)))


def _page(url: str, record: Record, findings: list[Finding]) -> Iterator[RenderableType]:
    yield Text(f"Vehicle {record.system_id} on {url}", style="bold")
    yield _facts(record)
    yield ""
    yield _found(findings)
    yield ""
    yield Columns([_streams(record), _parameters(record)], padding=(0, 4))
    if record.texts:
        yield ""
        yield Text("It says", style="bold")
        for severity, text in record.texts:
            yield Text(f"  {_SEVERITIES[min(severity, 7)]}: {text}")
    yield ""
    if can_fly(findings):
        yield Text("It can fly the challenge.", style="bold green")
    else:
        count = sum(finding.level is Level.MISSING for finding in findings)
        things = "one thing is" if count == 1 else f"{count} things are"
        yield Text(f"It cannot fly the challenge yet: {things} missing.", style="bold red")


def _facts(record: Record) -> Table:
    table = Table(show_header=False, box=None, pad_edge=False)
    table.add_column(style="dim")
    table.add_column()
    for name, value in _fact_lines(record):
        table.add_row(name, escape(value))
    return table


def _fact_lines(record: Record) -> Iterator[tuple[str, str]]:
    heartbeat = record.latest["HEARTBEAT"]
    autopilot = names.AUTOPILOTS.get(heartbeat.autopilot, f"autopilot {heartbeat.autopilot}")
    version = record.latest.get("AUTOPILOT_VERSION")
    number = "" if version is None else f" {names.version_text(version.flight_sw_version)}"
    yield "autopilot", f"{autopilot}{number}, {names.kind_name(heartbeat.type)}"
    mode = names.mode_name(heartbeat.custom_mode, record.modes)
    armed = "armed" if record.armed else "disarmed"
    yield "state", f"{armed}, {mode}, {names.STATES[min(heartbeat.system_status, len(names.STATES) - 1)]}"
    if version is not None:
        able = [text for bit, text in names.CAPABILITIES.items() if version.capabilities & bit]
        yield "can do", ", ".join(able) or "it does not say"
    if record.modes:
        yield "modes", ", ".join(names.mode_name(number, record.modes) for number in sorted(record.modes))
    factor = record.real_time_factor
    if factor is not None:
        yield "clock", f"runs at {factor:.2f} of real time"
    yield "home", _place(record.latest.get("HOME_POSITION"))
    yield "origin", _place(record.latest.get("GPS_GLOBAL_ORIGIN"))
    cameras = ", ".join(str(component) for component in sorted(record.cameras))
    yield "cameras", f"component {cameras}" if cameras else "none on MAVLink; fly is given a camera's URL"
    if record.stations:
        stations = ", ".join(f"{system}/{component}" for system, component in sorted(record.stations))
        yield "stations", f"others on this link: {stations}"


def _place(message: object) -> str:
    latitude, longitude = getattr(message, "latitude", None), getattr(message, "longitude", None)
    altitude = getattr(message, "altitude", None)
    if latitude is None or longitude is None or altitude is None:
        return "not known; the challenge needs none"
    return f"{latitude / 1e7:.6f}, {longitude / 1e7:.6f}, {altitude / 1e3:.1f} m above the sea"


def _found(findings: list[Finding]) -> Table:
    table = Table(show_header=False, box=None, pad_edge=False)
    for column in ("", "", "", ""):
        table.add_column(column)
    for finding in findings:
        advice = f"[dim]{escape(finding.advice)}[/]"
        table.add_row(_MARKS[finding.level], escape(finding.subject), escape(finding.text), advice)
    return table


def _streams(record: Record) -> Table:
    table = Table(title="Streams", title_justify="left", box=None, pad_edge=False)
    table.add_column("message", style="dim")
    table.add_column("Hz", justify="right")
    for kind in _STREAMS:
        if kind in record.counts:
            table.add_row(kind, f"{record.rate_hz(kind):.1f}")
    first_s, last_s = record.times_s.get("HEARTBEAT", (0.0, 0.0))
    others = sum(1 for kind in record.counts if kind not in _STREAMS)
    table.add_row(f"and {others} other kinds", "")
    if last_s > first_s:
        table.add_row("bytes a second, about", f"{record.octets / (last_s - first_s + 1.0):.0f}")
    return table


def _parameters(record: Record) -> Table:
    table = Table(title="Parameters", title_justify="left", box=None, pad_edge=False)
    table.add_column("name", style="dim")
    table.add_column("value", justify="right")
    for name, value in sorted(record.parameters.items()):
        table.add_row(name, f"{value:g}")
    return table
