"""What a flight, the monitor and the operators' pages tell each other, as lines of JSON.

The monitor listens on a local socket; a flight connects to it. The monitor passes the flight's messages on to
the pages of those who may fly, and theirs to the flight, with who they are.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

MAX_LINE_BYTES = 1 << 18
Demand = Literal["here", "go", "let_go", "stop", "stop_motors", "gone"]


class _Message(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class PageDemand(_Message):
    """What a page sends.

    Attributes:
        kind: `here` answers a beat; `go` says ten times a second that the button is held.
        beat: number of the latest beat that the page has received; -1 before the first.
        flight: that the page shows.
    """

    kind: Literal["here", "go", "let_go", "stop", "stop_motors"]
    beat: Annotated[int, Field(ge=-1, le=1 << 53)] = -1
    flight: Annotated[str, Field(max_length=80)] = ""


class PageMessage(_Message):
    """A page's demand, as the monitor passes it on; `gone`: the page has left.

    Attributes:
        page: number of the connection.
        name: of the person who is logged in; empty: this machine's user.
    """

    page: int
    name: str = ""
    what: Demand
    beat: int = -1
    flight: str = ""


class PageState(_Message):
    """A page that is connected.

    Attributes:
        alive: it was heard within the last second.
        delay_ms: from a beat to its answer; None before the first.
    """

    page: int
    name: str
    alive: bool
    delay_ms: int | None


class Row(_Message):
    """A row of the flight card: cells of text."""

    cells: tuple[str, ...]


class CardSection(_Message):
    """A table of the flight card."""

    title: str
    rows: tuple[Row, ...]


class FlightMessage(_Message):
    """What the flight is; sent when it connects and when it changes.

    Attributes:
        flight: names it.
        title: for people.
        sections: of the flight card; empty before the checks.
        failed: names of checks that prevent arming.
    """

    kind: Literal["flight"] = "flight"
    flight: str
    title: str
    sections: tuple[CardSection, ...] = ()
    failed: tuple[str, ...] = ()


class BeatMessage(_Message):
    """How the flight stands, five times a second.

    Attributes:
        beat: its number.
        phase: what the flight does; see `offboard.safety.operator`.
        asks: it waits for the go.
        stops: what the operator has demanded: 0 nothing, 1 a landing, 2 that the motors stop.
        terminal: the flight's terminal can stop it, too.
        words: on the state, for people.
        pages: all that are connected.
    """

    kind: Literal["beat"] = "beat"
    flight: str
    beat: int
    phase: str
    asks: bool
    stops: int
    terminal: bool
    words: str = ""
    pages: tuple[PageState, ...] = ()


ALL_PAGES = 0
"""Instead of a page's number."""


class AnswerMessage(_Message):
    """Why a page's demand, or what somebody else wanted of the flight, was not done."""

    kind: Literal["answer"] = "answer"
    page: int
    text: str


class EndMessage(_Message):
    """The flight has ended; the pages keep what they show.

    Attributes:
        flight: that has ended; empty: the one that is shown.
        words: how it ended.
        lost: its connection is lost, as the monitor says; it may go on, and connect again.
    """

    kind: Literal["end"] = "end"
    flight: str
    words: str
    lost: bool = False


class YouMessage(_Message):
    """The first message to a page: its number."""

    kind: Literal["you"] = "you"
    page: int


class NoFlightMessage(_Message):
    """No flight is connected."""

    kind: Literal["none"] = "none"


ToPage = YouMessage | NoFlightMessage | FlightMessage | BeatMessage | AnswerMessage | EndMessage
