"""What the checker says of a document, each finding at its place in text and diagram.

It is the checker of `framerunner mission check`; nothing is checked here.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, replace

from offboard.authoring.document import Document
from offboard.authoring.outline import SECTIONS, Section, Span, StateOutline
from offboard.authoring.references import instances
from offboard.chart.mission_texts import Language, Message
from offboard.chart.problems import MissionError, MissionProblem, ProblemList, Severity
from offboard.chart.spec import Event
from offboard.mission import expand_and_check
from offboard.pilot import Pilot

_WORD = re.compile(r"[\w.]+|\S")
_WITH_REASON = ("when", "action")
_MAX_FINDINGS = 300  # each is looked up in text and diagram


@dataclass(frozen=True, slots=True)
class Finding:
    """Something wrong with a mission, or that may go wrong.

    Attributes:
        severity: "error": not flown; "warning": a part does nothing; "advice": it may wait for ever.
        code: of the kind of fault, such as "name.unknown"; it does not change with the language.
        message: one line for people: what is wrong and what to write.
        file: another file's name if the fault is in what the mission extends; its places are then lines only.
        line, column: counted from 1; 0 if it concerns the whole file, or the whole line.
        start, end: offsets in the text; both 0 if it concerns the whole file.
        state: path of the state as written; empty if it concerns none.
        event, index: the transition of that state; None if it concerns none.
        section: of the actions of that state: "enter", "during", "exit"; empty if it concerns none.
        nodes: full ids of that state in the diagram: of a template's state one for each use.
    """

    severity: Severity
    code: str
    message: str
    file: str
    line: int
    column: int
    start: int = 0
    end: int = 0
    state: str = ""
    event: Event | None = None
    index: int | None = None
    section: Section | str = ""
    nodes: tuple[str, ...] = ()


def check_document(
    document: Document, pilot_class: type[Pilot] = Pilot, language: Language = "en"
) -> tuple[Finding, ...]:
    """The findings of a document, in the order of the text: all, or as many as a person reads, errors first.

    Args:
        document: any; also one that is no mission.
        pilot_class: whose names the mission uses.
        language: of their words.
    """
    return findings_of(document, reported_problems(document, pilot_class), language)


def findings_of(
    document: Document, problems: Iterable[MissionProblem], language: Language = "en"
) -> tuple[Finding, ...]:
    """The findings that problems of a document are, in the same order."""
    return tuple(_finding(document, each, language) for each in problems)


def reported_problems(document: Document, pilot_class: type[Pilot] = Pilot) -> tuple[MissionProblem, ...]:
    """The problems of which `check_document` makes findings, with the same arguments."""
    problems = problems_of(document, pilot_class)
    if len(problems) > _MAX_FINDINGS:
        problems = tuple(sorted(problems, key=lambda each: each.severity != "error"))[:_MAX_FINDINGS]
    return problems


def problems_of(document: Document, pilot_class: type[Pilot] = Pilot) -> tuple[MissionProblem, ...]:
    """What the checker notes of a document."""
    problems = ProblemList()
    try:
        expand_and_check(document.read(), pilot_class, problems, document.open_base)
    except MissionError as error:
        return (*problems.all, *error.problems)
    return problems.all


def _code(message: Message) -> str:
    reason = message.values.get("reason")
    return reason.code if message.code in _WITH_REASON and isinstance(reason, Message) else message.code


def _finding(document: Document, found: MissionProblem, language: Language) -> Finding:
    place, message = found.place, found.message
    plain = Finding(
        found.severity, _code(message), message.text(language), place.file, place.line, place.column
    )
    if place.file != document.label or not place.line:
        return plain
    positions = document.positions
    offset = positions.offset_of_yaml(place.line, place.column)
    span = _span(document, offset, whole_line=not place.column)
    line, column = positions.line_column(span.start)
    column = column if place.column else 0
    placed = replace(plain, line=line, column=column, start=span.start, end=span.end)
    state = document.outline.at(span.start)
    if state is None:
        return placed
    event, index, section = _part(state, span.start)
    nodes = instances(document, state)
    return replace(placed, state=state.path, event=event, index=index, section=section, nodes=nodes)


def _part(state: StateOutline, offset: int) -> tuple[Event | None, int | None, str]:
    """Which transition or which actions of a state are at an offset."""
    for transition in state.transitions:
        if transition.node.start <= offset <= transition.node.end:
            return transition.event, transition.index, ""
    for section in SECTIONS:
        node = state.entry(section)
        if node is not None and node.start <= offset <= node.end:
            return None, None, section
    return None, None, ""


def _span(document: Document, offset: int, *, whole_line: bool) -> Span:
    """The text that a fault at an offset concerns: a whole value, a word in it, or the line."""
    positions, text = document.positions, document.text
    node = document.scalar_at(offset)
    if node is not None and offset - node.start <= int(node.quoted):
        return Span(node.start, node.end)
    start, end = positions.line_start(offset), positions.line_end(offset)
    if not whole_line:
        word = _WORD.match(text, offset, end)
        return Span(offset, word.end() if word else min(offset + 1, end))
    line = text[start:end]
    return Span(start + len(line) - len(line.lstrip()), start + len(line.rstrip()))
