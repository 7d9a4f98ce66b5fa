"""What the editor's server says to its pages: tables by language; see `offboard.chart.mission_texts`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

from starlette.requests import HTTPConnection

from framerunner.errors import UserError
from offboard.authoring import EDIT_SPANISH, SPANISH, EditError
from offboard.chart.mission_texts import ENGLISH, Message
from offboard.chart.problems import MAX_REPORTED, MissionError

Language = Literal["en", "es"]

_ENGLISH: Mapping[str, str] = {
    "plain": "{text}",
    # Who may do what.
    "access.edit": "only pupils and organisers may edit; log in at /login",
    "access.own": "this file is not yours; open your own lesson from the page Course",
    "access.fly": "only pupils and organisers may start flights; log in at /login",
    "access.live": "only organisers may start a flight in the simulator, which all see; use the tab Fly",
    "access.course": "only pupils and organisers may take part; log in at /login",
    "access.learner": "you are logged in as {name}; log out to take part with another name",
    "access.teach": "only organisers may do this; log in at /login",
    # Files.
    "session.not_here": "'{name}' is no mission file of this folder; choose one from the list",
    "session.not_read": "{name}: cannot be read ({reason}); choose a mission file of this folder",
    "session.too_many_open": "{limit} missions are open; close some pages first",
    "session.source": "unknown source '{name}'; use empty, example or a mission of the package",
    "session.taken": "{name} is there already; choose another name",
    "session.not_written": "{name}: cannot be written ({reason}); {advice}",
    "session.name": "'{name}': use small letters, digits and _, a letter first",
    "session.changed": "{name} was changed by another program since it was opened",
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
    "flight.waits": "the flight waits for its turn; stop it, or wait",
    "flight.yours": "your flights are not over yet; wait until they are, or cancel them",
    "flight.too_many": "no more than {count} of a page can be under control at the same time; stop one first",
    "flight.full": "{count} others wait for their turn; try again in some minutes",
    "flight.cancelled": "cancelled",
    "flight.silent": "nothing was flown for {seconds:g} s",
    "flight.not_started": "it cannot be started ({reason})",
    "flight.killed": "it was ended, or used too much processor time or memory",
    "flight.no_result": "it ended without a result",
    "flight.ended_process": "the flight ended its process: {how}",
    "flight.no_state": "break_on '{name}': is not a state of the mission; take its full id",
    "flight.more": "{first} (and {count} more)",
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
    "lesson.no_result": "the flight had no result",
    "lesson.one_check": "{name}'s mission is being checked or waits for it already; wait for that",
}

_SPANISH: Mapping[str, str] = {
    "plain": "{text}",
    "access.edit": "solo pueden editar alumnos y organizadores; inicia sesión en /login",
    "access.own": "este archivo no es tuyo; abre tu lección desde la página Curso",
    "access.fly": "solo pueden iniciar vuelos alumnos y organizadores; inicia sesión en /login",
    "access.live": "solo los organizadores vuelan en el simulador, que todos ven; usa la pestaña Volar",
    "access.course": "solo pueden participar alumnos y organizadores; inicia sesión en /login",
    "access.learner": "has iniciado sesión como {name}; ciérrala para participar con otro nombre",
    "access.teach": "solo pueden hacerlo los organizadores; inicia sesión en /login",
    "session.not_here": "'{name}' no es un archivo de misión de esta carpeta; elige uno de la lista",
    "session.not_read": "{name}: no se puede leer ({reason}); elige un archivo de misión de esta carpeta",
    "session.too_many_open": "hay {limit} misiones abiertas; cierra antes alguna página",
    "session.source": "origen desconocido '{name}'; usa empty, example o una misión del paquete",
    "session.taken": "{name} ya existe; elige otro nombre",
    "session.not_written": "{name}: no se puede escribir ({reason}); {advice}",
    "session.name": "'{name}': usa minúsculas, cifras y _, con una letra al principio",
    "session.changed": "otro programa ha cambiado {name} desde que se abrió",
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
    "flight.waits": "el vuelo espera su turno; páralo, o espera",
    "flight.yours": "tus vuelos no han terminado; espera a que terminen, o cancélalos",
    "flight.too_many": "una página no puede controlar más de {count} a la vez; para antes uno",
    "flight.full": "{count} esperan ya su turno; prueba otra vez en unos minutos",
    "flight.cancelled": "cancelado",
    "flight.silent": "no se voló nada durante {seconds:g} s",
    "flight.not_started": "no se puede iniciar ({reason})",
    "flight.killed": "se terminó, o usó demasiado procesador o memoria",
    "flight.no_result": "terminó sin resultado",
    "flight.ended_process": "el vuelo terminó su proceso: {how}",
    "flight.no_state": "break_on '{name}': no es un estado de la misión; usa su nombre completo",
    "flight.more": "{first} (y {count} más)",
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
    "lesson.no_result": "el vuelo no tuvo resultado",
    "lesson.one_check": "la misión de {name} ya se comprueba o espera su turno; espera a que termine",
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
