"""`report.html`: one page with everything in it, for a browser, a phone or a printer."""

from __future__ import annotations

import shlex
from base64 import b64encode
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from framerunner.evaluation.charts import offset_chart, rate_colours, state_chart, time_chart
from framerunner.evaluation.compare import Comparison
from framerunner.evaluation.rows import Row
from framerunner.evaluation.statistics import Spread, Summary
from framerunner.evaluation.store import EvaluationFolder
from framerunner.evaluation.tables import comparison_lines
from scenarios.loader import load_scenario
from scenarios.models import ScenarioError
from scenarios.verdict import Verdict

PICTURES_AT_MOST = 150
"""More would make a page that phones cannot show; some 60 kB each."""
_PICTURE_DPI = 84


@dataclass(frozen=True, slots=True)
class Failure:
    """What the page shows of a flight that failed.

    Attributes:
        row: its numbers.
        command: replays it.
        picture: its track as a data URI; None without one.
        traceback: if the program failed.
    """

    row: Row
    command: str
    picture: str | None
    traceback: str


@dataclass(frozen=True, slots=True)
class Page:
    """What a report tells.

    Attributes:
        title: what was flown, such as "level calm, seeds 1 to 200".
        mission: name or file, as the command line takes it.
        pilot: a contestant's file, as the command line takes it; None without one.
        command: makes the same evaluation.
        summary: its numbers.
        comparison: against an earlier one; None without.
    """

    title: str
    mission: str
    pilot: str | None
    command: str
    summary: Summary
    comparison: Comparison | None


def write_report(
    folder: EvaluationFolder, page: Page, advance: Callable[[int, int], None] = lambda _done, _total: None
) -> None:
    """Draw and write the page.

    Args:
        folder: all flights are in it.
        page: what to tell beside them.
        advance: called with pictures drawn and pictures to draw.

    Raises:
        SettingError: the disk does not take it.
    """
    environment = Environment(
        loader=PackageLoader("framerunner.evaluation"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["spread"] = _spread_cells
    rows = list(folder.rows().values())
    failures = _failures(folder, page, advance)
    text = environment.get_template("report.html.j2").render(
        page=page,
        identity=folder.identity,
        summary=page.summary,
        comparison=page.comparison,
        comparison_lines=comparison_lines(page.comparison) if page.comparison else [],
        charts=[
            ("Try times", "how long from motors on to motors off", Markup(time_chart(rows))),
            ("Crossings", "how far off the opening's middle", Markup(offset_chart(rows))),
            ("Where time goes", "mean seconds in each state of the mission", Markup(state_chart(rows))),
        ],
        colours=rate_colours(),
        failures=failures,
        pictures_at_most=PICTURES_AT_MOST,
    )
    folder.write(folder.report, text)


def replay_command(path: Path, mission: str, pilot: str | None, seed: int) -> str:
    """The command that flies one flight of an evaluation again, the same to the last bit.

    Args:
        path: the scenario's file.
        mission: name or file.
        pilot: a contestant's file; None without one.
        seed: of the flight.
    """
    words = ["framerunner", "fly", str(path), "--mission", mission]
    words += ["--pilot", pilot] if pilot else []
    words += ["--seed", str(seed)] if seed else []
    return shlex.join([*words, "--lockstep"])


def picked_for_pictures(summary: Summary, most: int) -> set[str]:
    """Names of failures to draw: of every cause in turn, so that none is left out by frequent ones."""
    picked: list[str] = []
    deepest = max((len(cause.rows) for cause in summary.causes), default=0)
    for index in range(deepest):
        picked += [cause.rows[index].scenario for cause in summary.causes if index < len(cause.rows)]
        if len(picked) >= most:
            break
    return set(picked[:most])


def _failures(
    folder: EvaluationFolder, page: Page, advance: Callable[[int, int], None]
) -> list[tuple[str, str, list[Failure]]]:
    """By cause: verdict, cause, flights."""
    drawn = picked_for_pictures(page.summary, PICTURES_AT_MOST)
    done = 0
    groups = []
    for cause in page.summary.causes:
        failures = []
        for row in cause.rows:
            picture = None
            if row.scenario in drawn:
                advance(done, len(drawn))
                picture = _picture(folder, row)
                done += 1
            command = replay_command(
                folder.scenario_file(row.scenario), page.mission, page.pilot, row.seed or 0
            )
            failures.append(Failure(row, command, picture, _traceback(folder, row)))
        groups.append((cause.verdict, cause.cause, failures))
    return groups


def _picture(folder: EvaluationFolder, row: Row) -> str | None:
    """The track as a PNG within a data URI; None if the flight has none."""
    track = folder.track(row.scenario)
    if len(track) == 0:
        return None
    from framerunner.runs.plots import draw_track

    try:
        scenario = load_scenario(folder.scenario_file(row.scenario))
    except ScenarioError:
        return None  # somebody has tidied up; the page does without
    png = BytesIO()
    draw_track(scenario, track, row).savefig(png, format="png", dpi=_PICTURE_DPI)
    return f"data:image/png;base64,{b64encode(png.getvalue()).decode()}"


def _traceback(folder: EvaluationFolder, row: Row) -> str:
    if row.verdict is not Verdict.ERROR:
        return ""
    try:
        return folder.error_file(row.scenario).read_text(encoding="utf-8")
    except OSError:
        return ""


def _spread_cells(spread: Spread | None, form: str) -> Sequence[str]:
    """10 %, median, 90 % and mean, for a table."""
    if spread is None:
        return ["–"] * 4
    return [format(number, form) for number in (spread.p10, spread.median, spread.p90, spread.mean)]
