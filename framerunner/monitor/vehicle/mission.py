"""The mission of the app that flies a vehicle, from its TUNNEL messages to messages for the pages."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isfinite
from typing import Any

from pydantic import TypeAdapter, ValidationError

from framerunner.wire.dialect import Message
from framerunner.wire.finite_json import finite
from framerunner.wire.mission_report import (
    GuardsDocument,
    HistoryDocument,
    MapDocument,
    MissionDocument,
    TransitionTaken,
)
from framerunner.wire.mission_tunnel import (
    DETECTIONS_TYPE,
    DOCUMENT_TYPE,
    STATE_TYPE,
    UNSEEN,
    Box,
    DocumentAssembler,
    DocumentKind,
    MissionState,
    PayloadError,
    TunnelDocument,
    decode_detections,
    decode_state,
)
from framerunner.wire.status_text import plain
from scenarios.result import FlightResult, first_error

_ALIVE_S = 2.0
_TRANSITIONS = 10

_DOCUMENTS: Mapping[DocumentKind, TypeAdapter[Any]] = {
    DocumentKind.MISSION: TypeAdapter(MissionDocument),
    DocumentKind.HISTORY: TypeAdapter(HistoryDocument),
    DocumentKind.MAP: TypeAdapter(MapDocument),
    DocumentKind.GUARDS: TypeAdapter(GuardsDocument),
}

JsonMessage = dict[str, Any]


class MissionView:
    """The mission state of one app.

    Attributes:
        state: the newest; None before the first.
        result: CRC and valid content of the RESULT document; None before it was received.
        problem: of the newest payload that could not be read, for a notice; "" if there was none.
        problem_told: the notice was sent.
    """

    def __init__(self, drone_id: int) -> None:
        self._id = drone_id
        self._assembler = DocumentAssembler()
        self._document: MissionDocument | None = None
        self._document_crc = 0
        self._heard_s = -1e9
        self._history: JsonMessage | None = None
        self._detected: JsonMessage | None = None
        self._map: JsonMessage | None = None
        self._guards: JsonMessage | None = None
        self._flight_crc = 0  # of the mission of map and guards
        self.state: MissionState | None = None
        self.result: tuple[int, FlightResult] | None = None
        self.problem = ""
        self.problem_told = False

    def take(self, message: Message, now_s: float) -> list[JsonMessage]:
        """Take a TUNNEL message. Returns messages for pages: "detections", "chart", "map" and so on."""
        payload = bytes(message.payload[: message.payload_length])
        try:
            if message.payload_type == STATE_TYPE:
                self.state = decode_state(payload)
                self._heard_s = now_s
                return [] if self.state.mission_crc == self._flight_crc else self.forget_flight()
            if message.payload_type == DETECTIONS_TYPE:
                self._detected = self._detections(payload)
                return [self._detected]
            if message.payload_type == DOCUMENT_TYPE:
                document = self._assembler.take(payload)
                return [] if document is None else self._read(document)
        except PayloadError as error:
            self.problem = str(error)
        return []

    def alive(self, now_s: float) -> bool:
        """Whether a state was received in the last two seconds."""
        return now_s - self._heard_s < _ALIVE_S

    def state_index(self, now_s: float) -> int:
        """Index of the present state in the chart's list; -1: none, or the app is not alive."""
        state = self.state
        return state.state_index if state is not None and self.alive(now_s) else -1

    def command(self, now_s: float) -> list[float] | None:
        """The app's command: forward, left, up (m/s), yaw rate to the left (rad/s); None without one."""
        state = self.state
        if state is None or not state.flying or state.paused or not self.alive(now_s):
            return None
        return [round(value, 4) for value in state.command] if isfinite(sum(state.command)) else None

    def as_dict(self, time_us: int, now_s: float) -> JsonMessage | None:
        """The field `mission` of the message "status" at a vehicle time; None before the first state."""
        state, document = self.state, self._document
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
        """What a new watcher is sent: the chart, and the last transitions, guards, detections and map."""
        messages = (self._chart(), self._history, self._guards, self._detected, self._map)
        return [message for message in messages if message is not None]

    def forget_flight(self) -> list[JsonMessage]:
        """Forget map and guards, which belong to another flight; returns messages without their content."""
        told = []
        if self._map is not None:
            told.append(self._map_message(MapDocument()))
        if self._guards is not None:
            told.append(self._guards_message(GuardsDocument()))
        self._map = self._guards = None
        return told

    def _state_name(self, state: MissionState) -> str:
        document = self._document
        if document is None or self._document_crc != state.mission_crc:
            return ""
        if not 0 <= state.state_index < len(document.states):
            return ""
        return plain(document.states[state.state_index])

    def _read(self, document: TunnelDocument) -> list[JsonMessage]:
        if document.kind is DocumentKind.RESULT:
            result = FlightResult.from_outside(dict(document.content))
            if result is None:
                self.problem = "result document: it has no verdict"
            else:
                self.result = (document.crc, result)
            return []
        try:
            content = _DOCUMENTS[document.kind].validate_python(document.content)
        except ValidationError as error:
            self.problem = f"{document.kind.name.lower()} document: {first_error(error)}"
            return []
        match content:
            case MissionDocument():
                self._document, self._document_crc = content, document.crc
                message = _chart_message(self._id, content)
            case HistoryDocument():
                message = self._history = self._transitions(content.transitions[-_TRANSITIONS:])
            case MapDocument():
                message = self._map = self._map_message(content)
                self._flight_crc = content.mission_crc
            case _:
                message = self._guards = self._guards_message(content)
                self._flight_crc = content.mission_crc
        return [message]

    def _chart(self) -> JsonMessage | None:
        document = self._document
        return None if document is None else _chart_message(self._id, document)

    def _map_message(self, document: MapDocument) -> JsonMessage:
        """The message "map"; its texts come from outside."""
        content = document.as_json()
        for frame in content["frames"]:
            frame["colour"] = plain(frame["colour"])
        known = {**content, "goal": plain(document.goal), "t": round(document.time_us * 1e-6, 3)}
        return {"kind": "map", "id": self._id, **known}

    def _guards_message(self, document: GuardsDocument) -> JsonMessage:
        content = {
            "time_s": round(document.time_us * 1e-6, 3),
            "counts": document.counts,
            "guards": [{"id": name, "holds": holds} for name, holds in document.guards],
            "values": [{"name": name, "value": value, "unit": unit} for name, value, unit in document.values],
        }
        return {"kind": "guards", "id": self._id, **finite(content)}

    def _transitions(self, transitions: Sequence[TransitionTaken]) -> JsonMessage:
        listed = [
            {"time_s": round(each.time_us * 1e-6, 3), **each.as_json()} for each in reversed(transitions)
        ]
        return {"kind": "transitions", "id": self._id, "list": finite(listed)}

    def _detections(self, payload: bytes) -> JsonMessage:
        found = decode_detections(payload)
        return {
            "kind": "detections",
            "id": self._id,
            "t": None if found.time_us is None else round(found.time_us * 1e-6, 3),
            "width": found.width_px,
            "height": found.height_px,
            "boxes": {"red": _box(found.red), "green": _box(found.green), "blue": _box(found.blue)},
        }


def _chart_message(drone_id: int, document: MissionDocument) -> JsonMessage:
    content = {"name": document.name, "states": list(document.states)}
    drawn = {"mermaid": document.mermaid, "source": document.source}
    return {"kind": "chart", "id": drone_id, **content, **drawn}


def _box(box: Box) -> list[float | None] | None:
    if box == UNSEEN or not isfinite(box[0]):
        return None
    return [round(value, 3) if isfinite(value) else None for value in box]
