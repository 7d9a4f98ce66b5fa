"""What an edit may change: in the meaning of a mission, and in the lines of its text."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace

from framerunner.files.yaml_text import ListNode
from offboard.authoring import edits
from offboard.authoring.blocks import Blocks
from offboard.authoring.document import Document
from offboard.authoring.outline import TransitionOutline
from offboard.authoring.references import instances, prefix_change
from offboard.chart.spec import all_states


@dataclass(frozen=True)
class Meaning:
    """A state of the expanded chart, without places."""

    enter: tuple[str, ...]
    during: tuple[str, ...]
    exit: tuple[str, ...]
    transitions: tuple[tuple[str, str, tuple[str, ...]], ...]
    then: str
    resume: str
    final: bool
    initial: str

    def moved(self, change) -> Meaning:
        transitions = tuple((when, change(to), do) for when, to, do in self.transitions)
        return replace(self, transitions=transitions, then=change(self.then), resume=change(self.resume))

    def unresolved(self, known: Meaning) -> Meaning:
        """Without the targets that another state names but that were no states."""
        pairs = zip(self.transitions, known.transitions, strict=True)
        return replace(
            self,
            transitions=tuple((w, "?" if o[1] == "?" else to, do) for (w, to, do), o in pairs),
            then="?" if known.then == "?" else self.then,
            resume="?" if known.resume == "?" else self.resume,
        )

    def without_targets(self) -> Meaning:
        return self.moved(lambda _: "")


def meanings(document: Document) -> dict[str, Meaning]:
    assert document.chart is not None
    ids = {"", *(state.id for state in all_states(document.chart.states))}

    def known(target: str) -> str:
        return target if target in ids else "?"

    return {
        state.id: Meaning(
            tuple(map(str, state.enter)),
            tuple(map(str, state.during)),
            tuple(map(str, state.exit)),
            tuple((each.when, known(each.to), tuple(map(str, each.actions))) for each in state.transitions),
            "" if state.then is None else known(state.then.to),
            "" if state.resume is None else known(state.resume.to),
            state.final,
            state.initial,
        )
        for state in all_states(document.chart.states)
    }


def check_meaning(before: Document, edit: edits.Edit, after: Document) -> None:  # noqa: PLR0912 - one case for each kind
    """Only what the edit names has changed, as it says."""
    old, new = meanings(before), meanings(after)
    match edit:
        case edits.RenameState() | edits.MoveState():
            state = before.outline.get(edit.state)
            change = _id_change(before, edit)
            assert {change(each) for each in old} == set(new)
            for each, meaning in old.items():
                assert _same(new[change(each)], meaning.moved(change)), each
            if isinstance(edit, edits.RenameState) and not state.is_template:
                parents = {each.rpartition(".")[0] for each in instances(before, state)} - {""}
                for each in parents:
                    name = old[each].initial
                    assert new[each].initial == (edit.name if name == state.name else name)
        case edits.AddState() | edits.AddTemplate() | edits.DuplicateState():
            assert set(old) <= set(new)
            for each, meaning in old.items():
                assert _same(new[each], meaning), each
            if isinstance(edit, edits.DuplicateState):
                state = before.outline.get(edit.state)
                for own in instances(before, state) if not state.is_template else ():
                    copy = prefix_change([(own, f"{own.rpartition('.')[0]}.{edit.name}".lstrip("."))])
                    for each, meaning in old.items():
                        if copy(each) != each:
                            assert new[copy(each)].without_targets() == meaning.without_targets()
                        if copy(each) != each and before.outline.get(each) and not state.text("use"):
                            assert new[copy(each)].unresolved(meaning) == meaning.moved(copy)
        case edits.DeleteState():
            state = before.outline.get(edit.state)
            gone = instances(before, state)
            if state.is_template:
                gone = tuple(f"{each}.{child.name}" for each in gone for child in state.states)
            kept = {each for each in old if not f"{each}.".startswith(tuple(f"{each}." for each in gone))}
            assert kept == set(new)
            if edit.references == "keep" and not state.is_template:
                for each in kept:
                    assert new[each].without_targets() == old[each].without_targets()
        case edits.SetMission() | edits.SetVariable():
            assert old == new
        case edits.SetInitial(state=""):
            assert old == new
            assert after.outline.text("initial") == edit.name
        case edits.SetUse():
            pass
        case _:
            _check_inside(before, edit, after, old, new)


def _check_inside(before, edit, after, old, new) -> None:
    path = edit.transition.state if hasattr(edit, "transition") else edit.state
    state = before.outline.get(path)
    own = instances(before, state)
    assert set(old) == set(new)
    for each in set(old) - set(own):
        assert new[each] == old[each], each
    written = after.outline.get(path)
    match edit:
        case edits.SetActions():
            assert [each.text.strip() for each in written.actions(edit.section)] == list(edit.actions)
            for each in own if not state.is_template else ():
                assert replace(new[each], **{edit.section: ()}) == replace(old[each], **{edit.section: ()})
        case edits.SetGuard() | edits.RedirectTransition() | edits.SetTransitionActions():
            was, now = (_transition(d, edit.transition) for d in (before, after))
            if isinstance(edit, edits.SetGuard):
                assert (now.when.text.strip() if now.when else "") == edit.when
            elif isinstance(edit, edits.SetTransitionActions):
                assert [each.text.strip() for each in now.actions] == list(edit.actions)
            else:
                targets = {each.split(".")[-1] for each in instances(before, before.outline.get(edit.to))}
                assert now.to.text.strip().split(".")[-1] in targets | {edit.to.split(".")[-1]}
            assert was.event == now.event
            for each in own:
                assert len(new[each].transitions) == len(old[each].transitions)
                assert replace(new[each], transitions=(), then="", resume="") == replace(
                    old[each], transitions=(), then="", resume=""
                )
        case edits.MoveTransition():
            count = len([each for each in state.transitions if each.event == "tick"])
            for each in own:
                moved = list(old[each].transitions[:count])
                moved.insert(min(edit.index, count - 1), moved.pop(edit.transition.index))
                assert list(new[each].transitions[:count]) == moved
        case edits.AddTransition(event="tick") | edits.DeleteTransition():
            by = 1 if isinstance(edit, edits.AddTransition) else -1
            if isinstance(edit, edits.AddTransition) or edit.transition.event == "tick":
                assert len(written.transitions) == len(state.transitions) + by


def _same(new: Meaning, old: Meaning) -> bool:
    """Whether a state means the same but for where it starts; what led to no state before may lead to one."""
    return replace(new.unresolved(old), initial="") == replace(old, initial="")


def _transition(document: Document, path) -> TransitionOutline:
    state = document.outline.get(path.state)
    return next(t for t in state.transitions if (t.event, t.index) == (path.event, path.index))


def _id_change(document: Document, edit):
    state = document.outline.get(edit.state)
    ids = instances(document, state)
    if isinstance(edit, edits.RenameState):
        if state.is_template:
            return lambda each: each
        return prefix_change([(i, f"{i.rpartition('.')[0]}.{edit.name}".lstrip(".")) for i in ids])
    if state.path.startswith("@"):
        own, around = (path.partition(".")[2] for path in (state.path, f"{edit.parent}.x"))
        to = f"{around.rpartition('.')[0]}.{state.name}".lstrip(".")
        return prefix_change([(i, i.removesuffix(own) + to) for i in ids])
    return prefix_change([(i, f"{edit.parent}.{state.name}".lstrip(".")) for i in ids])


def check_lines(before: Document, edit: edits.Edit, after: Document) -> None:
    """No line outside the state or transition has changed; empty lines between states do not count."""
    old, new = before.text, after.text
    match edit:
        case edits.RenameState():
            name = before.outline.get(edit.state).name
            pairs = list(zip(old.split("\n"), new.split("\n"), strict=True))
            assert all(name in one or edit.name in one for one, other in pairs if one != other)
        case edits.AddState() | edits.AddTemplate() | edits.DuplicateState():
            # Nothing is taken away; only references that another name would have caught are rewritten.
            _check_only_added(old, new)
        case edits.DeleteState(references="keep"):
            block = _block(before, edit.state)
            rest = old[: block[0]] + old[block[1] :]
            _check_only_added(new, rest)
            assert len(_lines(rest)) - len(_lines(new)) <= 2  # "states:" and the "initial" of what has none
        case edits.MoveState():
            moved = _block(before, edit.state)
            rest = old[: moved[0]] + old[moved[1] :]
            placed = _block(after, f"{edit.parent}.{edit.state.rpartition('.')[2]}".lstrip("."))
            others = new[: placed[0]] + new[placed[1] :]
            # references may be rewritten, `states:` and `initial:` may come or go
            left, right = (_lines(text) for text in (rest, others))
            missing = Counter(map(str.strip, left)) - Counter(map(str.strip, right))
            keys = ("to:", "then:", "resume:", "states:", "{")
            assert all(any(key in line for key in keys) for line in missing), missing
        case edits.SetGuard() | edits.RedirectTransition() | edits.SetTransitionActions():
            _check_region(old, new, _transition_block(before, edit.transition))
        case edits.SetMission() | edits.SetVariable() | edits.DeleteState() | edits.SetInitial(state=""):
            pass
        case _:
            path = edit.transition.state if hasattr(edit, "transition") else edit.state
            _check_region(old, new, _block(before, path))


def _lines(text: str) -> list[str]:
    return [line.rstrip() for line in text.split("\n") if line.strip()]


def _check_only_added(old: str, new: str) -> None:
    """All lines of the old text are in the new one."""
    missing = list((Counter(_lines(old)) - Counter(_lines(new))).elements())
    allowed = ("to:", "then:", "resume:", "states:", "{", "templates:")
    assert all(any(key in line for key in allowed) for line in missing), missing


def _check_region(old: str, new: str, block: tuple[int, int]) -> None:
    start, end = block
    tail = len(old) - end
    assert new[:start] == old[:start]
    assert tail == 0 or new[-tail:] == old[end:]


def _block(document: Document, path: str) -> tuple[int, int]:
    state = document.outline.get(path)
    if state.container.flow:
        return state.span.start, state.span.end
    span = Blocks(document).entry(state.container, state.name)
    return span.start, span.end


def _transition_block(document: Document, path) -> tuple[int, int]:
    state, transition = document.outline.get(path.state), _transition(document, path)
    node = state.entry("transitions")
    if transition.event != "tick" or (isinstance(node, ListNode) and node.flow):
        return _block(document, path.state)
    span = Blocks(document).item(node, transition.index)
    return span.start, span.end
