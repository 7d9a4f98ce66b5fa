"""The virtual camera as a program: telemetry in, video and the referee's view out."""

from __future__ import annotations

import asyncio
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping

from framerunner.virtual_camera.painter import VirtualCamera
from sitl.video import VideoServer
from wire.dialect import (
    AUTOPILOT_COMPONENT_ID,
    Message,
    companion_heartbeat,
    is_vehicle,
    mavlink,
    request_rate,
)
from wire.simulator_api import REFEREE_PATH, SCENARIO_PATH
from wire.transports.urls import LinkError
from wire.transports.vehicle_link import VehicleLink

STALE_S = 0.5  # wall time without attitude or position, after which no image is served
SYSTEM_ID = 246  # MAVSDK has 245, ground stations 255
COMPONENT_ID = mavlink.MAV_COMP_ID_ONBOARD_COMPUTER
WANTED_HZ = 50.0
ENOUGH_HZ = 40.0
_ASKS = 5
_HOUSEKEEPING_S = 0.1
_RATE_PERIOD_S = 2.0
_WAITING_LINE_S = 10.0
_RECEIVE_S = 0.1

Say = Callable[[str], None]


class CameraServer:
    """Reads a vehicle's telemetry, paints, serves.

    Args:
        camera: paints.
        link: to the vehicle; closed at the end.
        video: where images are shown.
        say: called with lines for people.
    """

    def __init__(self, camera: VirtualCamera, link: VehicleLink, video: VideoServer, say: Say) -> None:
        self._camera = camera
        self._link = link
        self._video = video
        self._say = say
        self._watch = _Watch(say, link.url)
        self._vehicle: int | None = None
        self._to_send: deque[Message] = deque()  # by the thread that reads
        self._halt = threading.Event()
        self._failed: asyncio.Future[None] | None = None
        self._rates = _Rates()
        self._restarts = 0

    async def run(self) -> None:
        """Serve until cancelled.

        Raises:
            VideoError: the TCP port is taken.
            LinkError: the link failed.
        """
        loop = asyncio.get_running_loop()
        self._failed = loop.create_future()
        self._video.add_json(REFEREE_PATH, self._referee_answer)
        scenario = self._camera.plan.scenario
        self._video.add_json(SCENARIO_PATH, lambda _query: scenario.model_dump(mode="json"))
        reader = threading.Thread(target=self._read, args=(loop,), name="telemetry", daemon=True)
        keeper: asyncio.Task[None] | None = None
        try:
            await self._video.start()
            self._say(
                f"camera of {scenario.name}: video on {self._video.url} (Ctrl-C stops); "
                f"listening for a vehicle on {self._link.url}"
            )
            reader.start()
            keeper = asyncio.create_task(self._keep_house())
            await self._failed
        finally:
            self._halt.set()
            if keeper is not None:
                keeper.cancel()
            await self._video.close()
            if reader.ident is not None:
                await asyncio.to_thread(reader.join)
            self._link.close()

    def _read(self, loop: asyncio.AbstractEventLoop) -> None:
        """On a thread that alone uses the link: send, wait for packets, hand them to the loop."""
        while not self._halt.is_set():
            try:
                while self._to_send:
                    self._link.send(self._to_send.popleft())
                messages = self._link.receive(_RECEIVE_S)
            except LinkError as error:
                loop.call_soon_threadsafe(self._fail, error)
                return
            if messages and not self._halt.is_set():
                loop.call_soon_threadsafe(self._take, messages)

    def _fail(self, error: LinkError) -> None:
        if self._failed is not None and not self._failed.done():
            self._failed.set_exception(error)

    def _take(self, messages: list[Message]) -> None:
        for message in messages:
            if self._vehicle is None and is_vehicle(message):
                self._vehicle = message.get_srcSystem()
                self._say(f"vehicle {self._vehicle} found")
            if self._vehicle is None or not self._is_ours(message):
                continue
            self._camera.take(message)
            self._watch.see(message.get_type(), time.monotonic())
        if self._camera.restarts != self._restarts:
            self._restarts = self._camera.restarts
            self._rates = _Rates()
            self._say("the vehicle has started anew; the arena is laid under it again")
        self._watch.tell_placement(self._camera)
        shot = self._camera.step()
        if shot is not None and not self._watch.stale:
            self._video.publish(shot[1], shot[0])

    def _is_ours(self, message: Message) -> bool:
        return bool(
            message.get_srcSystem() == self._vehicle and message.get_srcComponent() == AUTOPILOT_COMPONENT_ID
        )

    async def _keep_house(self) -> None:
        """Heartbeat once a second, rates, and the word when telemetry stays away."""
        beat_s = rates_s = time.monotonic()
        self._to_send.append(companion_heartbeat())  # over udpout the vehicle does not know us before
        while True:
            await asyncio.sleep(_HOUSEKEEPING_S)
            now_s = time.monotonic()
            if now_s - beat_s >= 1.0:
                beat_s = now_s
                self._to_send.append(companion_heartbeat())
            self._watch.check(now_s)
            if self._vehicle is not None and now_s - rates_s >= _RATE_PERIOD_S:
                self._ask_for_rates(now_s - rates_s)
                rates_s = now_s

    def _ask_for_rates(self, span_s: float) -> None:
        """Ask for more where too little comes; a link that cannot carry it is told of and left alone."""
        telemetry, rates = self._camera.telemetry, self._rates
        attitude_hz = (telemetry.attitudes - rates.attitudes) / span_s
        position_hz = (telemetry.positions - rates.positions) / span_s
        rates.attitudes, rates.positions = telemetry.attitudes, telemetry.positions
        if min(attitude_hz, position_hz) >= ENOUGH_HZ or rates.asked > _ASKS:
            return
        rates.asked += 1
        if rates.asked > _ASKS:
            self._say(
                f"attitude comes at {attitude_hz:.0f} Hz and position at {position_hz:.0f} Hz, less than the "
                f"{WANTED_HZ:.0f} Hz asked for; the images stutter with it"
            )
            return
        assert self._vehicle is not None
        for number, rate_hz in (
            (mavlink.MAVLINK_MSG_ID_ATTITUDE_QUATERNION, attitude_hz),
            (mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED, position_hz),
        ):
            if rate_hz < ENOUGH_HZ:
                self._to_send.append(request_rate(self._vehicle, number, WANTED_HZ))

    def _referee_answer(self, query: Mapping[str, str]) -> object:
        return self._camera.standing(query.get("state", ""), query.get("ended")).model_dump(mode="json")


class _Rates:
    """What had come when the rates were last looked at."""

    def __init__(self) -> None:
        self.attitudes = self.positions = self.asked = 0


class _Watch:
    """Says once what is missing and once when it is there again.

    Attributes:
        stale: attitude or position stays away.
    """

    def __init__(self, say: Say, url: str) -> None:
        self._say = say
        self._url = url
        self._seen_s: dict[str, float] = {}
        self._began_s = time.monotonic()
        self._waiting_said = False
        self._placed: bool | None = None
        self.stale = False

    def see(self, kind: str, now_s: float) -> None:
        """Note a message's arrival."""
        self._seen_s["ATTITUDE" if kind == "ATTITUDE_QUATERNION" else kind] = now_s

    def check(self, now_s: float) -> None:
        """Compare with the clock."""
        ages = {
            name: now_s - self._seen_s.get(key, self._began_s)
            for name, key in (("attitude", "ATTITUDE"), ("local position", "LOCAL_POSITION_NED"))
        }
        missing = [name for name, age_s in ages.items() if age_s > STALE_S]
        if not {"ATTITUDE", "LOCAL_POSITION_NED"} <= set(self._seen_s):
            if missing and not self._waiting_said and now_s - self._began_s > _WAITING_LINE_S:
                self._waiting_said = True
                self._say(f"still no {' and no '.join(missing)} on {self._url}; no images until they come")
            return
        if missing and not self.stale:
            self._say(f"no {' and no '.join(missing)} for {STALE_S:g} s; no new images until they are back")
        if self.stale and not missing:
            self._say("telemetry is back")
        self.stale = bool(missing)

    def tell_placement(self, camera: VirtualCamera) -> None:
        """Say when the arena is laid, or why it is not."""
        placement = camera.placement
        placed = placement.alignment is not None
        if placed == self._placed or not (placed or placement.armed):
            return
        self._placed = placed
        if placed:
            self._say("the arena lies so that the vehicle stands on the start, looking the start's way")
        else:
            self._say("no place for the arena yet: the vehicle must stand disarmed on its start")
