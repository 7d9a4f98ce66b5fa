"""A vehicle: hands each message to whom it concerns, and tells the pages what is known."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from math import cos, sin
from typing import Any

from monitor.ports import Equipment, Message
from monitor.referee_channel import RefereeChannel
from monitor.tries import TryEvent
from monitor.vehicle.camera import CAMERAS, CameraWatch
from monitor.vehicle.history import History
from monitor.vehicle.judging import Judging
from monitor.vehicle.link_quality import BootTimeRequest, LinkQuality, RateWatch
from monitor.vehicle.mission import MissionView
from monitor.vehicle.orders import Answer, CommandDesk, carry_out
from monitor.vehicle.placement import Placement
from monitor.vehicle.speech import Speech
from scenarios.models import Scenario
from scenarios.result import Standing
from wire.dialect import AUTOPILOT_COMPONENT_ID, mavlink
from wire.mission_tunnel import COMPONENT_ID as APP
from wire.simulator_api import SimulatorApi
from wire.vehicle_telemetry import VehicleTelemetry

_FRESH_S = 1.0
_OTHER_BOOT_US = 10_000_000  # a referee whose clock is so far ahead still speaks of the boot before

JsonMessage = dict[str, Any]


@dataclass(frozen=True, slots=True)
class VehicleCallbacks:
    """Who is told of a vehicle; all are called on the loop.

    Attributes:
        send: puts a message on the link.
        tell: takes messages for the pages.
        notice: takes level and one line.
        tell_try: takes events of tries.
    """

    send: Callable[[Message], None]
    tell: Callable[[JsonMessage], None]
    notice: Callable[[str, str], None]
    tell_try: Callable[[TryEvent], None]


class Vehicle:
    """One drone on the link.

    Args:
        drone_id: MAVLink system id.
        equipment: what the monitor was given.
        callbacks: who is told.
        now_s: loop time.
        link_host: the host to which the link goes; "" if it only listens.

    Attributes:
        telemetry: what its autopilot tells.
        desk: through which it is commanded.
        pilot: who has its sticks; "" if nobody.
    """

    def __init__(
        self,
        drone_id: int,
        equipment: Equipment,
        callbacks: VehicleCallbacks,
        now_s: float,
        link_host: str = "",
    ) -> None:
        self.id = drone_id
        self._equipment = equipment
        self._callbacks = callbacks
        self._link_host = link_host
        self._link = LinkQuality(now_s)
        self._was_lost_s: float | None = None
        self.telemetry = VehicleTelemetry()
        self._camera = CameraWatch(drone_id, link_host, equipment.camera_hosts)
        self._channel: RefereeChannel | None = None
        self._channel_task: asyncio.Task[None] | None = None
        self._speech = Speech(drone_id, callbacks.tell)
        self.desk = CommandDesk(drone_id, callbacks.send)
        self.pilot = ""
        scenario, start_pose = equipment.scenario, equipment.start_pose
        self._start_pose = start_pose(scenario) if scenario is not None and start_pose is not None else None
        self._drawn: tuple[Scenario, JsonMessage] | None = None
        self._begin(now_s)

    def _begin(self, now_s: float) -> None:
        """Forget what belongs to one boot."""
        self._placement = Placement()
        self._history = History()
        self._history_source = self._placement.source
        self._mission = MissionView(self.id)
        self._judging = Judging(self.id, self._equipment, self._callbacks.tell_try, now_s)
        self._boot_time = BootTimeRequest(self.id)
        self._rates = RateWatch(self.id, now_s)
        self._restarts = self.telemetry.restarts
        self._has_flown = False
        self._result_crc: int | None = None

    def take(self, message: Message, now_s: float, host: str = "") -> None:
        """Take a message of this system, of whichever component.

        Args:
            message: as parsed.
            now_s: loop time.
            host: in numbers, from which it came; "" if over a wire.
        """
        number, component = message.get_msgId(), message.get_srcComponent()
        if component == AUTOPILOT_COMPONENT_ID:
            self._link.hear(message.get_seq(), now_s)
            self._take_autopilot(message, number, now_s)
        elif number == mavlink.MAVLINK_MSG_ID_STATUSTEXT:
            self._take_text(message, now_s)
        elif component == APP and number == mavlink.MAVLINK_MSG_ID_TUNNEL:
            self._take_app(message, now_s)
        elif component in CAMERAS:
            if number == mavlink.MAVLINK_MSG_ID_HEARTBEAT:
                self._camera.see(component)
            elif number == mavlink.MAVLINK_MSG_ID_VIDEO_STREAM_INFORMATION:
                self._camera.take(message, host)

    def tick(self, now_s: float) -> None:
        """Look at the clock, ten times a second."""
        self._watch_link(now_s)
        self._speech.tick(now_s)
        wall_boot_us = int(time.time() * 1e6) - self.telemetry.time_us
        self._judging.tick(self.telemetry.boot_unix_us, now_s, wall_boot_us)
        self._watch_problems()
        self._keep_history(now_s)
        if self._link.state(now_s) == "live":
            self._ask(now_s)
        api = SimulatorApi.of_video(self._camera.url or "") if self._channel_task is None else None
        if api is not None:
            self._open_channel(api)

    async def do(self, what: str) -> Answer:
        """Order something; see `Fleet.do`."""
        return await carry_out(self, what)

    def close(self) -> None:
        """Ask its referee no more."""
        if self._channel_task is not None:
            self._channel_task.cancel()

    @property
    def texts_count(self) -> int:
        """Warnings of the autopilot so far."""
        return self._speech.warnings

    def texts_since(self, count: int) -> list[str]:
        """Warnings of the autopilot after the first `count` of them, as far as they are kept."""
        return self._speech.since(count)

    @property
    def video_url(self) -> str | None:
        """Where its MJPEG is; None if it told none that may be asked for."""
        return self._camera.url

    def age_s(self, now_s: float) -> float:
        """Time since it was last heard."""
        return self._link.age_s(now_s)

    def pose(self, now_s: float) -> JsonMessage | None:
        """Its part of the message "pose"; None while it does not say where it is."""
        telemetry, alignment = self.telemetry, self._placement.alignment
        position, attitude = telemetry.position, telemetry.attitude
        if position is None or attitude is None:
            return None
        x, y, z = alignment.position(position.position_ned_m)
        qw, qx, qy, qz = alignment.attitude(attitude.attitude_ned)
        north, east, down = position.velocity_ned_m_s
        c, s = cos(position.yaw_ned_rad), sin(position.yaw_ned_rad)
        return {
            "id": self.id,
            "t": position.time_us * 1e-6,
            "p": [round(x, 4), round(y, 4), round(z, 4)],
            "q": [round(qw, 5), round(qx, 5), round(qy, 5), round(qz, 5)],
            "v": [round(c * north + s * east, 3), round(s * north - c * east, 3), round(-down, 3)],
            "r": round(-attitude.turn_rate_ned_rad_s, 3),
            "c": self._mission.command(now_s),
            "on": self._judging.motors_on(telemetry, now_s),
            "s": self._mission.state_index(now_s),
            "fresh": now_s - min(telemetry.attitude_heard_s, telemetry.position_heard_s) < _FRESH_S,
        }

    def status(self, now_s: float) -> JsonMessage:
        """Its part of the message "status"."""
        telemetry = self.telemetry
        voltage_v = telemetry.voltage_v
        figures = self._judging.figures(self._channel)
        return {
            "id": self.id,
            "name": f"drone {self.id}",
            "mode": telemetry.mode_name,
            "armed": telemetry.armed,
            "landed": telemetry.landed,
            "battery_percent": telemetry.battery_percent,
            "voltage_v": None if voltage_v is None else round(voltage_v, 2),
            "link": self._link.as_dict(now_s),
            "mission": self._mission.as_dict(telemetry.time_us, now_s),
            "pilot": self.pilot,
            "figures": figures,
            "video": self._camera.url is not None,
            "over": self._is_over(figures),
        }

    def world(self) -> JsonMessage | None:
        """The message "world" as this vehicle has it; None if it knows of none."""
        channel = self._channel
        scenario = self._judging.scenario(channel)
        if scenario is None:
            return None
        if self._drawn is None or self._drawn[0] is not scenario:
            self._drawn = (scenario, scenario.model_dump(mode="json"))
        told = channel is not None and channel.scenario is not None
        standing = self._judging.standing
        return {
            "kind": "world",
            "scenario": self._drawn[1],
            "lift_m": channel.lift_m if channel is not None and told else 0.0,
            "source": standing.source if standing is not None else "telemetry",
        }

    def standing_messages(self) -> list[JsonMessage]:
        """What a new watcher is told of its mission and of the flight so far."""
        return [*self._mission.standing(), self._history_message()]

    def _take_autopilot(self, message: Message, number: int, now_s: float) -> None:
        if number == mavlink.MAVLINK_MSG_ID_COMMAND_ACK:
            self.desk.take(message)
        elif number == mavlink.MAVLINK_MSG_ID_STATUSTEXT:
            self._take_text(message, now_s)
        else:
            is_newest = self.telemetry.take(message, now_s)
            if self.telemetry.restarts != self._restarts:
                self._restart(now_s)
            elif is_newest and number == mavlink.MAVLINK_MSG_ID_HEARTBEAT:
                self._place_by_start()
            elif is_newest and number == mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED:
                self._judging.follow(self.telemetry, self._placement)

    def _place_by_start(self) -> None:
        """A heartbeat came: while it stands disarmed and has not flown, it stands on its start.

        Only now is it sure to be disarmed: until the next heartbeat it may have left its start. And once it
        has flown nobody knows whether it stands there again.
        """
        self._has_flown = self._has_flown or self.telemetry.armed
        if self._start_pose is not None and not self._has_flown and self.telemetry.stands_disarmed:
            self._placement.lay_by_start(self._start_pose, self.telemetry)

    def _take_text(self, message: Message, now_s: float) -> None:
        self._speech.take(message, self.telemetry.time_us, now_s)

    def _take_app(self, message: Message, now_s: float) -> None:
        mission = self._mission
        before = mission.state
        for told in mission.take(message, now_s):
            self._callbacks.tell(told)
        state = mission.state
        if state is not None and state is not before:
            there = self.telemetry.position_near(state.time_us)
            if there is not None:
                self._placement.lay_by_app(state.pose_arena, there)
        if mission.result is not None and mission.result[0] != self._result_crc:
            self._result_crc = mission.result[0]
            self._judging.take_result(*mission.result, now_s)

    def _restart(self, now_s: float) -> None:
        self._judging.close()
        self._link.forget_sequence()
        self._begin(now_s)
        self._callbacks.notice("warning", f"drone {self.id} has started anew")

    def _watch_link(self, now_s: float) -> None:
        state = self._link.state(now_s)
        if state == "lost" and self._was_lost_s is None:
            self._was_lost_s = self._link.heard_s
            if self._is_over(self._judging.figures(self._channel)):
                self._callbacks.notice("info", f"drone {self.id}: not heard any more; its flight was over")
            else:
                self._callbacks.notice("warning", f"drone {self.id}: link lost")
        elif state == "live" and self._was_lost_s is not None:
            away_s = self._link.heard_s - self._was_lost_s
            self._was_lost_s = None
            self._callbacks.notice("info", f"drone {self.id}: link is back after {away_s:.0f} s")

    def _is_over(self, figures: JsonMessage | None) -> bool:
        """Whether it has flown and its flight has ended: disarmed, or judged for good."""
        judged = figures is not None and figures["final"]
        return self._has_flown and (judged or not self.telemetry.armed)

    def _keep_history(self, now_s: float) -> None:
        """Note where it is. What was noted before the arena was laid under it would be in the wrong place."""
        source = self._placement.source
        if source != self._history_source:
            self._history_source = source
            self._history.clear()
            self._callbacks.tell(self._history_message())
        pose = self.pose(now_s)
        if pose is not None:
            self._history.add(pose)

    def _history_message(self) -> JsonMessage:
        return {"kind": "history", "id": self.id, "poses": self._history.rows()}

    def _watch_problems(self) -> None:
        """Say what was wrong with what it sent, each once."""
        mission, camera = self._mission, self._camera
        if camera.problem:
            self._callbacks.notice("warning", f"drone {self.id}: {camera.problem}")
            camera.problem = ""
        if mission.problem and not mission.problem_told:
            mission.problem_told = True
            self._callbacks.notice("warning", f"drone {self.id}, mission: {mission.problem}")

    def _ask(self, now_s: float) -> None:
        telemetry = self.telemetry
        requests = [
            self._boot_time.request(telemetry.boot_unix_us, now_s),
            self._camera.question(now_s),
            *self._rates.requests((telemetry.attitudes, telemetry.positions), now_s),
        ]
        for request in requests:
            if request is not None:
                self._callbacks.send(request)

    def _open_channel(self, api: SimulatorApi) -> None:
        def hear(answer: Standing) -> None:
            ahead_us = (answer.time_us or 0) - self.telemetry.time_us
            if ahead_us >= _OTHER_BOOT_US:
                return
            frame = answer.local_frame
            if frame is not None:
                self._placement.lay_by_frame(frame.origin_arena_m, frame.yaw_rad)
            self._judging.hear(answer, asyncio.get_running_loop().time())

        def say(level: str, text: str) -> None:
            self._callbacks.notice(level, f"drone {self.id}: {text}")

        self._channel = RefereeChannel(api, hear, say)
        self._channel_task = asyncio.create_task(self._run_channel(self._channel))

    async def _run_channel(self, channel: RefereeChannel) -> None:
        with suppress(asyncio.CancelledError):
            await channel.run()
