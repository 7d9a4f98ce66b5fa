"""The page that a person reads: the drone, what was found, its streams, its status texts."""

from __future__ import annotations

from collections.abc import Iterator

from rich.columns import Columns
from rich.console import Console, Group, RenderableType
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from framerunner.doctor.checks import can_fly
from framerunner.wire.dialect import mavlink
from framerunner.wire.px4_modes import mode_words
from framerunner.wire.session.record import Record
from offboard.safety.check import Check, Outcome, failures

_MARKS = {Outcome.PASS: "[green]ok[/]", Outcome.NOTE: "[yellow]note[/]", Outcome.FAIL: "[red]MISSING[/]"}
_STREAMS = (
    *("HEARTBEAT", "ATTITUDE", "ATTITUDE_QUATERNION", "LOCAL_POSITION_NED", "GLOBAL_POSITION_INT"),
    *("SYS_STATUS", "EXTENDED_SYS_STATE", "BATTERY_STATUS", "DISTANCE_SENSOR", "ODOMETRY"),
    *("POSITION_TARGET_LOCAL_NED", "ESTIMATOR_STATUS"),
)
_SEVERITIES = ("emergency", "alert", "critical", "error", "warning", "notice", "info", "debug")
_CAPABILITIES = {
    mavlink.MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_LOCAL_NED: "local setpoints",
    mavlink.MAV_PROTOCOL_CAPABILITY_SET_ATTITUDE_TARGET: "attitude setpoints",
    mavlink.MAV_PROTOCOL_CAPABILITY_MISSION_INT: "missions",
    mavlink.MAV_PROTOCOL_CAPABILITY_MISSION_FENCE: "geofence",
    mavlink.MAV_PROTOCOL_CAPABILITY_FTP: "files",
    mavlink.MAV_PROTOCOL_CAPABILITY_MAVLINK2: "MAVLink 2",
}
_RELEASES = {0: " dev", 64: " alpha", 128: " beta", 192: " rc"}  # last byte of flight_sw_version; else final


def print_page(console: Console, url: str, record: Record, findings: list[Check]) -> None:
    """Print what was received on a URL, and the findings."""
    console.print(Group(*_page(url, record, findings)))


def _page(url: str, record: Record, findings: list[Check]) -> Iterator[RenderableType]:
    yield Text(f"Vehicle {record.system_id} on {url}", style="bold")
    facts = _table("", "")
    for name, value in _facts(record):
        facts.add_row(name, escape(value))
    yield facts
    yield ""
    yield findings_table(findings)
    yield ""
    yield Columns([_streams(record), _parameters(record)], padding=(0, 4))
    if record.texts:
        yield ""
        yield Text("Its status texts", style="bold")
        for severity, text in record.texts:
            yield Text(f"  {_SEVERITIES[min(severity, 7)]}: {text}")
    yield ""
    if can_fly(findings):
        yield Text("It can fly the challenge.", style="bold green")
    else:
        count = len(failures(findings))
        things = "one thing is" if count == 1 else f"{count} things are"
        yield Text(f"It cannot fly the challenge yet: {things} missing.", style="bold red")


def findings_table(findings: list[Check]) -> Table:
    """A row for each finding: how much it matters, its subject, what is the case, what to do."""
    found = Table(show_header=False, box=None, pad_edge=False)
    for finding in findings:
        advice = f"[dim]{escape(finding.advice)}[/]"
        found.add_row(_MARKS[finding.outcome], escape(finding.name), escape(finding.value), advice)
    return found


def _facts(record: Record) -> Iterator[tuple[str, str]]:
    version = record.latest.get("AUTOPILOT_VERSION")
    number = "" if version is None else f" {_version_text(version.flight_sw_version)}"
    yield "autopilot", f"{record.autopilot_name}{number}, {record.type_name}"
    armed = "armed" if record.armed else "disarmed"
    yield "state", f"{armed}, {record.mode_name}, {record.state_name}"
    if version is not None:
        able = [text for bit, text in _CAPABILITIES.items() if version.capabilities & bit]
        yield "can do", ", ".join(able) or "not reported"
    if record.modes:
        names = [name or mode_words(mode) for mode, name in sorted(record.modes.items())]
        yield "modes", ", ".join(name[:1].upper() + name[1:] for name in names)
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


def _version_text(number: int) -> str:
    """A flight_sw_version: three bytes and the kind of release."""
    return f"{number >> 24}.{number >> 16 & 0xFF}.{number >> 8 & 0xFF}{_RELEASES.get(number & 0xFF, '')}"


def _place(message: object) -> str:
    latitude, longitude = getattr(message, "latitude", None), getattr(message, "longitude", None)
    altitude = getattr(message, "altitude", None)
    if latitude is None or longitude is None or altitude is None:
        return "unknown; the challenge needs none"
    return f"{latitude / 1e7:.6f}, {longitude / 1e7:.6f}, {altitude / 1e3:.1f} m above sea level"


def _table(*columns: str, title: str | None = None) -> Table:
    table = Table(*columns, title=title, title_justify="left", show_header=any(columns), box=None)
    table.pad_edge = False
    table.columns[0].style = "dim"
    table.columns[1].justify = "right" if title else "left"
    return table


def _streams(record: Record) -> Table:
    table = _table("message", "Hz", title="Streams")
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
    table = _table("name", "value", title="Parameters")
    for name, value in sorted(record.parameters.items()):
        table.add_row(escape(name), f"{value:g}")
    return table
