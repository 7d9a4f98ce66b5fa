"""What is said of edits that cannot be applied: tables by language; see `offboard.chart.mission_texts`."""

from __future__ import annotations

from collections.abc import Mapping

from framerunner.errors import UserError
from offboard.chart.mission_texts import Message

EDIT_ENGLISH: Mapping[str, str] = {
    "edit.field": "{where} {given}: {what}; correct the edit",
    "edit.name": "{where} {given}: a name has small letters, digits and _, a letter first",
    "edit.unreadable": "the text cannot be read as YAML ({place}: {reason}); correct it first",
    "edit.the_text": "the text",
    "edit.line": "line {line}",
    "edit.breaks": "the text is written in a way that this edit would break; edit the text instead",
    "edit.range": "start {start}, end {end}: the text has {length} characters",
    "edit.beyond": "typed text: {place} is after the end of the text; load the page again",
    "edit.half_pair": "text: half of a surrogate pair cannot be saved; send whole characters",
    "edit.too_large": "the mission would be larger than 1 MB; a mission is a page or two",
    "edit.no_undo": "there is nothing to undo",
    "edit.no_redo": "there is nothing to do again",
    "edit.control": "{text} has a line end or a control character; write one line of text",
    # States.
    "edit.no_state": "there is no state '{state}' in this document",
    "edit.in_template": "'{state}' is written in a template; edit '{inner}', for all that use it",
    "edit.in_other_file": "'{state}' is not written in this file but in '{base}'; edit that one",
    "edit.other_template": "a template of another file",
    "edit.uses": "a state with 'use' has no states of its own, and is not in a template",
    "edit.no_template": "there is no template '{name}'",
    "edit.of_template": "state '{state}' has the states of a template; edit '@{template}'",
    "edit.braces_last": "the states are in braces; a new one is put after the last",
    "edit.braces": "'{state}' is in braces; write it on lines of its own first",
    "edit.taken": "there is a {what} '{name}' already; choose another name",
    "edit.what_template": "template",
    "edit.what_state": "state",
    "edit.taken_base": "'{base}' has a state '{name}'; choose another name",
    "edit.replaces": "'{state}' replaces the one of '{base}', so it keeps its name",
    "edit.template_order": "a template is not moved; the order of templates means nothing",
    "edit.into_itself": "state '{state}' cannot be moved into itself",
    "edit.template_border": "a state is not moved into or out of a template; duplicate and delete it there",
    "edit.key_in_line": "'{key}' begins within a line; edit the text",
    "edit.no_start": "there is no state '{name}' there to start in",
    "edit.template_final": "a template is not final; one of its states may be",
    "edit.no_parameter": "state '{state}' does not set '{name}' under 'enter'",
    # Transitions.
    "edit.no_transition": "state '{state}' has no transition {index} of '{event}'; {known}",
    "edit.has": "it has {count}",
    "edit.has_none": "it has none",
    "edit.final": "state '{state}' is final; no transition leaves it",
    "edit.plain_event": "a transition of '{event}' has no guard and no actions",
    "edit.event_taken": "state '{state}' has a transition of '{event}' already; redirect it",
    "edit.then_of_template": "'then' is written at the state that uses the template",
    "edit.no_order": "a transition of '{event}' has no order",
    "edit.no_guard": "a transition of '{event}' has no guard",
    "edit.no_actions": "a transition of '{event}' has no actions",
    "edit.is_tick": "a transition with a guard or actions is one of 'tick'; remove them first",
    "edit.leads_nowhere": "the transition leads nowhere; set its target first",
    "edit.to_template": "'{to}' is a template; lead to a state that uses it",
    "edit.no_way": "state '{state}' cannot lead to '{to}': there is no such state",
    "edit.no_name": "state '{state}' cannot name '{to}'; a state nearer has the same name",
    "edit.other_target": (
        "state '{state}': a transition would then lead to another state of the same name; choose another name"
    ),
    # The text as it is written.
    "edit.no_line": "'{key}' is not one line of text; correct the text first",
    "edit.no_mapping": "what stands there is no mapping; correct the text first",
    "edit.all_there_is": "'{key}' is all there is here; remove what it belongs to",
    "edit.list_in_line": "the list begins within a line; edit the text",
    "edit.brackets": "'{key}' is in brackets with comments; edit the text",
    "edit.no_list": "'{key}' is no list; correct the text first",
    "edit.dashes": "the list has several dashes in a line; edit the text",
}

EDIT_SPANISH: Mapping[str, str] = {
    "edit.field": "{where} {given}: {what}; corrige el cambio",
    "edit.name": "{where} {given}: un nombre tiene minúsculas, cifras y _, con una letra al principio",
    "edit.unreadable": "el texto no se puede leer como YAML ({place}: {reason}); corrígelo antes",
    "edit.the_text": "el texto",
    "edit.line": "línea {line}",
    "edit.breaks": "el texto está escrito de una forma que este cambio rompería; cambia el texto mismo",
    "edit.range": "start {start}, end {end}: el texto tiene {length} caracteres",
    "edit.beyond": "texto escrito: {place} está después del final del texto; carga la página de nuevo",
    "edit.half_pair": "text: medio par suplente no se puede guardar; envía caracteres enteros",
    "edit.too_large": "la misión pasaría de 1 MB; una misión es una página o dos",
    "edit.no_undo": "no hay nada que deshacer",
    "edit.no_redo": "no hay nada que rehacer",
    "edit.control": "{text} tiene un fin de línea o un carácter de control; escribe una sola línea",
    "edit.no_state": "no hay ningún estado '{state}' en este documento",
    "edit.in_template": "'{state}' está escrito en una plantilla; cambia '{inner}', para todos sus usos",
    "edit.in_other_file": "'{state}' no está escrito en este archivo sino en '{base}'; cámbialo allí",
    "edit.other_template": "una plantilla de otro archivo",
    "edit.uses": "un estado con 'use' no tiene estados propios, ni está en una plantilla",
    "edit.no_template": "no hay ninguna plantilla '{name}'",
    "edit.of_template": "el estado '{state}' tiene los estados de una plantilla; cambia '@{template}'",
    "edit.braces_last": "los estados están entre llaves; uno nuevo va después del último",
    "edit.braces": "'{state}' está entre llaves; escríbelo antes en líneas propias",
    "edit.taken": "ya hay {what} '{name}'; elige otro nombre",
    "edit.what_template": "una plantilla",
    "edit.what_state": "un estado",
    "edit.taken_base": "'{base}' tiene un estado '{name}'; elige otro nombre",
    "edit.replaces": "'{state}' sustituye al de '{base}', así que conserva su nombre",
    "edit.template_order": "una plantilla no se mueve; el orden de las plantillas no significa nada",
    "edit.into_itself": "el estado '{state}' no se puede mover dentro de sí mismo",
    "edit.template_border": (
        "un estado no se mueve adentro ni afuera de una plantilla; duplícalo allí y borra este"
    ),
    "edit.key_in_line": "'{key}' empieza en mitad de una línea; cambia el texto",
    "edit.no_start": "allí no hay ningún estado '{name}' en el que empezar",
    "edit.template_final": "una plantilla no es final; puede serlo uno de sus estados",
    "edit.no_parameter": "el estado '{state}' no asigna '{name}' en 'enter'",
    "edit.no_transition": "el estado '{state}' no tiene la transición {index} de '{event}'; {known}",
    "edit.has": "tiene {count}",
    "edit.has_none": "no tiene ninguna",
    "edit.final": "el estado '{state}' es final; ninguna transición sale de él",
    "edit.plain_event": "una transición de '{event}' no tiene condición ni acciones",
    "edit.event_taken": "el estado '{state}' ya tiene una transición de '{event}'; cambia su destino",
    "edit.then_of_template": "'then' se escribe en el estado que usa la plantilla",
    "edit.no_order": "una transición de '{event}' no tiene orden",
    "edit.no_guard": "una transición de '{event}' no tiene condición",
    "edit.no_actions": "una transición de '{event}' no tiene acciones",
    "edit.is_tick": "una transición con condición o acciones es de 'tick'; quítalas antes",
    "edit.leads_nowhere": "la transición no lleva a ninguna parte; elige antes su destino",
    "edit.to_template": "'{to}' es una plantilla; lleva a un estado que la use",
    "edit.no_way": "el estado '{state}' no puede llevar a '{to}': no existe tal estado",
    "edit.no_name": "el estado '{state}' no puede nombrar '{to}'; uno más cercano se llama igual",
    "edit.other_target": (
        "estado '{state}': una transición llevaría entonces a otro estado del mismo nombre; elige otro nombre"
    ),
    "edit.no_line": "'{key}' no es una línea de texto; corrige antes el texto",
    "edit.no_mapping": "lo que hay ahí no son claves con valores; corrige antes el texto",
    "edit.all_there_is": "'{key}' es lo único que hay aquí; quita aquello a lo que pertenece",
    "edit.list_in_line": "la lista empieza en mitad de una línea; cambia el texto",
    "edit.brackets": "'{key}' está entre corchetes con comentarios; cambia el texto",
    "edit.no_list": "'{key}' no es una lista; corrige antes el texto",
    "edit.dashes": "la lista tiene varios guiones en una línea; cambia el texto",
}


class EditText(Message):
    """A text about an edit."""

    english = EDIT_ENGLISH


class EditError(UserError):
    """An edit cannot be applied, and nothing was changed; the text is one line for people, in English.

    Args:
        code: of the kind of fault.
        values: that its text has.

    Attributes:
        message: the same as code and values, for other languages.
    """

    def __init__(self, code: str, **values: object) -> None:
        self.message = EditText(code, **values)
        super().__init__(str(self.message))
