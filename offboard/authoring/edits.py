"""Edits of a mission as data, as they come from a page: one pydantic model for each, told apart by `kind`.

    edit = parse_edit({"kind": "add_transition", "state": "red", "to": "green", "when": "frame_seen"})

States are named by their path in the text (`red`, `landing.stop`, `@cross_frame.turning`), see `outline`.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from offboard.authoring.edit_texts import EditError
from offboard.authoring.outline import Section
from offboard.chart.spec import Event

Name = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]*$", max_length=60, description="small letters")]
StatePath = Annotated[str, Field(max_length=1000, description="as written, such as landing.stop")]
Line = Annotated[str, Field(max_length=500, pattern=r"^[^\r\n]*$", description="one line")]
Actions = Annotated[tuple[Line, ...], Field(max_length=200, description="primitives and assignments")]
Index = Annotated[int, Field(ge=0, le=10_000)]


class StrictModel(BaseModel):
    """Data that comes from outside: it cannot be changed, and has no fields but its own."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class TransitionPath(StrictModel):
    """Which transition: a state's `index`-th of the event "tick", or its only one of another event."""

    state: StatePath
    event: Event = "tick"
    index: Index = 0


class _OfState(StrictModel):
    state: StatePath


class _OfTransition(StrictModel):
    transition: TransitionPath


class AddState(StrictModel):
    """A new state at the top, in a state or in a template; with `states` it starts in the first of them.

    At the top it may have the name of a state of the mission that is extended, and replaces that one.
    """

    kind: Literal["add_state"] = "add_state"
    name: Name
    parent: StatePath = ""
    index: Index | None = None  # among its siblings; None: after the last
    final: bool = False
    use: Name | None = None  # the template whose states it takes
    states: Annotated[tuple[Name, ...], Field(max_length=100)] = ()


class AddTemplate(StrictModel):
    """A new template with states, starting in the first."""

    kind: Literal["add_template"] = "add_template"
    name: Name
    states: Annotated[tuple[Name, ...], Field(min_length=1, max_length=100)]


class RenameState(_OfState):
    """Another name for a state or template, also in all that names it in this document."""

    kind: Literal["rename_state"] = "rename_state"
    name: Name


class MoveState(_OfState):
    """A state to another place among its siblings, or into or out of a superstate."""

    kind: Literal["move_state"] = "move_state"
    parent: StatePath = ""
    index: Index | None = None


class DuplicateState(_OfState):
    """A copy of a state beside it, with all its states, and with some of its parameters changed."""

    kind: Literal["duplicate_state"] = "duplicate_state"
    name: Name
    parameters: Annotated[dict[Line, Line], Field(max_length=50)] = Field(default_factory=dict)


class DeleteState(_OfState):
    """A state less; transitions to it are kept, which the checker then reports, or deleted, too."""

    kind: Literal["delete_state"] = "delete_state"
    references: Literal["keep", "delete"] = "keep"


class AddTransition(_OfState):
    """A new transition; only one of the event "tick" has a guard, actions and an order of priority."""

    kind: Literal["add_transition"] = "add_transition"
    to: StatePath  # of the target, as written, or its full id in the chart
    when: Line = ""
    actions: Actions = ()
    event: Event = "tick"
    index: Index | None = None  # its order of priority; None: the last


class DeleteTransition(_OfTransition):
    """A transition less."""

    kind: Literal["delete_transition"] = "delete_transition"


class RedirectTransition(_OfTransition):
    """Another target for a transition."""

    kind: Literal["redirect_transition"] = "redirect_transition"
    to: StatePath


class SetSource(_OfTransition):
    """Another state that has a transition; it comes last there, with its guard and actions."""

    kind: Literal["set_source"] = "set_source"
    state: StatePath  # that has it from now on
    to: StatePath  # its target, which stays


class MoveTransition(_OfTransition):
    """Another order of priority for a transition."""

    kind: Literal["move_transition"] = "move_transition"
    index: Index


class SetGuard(_OfTransition):
    """The guard of a transition; empty for "always"."""

    kind: Literal["set_guard"] = "set_guard"
    when: Line


class SetEvent(_OfTransition):
    """The event of a transition; one with a guard or actions stays one of the event "tick"."""

    kind: Literal["set_event"] = "set_event"
    event: Event


class SetTransitionActions(_OfTransition):
    """What is done when a transition is taken."""

    kind: Literal["set_transition_actions"] = "set_transition_actions"
    actions: Actions


class SetActions(_OfState):
    """What a state does on entry, during or on exit."""

    kind: Literal["set_actions"] = "set_actions"
    section: Section
    actions: Actions


class SetInitial(StrictModel):
    """The state in which a superstate, a template or, with an empty `state`, the mission starts."""

    kind: Literal["set_initial"] = "set_initial"
    state: StatePath = ""
    name: Name


class SetFinal(_OfState):
    """Whether a state is final."""

    kind: Literal["set_final"] = "set_final"
    final: bool


class SetUse(_OfState):
    """The template whose states a state takes; empty for none."""

    kind: Literal["set_use"] = "set_use"
    template: Annotated[str, Field(pattern=r"^([a-z][a-z0-9_]*)?$", max_length=60)]


class SetParameter(_OfState):
    """What a superstate assigns to a name on entry, such as `'green'` to `colour`."""

    kind: Literal["set_parameter"] = "set_parameter"
    name: Line
    value: Line


class SetVariable(StrictModel):
    """A variable of the mission with its first value; None removes it."""

    kind: Literal["set_variable"] = "set_variable"
    name: Name
    value: Line | None


class SetMission(StrictModel):
    """A key of the mission itself; an empty value removes it."""

    kind: Literal["set_mission"] = "set_mission"
    key: Literal["name", "description", "class", "vision", "detector", "extends"]
    value: Line


class ReplaceText(StrictModel):
    """Typed text; offsets count the characters of the document's text, whose lines end with a line feed."""

    kind: Literal["replace_text"] = "replace_text"
    start: Annotated[int, Field(ge=0)]
    end: Annotated[int, Field(ge=0)]
    text: Annotated[str, Field(max_length=1_000_000)]


Edit = Annotated[
    AddState
    | AddTemplate
    | RenameState
    | MoveState
    | DuplicateState
    | DeleteState
    | AddTransition
    | DeleteTransition
    | RedirectTransition
    | SetSource
    | MoveTransition
    | SetGuard
    | SetEvent
    | SetTransitionActions
    | SetActions
    | SetInitial
    | SetFinal
    | SetUse
    | SetParameter
    | SetVariable
    | SetMission
    | ReplaceText,
    Field(discriminator="kind"),
]
_ADAPTER: TypeAdapter[Edit] = TypeAdapter(Edit)


def parse_edit(data: object) -> Edit:
    """An edit from what JSON holds. Raises `EditError` with one line."""
    try:
        return _ADAPTER.validate_python(data)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        where = ".".join(str(part) for part in first["loc"]) or "edit"
        given = repr(first["input"])[:60]
        if first["type"] == "string_pattern_mismatch" and where.endswith("name"):
            raise EditError("edit.name", where=where, given=given) from None
        raise EditError("edit.field", where=where, given=given, what=first["msg"][:200]) from None


def edit_schema() -> dict[str, object]:
    """The JSON Schema of all edits."""
    return _ADAPTER.json_schema()
