"""A vehicle: passes each message to the object that it concerns, and makes the messages for the pages."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from math import cos, sin
from typing import Any

from framerunner.geometry.vectors import Vec3
from framerunner.monitor.ports import Equipment
from framerunner.monitor.vehicle.camera import CAMERAS, CameraWatch
from framerunner.monitor.vehicle.commands import OWN_SYSTEM, Answer, StickStream, carry_out
from framerunner.monitor.vehicle.link_quality import LinkQuality
from framerunner.monitor.vehicle.mission import MissionView
from framerunner.monitor.vehicle.referees import RefereeChannel, scenario_of
from framerunner.monitor.vehicle.texts import Texts
from framerunner.monitor.vehicle.track import History, Placement
from framerunner.monitor.vehicle.tries import Judging, TryEvent
from framerunner.wire.dialect import AUTOPILOT_COMPONENT_ID, Message, mavlink, request_message
from framerunner.wire.mission_tunnel import COMPONENT_ID as APP
from framerunner.wire.session.session import Request, Session, pose_rates
from framerunner.wire.simulator_api import SimulatorApi
from scenarios.models import Scenario
from scenarios.result import Standing

_FRESH_S = 1.0
_MAX_BOOT_TIME_REQUESTS, _REPEAT_S = 5, 2.0
_WANTED_HZ, _ENOUGH = 25.0, 0.6
_RATE_SPAN_S = 3.0  # over which rates are measured
_MAX_RATE_REQUESTS = 5
_OTHER_BOOT_US = 10_000_000  # a referee whose clock is so far ahead reports the boot before

JsonMessage = dict[str, Any]


@dataclass(frozen=True, slots=True)
class VehicleCallbacks:
    """Called on the loop: `send` with MAVLink, `notice` with level and one line, the others with messages."""

    send: Callable[[Message], None]
    publish: Callable[[JsonMessage], None]
    notice: Callable[[str, str], None]
    publish_try: Callable[[TryEvent], None]


class MonitoredVehicle:
    """One drone on the link.

    Args:
        equipment: what the monitor was given.
        callbacks: receivers of what it sends and reports.
        link_host: the host to which the link is opened; "" if it only listens.

    Attributes:
        id: MAVLink system id.
        pilot: name of the person who has its sticks; "" without one.
        sticks: sends its manual control.
        link: how well it is received.
        camera: where its video is.
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
        self.pilot = ""
        self.sticks = StickStream(drone_id, callbacks.send)
        self.link = LinkQuality(now_s)
        self.camera = CameraWatch(drone_id, link_host, equipment.camera_hosts)
        self._equipment = equipment
        self._callbacks = callbacks
        self._was_lost_s: float | None = None
        self._session = Session(OWN_SYSTEM, drone_id)
        self._telemetry = self._session.telemetry
        self._channel: RefereeChannel | None = None
        self._channel_task: asyncio.Task[None] | None = None
        self._texts = Texts(drone_id, callbacks.publish)
        scenario, start_pose = equipment.scenario, equipment.start_pose
        self._start_pose = start_pose(scenario) if scenario is not None and start_pose is not None else None
        self._drawn: tuple[Scenario, JsonMessage] | None = None
        self._reset(now_s)

    def _reset(self, now_s: float) -> None:
        """Set what belongs to one boot to its initial state."""
        self._placement = Placement()
        self._history = History()
        self._history_source = self._placement.source
        self._mission = MissionView(self.id)
        self._judging = Judging(self.id, self._equipment, self._callbacks.publish_try, now_s)
        boot_time = request_message(self.id, mavlink.MAVLINK_MSG_ID_SYSTEM_TIME)
        self._boot_time: Request[None] = Request(
            boot_time, lambda _: None, tries=_MAX_BOOT_TIME_REQUESTS, every_s=_REPEAT_S
        )
        self._rates = pose_rates(_WANTED_HZ, _ENOUGH, _RATE_SPAN_S, now_s, _MAX_RATE_REQUESTS)
        self._restarts = self._telemetry.restarts
        self._has_flown = False
        self._truth_m: Vec3 | None = None
        self._result_crc: int | None = None

    def take(self, message: Message, now_s: float, host: str = "") -> None:
        """Take a message of any component of this system."""
        number, component = message.get_msgId(), message.get_srcComponent()
        if component == AUTOPILOT_COMPONENT_ID:
            self.link.count(message.get_seq(), now_s)
        if number == mavlink.MAVLINK_MSG_ID_STATUSTEXT:
            self._texts.take(message, self._telemetry.time_us, now_s)
        elif component == AUTOPILOT_COMPONENT_ID:
            self._take_autopilot(message, number, now_s)
        elif component == APP and number == mavlink.MAVLINK_MSG_ID_TUNNEL:
            self._take_app(message, now_s)
        elif component in CAMERAS:
            if number == mavlink.MAVLINK_MSG_ID_HEARTBEAT:
                self.camera.see(component)
            elif number == mavlink.MAVLINK_MSG_ID_VIDEO_STREAM_INFORMATION:
                self.camera.take(message, host)

    def tick(self, now_s: float) -> None:
        """Do what depends on time; to be called ten times a second."""
        self._watch_link(now_s)
        self._texts.tick(now_s)
        wall_boot_us = int(time.time() * 1e6) - self._telemetry.time_us
        self._judging.tick(self._telemetry.boot_unix_us, now_s, wall_boot_us)
        self._report_problems()
        self._keep_history(now_s)
        if self.link.state(now_s) == "live":
            self._send_requests(now_s)
        api = SimulatorApi.of_video(self.camera.url or "") if self._channel_task is None else None
        if api is not None:
            self._open_channel(api)

    async def do(self, what: str) -> Answer:
        """Carry out an order; see `Fleet.do`."""
        return await carry_out(what, self._session, self._callbacks.send, self._texts)

    def close(self) -> None:
        """Stop its sticks and the requests to its referee."""
        self.sticks.set(None)
        if self._channel_task is not None:
            self._channel_task.cancel()

    def pose(self, now_s: float) -> JsonMessage | None:
        """Its part of the message "pose"; None until position and attitude were received."""
        telemetry, alignment = self._telemetry, self._placement.alignment
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
            "truth": None if self._truth_m is None else [round(value, 4) for value in self._truth_m],
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
        telemetry = self._telemetry
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
            "link": self.link.as_dict(now_s),
            "mission": self._mission.as_dict(telemetry.time_us, now_s),
            "pilot": self.pilot,
            "figures": figures,
            "video": self.camera.url is not None,
            "over": self._is_over(figures),
        }

    def world(self) -> JsonMessage | None:
        """The message "world" for this vehicle; None without a scenario."""
        channel = self._channel
        scenario = self._judging.scenario(channel)
        if scenario is None:
            return None
        if self._drawn is None or self._drawn[0] is not scenario:
            self._drawn = (scenario, scenario.model_dump(mode="json"))
        standing = self._judging.standing
        return {
            "kind": "world",
            "scenario": self._drawn[1],
            "lift_m": channel.lift_m if channel is not None and channel.scenario is not None else 0.0,
            "source": standing.source if standing is not None else "telemetry",
        }

    def standing_messages(self) -> list[JsonMessage]:
        """What a new watcher is sent of its mission and of the flight so far."""
        return [*self._mission.standing(), self._history_message()]

    def _take_autopilot(self, message: Message, number: int, now_s: float) -> None:
        is_newest = self._session.take(message, now_s)
        if self._telemetry.restarts != self._restarts:
            self._judging.close()
            self.link.forget_sequence()
            for forgotten in self._mission.forget_flight():
                self._callbacks.publish(forgotten)
            self._reset(now_s)
            self._callbacks.notice("warning", f"drone {self.id} has restarted")
        elif is_newest and number == mavlink.MAVLINK_MSG_ID_HEARTBEAT:
            self._place_by_start()
        elif is_newest and number == mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED:
            self._judging.follow(self._telemetry, self._placement)

    def _place_by_start(self) -> None:
        """Place it by its start if it is disarmed and has not flown.

        Call at each heartbeat: until the next one it may have left its start. After a flight it is not known
        whether it stands there again.
        """
        self._has_flown = self._has_flown or self._telemetry.armed
        if self._start_pose is not None and not self._has_flown and self._telemetry.stands_disarmed:
            self._placement.lay_by_start(self._start_pose, self._telemetry)

    def _take_app(self, message: Message, now_s: float) -> None:
        mission = self._mission
        before = mission.state
        for published in mission.take(message, now_s):
            self._callbacks.publish(published)
        state = mission.state
        if state is not None and state is not before:
            report = self._telemetry.position_near(state.time_us)
            if report is not None:
                self._placement.lay_by_app(state.pose_arena, report)
        if mission.result is not None and mission.result[0] != self._result_crc:
            self._result_crc = mission.result[0]
            self._judging.take_result(*mission.result, now_s)

    def _watch_link(self, now_s: float) -> None:
        state = self.link.state(now_s)
        if state == "lost" and self._was_lost_s is None:
            self._was_lost_s = self.link.heard_s
            if self._is_over(self._judging.figures(self._channel)):
                self._callbacks.notice("info", f"drone {self.id}: not heard any more; its flight was over")
            else:
                self._callbacks.notice("warning", f"drone {self.id}: link lost")
        elif state == "live" and self._was_lost_s is not None:
            away_s = self.link.heard_s - self._was_lost_s
            self._was_lost_s = None
            self._callbacks.notice("info", f"drone {self.id}: link is back after {away_s:.0f} s")

    def _is_over(self, figures: JsonMessage | None) -> bool:
        """Whether it has flown and is disarmed, or its try has a final result."""
        judged = figures is not None and figures["final"]
        return self._has_flown and (judged or not self._telemetry.armed)

    def _keep_history(self, now_s: float) -> None:
        """Add the pose; a better placement removes the samples before it, whose places would be wrong."""
        source = self._placement.source
        if source != self._history_source:
            self._history_source = source
            self._history.clear()
            self._callbacks.publish(self._history_message())
        pose = self.pose(now_s)
        if pose is not None:
            self._history.add(pose)

    def _history_message(self) -> JsonMessage:
        return {"kind": "history", "id": self.id, "poses": self._history.rows()}

    def _report_problems(self) -> None:
        """Report refused video URLs and, of the mission's unreadable payloads, only the first of a boot."""
        mission, camera = self._mission, self.camera
        if camera.problem:
            self._callbacks.notice("warning", f"drone {self.id}: {camera.problem}")
            camera.problem = ""
        if mission.problem and not mission.problem_told:
            mission.problem_told = True
            self._callbacks.notice("warning", f"drone {self.id}, mission: {mission.problem}")

    def _send_requests(self, now_s: float) -> None:
        counts = self._session.stream_counts
        requests = [
            self._boot_time.due(now_s) if self._telemetry.boot_unix_us is None else None,
            self.camera.request(now_s),
            *(self._rates.requests(self.id, counts, now_s) if any(counts.values()) else ()),
        ]
        for request in requests:
            if request is not None:
                self._callbacks.send(request)

    def _open_channel(self, api: SimulatorApi) -> None:
        def take(answer: Standing) -> None:
            ahead_us = (answer.time_us or 0) - self._telemetry.time_us
            if ahead_us >= _OTHER_BOOT_US:
                return
            frame = answer.local_frame
            if frame is not None:
                self._placement.lay_by_frame(frame.origin_arena_m, frame.yaw_rad)
            self._truth_m = answer.position_arena_m
            self._judging.take_standing(answer, asyncio.get_running_loop().time())

        def say(level: str, text: str) -> None:
            self._callbacks.notice(level, f"drone {self.id}: {text}")

        find = partial(scenario_of, equipment=self._equipment)
        self._channel = RefereeChannel(api, take, say, find)
        self._channel_task = asyncio.create_task(self._channel.run())
