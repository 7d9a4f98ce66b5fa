"""Reports a mission over MAVLink while it is flown: its state, detections, transitions, and the result."""

from __future__ import annotations

import logging
from collections import Counter, deque
from collections.abc import Mapping
from dataclasses import asdict, replace
from typing import Any

from framerunner.flying.navigation_reporter import map_document
from framerunner.wire.mission_report import GuardsDocument, MapDocument, MissionDocument
from framerunner.wire.mission_tunnel import (
    TEXT_PREFIX,
    Box,
    DocumentKind,
    MissionDetections,
    MissionState,
    PayloadError,
    split_document,
)
from offboard.app import Moment
from offboard.drone import DroneState
from offboard.engine import MissionEngine
from offboard.link.companion import Companion
from offboard.mission import Mission, mermaid
from scenarios.result import FlightResult
from vision.types import CameraFrame, Detection, Detections

STATE_TICKS = 2  # 10 Hz of vehicle time
HISTORY = 10
NEWS_US = 500_000  # of vehicle time between two maps, and between two documents of guards
MAX_GUARDS = 100
MAX_COUNTS = 1000
MAX_HISTORY_PIECES = 4  # two are sent at once, two with the companion's next beat

logger = logging.getLogger(__name__)


class _News:
    """Whether a document that can be made at each tick is sent: if it is due, and not the last one again."""

    def __init__(self) -> None:
        self._told: MapDocument | GuardsDocument | None = None

    def is_due(self, time_us: int) -> bool:
        """Whether one may be sent at a vehicle time."""
        return self._told is None or time_us - self._told.time_us >= NEWS_US

    def take(self, document: MapDocument | GuardsDocument) -> bool:
        """Take a document; whether it is to be sent."""
        if self._told is not None and replace(self._told, time_us=document.time_us) == document:
            return False
        self._told = document
        return True


class MissionReporter:
    """Sees a flight tick by tick and reports it through a companion. It never raises.

    Args:
        companion: sends.
        mission: what is flown.
        source: text of its file.
        scenario: its name.
        start_arena: x, y, z (metres) and yaw (radians) before the first tick.
    """

    def __init__(
        self,
        companion: Companion,
        mission: Mission,
        source: str,
        scenario: str,
        start_arena: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0),
    ) -> None:
        self._companion = companion
        self._numbers = {leaf_id: number for number, leaf_id in enumerate(mission.leaves)}
        self._finishes = mission.finishes
        self._crc = self._report_mission(mission, source, scenario)
        self._history: deque[dict[str, object]] = deque(maxlen=HISTORY)
        self._transitions = 0
        self._mission_state = ""
        self._entered_us = 0
        self._reported: tuple[object, ...] = ()
        self._ticks = 0
        self._image_size_px = (0, 0)
        self._detections: Detections | None = None
        self._counts: Counter[str] = Counter()
        self._map_news, self._guard_news = _News(), _News()
        self._broken = False
        still = (0.0, 0.0, 0.0, 0.0)
        companion.send_state(MissionState(self._crc, -1, 0, 0, 0, False, False, False, still, start_arena))

    def see_frame(self, frame: CameraFrame) -> None:
        """Note the size of the images."""
        height, width = frame.image.shape[:2]
        self._image_size_px = (width, height)

    def see(self, moment: Moment) -> None:
        """Report a tick."""
        if self._broken:
            return
        try:
            self._see(moment)
        except Exception as error:  # must not end the flight
            self._broken = True
            logger.warning("the mission is no longer reported: %r", error)

    async def look(self, engine: MissionEngine, state: DroneState) -> None:
        """Report what the guards read, twice a second: a `TickHook` that never waits."""
        is_busy = self._companion.is_sending(DocumentKind.GUARDS)
        if self._broken or is_busy or not self._guard_news.is_due(state.time_us):
            return
        try:
            chart = engine.chart_now()
            document = GuardsDocument(
                self._crc,
                state.time_us,
                counts=dict(self._counts.most_common(MAX_COUNTS)),
                guards=tuple((each.id, each.holds) for each in chart.guards[:MAX_GUARDS]),
                values=tuple((each.name, each.value, each.unit) for each in chart.values[:MAX_GUARDS]),
            )
            if self._guard_news.take(document):
                self._send_document(DocumentKind.GUARDS, asdict(document))
        except Exception as error:  # must not end the flight
            self._broken = True
            logger.warning("the mission is no longer reported: %r", error)

    async def send_result(self, result: FlightResult) -> None:
        """Send how the flight was judged, at once and twice, and wait 0.3 s until that has been sent."""
        if self._send_document(DocumentKind.RESULT, result.as_json()) is not None:
            await self._companion.send_finally(DocumentKind.RESULT)

    def _see(self, moment: Moment) -> None:
        time_us = moment.state.time_us
        if moment.transition is not None:
            self._transitions += 1
            self._counts.update(moment.transition.ids)
            self._history.append({"time_us": moment.transition.time_us, **moment.transition.as_json()})
            self._send_history()
        if moment.mission_state != self._mission_state or moment.transition is not None:
            self._entered_us = time_us
        flying = moment.state.armed and moment.state.offboard and not moment.paused
        changing = (self._transitions, moment.mission_state, moment.paused, flying)
        if changing != self._reported or self._ticks % STATE_TICKS == 0:
            self._reported = changing
            self._ticks = 0
            self._send_state(moment, flying)
        self._ticks += 1
        if moment.mission_state != self._mission_state:
            self._mission_state = moment.mission_state
            self._companion.send_text(f"{TEXT_PREFIX}{moment.mission_state}")
        self._send_detections(moment)
        self._send_map(moment)

    def _send_history(self) -> None:
        """Send the last transitions, as many as arrive within 0.1 s of the newest."""
        while True:
            _, pieces = split_document(DocumentKind.HISTORY, {"transitions": list(self._history)})
            if len(pieces) <= MAX_HISTORY_PIECES or len(self._history) == 1:
                break
            self._history.popleft()
        self._companion.send_document(DocumentKind.HISTORY, pieces)

    def _send_state(self, moment: Moment, flying: bool) -> None:
        state, command = moment.state, moment.command
        self._companion.send_state(
            MissionState(
                mission_crc=self._crc,
                state_index=self._numbers.get(moment.mission_state, -1),
                transitions=self._transitions & 0xFFFF,
                time_us=state.time_us,
                entered_us=self._entered_us,
                flying=flying,
                paused=moment.paused,
                finished=moment.mission_state in self._finishes,
                command=(command.forward_m_s, command.left_m_s, command.up_m_s, command.yaw_rate_rad_s),
                pose_arena=(state.x, state.y, state.z, state.yaw),
            )
        )

    def _send_detections(self, moment: Moment) -> None:
        """Once for each image: perception returns the same object until there is another image."""
        seen = moment.detections
        if seen is self._detections or self._image_size_px == (0, 0):
            return
        self._detections = seen
        if moment.mission_state in self._finishes:
            return  # the image is not used any more
        width, height = self._image_size_px
        red, green, blue = _box(seen.red), _box(seen.green), _box(seen.blue)
        self._companion.send_detections(MissionDetections(seen.time_us, width, height, red, green, blue))

    def _send_map(self, moment: Moment) -> None:
        """Send the navigator's map if it is due; one that is still being sent is finished before."""
        view, time_us = moment.navigation, moment.state.time_us
        is_busy = self._companion.is_sending(DocumentKind.MAP)
        if view is None or is_busy or not self._map_news.is_due(time_us):
            return
        document = map_document(view, moment.place, mission_crc=self._crc, time_us=time_us)
        if self._map_news.take(document):
            self._send_document(DocumentKind.MAP, asdict(document))

    def _report_mission(self, mission: Mission, source: str, scenario: str) -> int:
        """Send what is flown, without the parts that make it too large; returns its CRC."""
        states, chart = tuple(mission.leaves), mermaid(mission)
        whole = MissionDocument(mission.name, mission.description, scenario, states, chart, source)
        without_source = replace(whole, source="")
        without_chart = replace(without_source, mermaid="")
        for document in (whole, without_source, without_chart, replace(without_chart, states=())):
            crc = self._send_document(DocumentKind.MISSION, asdict(document))
            if crc is not None:
                return crc
        return 0

    def _send_document(self, kind: DocumentKind, content: Mapping[str, Any]) -> int | None:
        """Returns its CRC; None if it cannot be sent."""
        try:
            crc, pieces = split_document(kind, content)
        except PayloadError as error:
            logger.warning("not reported: %s", error)
            return None
        self._companion.send_document(kind, pieces)
        return crc


def _box(detection: Detection) -> Box:
    return (detection.n, detection.s, detection.e, detection.w, detection.d, detection.a)
