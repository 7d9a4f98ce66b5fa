"""What judges may ask for, as models; anything else is refused in one line."""

from __future__ import annotations

from typing import Annotated, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from monitor.competition.rules import LONGEST_S, MOST_CONTACTS, Counting
from monitor.competition.words import Refused, shown

MOST_BODY_BYTES = 65_536
MOST_SCENARIOS = 10  # of a round
MOST_POOL = 200
MOST_QUEUED = 500

Id = Annotated[int, Field(ge=1, le=2**31 - 1)]
Seconds = Annotated[float, Field(ge=0, le=LONGEST_S, allow_inf_nan=False)]
Name = Annotated[str, Field(max_length=80)]

_MENDS = {
    "name": "give 1 to 60 characters",
    "members": "give at most 300 characters",
    "withdrawn": "give true or false",
    "team": "give the number of a team, or null for none",
    "scenario": 'give the name of a scenario, or "" for whatever the drone flies',
    "pool": f"give a list of 1 to {MOST_POOL} names of scenarios",
    "count": f"give a whole number from 1 to {MOST_SCENARIOS}",
    "seen": "give the try's `judgements`, or the queue's `number`, as you saw it",
    "call": "give the id of the last call",
    "teams": f"give a list of at most {MOST_QUEUED} numbers of teams, the first flies first",
    "shuffle": "give true or false",
    "crossed": "give a list of colours, or null for what the referee says",
    "contacts": f"give a whole number from 0 to {MOST_CONTACTS}, or null for what the referee says",
    "penalty_s": f"give seconds from 0 to {LONGEST_S:.0f}, or null for what the referee says",
    "try_time_s": f"give seconds from 0 to {LONGEST_S:.0f}, or null for what the referee says",
    "completed": "give true, false, or null for what the referee says",
    "remarks": "give at most 1000 characters",
    "limit_s": f"give seconds from 1 to {LONGEST_S:.0f}",
    "missing_frame_s": f"give seconds from 0 to {LONGEST_S:.0f}",
    "scenarios": f"give a whole number from 1 to {MOST_SCENARIOS}",
    "counting": 'give "best" or "last"',
}


class FormModel(BaseModel):
    """Base of all forms: exact types, and an unknown field is an error."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


class TeamForm(FormModel):
    """A new team."""

    name: str
    members: str = ""


class TeamChangeForm(FormModel):
    """Changes of a team; what is left out stays."""

    name: str | None = None
    members: str | None = None
    withdrawn: bool | None = None


class NextForm(FormModel):
    """Whom to call to the start; null for nobody."""

    team: Id | None
    scenario: Name = Field("", description="empty for whatever the drone flies")


class UndoForm(FormModel):
    """A call to take back."""

    call: Id


class QueueForm(FormModel):
    """The order in which teams are to fly."""

    seen: int = Field(ge=0, description="the number of the queue when the judge looked at it")
    teams: list[Id] = Field(max_length=MOST_QUEUED, description="the first flies first")
    shuffle: bool = Field(False, description="put them in a random order")


class DrawForm(FormModel):
    """A draw of scenarios."""

    pool: list[Name] = Field(min_length=1, max_length=MOST_POOL)
    count: int | None = Field(None, ge=1, le=MOST_SCENARIOS, description="null for as many as a round has")


class JudgementForm(FormModel):
    """A correction. It takes the place of an earlier one: what is left out or null is as the referee says."""

    seen: int = Field(ge=0, description="the try's `judgements` when the judge looked at it")
    crossed: list[Name] | None = Field(None, max_length=10)
    contacts: int | None = Field(None, ge=0, le=MOST_CONTACTS)
    penalty_s: Seconds | None = None
    try_time_s: Seconds | None = None
    completed: bool | None = None
    remarks: str = ""


class TeamOfTryForm(FormModel):
    """Whose try it was; null for nobody's."""

    seen: int = Field(ge=0, description="the try's `judgements` when the judge looked at it")
    team: Id | None


class SettingsForm(FormModel):
    """The combination rule."""

    limit_s: float = Field(ge=1, le=LONGEST_S, allow_inf_nan=False)
    missing_frame_s: Seconds
    scenarios: int = Field(ge=1, le=MOST_SCENARIOS)
    counting: Counting


Form = TypeVar("Form", bound=FormModel)


def read_form(model: type[Form], body: bytes) -> Form:
    """Read a form from JSON.

    Raises:
        Refused: it is not one; the message names the first bad field, its value and the mend.
    """
    try:
        return model.model_validate_json(body)
    except ValidationError as error:
        detail = error.errors(include_url=False)[0]
        raise Refused(_one_line(model, detail["type"], detail["loc"], detail["input"])) from error
    except (UnicodeError, RecursionError) as error:
        raise Refused("the body is not JSON in UTF-8; send an object") from error


def _one_line(model: type[FormModel], kind: str, place: tuple[int | str, ...], value: object) -> str:
    known = ", ".join(model.model_fields)
    if kind == "json_invalid":
        return f"the body is not JSON; send an object with {known}"
    if not place:
        return f"the body {shown(value)} is not an object; send one with {known}"
    field = str(place[0])
    if kind == "extra_forbidden":
        return f"{shown(field)} is not a field; known are {known}"
    mend = _MENDS[field]
    if kind == "missing":
        return f"{field} is missing; {mend}"
    return f"{field} {shown(value)} cannot be taken; {mend}"
