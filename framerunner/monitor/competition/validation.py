"""What judges, drones and referees may send: forms and texts. Anything else is refused in one line."""

from __future__ import annotations

import unicodedata
from typing import Annotated, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from framerunner.errors import UserError
from framerunner.monitor.competition.rules import MAX_CONTACTS, MAX_S
from framerunner.monitor.competition.views import Counting

MAX_SCENARIOS = 10  # of a round
MAX_POOL = 200
MAX_QUEUED = 500

_CONTROL = frozenset({"Cc", "Cs", "Zl", "Zp"})
_BIDI = frozenset("\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069")  # change the direction of text

Id = Annotated[int, Field(ge=1, le=2**31 - 1)]
Seconds = Annotated[float, Field(ge=0, le=MAX_S, allow_inf_nan=False)]
Name = Annotated[str, Field(max_length=80)]

_HINTS = {
    "name": "give 1 to 60 characters",
    "members": "give at most 300 characters",
    "withdrawn": "give true or false",
    "team": "give the number of a team, or null for none",
    "scenario": 'give the name of a scenario, or "" for whatever the drone flies',
    "pool": f"give a list of 1 to {MAX_POOL} names of scenarios",
    "count": f"give a whole number from 1 to {MAX_SCENARIOS}",
    "seen": "give the try's `judgements`, or the queue's `number`, as you saw it",
    "call": "give the id of the last call",
    "teams": f"give a list of at most {MAX_QUEUED} numbers of teams, the first flies first",
    "shuffle": "give true or false",
    "crossed": "give a list of colours, or null for what the referee says",
    "contacts": f"give a whole number from 0 to {MAX_CONTACTS}, or null for what the referee says",
    "penalty_s": f"give seconds from 0 to {MAX_S:.0f}, or null for what the referee says",
    "try_time_s": f"give seconds from 0 to {MAX_S:.0f}, or null for what the referee says",
    "completed": "give true, false, or null for what the referee says",
    "remarks": "give at most 1000 characters",
    "limit_s": f"give seconds from 1 to {MAX_S:.0f}",
    "missing_frame_s": f"give seconds from 0 to {MAX_S:.0f}",
    "scenarios": f"give a whole number from 1 to {MAX_SCENARIOS}",
    "counting": 'give "best" or "last"',
}


class RefusedError(UserError):
    """A request is refused; the message is one line with field, value and what to do.

    Attributes:
        status: of HTTP: 422 for bad input, 404 for what does not exist, 409 when it changed meanwhile.
    """

    def __init__(self, message: str, status: int = 422) -> None:
        super().__init__(message)
        self.status = status


class FormModel(BaseModel):
    """Base of all forms: exact types, and an unknown field is an error."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


class TeamForm(FormModel):
    """A new team."""

    name: str
    members: str = ""


class TeamChangeForm(FormModel):
    """Changes of a team; null leaves a field as it is."""

    name: str | None = None
    members: str | None = None
    withdrawn: bool | None = None


class NextForm(FormModel):
    """The team to call to the start; null for none."""

    team: Id | None
    scenario: Name = Field("", description="empty for whatever the drone flies")


class UndoForm(FormModel):
    """A call to take back."""

    call: Id


class QueueForm(FormModel):
    """The order in which teams are to fly."""

    seen: int = Field(ge=0, description="the number of the queue that the judge saw")
    teams: list[Id] = Field(max_length=MAX_QUEUED, description="the first flies first")
    shuffle: bool = Field(False, description="put them in a random order")


class DrawForm(FormModel):
    """A draw of scenarios."""

    pool: list[Name] = Field(min_length=1, max_length=MAX_POOL)
    count: int | None = Field(None, ge=1, le=MAX_SCENARIOS, description="null for as many as a round has")


class ScenarioForm(FormModel):
    """A scenario to be added to the pool of a draw."""

    scenario: Name


class JudgementForm(FormModel):
    """A correction. It replaces an earlier one: what is left out or null is as the referee says."""

    seen: int = Field(ge=0, description="the try's `judgements` that the judge saw")
    crossed: list[Name] | None = Field(None, max_length=10)
    contacts: int | None = Field(None, ge=0, le=MAX_CONTACTS)
    penalty_s: Seconds | None = None
    try_time_s: Seconds | None = None
    completed: bool | None = None
    remarks: str = ""


class TeamOfTryForm(FormModel):
    """The team that flew a try; null for none."""

    seen: int = Field(ge=0, description="the try's `judgements` that the judge saw")
    team: Id | None


class SettingsForm(FormModel):
    """The combination rule."""

    limit_s: float = Field(ge=1, le=MAX_S, allow_inf_nan=False)
    missing_frame_s: Seconds
    scenarios: int = Field(ge=1, le=MAX_SCENARIOS)
    counting: Counting


Form = TypeVar("Form", bound=FormModel)


def read_form(model: type[Form], body: bytes) -> Form:
    """Read a form from JSON.

    Raises:
        RefusedError: it is invalid; the message names the first bad field, its value and what to do.
    """
    try:
        return model.model_validate_json(body)
    except ValidationError as error:
        detail = error.errors(include_url=False)[0]
        raise RefusedError(_one_line(model, detail["type"], detail["loc"], detail["input"])) from error
    except (UnicodeError, RecursionError) as error:
        raise RefusedError("the body is not JSON in UTF-8; send an object") from error


def _one_line(model: type[FormModel], kind: str, path: tuple[int | str, ...], value: object) -> str:
    known = ", ".join(model.model_fields)
    if kind == "json_invalid":
        return f"the body is not JSON; send an object with {known}"
    if not path:
        return f"the body {shown(value)} is not an object; send one with {known}"
    field = str(path[0])
    if kind == "extra_forbidden":
        return f"{shown(field)} is not a field; known are {known}"
    if kind == "missing":
        return f"{field} is missing; {_HINTS[field]}"
    return f"{field} {shown(value)} cannot be taken; {_HINTS[field]}"


def team_name(value: str) -> str:
    """Check a team's name and collapse its spaces.

    Raises:
        RefusedError: it is empty, too long or has control characters.
    """
    if any(_is_control(character) for character in value):
        raise RefusedError(f"name {shown(value)} has control characters; remove them")
    name = " ".join(value.split())
    if not any(unicodedata.category(character)[0] in "LNPS" for character in name):
        raise RefusedError(f"name {shown(name)} shows nothing; give 1 to 60 characters")
    if len(name) > 60:
        raise RefusedError(f"name {shown(name)} has {len(name)} characters; use 60 or fewer")
    return name


def name_key(name: str) -> str:
    """A name for comparison: without case, width of letters and invisible characters; spaces as one."""
    folded = unicodedata.normalize("NFKC", unicodedata.normalize("NFKC", name).casefold())
    seen = "".join(character for character in folded if unicodedata.category(character) != "Cf")
    return " ".join(seen.split())[:300]


def free_text(value: str, field: str, max_length: int) -> str:
    """Check a text of several lines.

    Raises:
        RefusedError: it is too long or has control characters other than line ends and tabs.
    """
    text = value.replace("\r\n", "\n").replace("\r", "\n").strip()
    if len(text) > max_length:
        raise RefusedError(f"{field} {shown(text)} has {len(text)} characters; use {max_length} or fewer")
    if any(_is_control(character) for character in text if character not in "\n\t"):
        raise RefusedError(f"{field} {shown(text)} has control characters; remove them")
    return text


def from_wire(value: object, max_length: int) -> str:
    """Cut a text from a drone or a referee, and remove its control characters; "" if it is no text."""
    text = value if isinstance(value, str) else ""
    return "".join(character for character in text[:max_length] if not _is_control(character))


def shown(value: object) -> str:
    """Quote a value for a message: short, and on one line."""
    text = str(value)
    kept = "".join("\ufffd" if _is_control(character) else character for character in text[:41])
    return f'"{kept[:40]}…"' if len(text) > 40 else f'"{kept}"'


def _is_control(character: str) -> bool:
    return unicodedata.category(character) in _CONTROL or character in _BIDI
