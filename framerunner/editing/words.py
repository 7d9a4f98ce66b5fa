"""What the editor's server says to its pages: a table for each language; see `offboard.chart.messages`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

from starlette.requests import HTTPConnection

from errors import UserError
from offboard.authoring import EDIT_SPANISH, SPANISH, EditError
from offboard.chart.messages import ENGLISH, Message
from offboard.chart.problems import MAX_REPORTED, MissionError

Language = Literal["en", "es"]

_ENGLISH: Mapping[str, str] = {
    "plain": "{text}",
    # Who may do what.
    "access.edit": "only those who logged in may edit",
    "access.fly": "only those who logged in may start flights",
    "access.course": "only those who logged in may take part",
    # Files.
    "desk.not_here": "'{name}' is no mission file of this folder; choose one from the list",
    "desk.not_read": "{name}: cannot be read ({reason}); choose a mission file of this folder",
    "desk.too_many_open": "{limit} missions are open; close some pages first",
    "desk.source": "unknown source '{name}'; use empty, example or a mission of the package",
    "desk.taken": "{name} is there already; choose another name",
    "desk.not_written": "{name}: cannot be written ({reason}); {advice}",
    "desk.name": "'{name}': use small letters, digits and _, a letter first",
    "desk.changed": "{name} was changed by another program since it was opened",
    "advice.space": "free some space, then save again; nothing is lost while this page and its program run",
    "advice.again": "check the folder, then save again; nothing is lost while this page and its program run",
    "export.mistakes": "the mission has mistakes; correct them, then export it",
    "places.not_written": (
        "the places of the states cannot be written ({reason}); they are kept until the program ends"
    ),
    "journal.not_written": (
        "what is not saved cannot be kept beside the mission ({reason}); it would be lost with the program: "
        "free some space, or save"
    ),
    # Typed text.
    "typed.elsewhere": (
        "the text was changed in another window at the same time; what you typed last is left out"
    ),
    # Flights.
    "flight.unknown": "'{name}': there is no such flight or batch; start it again",
    "flight.is_batch": "it is a batch; cancel it",
    "flight.over": "the flight is over",
    "flight.others": "other flights are being flown; wait until they are over, or cancel them",
    "flight.too_many": "no more than {count} can be under control at the same time; stop one first",
    "flight.cancelled": "cancelled",
    "flight.silent": "nothing was flown for {seconds:g} s",
    "flight.not_started": "it cannot be started ({reason})",
    "flight.killed": "it was ended, or used too much processor time or memory",
    "flight.no_result": "it ended without a result",
    "flight.ended_process": "the flight ended its process: {how}",
    "flight.no_state": "break_on '{name}': is not a state of the mission; take its full id",
    "flight.more": "{first} (and {count} more)",
    "message.too_long": "the message is too long",
    # The real flight.
    "live.busy": "a flight in the simulator is in the air already; stop it first",
    "live.none": "no flight in the simulator was started here",
    "live.no_link": "this program listens at {url}, where no simulator can send; start it without --drone",
    "live.no_ports": (
        "the ports of all ten simulated drones are taken (UDP 14540, 14580, 18570 and TCP 8100, "
        "each plus 0 to 9); end a simulator"
    ),
    "live.none_here": "this program flies no simulator",
    # Lessons.
    "lesson.too_long": "the flight was not over after {seconds:g} s",
    "lesson.no_result": "the flight had no result",
}

_SPANISH: Mapping[str, str] = {
    "plain": "{text}",
    "access.edit": "solo pueden editar quienes han iniciado sesión",
    "access.fly": "solo pueden iniciar vuelos quienes han iniciado sesión",
    "access.course": "solo pueden participar quienes han iniciado sesión",
    "desk.not_here": "'{name}' no es un archivo de misión de esta carpeta; elige uno de la lista",
    "desk.not_read": "{name}: no se puede leer ({reason}); elige un archivo de misión de esta carpeta",
    "desk.too_many_open": "hay {limit} misiones abiertas; cierra antes alguna página",
    "desk.source": "origen desconocido '{name}'; usa empty, example o una misión del paquete",
    "desk.taken": "{name} ya existe; elige otro nombre",
    "desk.not_written": "{name}: no se puede escribir ({reason}); {advice}",
    "desk.name": "'{name}': usa minúsculas, cifras y _, con una letra al principio",
    "desk.changed": "otro programa ha cambiado {name} desde que se abrió",
    "advice.space": (
        "libera espacio y guarda de nuevo; nada se pierde mientras esta página y su programa sigan en marcha"
    ),
    "advice.again": (
        "revisa la carpeta y guarda de nuevo; nada se pierde mientras esta página y su programa sigan"
    ),
    "export.mistakes": "la misión tiene errores; corrígelos y después expórtala",
    "places.not_written": (
        "no se pueden escribir los lugares de los estados ({reason}); quedan hasta que acabe el programa"
    ),
    "journal.not_written": (
        "lo que no está guardado no se puede conservar junto a la misión ({reason}); se perdería con el "
        "programa: libera espacio, o guarda"
    ),
    "typed.elsewhere": (
        "el texto se cambió a la vez en otra ventana; lo último que escribiste no se ha incluido"
    ),
    "flight.unknown": "'{name}': no hay tal vuelo ni serie; empieza de nuevo",
    "flight.is_batch": "es una serie de vuelos; cancélala",
    "flight.over": "el vuelo ha terminado",
    "flight.others": "se están volando otros vuelos; espera a que terminen, o cancélalos",
    "flight.too_many": "no se pueden controlar más de {count} a la vez; para antes uno",
    "flight.cancelled": "cancelado",
    "flight.silent": "no se voló nada durante {seconds:g} s",
    "flight.not_started": "no se puede iniciar ({reason})",
    "flight.killed": "se terminó, o usó demasiado procesador o memoria",
    "flight.no_result": "terminó sin resultado",
    "flight.ended_process": "el vuelo terminó su proceso: {how}",
    "flight.no_state": "break_on '{name}': no es un estado de la misión; usa su nombre completo",
    "flight.more": "{first} (y {count} más)",
    "message.too_long": "el mensaje es demasiado largo",
    "live.busy": "ya hay un vuelo en el simulador; páralo antes",
    "live.none": "aquí no se inició ningún vuelo en el simulador",
    "live.no_link": (
        "este programa escucha en {url}, adonde ningún simulador puede enviar; inícialo sin --drone"
    ),
    "live.no_ports": (
        "los puertos de los diez drones simulados están ocupados (UDP 14540, 14580, 18570 y TCP 8100, "
        "cada uno más 0 a 9); termina un simulador"
    ),
    "live.none_here": "este programa no vuela ningún simulador",
    "lesson.too_long": "el vuelo no había terminado tras {seconds:g} s",
    "lesson.no_result": "el vuelo no tuvo resultado",
}

TABLES: Mapping[Language, Mapping[str, str]] = {
    "en": ENGLISH,
    "es": {**SPANISH, **EDIT_SPANISH, **_SPANISH},
}


class Said(Message):
    """A text of the server."""

    english = _ENGLISH


class SaidError(UserError):
    """Something that a page asked for cannot be done.

    Attributes:
        message: why, in words for people of any language.
    """

    def __init__(self, code: str, **values: object) -> None:
        self.message = Said(code, **values)
        super().__init__(str(self.message))


def language_of(connection: HTTPConnection) -> Language:
    """The language of a page, which its requests name."""
    return "es" if connection.query_params.get("language") == "es" else "en"


def say(what: Message, language: Language) -> str:
    """A text in a language."""
    return what.text(TABLES[language])


def reason(error: UserError, language: Language) -> str:
    """Why something failed, one line; in English if its words are in no table."""
    return reasons(error, language)[0]


def reasons(error: UserError, language: Language) -> tuple[str, ...]:
    """Likewise, a line for each fault of a mission."""
    if isinstance(error, SaidError | EditError):
        return (" ".join(say(error.message, language).split()),)
    if isinstance(error, MissionError):
        if language == "en" or not error.problems:
            return tuple(str(error).splitlines())
        return tuple(each.line(TABLES[language]) for each in error.problems[:MAX_REPORTED])
    return (" ".join(str(error).split()),)
