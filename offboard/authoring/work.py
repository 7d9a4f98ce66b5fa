"""A document while an edit is applied to it, step by step."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace

from framerunner.files.yaml_text import MapNode, Scalar
from offboard.authoring.blocks import Blocks, Owner, Patch
from offboard.authoring.document import Document
from offboard.authoring.edit_texts import EditError, EditText
from offboard.authoring.edits import TransitionPath
from offboard.authoring.outline import TEMPLATE, StateOutline, TransitionOutline
from offboard.authoring.references import (
    TargetReference,
    chart_ids,
    instances,
    references,
    relative,
    shortest_text,
)
from offboard.authoring.text import TextChange
from offboard.authoring.yaml_writer import Value
from offboard.chart.problems import cut

STATE_ORDER = (
    *("use", "initial", "resume", "enter", "during", "exit"),
    *("transitions", "final", "states", "then"),
)


def keys_before(order: tuple[str, ...], key: str) -> tuple[str, ...]:
    """The keys that are written before one."""
    return order[: order.index(key)]


class Work:
    """What the steps of an edit have made of a document.

    Args:
        document: before the edit.

    Attributes:
        document: after the steps up to now.
        changes: of its text, in order; each is made for the text after those before it.
    """

    def __init__(self, document: Document) -> None:
        if document.unreadable is not None:
            problem = document.unreadable.problems[0]
            line = problem.place.line
            place = EditText("edit.line", line=line) if line else EditText("edit.the_text")
            raise EditError("edit.unreadable", place=place, reason=problem.message)
        self.document = document
        self.changes: list[TextChange] = []

    def patch(self, *patches: Patch) -> None:
        """Replace parts of the text; the offsets of all patches are those before this step."""
        content = self.document.content
        parts = sorted(patches, key=lambda patch: patch[:2], reverse=True)
        for change in content.changes(parts):
            if change.removed != change.inserted:
                self.changes.append(change)
                content = content.changed(change)
        self.document = replace(self.document, content=content)

    @property
    def blocks(self) -> Blocks:
        """Makes patches of the present text."""
        return Blocks(self.document)

    def state(self, path: str) -> StateOutline:
        """The state with a path. Raises `EditError` with what to write instead."""
        found = self.document.outline.get(path)
        if found is not None:
            return found
        top = self.document.outline.get(path.partition(".")[0])
        if top is not None and top.text("use") and "." in path:
            inner = f"{TEMPLATE}{top.text('use')}.{path.partition('.')[2]}"
            if self.document.outline.get(inner) is not None:
                raise EditError("edit.in_template", state=cut(path), inner=cut(inner))
        if path.partition(".")[0] in {each.partition(".")[0] for each in chart_ids(self.document)}:
            base = self.document.outline.text("extends") or EditText("edit.other_template")
            raise EditError("edit.in_other_file", state=cut(path), base=base)
        raise EditError("edit.no_state", state=cut(path))

    def transition(self, path: TransitionPath) -> tuple[StateOutline, TransitionOutline]:
        """A transition with the state that has it. Raises `EditError`."""
        state = self.state(path.state)
        for each in state.transitions:
            if (each.event, each.index) == (path.event, path.index):
                return state, each
        own = [each.index for each in state.transitions if each.event == path.event]
        known = EditText("edit.has", count=len(own)) if own else EditText("edit.has_none")
        raise EditError(
            "edit.no_transition", state=path.state, index=path.index, event=path.event, known=known
        )

    def owner(self, state: StateOutline) -> Owner:
        """A state as a mapping to which entries are added."""
        return Owner(state.key, state.node, state.container.flow)

    @property
    def root(self) -> Owner:
        """The mission as a mapping to which entries are added."""
        return Owner(None, self.document.outline.root)

    def set_text(self, state: StateOutline, key: str, text: str) -> None:
        """Set, add or, with an empty text, remove a key of a state."""
        self.set_key(self.owner(state), key, text, STATE_ORDER)

    def set_key(self, owner: Owner, key: str, text: str, order: tuple[str, ...]) -> None:
        """Set, add or, with an empty text, remove a key of a mapping."""
        node = owner.node.items.get(key) if isinstance(owner.node, MapNode) else None
        if node is None:
            if text:
                self.patch(self.blocks.add_entry(owner, key, text, keys_before(order, key)))
            return
        assert isinstance(owner.node, MapNode)
        if not text:
            self.patch(self.blocks.remove_entry(owner.node, key))
        elif not isinstance(node, Scalar):
            raise EditError("edit.no_line", key=key)
        elif node.text.strip() != text:
            self.patch(self.blocks.set_scalar(node, text, in_braces=owner.node.flow))

    def add(self, owner: Owner, key: str, value: Value, order: tuple[str, ...]) -> None:
        """Add a key to a mapping."""
        self.patch(self.blocks.add_entry(owner, key, value, keys_before(order, key)))

    def target_text(self, source: str, to: str) -> str:
        """How a state's transition names a target, given by its path or its full id. Raises `EditError`."""
        document, state = self.document, self.state(source)
        ids, sources = chart_ids(document), instances(document, state)
        target = document.outline.get(to)
        if target is not None and target.is_template:
            raise EditError("edit.to_template", to=cut(to))
        if not sources:  # of a template that nothing uses yet
            return self._text_in_template(state, target, to)
        targets = (to,) if target is None else instances(document, target)
        if len(targets) != len(sources):
            targets = targets * len(sources) if len(targets) == 1 else ()
        leads = frozenset(zip(sources, targets, strict=True)) if targets else frozenset()
        if not leads or any(each not in ids for each in targets):
            raise EditError("edit.no_way", state=cut(source), to=cut(to))
        name = shortest_text(leads, ids)
        if name is None:
            raise EditError("edit.no_name", state=cut(source), to=cut(to))
        return name

    @staticmethod
    def _text_in_template(state: StateOutline, target: StateOutline | None, to: str) -> str:
        tops = {path.partition(".")[0] for path in (state.path, to) if path.startswith(TEMPLATE)}
        if target is None or len(tops) > 1:
            raise EditError("edit.no_way", state=cut(state.path), to=cut(to))
        return relative(to)

    def keep_references(
        self,
        before: Iterable[TargetReference],
        path_of: Callable[[str], str],
        id_of: Callable[[str], str],
        *,
        source_id_of: Callable[[str], str] | None = None,
    ) -> None:
        """Let transitions lead to the same states as before; those that do are not touched.

        Args:
            before: the references that must be kept.
            path_of: of a state as it was, its path now.
            id_of: of a target as it was, its full id now.
            source_id_of: likewise of the state that has the transition; by default as of a target.

        Raises:
            EditError: a target cannot be named any more.
        """
        source_id_of = source_id_of or id_of
        now, ids = references(self.document), chart_ids(self.document)
        outline = self.document.outline
        patches: list[Patch] = []
        for reference in before:
            leads = frozenset((source_id_of(a), id_of(b)) for a, b in reference.leads)
            leads = frozenset((a, b) for a, b in leads if a in ids and b in ids)
            present = now.get((path_of(reference.state), reference.event, reference.index))
            if not leads or (present is not None and present.leads == leads):
                continue
            state = outline.get(path_of(reference.state))
            targets = [
                each.to
                for each in (state.transitions if state is not None else ())
                if (each.event, each.index) == (reference.event, reference.index)
            ]
            name = shortest_text(leads, ids)
            if name is None or not targets or targets[0] is None or state is None:
                raise EditError("edit.other_target", state=cut(reference.state))
            patches.append(self.blocks.set_scalar(targets[0], name, in_braces=state.container.flow))
        self.patch(*patches)
