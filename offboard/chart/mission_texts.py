"""All texts about mission files, in one table: the words of each finding, by its code.

A finding is made of a code and values; `ENGLISH` has the words. Another language is another table with the
same codes, such as `spanish.SPANISH`: `Message.text(table)`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar


class Message:
    """A text of the table with its values, some of which may be messages again.

    Attributes:
        code: key of the table, such as "state.no_way_out".
        values: of the names in braces.
        english: texts of a subclass that has a table of its own; they come before those of `ENGLISH`.
    """

    __slots__ = ("code", "values")
    english: ClassVar[Mapping[str, str]] = {}

    def __init__(self, code: str, /, **values: object) -> None:
        self.code = code
        self.values = values

    def text(self, table: Mapping[str, str]) -> str:
        """The words by a table of texts; those of `ENGLISH` where it has none."""
        values = {
            name: value.text(table) if isinstance(value, Message) else value
            for name, value in self.values.items()
        }
        return (table.get(self.code) or self.english.get(self.code) or ENGLISH[self.code]).format(**values)

    def __str__(self) -> str:
        return self.text(ENGLISH)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Message) and (self.code, self.values) == (other.code, other.values)

    def __hash__(self) -> int:
        return hash(self.code)


def as_message(text: Message | str) -> Message:
    """A text that is in no table, such as the reason of a library, as a message."""
    return text if isinstance(text, Message) else Message("plain", text=text)


ENGLISH: Mapping[str, str] = {
    "plain": "{text}",
    "did_you_mean": "did you mean '{name}'?",
    "did_you_mean_one_of": "did you mean {names}?",
    # The file.
    "file.too_large": "is larger than 1 MB; a mission is a page or two",
    "file.unreadable": "cannot be read: {reason}",
    "file.not_utf8": "cannot be read: is not UTF-8 text; save it as UTF-8",
    "file.utf16": "cannot be read: is UTF-16 text, or no text; save it as UTF-8",
    "file.missing": "mission file '{name}' does not exist",
    "file.irregular": "mission file '{name}' is not a regular file",
    "file.unknown": "unknown mission '{name}'; {advice}",
    "file.known": "known: {names}; a file ends in .yaml",
    # YAML.
    "yaml.empty": "is empty; `framerunner mission new NAME` writes a first one",
    "yaml.no_mapping": "a mission begins with 'name: ...', then 'initial: ...' and 'states:'",
    "yaml.alias": "alias '*{name}' is not allowed; use a template instead",
    "yaml.depth": "nested deeper than {limit} levels",
    "yaml.too_many": "has more than {limit} keys and values; a mission is a page or two",
    "yaml.key_no_word": "a key must be a plain word",
    "yaml.key_twice": "'{key}' is written twice (first in line {line}); rename one",
    "yaml.character": "the character {name} is not allowed in this file; remove it",
    "yaml.second_document": "two documents are in this file; keep one, without the line '---'",
    "yaml.syntax": "YAML syntax: {what}",
    "yaml.second_colon": "a second ':' in this line; write what follows it in the next line",
    "yaml.open_quote": "this quotation mark is never closed; write another at the end",
    "yaml.sign": "'{sign}' cannot stand here; put the text in \"quotation marks\"",
    "yaml.tab": "there is a tab; write spaces instead",
    "yaml.special_space": (
        "this line begins with special spaces, as copied from a web page; write plain ones"
    ),
    "yaml.no_space": "a space is missing after ':'; write '{key}: {value}'",
    "yaml.no_dash": "begin each line of a list with '- ', under the line above it",
    "yaml.no_colon": "a ':' is missing; write '{line}:'",
    "yaml.not_indented": "'{key}' must be indented, to stand under the line it belongs to",
    "yaml.mixed": "lines with and without '- ' are mixed here; write all of them alike",
    "yaml.does_not_fit": "this line does not fit under the one above; is a ':' or a '- ' missing?",
    "yaml.indentation": "wrong indentation: {spaces}; the lines above have {known}",
    # Structure.
    "key.beside": "'{name}' stands beside the {key}; indent it more",
    "key.beside_under": "'{name}' stands beside the {key}; indent it more, under '{under}:'",
    "key.unknown": "{what} has no '{key}'; {advice}",
    "key.indent_state": "if it is a state, indent it to stand under 'states:'",
    "key.of_transition": "write it into a list under 'transitions:', such as '- {key}: ...'",
    "key.of_mission": "it belongs to the mission; write it at the beginning of a line",
    "key.listed": "it has {names}",
    "key.names_below": "'{key}' needs names below it, such as '{example}'",
    "key.name": "'{name}' is not a name; use small letters, digits and _, a letter first",
    "key.list": "'{key}' must be a list; start its lines with '- ', such as '{example}'",
    "key.one_line": "'{key}' must be one line of text",
    "key.flag": "'{key}' is true or false, not '{text}'",
    "key.choice": "unknown {key} '{text}'; {advice}",
    "key.choices": "it is {choices}",
    "mission.name": "name '{name}': use small letters, digits, - and _, a letter or digit first",
    "mission.name_long": (
        "name '{name}': use small letters, digits, - and _, a letter or digit first; at most 80"
    ),
    "state.no_lines": "state '{state}' needs lines below it, such as 'enter:' and 'transitions:'",
    "state.resume_empty": "'resume' is empty; name the state to go on in after a pause",
    "transition.form": "a transition has 'when: ...' and, under it, 'to: ...'",
    "transition.dash": "take the '-' before 'to' away, and put 'to' under the 'when' above it",
    "transition.no_target": "transition without 'to'; name the state it leads to",
    "transition.when_empty": "'when' is empty; leave it out for a transition at the next tick",
    "action.misplaced": "'{name}' does not belong here; write it under 'transitions:'",
    "action.colon": "to set a value write '=': {name} = {value}",
    "action.form": "'{key}' lists primitives and assignments, such as '- hover' and '- cmd.vel_x = 0.3'",
    "variable.state": "'{name}' looks like a state, but stands under 'variables:'; put 'states:' above it",
    "variable.value": "variable '{name}' needs a number, a (x, y, z), True, False or 'text'",
    "variable.comma": "{text} is two numbers; write it with a point: {point}",
    "variable.word": "write {word}",
    "variable.text": "write a text in quotes: '{text}'",
    # The chart.
    "extends.package_only": "extends '{name}': here a mission extends one of the package; known: {names}",
    "extends.elsewhere": "extends '{name}': is in another folder; copy that file beside this one",
    "extends.circle": "extends '{name}': runs in a circle or too deep",
    "template.unused": "template '{name}' is not used; remove it or 'use' it",
    "template.unknown": "state '{state}' uses the unknown template '{name}'; known: {known}",
    "template.use": "state '{state}': 'use' is not possible within a template",
    "template.both": "state '{state}' has 'use' and states of its own; choose one",
    "chart.too_many": "has {count} states; {limit} are the limit",
    "chart.too_many_parts": "has {count} transitions and actions; {limit} are the limit",
    "chart.too_much_text": "has {count} characters of expressions; {limit} are the limit",
    "target.unknown": "{what} '{name}' of state '{state}' is not a state; {advice}",
    "target.what": "target",
    "target.beside": "there are {names}",
    "mission.no_states": "has no 'states'; write 'states:' and below it the states, indented",
    "initial.missing": "{what} has no 'initial'; name the state it starts in, such as '{first}'",
    "initial.unknown": "'initial' of {what} is '{name}'; {advice}",
    "initial.known": "it has the states {names}",
    "what.mission": "the mission",
    "what.state": "state '{state}'",
    "what.a_mission": "a mission",
    "what.a_transition": "a transition",
    "state.final_with_states": "state '{state}' is final and has states; only one of both is possible",
    "state.then_unreached": (
        "none of the states of '{state}' has 'final: true', so its 'then' is never reached"
    ),
    "state.no_superstate": "state '{state}' has 'then' or 'initial' but no states of its own",
    "state.final_resume": "state '{state}' is final; there is nothing to continue, remove 'resume'",
    "state.final_more": "state '{state}' is final; nothing happens after its 'enter'",
    "state.no_way_out": (
        "state '{state}' has no way out; add 'transitions:', or 'final: true' if it is the end"
    ),
    "state.never_finishes": (
        "never finishes: no way from state '{state}' to a final state; "
        "add a transition to one, or mark a state with 'final: true'"
    ),
    "state.unreachable": "state '{state}' is never reached; add a transition to it, or remove it",
    "state.no_timeout": (
        "state '{state}' waits for what may never happen, and has no time-out; "
        "add a transition such as 'when: seconds_in_state > 30'"
    ),
    "transition.after_always": ("this transition of '{state}' is never reached: the one above always holds"),
    "transition.same_guard": (
        "this transition of '{state}' is never reached: line {line} has the same 'when'"
    ),
    "transition.hidden": (
        "this transition of '{state}' is never taken: whenever its 'when' holds, that of line {line} "
        "holds too and goes first; put this one above it, or change one of them"
    ),
    "transition.hidden_by_several": (
        "this transition of '{state}' is never taken: whenever its 'when' holds, one above it holds too "
        "and goes first; put this one above them, or change one of them"
    ),
    "guard.never": "when '{when}' can never hold: {reason}",
    "guard.constant": "it is always false",
    "guard.contradiction": "no value of {names} fulfils all of it; is an 'and' meant as 'or'?",
    "guard.range": "{name} is never {meant}; it is {range}",
    "guard.at_least": "at least {low:g}",
    "guard.at_most": "at most {high:g}",
    "guard.from_to": "from {low:g} to {high:g}",
    "guard.always": "when '{when}' always holds: {reason}; leave 'when' out, or correct it",
    "guard.always_true": "it is true for every value",
    "detector.unknown": "unknown detector '{name}'; {advice}",
    "detector.known": "installed packages add: {names}",
    "detector.none": "no installed package adds one; leave 'detector' out, and 'vision' chooses",
    "what.gate": "a mission's 'gate'",
    "gate.size": "{key} of 'gate' is '{text}'; write metres, from {low:g} to {high:g}",
    "gate.opening": "bar_m {bar:g} of 'gate' leaves no opening; make it thinner or the frame larger",
    "vision.needed": "'{name}' needs the map of frames; add the line 'vision: frames' at the top of {file}",
    "when": "when '{when}': {reason}",
    "action": "'{action}': {reason}",
    # Expressions.
    "expression.call": (
        "calls are not possible; name a value of the pilot, or set goal_m and read distance_to_goal_m"
    ),
    "expression.subscript": "[...] is not possible; name the part, such as imu.x",
    "expression.list": "[...] is not possible; write a place in parentheses: (x, y, z)",
    "expression.power": "** is not possible; write a product",
    "expression.modulo": "% is not possible here",
    "expression.bit_and": "write 'and' instead of '&'",
    "expression.bit_or": "write 'or' instead of '|'",
    "expression.invert": "write 'not' instead of '~'",
    "expression.is": "write '==' instead of 'is'",
    "expression.is_not": "write '!=' instead of 'is not'",
    "expression.in": "'in' is not possible; compare with each: colour == 'red' or colour == 'blue'",
    "expression.not_in": "'not in' is not possible; compare with each: colour != 'red' and colour != 'blue'",
    "expression.if": "'if' is not possible here; write a transition for each case",
    "expression.walrus": ":= is not possible; assign under 'enter' or 'during'",
    "expression.kind": "{kind} is not possible here",
    "expression.constant": "{value!r} is not possible here",
    "expression.parentheses": "write it without parentheses: {name}",
    "expression.after_name": "'.{name}' must follow a name",
    "expression.empty": "nothing is written here; write an expression (what follows a # is not read)",
    "expression.long": "is longer than {limit} characters; split it",
    "expression.deep": "is nested too deep; write it simpler",
    "expression.too_deep": "cannot be understood: too deep",
    "expression.open_text": "a text begins here and is never closed; write {sign} after it",
    "expression.no_closing": "a ')' is missing",
    "expression.no_opening": "a '(' is missing",
    "expression.not_understood": (
        "cannot be understood from '{rest}' on; write a comparison such as imu.z > 1"
    ),
    "expression.and": "write 'and' instead of '{sign}'",
    "expression.or": "write 'or' instead of '{sign}'",
    "expression.not": "write 'not' instead of '{sign}'",
    "expression.unequal": "write '!=' instead of '{sign}'",
    "expression.at_most": "write '<=' instead of '{sign}'",
    "expression.at_least": "write '>=' instead of '{sign}'",
    "expression.equal": "write '==' instead of '{sign}'",
    "expression.assignment": "'=' sets a value; to compare write '=='",
    "expression.change": "'{sign}' is not possible here; a guard only compares",
    "expression.quotes": "write a straight quotation mark ' instead of {sign}",
    "expression.times": "write '*' instead of '{sign}'",
    "expression.minus": "write '-' instead of '{sign}'",
    "expression.divide": "write '/' instead of '{sign}'",
    "expression.percent": "'{sign}' is not possible; write 0.3 for 30 %",
    "expression.small": "write '{lower}' in small letters",
    "expression.leave_out_if": "leave '{sign}' out; 'when:' means it already",
    "expression.leave_out_then": "leave '{sign}' out; write the next state under 'to:'",
    "expression.unit": "write the number without a unit: {number} instead of {sign}",
    "expression.value_again": "name the value again after '{first}': a < 2 and a > 1",
    "expression.something_after": "something must follow '{sign}'",
    "expression.value_after": "a value must follow '{sign}'",
    # Kinds of values.
    "kind.condition": "true or false",
    "kind.number": "a number",
    "kind.text": "a text",
    "kind.place": "a place (x, y, z)",
    "kind.parts": "several values",
    "kind.any": "anything",
    "kind.text_alone": "{shown} alone is no condition; write the whole comparison: colour == {shown}",
    "kind.no_condition": "{shown} is {kind}, no condition; {advice}",
    "kind.compare": "compare it, such as {example}",
    "kind.compare_number": "compare a number, such as distance_to_goal_m < 0.2",
    "kind.several": "{shown} is several values; {advice}",
    "kind.part": "name one of its parts, such as {example}",
    "kind.too_fast": (
        "{name} = {value:g} is too fast; at most {limit:g} {unit} is flown: "
        "write a number from -{limit:g} to {limit:g}"
    ),
    "kind.not_assignable": "{name} is {wanted}, {shown} is {given}; write {example}",
    "kind.not_one_of": "{name} cannot be {value!r}; it is one of {choices}",
    "kind.no_number": "{shown} is no number; a place is three numbers (x, y, z)",
    "kind.not_a_number": "{shown} is {kind}, not a number; {advice}",
    "kind.take_number": "take a number",
    "kind.read_number": "read distance_to_goal_m, or imu.x",
    "kind.no_quotes": "write a number without quotes",
    "kind.never": "{shown} is never {value}; it is one of {choices}",
    "kind.never_equal": "{one} is {first}, {other} is {second}; they are never equal",
    "kind.comma": "{shown} is {count} values; take the comma away",
    "kind.decimal_comma": "write decimals with a point: {whole}.{part} instead of {whole},{part}",
    "kind.not_three": "{name} needs three numbers (x, y, z), here are {count}",
    "kind.not_three_comma": "{name} needs three numbers (x, y, z), here are {count}; {hint}",
    "kind.no_height": "{name} needs three numbers (x, y, z), here are {count}; the third is the height",
    # Names.
    "name.needs_values": "'{name}' needs {needed}, but an action is called without values",
    "name.value_as_action": "'{name}' is a value, not an action; write 'location = expression'",
    "name.unknown_action": "unknown action '{name}'; {advice}",
    "name.action_as_value": "'{name}' is an action, not a value",
    "name.unknown": "unknown name '{name}'; {advice}",
    "name.no_variable": "no variable '{name}'; {advice}",
    "name.declared": "declared under 'variables': {names}",
    "name.no_part": "'{owner}' has no '{name}'; {advice}",
    "name.plain": "it is a plain value",
    "name.parts": "it has {names}",
    "name.goal_whole": "goal_m is set as a whole: goal_m = (x, y, z)",
    "name.not_whole": "'{name}' cannot be set as a whole; set {parts}",
    "name.read_only": (
        "'{name}' can only be read; "
        "a mission sets cmd.vel_x and the like, goal_m, colour and memory.<variable>"
    ),
    "name.capital": "write {name}",
    "name.quotes": "write a text in quotes: '{name}'",
    "name.memory": "write memory.{name}",
    "name.known": "there are {names}",
    "name.known_pilot": "there are {names}; what a Python file adds needs --pilot FILE.py",
    "action.walrus": "to set a value write '=' instead of ':='",
    "action.equal": "'==' compares; to set a value write one '='",
    "action.colon_sign": "to set a value write '=' instead of ':'",
    "action.one_a_line": "one action a line; begin each line with '- '",
    "action.in_full": "write it in full: {name} = {name} {sign} {value}",
    "action.parentheses": "write it without parentheses: {name}",
    "action.no_values": "'{name}' takes no values",
    "action.no_values_goal": "'{name}' takes no values; set goal_m in a line before it",
}
