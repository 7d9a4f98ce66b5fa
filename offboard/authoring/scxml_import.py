"""A mission from SCXML, as far as a mission can express it; all else is refused, one line for each.

`scxml_export` says how the formats correspond. Expressions may be written as Python or as ECMAScript writes
them (`&&`, `||`, `!`, `true`). Elements and attributes of other namespaces, such as positions of an editor,
are ignored.
"""

from __future__ import annotations

import ast
import re
from dataclasses import dataclass, field, fields

from framerunner.geometry.gate_shape import GateShape
from offboard.authoring.edit_texts import EditError
from offboard.authoring.scxml_export import NAMESPACE, SCXML, TICK
from offboard.authoring.xml_tree import Element, XmlError, parse_xml
from offboard.authoring.yaml_writer import Style, Value
from offboard.chart.expressions import ExpressionError, check_form
from offboard.chart.problems import MAX_REPORTED, cut
from offboard.chart.spec import MAX_STATES, RESUME, look_up

_INCLUDE = "http://www.w3.org/2001/XInclude"
_STATES = ("state", "final")
_CALL = re.compile(r"([A-Za-z_]\w*) ?(?:\( ?\))?")
_ASSIGNMENT = re.compile(r"([A-Za-z_][\w.]*) ?=(?!=) ?(.+)")
_TEXTS = re.compile(r"('[^']*'|\"[^\"]*\")")
_ECMASCRIPT = (
    (re.compile(r"\s*&&\s*"), " and "),
    (re.compile(r"\s*\|\|\s*"), " or "),
    (re.compile(r"!==|!="), "!="),
    (re.compile(r"==="), "=="),
    (re.compile(r"!(?!=)\s*"), "not "),
    (re.compile(r"\btrue\b"), "True"),
    (re.compile(r"\bfalse\b"), "False"),
)
_ATTRIBUTES = {
    "scxml": ("version", "name", "initial", "datamodel", "binding"),
    "state": ("id", "initial"),
    "final": ("id",),
    "transition": ("event", "cond", "target", "type"),
    "assign": ("location", "expr"),
    "script": (),
    "data": ("id", "expr"),
    "onentry": (),
    "onexit": (),
    "datamodel": (),
    "initial": (),
}


@dataclass(slots=True)
class _State:
    """A state that is read, before its transitions are.

    Attributes:
        path: full id in the mission.
    """

    element: Element
    path: str
    states: list[_State] = field(default_factory=list)


def import_scxml(data: bytes, name: str = "") -> str:
    """The text of a mission file from an SCXML document.

    Args:
        data: the document.
        name: of the mission if the document has none.

    Raises:
        XmlError: it is not SCXML, or has what a mission cannot express: one line for each, with its line.
    """
    return _Importer().mission(parse_xml(data), name)


class _Importer:
    """Reads one document and collects what cannot be expressed."""

    def __init__(self) -> None:
        self._problems: list[str] = []
        self._by_id: dict[str, str] = {}
        self._paths: set[str] = set()

    def mission(self, root: Element, name: str) -> str:
        if (root.namespace, root.name) != (SCXML, "scxml"):
            raise XmlError(f"line {root.line}: is not SCXML: the outermost element is not <scxml> of {SCXML}")
        children = self._children(root, (*_STATES, "datamodel"))
        self._check_attributes(root)
        states = self._states(root, children, "")
        if not states:
            self._refuse(root, "there is no <state>; a mission has at least one")
        value: dict[str, Value] = {"name": _mission_name(root.attributes.get("name", "") or name)}
        for key in ("description", "class", "vision", "detector"):
            text = " ".join(root.attributes.get(f"{NAMESPACE} {key}", "").split())
            if text:
                value[key] = text
        sizes_m = root.attributes.get(f"{NAMESPACE} gate", "").split()
        if sizes_m:
            value["gate"] = dict(zip((each.name for each in fields(GateShape)), sizes_m, strict=False))
        initial = self._initial(root, states, "")
        variables = self._variables(children)
        written = {state.path: self._state(state) for state in states}
        self._raise_if_any()
        value["initial"] = initial
        if variables:
            value["variables"] = variables
        return self._text(value, written)

    def _raise_if_any(self) -> None:
        if self._problems:
            lines = self._problems[:MAX_REPORTED]
            if len(self._problems) > MAX_REPORTED:
                lines.append(f"and {len(self._problems) - MAX_REPORTED} more")
            raise XmlError("\n".join(lines))

    def _text(self, value: dict[str, Value], states: dict[str, Value]) -> str:
        style = Style()
        try:
            lines = [line for key, each in value.items() for line in style.entry(key, each, 0)]
            lines += ["", "states:"]
            for number, (name, state) in enumerate(states.items()):
                lines += ([""] if number else []) + style.entry(name, state, 2)
        except EditError as error:
            raise XmlError(str(error)) from None
        return "\n".join(lines) + "\n"

    def _refuse(self, element: Element, text: str) -> None:
        self._problems.append(f"line {element.line}: {text}")

    def _children(self, element: Element, known: tuple[str, ...]) -> list[Element]:
        """The children that are understood; the others are refused."""
        found = []
        for child in element.children:
            if child.namespace == SCXML and child.name in known:
                found.append(child)
            elif child.namespace in (SCXML, _INCLUDE):
                self._refuse(child, f"<{child.name}> in <{element.name}> cannot be expressed in a mission")
        return found

    def _check_attributes(self, element: Element) -> None:
        for key in element.attributes:
            if " " not in key and key not in _ATTRIBUTES[element.name]:
                self._refuse(element, f"'{key}' of <{element.name}> cannot be expressed in a mission")

    def _states(self, parent: Element, children: list[Element], prefix: str) -> list[_State]:
        """The states in an element, each with a name that a mission can have."""
        found: list[_State] = []
        names: set[str] = set()
        for element in children:
            if element.name not in _STATES:
                continue
            if len(self._paths) >= MAX_STATES:
                raise XmlError(f"line {element.line}: more than {MAX_STATES} states; a mission has fewer")
            full_id = element.attributes.get("id", "")
            name = _state_name(full_id, parent.attributes.get("id", ""), names)
            names.add(name)
            state = _State(element, prefix + name)
            if full_id in self._by_id:
                self._refuse(element, f"the id '{cut(full_id)}' is there twice; change one")
            if full_id:
                self._by_id[full_id] = state.path
            self._paths.add(state.path)
            inner = [child for child in element.children if child.namespace == SCXML]
            state.states = self._states(element, inner, f"{state.path}.")
            found.append(state)
        return found

    def _initial(self, element: Element, states: list[_State], prefix: str) -> str:
        """Name of the state in which an element starts; by default its first."""
        if not states:
            return ""
        target = element.attributes.get("initial", "")
        for child in element.children:
            if child.namespace == SCXML and child.name == "initial":
                for transition in self._children(child, ("transition",)):
                    target = transition.attributes.get("target", "")
                    if transition.children or "cond" in transition.attributes:
                        self._refuse(transition, "actions or a condition in <initial> cannot be expressed")
        if not target:
            return states[0].path.removeprefix(prefix)
        path = self._by_id.get(target, "")
        if path not in [state.path for state in states]:
            text = f"'initial' is '{cut(target)}', which is not one state directly within; name one that is"
            self._refuse(element, text)
        return path.removeprefix(prefix)

    def _variables(self, children: list[Element]) -> dict[str, Value]:
        found: dict[str, Value] = {}
        for model in children:
            for data in self._children(model, ("data",)) if model.name == "datamodel" else ():
                self._check_attributes(data)
                name = data.attributes.get("id", "").removeprefix("memory.")
                expression = (data.attributes.get("expr") or data.text).strip()
                if not re.fullmatch(r"[a-z][a-z0-9_]*", name):
                    self._refuse(data, f"<data> '{cut(name)}': a variable has small letters, digits and _")
                elif not _is_constant(_python(expression)):
                    self._refuse(
                        data, f"<data> '{name}': '{cut(expression)}' is no number, text or (x, y, z)"
                    )
                else:
                    found[name] = _python(expression)
        return found

    def _state(self, state: _State) -> Value:
        element, value = state.element, dict[str, Value]()
        self._check_attributes(element)
        final = element.name == "final"
        known = ("onentry", "onexit") if final else ("onentry", "onexit", "transition", "initial", *_STATES)
        children = self._children(element, known)
        if state.states:
            value["initial"] = self._initial(element, state.states, f"{state.path}.")
        transitions = self._transitions(state, [child for child in children if child.name == "transition"])
        if "resume" in transitions:
            value["resume"] = transitions.pop("resume")
        for key, name in (("enter", "onentry"), ("exit", "onexit")):
            blocks = [child for child in children if child.name == name]
            actions = [action for block in blocks for action in self._actions(block)]
            if actions:
                value[key] = actions
        value |= transitions
        if final:
            value["final"] = "true"
        if state.states:
            value["states"] = {each.path.rpartition(".")[2]: self._state(each) for each in state.states}
        if "then" in value:
            value["then"] = value.pop("then")
        if state.states and ("transitions" in value or "during" in value):
            self._refuse_inner_during(state)
        return value

    def _refuse_inner_during(self, state: _State) -> None:
        """In SCXML a state that acts at each tick keeps the event from the states around it."""
        for inner in (each for child in state.states for each in _all(child)):
            for child in inner.element.children:
                if child.name == "transition" and "target" not in child.attributes:
                    text = f"hides those of <state> '{state.path}' around it; write these at each inner state"
                    self._refuse(child, f"this transition without a target {text}")
                    return

    def _transitions(self, state: _State, elements: list[Element]) -> dict[str, Value]:
        found: dict[str, Value] = {}
        ticks: list[Value] = []
        for element in elements:
            self._check_attributes(element)
            event = element.attributes.get("event", "")
            target = element.attributes.get("target", "")
            if event == TICK and not target:
                self._during(element, found)
            elif event == TICK:
                if "during" in found:
                    self._refuse(
                        element, "it is after a transition without a target, which hides it; put it before"
                    )
                ticks.append(self._tick(state, element, target))
            elif event == RESUME or event == f"done.state.{state.element.attributes.get('id', '')}":
                key = "resume" if event == RESUME else "then"
                if key in found or element.children or "cond" in element.attributes or not target:
                    text = f"'{event}' has one transition, with a target, and without a condition and actions"
                    self._refuse(element, text)
                found[key] = self._target(state, element, target)
            else:
                text = f'event "{cut(event)}" cannot be expressed; a mission\'s transitions have event="tick"'
                self._refuse(element, f"{text} and a condition")
        if ticks:
            found["transitions"] = ticks
        return found

    def _during(self, element: Element, found: dict[str, Value]) -> None:
        if "cond" in element.attributes or "during" in found:
            self._refuse(element, "a state has one transition without a target, and that has no condition")
        found["during"] = self._actions(element)

    def _tick(self, state: _State, element: Element, target: str) -> Value:
        written: dict[str, Value] = {}
        condition = self._expression(element, element.attributes.get("cond", ""))
        if condition:
            written["when"] = condition
        if element.attributes.get("type", "external") == "internal" and state.states:
            self._refuse(element, 'type="internal" of a state with states cannot be expressed')
        written["to"] = self._target(state, element, target)
        actions = self._actions(element)
        if actions:
            written["do"] = actions
        return written

    def _target(self, state: _State, element: Element, target: str) -> str:
        """How a mission names a target, as seen from a state."""
        path = self._by_id.get(target, "")
        if not path:
            several = len(target.split()) > 1
            text = "several targets cannot be expressed" if several else f"there is no state '{cut(target)}'"
            self._refuse(element, text)
            return target
        parts = path.split(".")
        for count in range(1, len(parts) + 1):
            name = ".".join(parts[-count:])
            if look_up(name, state.path, self._paths) == path:
                return name
        self._refuse(element, f"the state '{path}' cannot be named from '{state.path}'; rename one of them")
        return path

    def _actions(self, element: Element) -> list[str]:
        found = []
        for child in self._children(element, ("assign", "script")):
            self._check_attributes(child)
            if child.name == "assign":
                location = child.attributes.get("location", "").strip()
                found.append(
                    f"{location} = {self._expression(child, child.attributes.get('expr') or child.text)}"
                )
                continue
            for statement in re.split(r"[;\n]", child.text):
                if statement.strip():
                    found.append(self._statement(child, statement))
        return found

    def _expression(self, element: Element, text: str) -> str:
        expression = _python(text)
        try:
            if expression:
                check_form(expression)
        except ExpressionError as error:
            self._refuse(element, f"'{cut(expression)}': {error}")
        return expression

    def _statement(self, element: Element, statement: str) -> str:
        statement = " ".join(statement.split())
        call, assignment = _CALL.fullmatch(statement), _ASSIGNMENT.fullmatch(statement)
        if call is not None:
            return call.group(1)
        if assignment is not None:
            return f"{assignment.group(1)} = {self._expression(element, assignment.group(2))}"
        text = f"'{cut(statement)}' is no primitive such as hover() and no assignment"
        self._refuse(element, f"<script>: {text}")
        return ""


def _all(state: _State) -> list[_State]:
    return [state, *(each for child in state.states for each in _all(child))]


def _python(expression: str) -> str:
    """An expression as a mission writes it; texts in quotation marks are not touched."""
    parts = _TEXTS.split(expression)
    for number in range(0, len(parts), 2):
        parts[number] = re.sub(r"\s+", " ", parts[number])
        for pattern, text in _ECMASCRIPT:
            parts[number] = pattern.sub(text, parts[number])
    return "".join(parts).strip()


def _is_constant(expression: str) -> bool:
    try:
        value = ast.literal_eval(expression) if len(expression) <= 500 else None
    except (ValueError, SyntaxError, MemoryError, RecursionError):
        return False
    return isinstance(value, (bool, int, float, str, tuple))


def _state_name(full_id: str, around: str, taken: set[str]) -> str:
    """A name for a state from its id: without that of the state around it, in a mission's letters."""
    own = full_id.removeprefix(f"{around}.") if around else full_id
    name = re.sub(r"[^a-z0-9]+", "_", own.lower()).strip("_")
    name = name if re.match(r"[a-z]", name) else f"state_{name}".strip("_")
    name, number, base = name[:60], 1, name[:50]
    while name in taken:
        number += 1
        name = f"{base}_{number}"
    return name


def _mission_name(text: str) -> str:
    return re.sub(r"[^a-z0-9_-]+", "-", text.lower()).strip("-_")[:80] or "mission"
