"""The contest as CSV, for spreadsheets."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence

from monitor.competition.views import Board, RankingView
from scenarios.result import spreadsheet_cell

_TRY_COLUMNS = (
    *("try", "round", "team", "scenario", "attempt", "drone", "state", "judged", "verdict"),
    *("crossed", "missing", "contacts", "penalty_s", "try_time_s", "total_s", "completed", "counted_s"),
    *("corrected_by", "source", "final", "started", "ended", "reason"),
)


def ranking_csv(ranking: RankingView) -> str:
    """The ranking of a round; for each scenario what it counts and which try that was."""
    columns = ["rank", "team", "total_s", "contacts", "flown"]
    for number, name in enumerate(ranking.scenarios, 1):
        scenario = name or f"scenario {number}"
        columns += [f"{scenario} counted_s", f"{scenario} state", f"{scenario} try"]
    rows: list[list[object]] = []
    for row in ranking.rows:
        values: list[object] = [row.rank, row.name, f"{row.total_s:.2f}", row.contacts, row.flown]
        for flown in row.cells:
            values += [f"{flown.counted_s:.2f}", flown.state, flown.attempt]
        rows.append(values)
    return _csv(columns, rows)


def tries_csv(board: Board) -> str:
    """The tries of a board, oldest first, after correction."""
    rows: list[list[object]] = []
    for each in reversed(board.tries):
        result = each.result
        rows.append(
            [
                *(each.id, each.round, each.team_name, each.scenario, each.attempt or "", each.drone_id),
                *(each.state, each.judged, each.verdict, " ".join(result.crossed), " ".join(result.missing)),
                *(result.contacts, result.penalty_s, result.try_time_s, result.total_s, result.completed),
                *(result.counted_s, each.corrected_by, each.source, each.final, each.started.isoformat()),
                *(each.ended.isoformat() if each.ended is not None else "", each.reason),
            ]
        )
    return _csv(_TRY_COLUMNS, rows)


def _csv(columns: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\r\n")
    writer.writerow([_safe(column) for column in columns])
    writer.writerows([_safe(value) for value in row] for row in rows)
    return text.getvalue()


def _safe(value: object) -> str:
    """A value as text that no spreadsheet takes for a formula."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return "true" if value else "false"
    if not isinstance(value, str):
        return str(value)
    return spreadsheet_cell(value)
