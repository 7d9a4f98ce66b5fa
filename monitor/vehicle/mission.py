"""What the app that flies a vehicle tells of its mission, made into messages for the pages."""

from __future__ import annotations

from math import isfinite
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from monitor.ports import Message
from scenarios.result import FlightResult, first_error
from wire.finite_json import finite
from wire.mission_tunnel import (
    DETECTIONS_TYPE,
    DOCUMENT_TYPE,
    STATE_TYPE,
    UNSEEN,
    Box,
    Document,
    DocumentAssembler,
    DocumentKind,
    MissionState,
    PayloadError,
    decode_detections,
    decode_state,
)
from wire.status_text import plain

ALIVE_S = 2.0
_TRANSITIONS = 10
_COLOURS = ("red", "green", "blue")

JsonMessage = dict[str, Any]
Name = Annotated[str, Field(max_length=200)]


class _Lenient(BaseModel):
    model_config = ConfigDict(extra="ignore", frozen=True)


class MissionDocument(_Lenient):
    """The MISSION document."""

    name: Name = ""
    description: str = ""
    scenario: Name = ""
    states: list[Name] = Field([], max_length=2000)
    mermaid: str = ""
    source: str = ""


class TransitionTold(_Lenient):
    """A transition in the HISTORY document."""

    source: Name = Field("", alias="from")
    target: Name = Field("", alias="to")
    time_us: int = Field(0, ge=0, le=2**63)
    when: str = Field("", max_length=2000)
    values: list[tuple[Name, float | bool | int | str | None]] = Field([], max_length=100)
    seconds: float | None = None


class _History(_Lenient):
    transitions: list[TransitionTold] = Field([], max_length=100)


class MissionView:
    """Follows one app.

    Attributes:
        state: the last one told; None before.
        document: of the mission flown; None before.
        result: the CRC of the RESULT document and what makes sense in it; None before.
        problem: the last payload that made no sense, for a notice; "" if none.
        problem_told: the notice was given.
    """

    def __init__(self, drone_id: int) -> None:
        self._id = drone_id
        self._assembler = DocumentAssembler()
        self._document_crc = 0
        self._heard_s = -1e9
        self._history: JsonMessage | None = None
        self._seen: JsonMessage | None = None
        self.state: MissionState | None = None
        self.document: MissionDocument | None = None
        self.result: tuple[int, FlightResult] | None = None
        self.problem = ""
        self.problem_told = False

    def take(self, message: Message, now_s: float) -> list[JsonMessage]:
        """Take a TUNNEL message.

        Returns:
            What the pages are to be told: "detections", "chart" or "transitions".
        """
        payload = bytes(message.payload[: message.payload_length])
        try:
            if message.payload_type == STATE_TYPE:
                self.state = decode_state(payload)
                self._heard_s = now_s
            elif message.payload_type == DETECTIONS_TYPE:
                self._seen = self._detections(payload)
                return [self._seen]
            elif message.payload_type == DOCUMENT_TYPE:
                document = self._assembler.take(payload)
                return [] if document is None else self._read(document)
        except PayloadError as error:
            self.problem = str(error)
        return []

    def alive(self, now_s: float) -> bool:
        """Whether the app was heard lately."""
        return now_s - self._heard_s < ALIVE_S

    def state_index(self, now_s: float) -> int:
        """The present state in the chart's list; -1: none, or nobody says."""
        state = self.state
        return state.state_index if state is not None and self.alive(now_s) else -1

    def command(self, now_s: float) -> list[float] | None:
        """What the app commands: forward, left, up (m/s), yaw rate to the left (rad/s); None if nothing."""
        state = self.state
        if state is None or not state.flying or state.paused or not self.alive(now_s):
            return None
        return [round(value, 4) for value in state.command] if isfinite(sum(state.command)) else None

    def as_dict(self, time_us: int, now_s: float) -> JsonMessage | None:
        """The mission as the status tells it.

        Args:
            time_us: vehicle time now.
            now_s: loop time.
        """
        state, document = self.state, self.document
        if state is None:
            return None
        alive = self.alive(now_s)
        until_us = max(time_us, state.time_us) if alive else state.time_us
        return {
            "name": plain(document.name) if document is not None else "",
            "state": self._state_name(state),
            "seconds": round(max(0, until_us - state.entered_us) * 1e-6, 1),
            "transitions": state.transitions,
            "paused": state.paused,
            "flying": state.flying,
            "finished": state.finished,
            "alive": alive,
        }

    def standing(self) -> list[JsonMessage]:
        """What a new watcher is told: the chart, the last transitions, and what the last image showed."""
        told = (self._chart(), self._history, self._seen)
        return [message for message in told if message is not None]

    def _state_name(self, state: MissionState) -> str:
        document = self.document
        fits = document is not None and self._document_crc == state.mission_crc
        if document is None or not fits or not 0 <= state.state_index < len(document.states):
            return ""
        return plain(document.states[state.state_index])

    def _read(self, document: Document) -> list[JsonMessage]:
        try:
            if document.kind is DocumentKind.MISSION:
                self.document = MissionDocument.model_validate(document.content)
                self._document_crc = document.crc
                chart = self._chart()
                return [] if chart is None else [chart]
            if document.kind is DocumentKind.HISTORY:
                told = _History.model_validate(document.content).transitions
                self._history = self._transitions(told[-_TRANSITIONS:])
                return [self._history]
        except ValidationError as error:
            self.problem = f"{document.kind.name.lower()} document: {first_error(error)}"
            return []
        result = FlightResult.from_outside(dict(document.content))
        if result is None:
            self.problem = "result document: no verdict is told"
        else:
            self.result = (document.crc, result)
        return []

    def _chart(self) -> JsonMessage | None:
        document = self.document
        if document is None:
            return None
        return {
            "kind": "chart",
            "id": self._id,
            "name": document.name,
            "mermaid": document.mermaid,
            "states": document.states,
            "source": document.source,
        }

    def _transitions(self, told: list[TransitionTold]) -> JsonMessage:
        listed = [
            {
                "time_s": round(each.time_us * 1e-6, 3),
                "from": each.source,
                "to": each.target,
                "when": each.when,
                "values": [[name, value] for name, value in each.values],
                "seconds": each.seconds,
            }
            for each in reversed(told)
        ]
        return {"kind": "transitions", "id": self._id, "list": finite(listed)}

    def _detections(self, payload: bytes) -> JsonMessage:
        seen = decode_detections(payload)
        boxes = zip(_COLOURS, (seen.red, seen.green, seen.blue), strict=True)
        return {
            "kind": "detections",
            "id": self._id,
            "t": None if seen.time_us is None else round(seen.time_us * 1e-6, 3),
            "width": seen.width_px,
            "height": seen.height_px,
            "boxes": {colour: _box(box) for colour, box in boxes},
        }


def _box(box: Box) -> list[float | None] | None:
    if box == UNSEEN or not isfinite(box[0]):
        return None
    return [round(value, 3) if isfinite(value) else None for value in box]
