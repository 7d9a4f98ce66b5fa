"""How edits of states change the text: add, rename, move, duplicate and delete them, and set what they do."""

from __future__ import annotations

from collections import defaultdict

from framerunner.files.yaml_text import MapNode, Scalar
from offboard.authoring.blocks import Owner, Patch
from offboard.authoring.edit_texts import EditError, EditText
from offboard.authoring.edits import (
    AddState,
    AddTemplate,
    DeleteState,
    DuplicateState,
    MoveState,
    RenameState,
    SetActions,
    SetFinal,
    SetInitial,
    SetParameter,
    SetUse,
)
from offboard.authoring.outline import KEYS, TEMPLATE, StateOutline
from offboard.authoring.references import (
    TargetReference,
    beside,
    instances,
    prefix_change,
    references,
    relative,
)
from offboard.authoring.work import STATE_ORDER, Work, keys_before
from offboard.authoring.yaml_writer import Value, style_of
from offboard.chart.problems import cut
from offboard.chart.read import MISSION_KEYS
from offboard.chart.spec import Event, all_states


def add_state(work: Work, edit: AddState) -> None:
    """Add a state to the mission, a state or a template."""
    if edit.use and (edit.states or edit.parent.startswith(TEMPLATE)):
        raise EditError("edit.uses")
    value: dict[str, Value] = {}
    if edit.use:
        value["use"] = edit.use
    if edit.states:
        value["initial"] = edit.states[0]
        value["states"] = {name: {} for name in edit.states}
    if edit.final:
        value["final"] = "true"
    _insert_state(work, edit.parent, edit.name, value, edit.index)


def add_template(work: Work, edit: AddTemplate) -> None:
    """Add a template after the last one."""
    states: dict[str, Value] = {name: {} for name in edit.states}
    _insert_state(work, TEMPLATE, edit.name, {"initial": edit.states[0], "states": states}, None)


def _insert_state(work: Work, parent: str, name: str, value: Value, index: int | None) -> None:
    """Insert a new state or, with the parent "@", a template; it may replace one of the extended mission."""
    _refuse_taken(work, parent, name, replacing=True)
    before = references(work.document).values()
    container, owner = _container(work, parent)
    if container is None or not container.items:
        _add_first(work, owner, "templates" if parent == TEMPLATE else "states", {name: value})
    else:
        index = len(container.items) if index is None else min(index, len(container.items))
        if container.flow:
            if index < len(container.items):
                raise EditError("edit.braces_last")
            work.patch(
                work.blocks.add_entry(Owner(None, container, True), name, value, tuple(container.items))
            )
        else:
            blocks = work.blocks
            lines = style_of(work.document.nodes).entry(name, value, _column(work, container))
            work.patch(blocks.insert_entry_text(container, index, lines, apart=_are_apart(work, container)))
    if parent != TEMPLATE:
        _set_first_initial(work, parent, name)
    work.keep_references(before, lambda path: path, lambda full_id: full_id)


def _set_first_initial(work: Work, parent: str, name: str) -> None:
    """Let what had no states start in its first one."""
    outline = work.document.outline
    if len(outline.states_in(parent)) != 1:
        return
    if parent:
        state = work.state(parent)
        if not state.text("initial"):
            work.set_text(state, "initial", name)
    elif not outline.text("initial") and not outline.text("extends"):
        work.set_key(work.root, "initial", name, MISSION_KEYS)


def _add_first(work: Work, owner: Owner, key: str, value: Value) -> None:
    """Add the mapping of states with a first one, or fill an empty one."""
    node = owner.node
    if isinstance(node, MapNode) and key in node.items:
        inner = Owner(node.key_nodes[key], node.items[key], node.flow)
        assert isinstance(value, dict)
        (name, state), *_ = value.items()
        work.patch(work.blocks.add_entry(inner, name, state))
        return
    order = MISSION_KEYS if owner.key is None else STATE_ORDER
    work.patch(work.blocks.add_entry(owner, key, value, keys_before(order, key)))


def _container(work: Work, parent: str) -> tuple[MapNode | None, Owner]:
    """The mapping of the states of a parent, if there is one, and the parent's own mapping."""
    outline = work.document.outline
    if parent in ("", TEMPLATE):
        owner = work.root
        node = outline.root.items.get("states" if not parent else "templates")
    else:
        state = work.state(parent)
        if state.text("use"):
            raise EditError("edit.of_template", state=parent, template=state.text("use"))
        owner, node = work.owner(state), state.entry("states")
    return (node if isinstance(node, MapNode) else None), owner


def _refuse_taken(work: Work, parent: str, name: str, *, replacing: bool = False) -> None:
    outline = work.document.outline
    siblings = outline.templates if parent == TEMPLATE else outline.states_in(parent)
    if name in [state.name for state in siblings]:
        what = EditText("edit.what_template" if parent == TEMPLATE else "edit.what_state")
        raise EditError("edit.taken", what=what, name=name)
    if parent == "" and not replacing and name in _base_names(work):
        raise EditError("edit.taken_base", base=outline.text("extends"), name=name)


def _base_names(work: Work) -> set[str]:
    """Names of the states at the top and, with a sign, templates of the mission that this one extends."""
    base = work.document.base
    if base is None:
        return set()
    return {state.id for state in base.states} | {TEMPLATE + name for name in base.templates}


def _column(work: Work, container: MapNode) -> int:
    first = next(iter(container.key_nodes.values()))
    return first.start - work.document.positions.line_start(first.start)


def _are_apart(work: Work, container: MapNode) -> bool:
    """Whether empty lines stand between the states of a mapping; of a single one, if it is at the top."""
    names = list(container.items)
    text = work.document.text
    if len(names) > 1:
        end = work.blocks.entry(container, names[0]).end
        return text[end : end + 1] == "\n"
    return container is work.document.outline.root.items.get("states")


def rename_state(work: Work, edit: RenameState) -> None:
    """Rename a state or template, and all that names it."""
    state = work.state(edit.state)
    if state.name == edit.name:
        return
    parent = TEMPLATE if state.is_template else state.parent
    _refuse_taken(work, parent, edit.name)
    if state.path in _base_names(work):
        base = work.document.outline.text("extends")
        raise EditError("edit.replaces", state=state.path, base=base)
    new_path = f"{state.parent}.{edit.name}" if state.parent else edit.name
    patches = [work.blocks.set_scalar(state.key, edit.name)]
    if state.is_template:
        new_path = TEMPLATE + edit.name
        for user in work.document.outline:
            node = user.entry("use")
            if isinstance(node, Scalar) and node.text.strip() == state.name:
                patches.append(work.blocks.set_scalar(node, edit.name, in_braces=user.container.flow))
        before, pairs = references(work.document).values(), []
    else:
        initial = _initial_of(work, state.parent)
        if initial is not None and initial.text.strip() == state.name:
            patches.append(work.blocks.set_scalar(initial, edit.name))
        before = references(work.document).values()
        pairs = [(each, beside(each, edit.name)) for each in instances(work.document, state)]
    work.patch(*patches)
    work.keep_references(before, prefix_change([(state.path, new_path)]), prefix_change(pairs))


def _initial_of(work: Work, parent: str) -> Scalar | None:
    node = work.state(parent).entry("initial") if parent else work.document.outline.root.items.get("initial")
    return node if isinstance(node, Scalar) else None


def move_state(work: Work, edit: MoveState) -> None:
    """Move a state with its lines and comments."""
    state = work.state(edit.state)
    _refuse_move(state, edit)
    if edit.parent != state.parent:
        _refuse_taken(work, edit.parent, state.name)
    before = references(work.document).values()
    old_ids = instances(work.document, state)
    siblings = [each.path for each in work.document.outline.states_in(edit.parent) if each.path != state.path]
    index = len(siblings) if edit.index is None else min(edit.index, len(siblings))
    if edit.parent == state.parent and not siblings:
        return
    _cut_and_insert(work, state, edit.parent, index)
    prefix = f"{edit.parent}." if edit.parent else ""
    path = prefix + state.name
    _set_first_initial(work, edit.parent, state.name)
    cut_from, put_to = f".{relative(state.path)}", f".{relative(path)}"
    if state.path.startswith(TEMPLATE):
        pairs = [(each, each.removesuffix(cut_from) + put_to) for each in old_ids]
    else:
        pairs = [(each, path) for each in old_ids]
    work.keep_references(before, prefix_change([(state.path, path)]), prefix_change(pairs))


def _refuse_move(state: StateOutline, edit: MoveState) -> None:
    if state.is_template:
        raise EditError("edit.template_order")
    if f"{edit.parent}.".startswith(f"{state.path}."):
        raise EditError("edit.into_itself", state=state.path)
    templates = [
        path.partition(".")[0] if path.startswith(TEMPLATE) else "" for path in (state.path, edit.parent)
    ]
    if templates[0] != templates[1]:
        raise EditError("edit.template_border")
    if state.container.flow:
        raise EditError("edit.braces", state=state.path)


def _cut_and_insert(work: Work, state: StateOutline, parent: str, index: int) -> None:
    """Move the lines of a state; the last state of a superstate takes its `states` along."""
    _open_braces(work, parent)
    state = work.state(state.path)
    blocks = work.blocks
    lines = blocks.shifted(blocks.entry(state.container, state.name), 0)
    old_parent = work.document.outline.get(state.parent)
    if old_parent is not None and len(old_parent.states) == 1 and isinstance(old_parent.node, MapNode):
        _remove_with_key(work, old_parent.node, "states", state)
    else:
        work.patch(blocks.remove_state(state.container, state.name))
    container, owner = _container(work, parent)
    if container is not None and container.items and not container.flow:
        lines = _indented(lines, _column(work, container))
        apart = _are_apart(work, container)
        work.patch(work.blocks.insert_entry_text(container, index, lines, apart=apart))
        return
    _add_first(work, owner, "states", {state.name: {}})
    placed = next(each for each in work.document.outline.states_in(parent) if each.name == state.name)
    span = work.blocks.entry(placed.container, placed.name)
    text = "\n".join(_indented(lines, _column(work, placed.container))) + "\n"
    has_end = work.document.text[span.start : span.end].endswith("\n")
    work.patch((span.start, span.end, text if has_end else text[:-1]))


def _open_braces(work: Work, parent: str) -> None:
    """Make room for lines below a parent: take empty braces away, refuse others."""
    container, owner = _container(work, parent)
    node = owner.node
    in_braces = (
        owner.in_braces,
        isinstance(node, MapNode) and node.flow,
        container is not None and container.flow,
    )
    if not any(in_braces):
        return
    if owner.in_braces or not isinstance(node, MapNode) or node.items or owner.key is None:
        raise EditError("edit.braces", state=parent)
    start = len(work.document.text[: node.start].rstrip(" "))
    work.patch((start, node.end, ""))


def _indented(lines: list[str], indent: int) -> list[str]:
    return [" " * indent + line if line.strip() else line for line in lines]


def duplicate_state(work: Work, edit: DuplicateState) -> None:
    """Copy a state beside it; what its transitions lead to within it is copied, too."""
    state = work.state(edit.state)
    if state.container.flow:
        raise EditError("edit.braces", state=state.path)
    _refuse_taken(work, TEMPLATE if state.is_template else state.parent, edit.name)
    before = list(references(work.document).values())
    old_ids = instances(work.document, state)
    names, blocks = list(state.container.items), work.blocks
    span = blocks.entry(state.container, state.name)
    indent = _column(work, state.container)
    renamed = blocks.set_scalar(state.key, edit.name)
    text = work.document.text
    copy = text[span.start : renamed[0]] + renamed[2] + text[renamed[1] : span.end]
    lines = _indented(_unindented(copy.removesuffix("\n").split("\n"), indent), indent)
    index = names.index(state.name) + 1
    apart = _are_apart(work, state.container)
    work.patch(blocks.insert_entry_text(state.container, index, lines, apart=apart))
    prefix = f"{state.parent}." if state.parent else ""
    path = TEMPLATE + edit.name if state.is_template else prefix + edit.name
    work.keep_references(before, lambda each: each, lambda each: each)
    if not state.is_template:
        pairs = [(each, beside(each, edit.name)) for each in old_ids]
        inner = [each for each in before if f"{each.state}.".startswith(f"{state.path}.")]
        work.keep_references(inner, prefix_change([(state.path, path)]), prefix_change(pairs))
    for name, value in edit.parameters.items():
        set_parameter(work, SetParameter(state=path, name=name, value=value))


def _unindented(lines: list[str], indent: int) -> list[str]:
    return [line[min(indent, len(line) - len(line.lstrip(" "))) :] for line in lines]


def delete_state(work: Work, edit: DeleteState) -> None:
    """Delete a state and, if wanted, the transitions to it."""
    state = work.state(edit.state)
    if edit.references == "delete":
        _delete_references(work, state)
        state = work.state(edit.state)
    if len(state.container.items) > 1:
        work.patch(work.blocks.remove_state(state.container, state.name))
        return
    parent = work.document.outline.get(state.parent)
    if parent is not None and isinstance(parent.node, MapNode):
        _remove_with_key(work, parent.node, "states", state)
    else:
        key = "templates" if state.is_template else "states"
        _remove_with_key(work, work.document.outline.root, key, state)


def _remove_with_key(work: Work, node: MapNode, key: str, state: StateOutline) -> None:
    """Remove the only state of a mapping and the line of the mapping's key; other comments stay."""
    if state.container.flow or node.flow:
        work.patch(work.blocks.remove_entry(node, key))
        return
    span = work.blocks.entry(state.container, state.name)
    own, lines = node.key_nodes[key], work.document.positions
    if not lines.is_first_in_line(own.start):
        raise EditError("edit.key_in_line", key=key)
    work.patch((span.start, span.end, ""), (lines.line_start(own.start), lines.line_end(own.end), ""))


def _delete_references(work: Work, state: StateOutline) -> None:
    gone = instances(work.document, state)
    leading: dict[str, list[TargetReference]] = defaultdict(list)
    for reference in sorted(references(work.document).values(), key=lambda each: each.index):
        inside = f"{reference.state}.".startswith(f"{state.path}.")
        targets = {target for _, target in reference.leads}
        if not inside and all(f"{t}.".startswith(tuple(f"{each}." for each in gone)) for t in targets):
            leading[reference.state].append(reference)
    while any(leading.values()):  # one of each state at a time: the text is read anew after each step
        last = [each.pop() for each in leading.values() if each]
        work.patch(*(deleted_reference(work, each.state, each.event, each.index) for each in last))


def deleted_reference(work: Work, path: str, event: Event, index: int) -> Patch:
    """What deletes a transition as written."""
    state = work.state(path)
    assert isinstance(state.node, MapNode)
    if event != "tick":
        return work.blocks.remove_entry(state.node, KEYS[event])
    node = state.node.items["transitions"]
    assert not isinstance(node, (Scalar, MapNode))
    if len(node.items) == 1:
        return work.blocks.remove_entry(state.node, "transitions")
    return work.blocks.remove_item(node, index)


def set_actions(work: Work, edit: SetActions) -> None:
    """Set the actions of a section; lines of those that stay are not touched."""
    owner = work.owner(work.state(edit.state))
    order = keys_before(STATE_ORDER, edit.section)
    work.patch(*work.blocks.set_list(owner, edit.section, [each.strip() for each in edit.actions], order))


def set_initial(work: Work, edit: SetInitial) -> None:
    """Set where a superstate or the mission starts."""
    if edit.name not in _state_names(work, edit.state):
        raise EditError("edit.no_start", name=edit.name)
    if edit.state:
        work.set_text(work.state(edit.state), "initial", edit.name)
    else:
        work.set_key(work.root, "initial", edit.name, MISSION_KEYS)


def _state_names(work: Work, parent: str) -> list[str]:
    own = [state.name for state in work.document.outline.states_in(parent)]
    if parent or work.document.chart is None:
        return own
    return own + [state.name for state in all_states(work.document.chart.states) if "." not in state.id]


def set_final(work: Work, edit: SetFinal) -> None:
    """Make a state final, or not."""
    state = work.state(edit.state)
    if state.is_template:
        raise EditError("edit.template_final")
    work.set_text(state, "final", "true" if edit.final else "")


def set_use(work: Work, edit: SetUse) -> None:
    """Let a state take the states of a template."""
    state = work.state(edit.state)
    if edit.template and (state.states or state.path.startswith(TEMPLATE)):
        raise EditError("edit.uses")
    known = {each.name for each in work.document.outline.templates}
    known |= {name.removeprefix(TEMPLATE) for name in _base_names(work) if name.startswith(TEMPLATE)}
    if edit.template and edit.template not in known:
        raise EditError("edit.no_template", name=edit.template)
    work.set_text(state, "use", edit.template)


def set_parameter(work: Work, edit: SetParameter) -> None:
    """Change the value that a state assigns to a name on entry."""
    state = work.state(edit.state)
    actions = [action.text.strip() for action in state.actions("enter")]
    for number, action in enumerate(actions):
        name, sign, _ = action.partition("=")
        if sign and name.strip() == edit.name:
            actions[number] = f"{edit.name} = {edit.value}"
            set_actions(work, SetActions(state=edit.state, section="enter", actions=tuple(actions)))
            return
    raise EditError("edit.no_parameter", state=cut(edit.state), name=cut(edit.name))
