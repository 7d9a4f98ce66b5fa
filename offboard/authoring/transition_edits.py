"""How edits of transitions change the text, and those of the mission itself."""

from __future__ import annotations

from framerunner.files.yaml_text import ListNode, MapNode, Scalar
from offboard.authoring.blocks import Owner
from offboard.authoring.edit_texts import EditError
from offboard.authoring.edits import (
    AddTransition,
    DeleteTransition,
    MoveTransition,
    RedirectTransition,
    SetEvent,
    SetGuard,
    SetMission,
    SetSource,
    SetTransitionActions,
    SetVariable,
)
from offboard.authoring.outline import KEYS, StateOutline
from offboard.authoring.state_edits import deleted_reference
from offboard.authoring.work import STATE_ORDER, Work, keys_before
from offboard.authoring.yaml_writer import Value
from offboard.chart.read import MISSION_KEYS, TRANSITION_KEYS


def add_transition(work: Work, edit: AddTransition) -> None:
    """Add a transition to a state."""
    state = work.state(edit.state)
    to = work.target_text(edit.state, edit.to)
    if edit.event != "tick":
        _add_single(work, state, edit, to)
        return
    if state.text("final").lower() == "true":
        raise EditError("edit.final", state=state.path)
    value: dict[str, Value] = {"when": edit.when.strip()} if edit.when.strip() else {}
    value["to"] = to
    if edit.actions:
        value["do"] = [each.strip() for each in edit.actions]
    node = state.entry("transitions")
    if isinstance(node, ListNode) and (node.items or node.flow):
        index = len(node.items) if edit.index is None else min(edit.index, len(node.items))
        work.patch(work.blocks.add_item(node, index, value))
    else:
        order = keys_before(STATE_ORDER, "transitions")
        work.patch(*work.blocks.set_list(work.owner(state), "transitions", [value], order))


def _add_single(work: Work, state: StateOutline, edit: AddTransition, to: str) -> None:
    key = KEYS[edit.event]
    if edit.when.strip() or edit.actions:
        raise EditError("edit.plain_event", event=edit.event)
    if state.text(key):
        raise EditError("edit.event_taken", state=state.path, event=edit.event)
    if state.is_template and edit.event == "done":
        raise EditError("edit.then_of_template")
    work.set_text(state, key, to)


def delete_transition(work: Work, edit: DeleteTransition) -> None:
    """Delete a transition."""
    state, transition = work.transition(edit.transition)
    work.patch(deleted_reference(work, state.path, transition.event, transition.index))


def redirect_transition(work: Work, edit: RedirectTransition) -> None:
    """Set the target of a transition."""
    state, transition = work.transition(edit.transition)
    to = work.target_text(state.path, edit.to)
    if transition.event != "tick":
        work.set_text(state, KEYS[transition.event], to)
    else:
        work.set_key(Owner(None, transition.node), "to", to, TRANSITION_KEYS)


def set_source(work: Work, edit: SetSource) -> None:
    """Give a transition to another state."""
    state, transition = work.transition(edit.transition)
    if edit.state == state.path:
        return
    when = "" if transition.when is None else transition.when.text
    actions = tuple(each.text for each in transition.actions)
    to, event = edit.to, transition.event
    add_transition(work, AddTransition(state=edit.state, to=to, when=when, actions=actions, event=event))
    work.patch(deleted_reference(work, state.path, event, transition.index))


def move_transition(work: Work, edit: MoveTransition) -> None:
    """Set the order of priority of a transition."""
    state, transition = work.transition(edit.transition)
    if transition.event != "tick":
        raise EditError("edit.no_order", event=transition.event)
    node = state.entry("transitions")
    assert isinstance(node, ListNode)
    to = min(edit.index, len(node.items) - 1)
    if to == transition.index:
        return
    blocks = work.blocks
    last_has_no_end = not work.document.text.endswith("\n")
    patches = blocks.move_item(node, transition.index, to)
    if last_has_no_end and not node.flow and len(node.items) - 1 in (to, transition.index):
        work.patch((len(work.document.text), len(work.document.text), "\n"))
        move_transition(work, edit)
        end = len(work.document.text)
        work.patch((end - 1, end, ""))
        return
    work.patch(*patches)


def set_guard(work: Work, edit: SetGuard) -> None:
    """Set the guard of a transition."""
    _, transition = work.transition(edit.transition)
    if transition.event != "tick":
        raise EditError("edit.no_guard", event=transition.event)
    work.set_key(Owner(None, transition.node), "when", edit.when.strip(), TRANSITION_KEYS)


def set_transition_actions(work: Work, edit: SetTransitionActions) -> None:
    """Set the actions of a transition."""
    _, transition = work.transition(edit.transition)
    if transition.event != "tick":
        raise EditError("edit.no_actions", event=transition.event)
    owner, order = Owner(None, transition.node), keys_before(TRANSITION_KEYS, "do")
    work.patch(*work.blocks.set_list(owner, "do", [each.strip() for each in edit.actions], order))


def set_event(work: Work, edit: SetEvent) -> None:
    """Let a transition be looked at on another event."""
    state, transition = work.transition(edit.transition)
    if transition.event == edit.event:
        return
    if transition.when is not None or transition.actions:
        raise EditError("edit.is_tick")
    if transition.to is None:
        raise EditError("edit.leads_nowhere")
    to = transition.to.text.strip()
    if edit.event != "tick" and state.text(KEYS[edit.event]):
        raise EditError("edit.event_taken", state=state.path, event=edit.event)
    work.patch(deleted_reference(work, state.path, transition.event, transition.index))
    state = work.state(state.path)
    if edit.event != "tick":
        work.set_text(state, KEYS[edit.event], to)
        return
    node = state.entry("transitions")
    if isinstance(node, ListNode) and node.items:
        work.patch(work.blocks.add_item(node, len(node.items), {"to": to}))
    else:
        order = keys_before(STATE_ORDER, "transitions")
        work.patch(*work.blocks.set_list(work.owner(state), "transitions", [{"to": to}], order))


def set_variable(work: Work, edit: SetVariable) -> None:
    """Set, add or remove a variable."""
    root = work.document.outline.root
    node = root.items.get("variables")
    if isinstance(node, MapNode) and node.items:
        if edit.value is None and edit.name in node.items and len(node.items) == 1:
            work.patch(work.blocks.remove_entry(root, "variables"))
        elif edit.name in node.items or edit.value:
            value, order = edit.value or "", (*node.items, edit.name)
            work.set_key(Owner(root.key_nodes["variables"], node), edit.name, value, order)
    elif edit.value and (node is None or (isinstance(node, MapNode) and node.flow)):
        if node is not None:
            work.patch(work.blocks.remove_entry(root, "variables"))
        work.add(work.root, "variables", {edit.name: edit.value}, MISSION_KEYS)
    elif edit.value and isinstance(node, Scalar) and not node.text:
        owner = Owner(root.key_nodes["variables"], node, root.flow)
        work.patch(work.blocks.add_entry(owner, edit.name, edit.value))


def set_mission(work: Work, edit: SetMission) -> None:
    """Set a key of the mission."""
    work.set_key(work.root, edit.key, edit.value.strip(), MISSION_KEYS)
