"""Missions with comments and all ways of writing them, and edits of them, drawn from a random generator."""

from __future__ import annotations

from random import Random

from offboard.authoring.document import Document
from offboard.authoring.edits import (
    AddState,
    AddTemplate,
    AddTransition,
    DeleteState,
    DeleteTransition,
    DuplicateState,
    Edit,
    MoveState,
    MoveTransition,
    RedirectTransition,
    RenameState,
    ReplaceText,
    SetActions,
    SetEvent,
    SetFinal,
    SetGuard,
    SetInitial,
    SetMission,
    SetParameter,
    SetTransitionActions,
    SetUse,
    SetVariable,
    TransitionPath,
)

GUARDS = [
    "frame_seen",
    "not frame_seen",
    "seconds_in_state > 5",
    "frame.d < 0.45 and frame.a < 3",
    "colour == 'red'",
    "-8 < frame.e + frame.w < 8",
    "distance_to_goal_m < 0.2 or seconds_in_mission >= 60",
    "",
]
ACTIONS = [
    "hover",
    "fly_to_goal",
    "cmd.vel_x = (frame.d - 0.4) / 2",
    "goal_m = (0, 0, 2)",
    "colour = 'green'",
    "land",
]
COMMENTS = ["# a comment", "#", "#\ttabs\tand: colons", "# ü → 😀 'quotes\"", "# - when: x", "# state:"]
NAMES = [f"{letter}{number}" for letter in "abcd" for number in range(6)]


class _Writer:
    def __init__(self, random: Random) -> None:
        self.random = random
        self.lines: list[str] = []
        self.step = random.choice([2, 2, 2, 4, 3])
        self.dash = random.choice([self.step, 0, 2])
        self.apart = random.random() < 0.6

    def line(self, indent: int, text: str) -> None:
        random = self.random
        if random.random() < 0.15:
            deeper = random.choice([0, 0, self.step])
            self.lines.append(" " * (indent + deeper) + random.choice(COMMENTS))
        self.lines.append(
            " " * indent + text + (" " + random.choice(COMMENTS) if random.random() < 0.1 else "")
        )

    def actions(self, indent: int, key: str) -> None:
        random = self.random
        chosen = [random.choice(ACTIONS) for _ in range(random.randint(1, 3))]
        if random.random() < 0.15:
            inside = ", ".join(f'"{each}"' if "(" in each else each for each in chosen)
            self.line(indent, f"{key}: [{inside}]")
            return
        self.line(indent, f"{key}:")
        for action in chosen:
            self.line(indent + self.dash, f"- {action}")

    def state(self, indent: int, name: str, around: list[str], depth: int, templates: list[str]) -> None:
        random = self.random
        if random.random() < 0.1:
            self.line(indent, random.choice([f"{name}: {{final: true}}", f"{name}: {{}}", f"{name}:"]))
            return
        self.line(indent, f"{name}:")
        inner = indent + self.step
        if templates and random.random() < 0.3:
            self.line(inner, f"use: {random.choice(templates)}")
            self.line(inner, "enter:")
            self.line(inner + self.dash, f"- colour = '{random.choice(['red', 'green'])}'")
            self.line(inner, f"then: {random.choice(around)}")
            return
        inside = random.sample(NAMES, random.randint(1, 3)) if depth < 2 and random.random() < 0.3 else []
        if inside:
            self.line(inner, f"initial: {inside[0]}")
        for key in ("enter", "during", "exit"):
            if random.random() < 0.4:
                self.actions(inner, key)
        if random.random() < 0.8:
            self.line(inner, "transitions:")
            for _ in range(random.randint(1, 3)):
                self.transition(inner + self.dash, around + inside)
        if inside:
            self.line(inner, "states:")
            self.states(inner + self.step, inside, [*around, *inside], depth + 1, [])
        if random.random() < 0.2:
            self.line(inner, f"resume: {random.choice(around)}")

    def transition(self, indent: int, targets: list[str]) -> None:
        random = self.random
        when, to = random.choice(GUARDS), random.choice(targets)
        if random.random() < 0.1 and "'" not in when:
            self.line(indent, f"- {{when: '{when or 'True'}', to: {to}}}")
            return
        entries = [f"when: {when}"] if when else []
        entries.append(f"to: {to}")
        if random.random() < 0.3:
            entries.reverse()
        self.line(indent, f"- {entries[0]}")
        for entry in entries[1:]:
            self.line(indent + 2, entry)
        if random.random() < 0.2:
            self.line(indent + 2, "do:")
            self.line(indent + 2 + self.dash, f"- {random.choice(ACTIONS)}")

    def states(
        self, indent: int, names: list[str], around: list[str], depth: int, templates: list[str]
    ) -> None:
        for number, name in enumerate(names):
            if number and self.apart:
                self.lines.append("")
            self.state(indent, name, around, depth, templates)


def random_mission(random: Random) -> str:
    """The text of a mission; it can be expanded, but may have states that are not reached and the like."""
    writer = _Writer(random)
    if random.random() < 0.5:
        writer.lines += ["# The mission.", ""]
    names = random.sample(NAMES, random.randint(2, 5))
    templates = random.sample(["leg", "cross", "search"], random.randint(0, 2))
    writer.line(0, "name: drawn")
    writer.line(
        0, random.choice(["description: 'It''s drawn'", "description: >\n  Two\n  lines", "class: open"])
    )
    writer.line(0, f"initial: {names[0]}")
    if random.random() < 0.6:
        writer.line(
            0, random.choice(["variables: {x0: 0, y0: 'a'}", f"variables:\n{' ' * writer.step}x0: 0"])
        )
    if templates:
        writer.line(0, "templates:")
        for template in templates:
            inside = random.sample(NAMES, random.randint(1, 3))
            writer.line(writer.step, f"{template}:")
            writer.line(2 * writer.step, f"initial: {inside[0]}")
            writer.line(2 * writer.step, "states:")
            writer.states(3 * writer.step, inside, [*inside, *names], 1, [])
    writer.line(0, "states:")
    writer.states(writer.step, names, names, 0, templates)
    if random.random() < 0.3:
        writer.lines.append(random.choice(COMMENTS))
    text = "\n".join(writer.lines) + ("\n" if random.random() < 0.8 else "")
    if random.random() < 0.4:
        end = random.choice(["\r\n", "\r\n", "mixed"])
        text = (
            "".join(
                line + (random.choice(["\n", "\r\n"]) if end == "mixed" else end)
                for line in text.split("\n")[:-1]
            )
            + text.split("\n")[-1]
        )
    return ("\ufeff" if random.random() < 0.1 else "") + text


def random_edit(document: Document, random: Random, *, text: bool = True) -> Edit:  # noqa: PLR0911, PLR0912
    """An edit that may be refused."""
    states = [state.path for state in document.outline] or ["a0"]
    state, other, name = random.choice(states), random.choice(states), random.choice(NAMES)
    own = [
        TransitionPath(state=each.path, event=transition.event, index=transition.index)
        for each in document.outline
        for transition in each.transitions
    ] or [TransitionPath(state=state)]
    transition = random.choice(own)
    some = tuple(random.choice(ACTIONS) for _ in range(random.randint(0, 3)))
    index = random.choice([None, 0, 1, 2])
    match random.randint(0, 21 if text else 20):
        case 0:
            return AddState(
                name=name, parent=random.choice(["", state]), index=index, final=random.random() < 0.3
            )
        case 1:
            return AddState(name=name, states=("a0", "b0"), parent=random.choice(["", state]))
        case 2:
            return RenameState(state=state, name=name)
        case 3 | 4:
            return MoveState(
                state=state, parent=random.choice(["", other, state.rpartition(".")[0]]), index=index
            )
        case 5:
            return DuplicateState(state=state, name=name)
        case 6:
            return DeleteState(state=state, references=random.choice(["keep", "delete"]))
        case 7 | 8:
            event = random.choice(["tick", "tick", "tick", "done", "resume"])
            when = random.choice(GUARDS) if event == "tick" else ""
            actions = some if event == "tick" else ()
            return AddTransition(state=state, to=other, when=when, actions=actions, event=event, index=index)
        case 9:
            return DeleteTransition(transition=transition)
        case 10:
            return RedirectTransition(transition=transition, to=other)
        case 11:
            return MoveTransition(transition=transition, index=random.randint(0, 3))
        case 12 | 13:
            return SetGuard(transition=transition, when=random.choice(GUARDS))
        case 14:
            return SetTransitionActions(transition=transition, actions=some)
        case 15:
            return SetActions(state=state, section=random.choice(["enter", "during", "exit"]), actions=some)
        case 16:
            return SetInitial(state=random.choice(["", state]), name=name)
        case 17:
            return random.choice(
                [SetFinal(state=state, final=random.random() < 0.5), SetUse(state=state, template="leg")]
            )
        case 18:
            return SetParameter(state=state, name="colour", value=random.choice(["'blue'", "'red'"]))
        case 19:
            value = random.choice([None, "1", "(0, 0, 2)"])
            return random.choice(
                [SetVariable(name=name, value=value), SetMission(key="description", value="It: is # new")]
            )
        case 20:
            return random.choice(
                [AddTemplate(name=name, states=("a0",)), SetEvent(transition=transition, event="done")]
            )
        case _:
            start = random.randint(0, len(document.text))
            end = min(len(document.text), start + random.choice([0, 0, 1, 30]))
            return ReplaceText(
                start=start, end=end, text=random.choice(["x", "\n", "  # typed\r\n", "'", "", "😀"])
            )
