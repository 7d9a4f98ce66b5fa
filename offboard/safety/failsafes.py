"""The failsafe parameters of a vehicle: one table for the checks, for setting them and for the documentation.

The tables are in `failsafes.yaml`. Run as a program, this writes them into the documents (`make failsafes`).
"""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Literal

from pydantic import BaseModel, ConfigDict, TypeAdapter, model_validator

from framerunner.files.text_file import read_text
from framerunner.files.yaml_text import read_yaml
from offboard.safety.check import Check, Outcome
from offboard.safety.fence import FlightFence
from offboard.safety.rules import AbortAction

TABLE = Path(__file__).with_name("failsafes.yaml")
BEGIN, END = "<!-- failsafes: written by `make failsafes` -->\n", "<!-- end of failsafes -->\n"
DOCUMENTS = {"px4": "docs/real-drone.md", "ardupilot": "docs/ardupilot.md"}
"""Those with the tables, by autopilot."""
TOLERANCE = 1e-3
"""Of a comparison: parameters are single precision, and people round."""

OfFence = Literal["fence height", "fence radius"]


class FailsafeRow(BaseModel):
    """One parameter.

    Attributes:
        name: of the parameter.
        older_name: that it has in older versions of the autopilot; empty: the same.
        set_to: the value to set.
        accepted: other values that pass.
        least: with `most`: values between them pass.
        most: see `least`.
        per_m: units of the value, a metre; for what the fence sets.
        unit: of the value.
        values: what each value means.
        needs: what the vehicle must have for the parameter to matter.
        strict_with_hold: with `--on-abort hold` only `set_to` passes.
        why: for people, Markdown.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: str
    older_name: str = ""
    set_to: float | OfFence
    accepted: tuple[float, ...] = ()
    least: float | None = None
    most: float | OfFence | None = None
    per_m: float = 1.0
    unit: str = ""
    values: dict[int, str] = {}
    needs: Literal["global position"] | None = None
    strict_with_hold: bool = False
    why: str

    @model_validator(mode="after")
    def _has_both_ends(self) -> FailsafeRow:
        if (self.least is None) != (self.most is None):
            raise ValueError(f"{self.name}: give both least and most, or neither")
        return self

    @property
    def names(self) -> tuple[str, ...]:
        """Those that the parameter may have."""
        return (self.name, self.older_name) if self.older_name else (self.name,)

    def wanted(self, fence: FlightFence) -> float:
        """The value to set for a flight: not more than a fence allows that is lower."""
        value = self._number(self.set_to, fence)
        return value if self.most is None else min(value, self._number(self.most, fence))

    def strict(self, abort: AbortAction) -> FailsafeRow:
        """The row for flights that end so when they are aborted."""
        if abort == "land" or not self.strict_with_hold:
            return self
        return self.model_copy(update={"accepted": ()})

    def allows(self, value: float, fence: FlightFence) -> bool:
        """Whether a value passes."""
        if any(abs(value - good) <= TOLERANCE for good in (self.wanted(fence), *self.accepted)):
            return True
        if self.least is None or self.most is None:
            return False
        return self.least - TOLERANCE <= value <= self._number(self.most, fence) + TOLERANCE

    def allowed(self, fence: FlightFence | None = None) -> str:
        """The values that pass, for people; without a flight the fence's are named."""
        if self.least is not None and self.most is not None:
            if fence is None and isinstance(self.most, str):
                return f"{self.least:g}{self._unit} to the {self.most}"
            return f"{self.least:g} to {self._number(self.most, fence):g}{self._unit}"
        good = [self.set_to, *self.accepted]
        return " or ".join(each if isinstance(each, str) else self.shown(each) for each in good)

    def shown(self, value: float) -> str:
        """A value with its unit or its meaning."""
        meaning = self.values.get(round(value))
        return f"{value:g} ({meaning})" if meaning else f"{value:g}{self._unit}"

    def _number(self, value: float | OfFence, fence: FlightFence | None) -> float:
        if not isinstance(value, str):
            return value
        assert fence is not None, "a value of the fence needs a flight"
        return self.per_m * (fence.height_m if value == "fence height" else fence.radius_m)

    @property
    def _unit(self) -> str:
        return f" {self.unit}" if self.unit else ""


_TABLES = TypeAdapter(dict[str, tuple[FailsafeRow, ...]])


@cache
def failsafe_rows(autopilot: str = "px4", abort: AbortAction = "land") -> tuple[FailsafeRow, ...]:
    """The table of an autopilot, for flights that end so when they are aborted; empty if there is none."""
    tables = _TABLES.validate_python(read_yaml(read_text(TABLE)))
    return tuple(row.strict(abort) for row in tables.get(autopilot, ()))


def rows_by_known_names(rows: Sequence[FailsafeRow], parameters: Container[str]) -> tuple[FailsafeRow, ...]:
    """A table with the names that a vehicle's version of the autopilot has, by the parameters received."""
    return tuple(
        row.model_copy(update={"name": row.older_name})
        if row.name not in parameters and row.older_name in parameters
        else row
        for row in rows
    )


def failsafe_checks(
    parameters: Mapping[str, float],
    fence: FlightFence,
    *,
    has_global_position: bool,
    rows: Sequence[FailsafeRow] | None = None,
) -> list[Check]:
    """A check for each parameter.

    Args:
        parameters: of the vehicle, by name, as far as they were received.
        fence: of the flight.
        has_global_position: the vehicle has one; without it some parameters have no effect.
        rows: the table; by default PX4's.
    """
    return [
        _check(row, parameters.get(row.name), fence)
        if has_global_position or row.needs is None
        else Check(row.name, Outcome.NOTE, f"has no effect without a {row.needs}")
        for row in (failsafe_rows() if rows is None else rows)
    ]


def values_to_set(
    parameters: Mapping[str, float],
    fence: FlightFence,
    *,
    has_global_position: bool,
    rows: Sequence[FailsafeRow] | None = None,
) -> dict[str, float]:
    """The parameters that fail their check and are known to the vehicle, with the values to set."""
    return {
        row.name: row.wanted(fence)
        for row in (failsafe_rows() if rows is None else rows)
        if row.name in parameters
        and (has_global_position or row.needs is None)
        and not row.allows(parameters[row.name], fence)
    }


def markdown_table(rows: Sequence[FailsafeRow]) -> str:
    """The table of the documentation."""
    lines = ["| parameter | set to | allowed | why |", "|---|---|---|---|"]
    for row in rows:
        value = row.set_to if isinstance(row.set_to, str) else row.shown(row.set_to)
        lines.append(f"| `{row.name}` | {value} | {row.allowed()} | {row.why} |")
    return "\n".join(lines) + "\n"


def with_table(text: str, autopilot: str = "px4") -> str:
    """A document with the table of an autopilot written anew.

    Raises:
        ValueError: it has no place for the table.
    """
    before, begin, rest = text.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not begin or not end:
        raise ValueError(f"the document has no lines {BEGIN.strip()} and {END.strip()}")
    return f"{before}{begin}{markdown_table(failsafe_rows(autopilot))}{end}{after}"


def _check(row: FailsafeRow, value: float | None, fence: FlightFence) -> Check:
    limit = row.allowed(fence)
    advice = f"set it to {row.shown(row.wanted(fence))}, or add --set-parameters"
    if value is None:
        return Check(row.name, Outcome.FAIL, "not received", limit, "check that the link takes requests")
    outcome = Outcome.PASS if row.allows(value, fence) else Outcome.FAIL
    return Check(row.name, outcome, row.shown(value), limit, advice if outcome is Outcome.FAIL else "")


if __name__ == "__main__":
    for autopilot, name in DOCUMENTS.items():
        document = Path(name)
        document.write_text(with_table(read_text(document), autopilot), encoding="utf-8")
