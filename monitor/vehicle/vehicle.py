"""A vehicle: hands each message to whom it concerns, and tells the pages what is known."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from math import cos, sin
from typing import Any

from pymavlink.dialects.v20 import common as mavlink

from monitor.ports import Equipment, Message
from monitor.referee_channel import RefereeChannel
from monitor.tries import TryEvent
from monitor.vehicle.asking import BootTime, RateWatch
from monitor.vehicle.camera import CAMERAS, CameraWatch
from monitor.vehicle.commands import CommandDesk
from monitor.vehicle.condition import Condition
from monitor.vehicle.history import History
from monitor.vehicle.judging import Judging
from monitor.vehicle.mission import MissionView
from monitor.vehicle.motion import Motion
from monitor.vehicle.orders import Answer, carry_out
from monitor.vehicle.placement import Placement
from monitor.vehicle.speech import Speech
from monitor.vehicle.traffic import Traffic
from scenarios.models import Scenario
from scenarios.result import Standing
from wire.mission_messages import COMPONENT_ID as APP
from wire.simulator_api import SimulatorApi

AUTOPILOT = mavlink.MAV_COMP_ID_AUTOPILOT1
_FRESH_S = 1.0
_OTHER_BOOT_US = 10_000_000  # a referee whose clock is so far ahead still speaks of the boot before

JsonMessage = dict[str, Any]
Handler = Callable[[Message, float], object]


@dataclass(frozen=True, slots=True)
class Ears:
    """Who is told what a vehicle has to tell; all are called on the loop.

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
        ears: who is told.
        now_s: loop time.
        link_host: the host to which the link goes; "" if it only listens.

    Attributes:
        condition: armed, mode, battery.
        desk: through which it is commanded.
        pilot: who has its sticks; "" if nobody.
    """

    def __init__(
        self, drone_id: int, equipment: Equipment, ears: Ears, now_s: float, link_host: str = ""
    ) -> None:
        self.id = drone_id
        self._equipment = equipment
        self._ears = ears
        self._link_host = link_host
        self._traffic = Traffic(now_s)
        self._was_lost_s: float | None = None
        self._motion = Motion()
        self._camera = CameraWatch(drone_id, link_host, equipment.camera_hosts)
        self._channel: RefereeChannel | None = None
        self._channel_task: asyncio.Task[None] | None = None
        self._speech = Speech(drone_id, ears.tell)
        self.desk = CommandDesk(drone_id, ears.send)
        self.pilot = ""
        scenario, start_pose = equipment.scenario, equipment.start_pose
        self._start_pose = start_pose(scenario) if scenario is not None and start_pose is not None else None
        self._drawn: tuple[Scenario, JsonMessage] | None = None
        self._begin(now_s)
        self._autopilot_handlers = self._handlers()

    def _begin(self, now_s: float) -> None:
        """Forget what belongs to one boot."""
        self.condition = Condition()
        self._placement = Placement()
        self._history = History()
        self._history_source = self._placement.source
        self._mission = MissionView(self.id)
        self._judging = Judging(self.id, self._equipment, self._ears.tell_try, now_s)
        self._boot = BootTime(self.id)
        self._rates = RateWatch(self.id, now_s)
        self._restarts = self._motion.restarts
        self._has_flown = False
        self._result_crc: int | None = None

    def _handlers(self) -> dict[int, Handler]:
        motion = self._motion
        return {
            mavlink.MAVLINK_MSG_ID_HEARTBEAT: self._take_heartbeat,
            mavlink.MAVLINK_MSG_ID_ATTITUDE_QUATERNION: motion.take_quaternion,
            mavlink.MAVLINK_MSG_ID_ATTITUDE: motion.take_angles,
            mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED: self._take_position,
            mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: lambda each, _: self.condition.take_landed(each),
            mavlink.MAVLINK_MSG_ID_BATTERY_STATUS: lambda each, _: self.condition.take_battery(each),
            mavlink.MAVLINK_MSG_ID_SYS_STATUS: lambda each, _: self.condition.take_system_status(each),
            mavlink.MAVLINK_MSG_ID_SYSTEM_TIME: lambda each, _: self._boot.take(each),
            mavlink.MAVLINK_MSG_ID_COMMAND_ACK: lambda each, _: self.desk.take(each),
            mavlink.MAVLINK_MSG_ID_STATUSTEXT: self._take_text,
        }

    def take(self, message: Message, now_s: float, host: str = "") -> None:
        """Take a message of this system, of whichever component.

        Args:
            message: as parsed.
            now_s: loop time.
            host: in numbers, from which it came; "" if over a wire.
        """
        number, component = message.get_msgId(), message.get_srcComponent()
        if component == AUTOPILOT:
            self._traffic.hear(message.get_seq(), now_s)
            handler = self._autopilot_handlers.get(number)
            if handler is not None:
                handler(message, now_s)
                if self._motion.restarts != self._restarts:
                    self._restart(now_s)
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
        wall_boot_us = int(time.time() * 1e6) - self._motion.time_us
        self._judging.tick(self._boot.unix_us, now_s, wall_boot_us)
        self._watch_problems()
        self._keep_history(now_s)
        if self._traffic.state(now_s) == "live":
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
        return self._traffic.age_s(now_s)

    def pose(self, now_s: float) -> JsonMessage | None:
        """Its part of the message "pose"; None while it does not say where it is."""
        motion = self._motion
        position, attitude_ned = motion.position, motion.attitude_ned
        if position is None or attitude_ned is None:
            return None
        x, y, z = self._placement.position(position.position_ned_m)
        qw, qx, qy, qz = self._placement.attitude(attitude_ned)
        north, east, down = position.velocity_ned_m_s
        c, s = cos(position.yaw_ned_rad), sin(position.yaw_ned_rad)
        return {
            "id": self.id,
            "t": position.time_us * 1e-6,
            "p": [round(x, 4), round(y, 4), round(z, 4)],
            "q": [round(qw, 5), round(qx, 5), round(qy, 5), round(qz, 5)],
            "v": [round(c * north + s * east, 3), round(s * north - c * east, 3), round(-down, 3)],
            "r": round(motion.yaw_rate_left_rad_s, 3),
            "c": self._mission.command(now_s),
            "on": self._judging.motors_on(self.condition, now_s),
            "s": self._mission.state_index(now_s),
            "fresh": now_s - min(motion.heard_s) < _FRESH_S,
        }

    def status(self, now_s: float) -> JsonMessage:
        """Its part of the message "status"."""
        condition = self.condition
        voltage_v = condition.voltage_v
        figures = self._judging.figures(self._channel)
        return {
            "id": self.id,
            "name": f"drone {self.id}",
            "mode": condition.mode_name,
            "armed": condition.armed,
            "landed": condition.landed,
            "battery_percent": condition.battery_percent,
            "voltage_v": None if voltage_v is None else round(voltage_v, 2),
            "link": self._traffic.as_dict(now_s),
            "mission": self._mission.as_dict(self._motion.time_us, now_s),
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

    def _take_heartbeat(self, message: Message, _now_s: float) -> None:
        self.condition.take_heartbeat(message)
        self._has_flown = self._has_flown or self.condition.armed
        # Only now is it sure to be disarmed: until the next heartbeat it may have left its start. And once
        # it has flown nobody knows whether it stands there again.
        if self._start_pose is not None and not self._has_flown and self.condition.standing:
            self._placement.lay_by_start(self._start_pose, self._motion)

    def _take_position(self, message: Message, now_s: float) -> None:
        if not self._motion.take_position(message, now_s):
            return
        self._judging.follow(self._motion, self.condition, self._placement)

    def _take_text(self, message: Message, now_s: float) -> None:
        self._speech.take(message, self._motion.time_us, now_s)

    def _take_app(self, message: Message, now_s: float) -> None:
        mission = self._mission
        before = mission.state
        for told in mission.take(message, now_s):
            self._ears.tell(told)
        state = mission.state
        if state is not None and state is not before:
            there = self._motion.at(state.time_us)
            if there is not None:
                self._placement.lay_by_app(state.pose_arena, there)
        if mission.result is not None and mission.result[0] != self._result_crc:
            self._result_crc = mission.result[0]
            self._judging.take_result(*mission.result, now_s)

    def _restart(self, now_s: float) -> None:
        self._judging.close()
        self._traffic.forget_sequence()
        self._begin(now_s)
        self._ears.notice("warning", f"drone {self.id} has started anew")

    def _watch_link(self, now_s: float) -> None:
        state = self._traffic.state(now_s)
        if state == "lost" and self._was_lost_s is None:
            self._was_lost_s = self._traffic.heard_s
            if self._is_over(self._judging.figures(self._channel)):
                self._ears.notice("info", f"drone {self.id}: not heard any more; its flight was over")
            else:
                self._ears.notice("warning", f"drone {self.id}: link lost")
        elif state == "live" and self._was_lost_s is not None:
            away_s = self._traffic.heard_s - self._was_lost_s
            self._was_lost_s = None
            self._ears.notice("info", f"drone {self.id}: link is back after {away_s:.0f} s")

    def _is_over(self, figures: JsonMessage | None) -> bool:
        """Whether it has flown and its flight has ended: disarmed, or judged for good."""
        judged = figures is not None and figures["final"]
        return self._has_flown and (judged or not self.condition.armed)

    def _keep_history(self, now_s: float) -> None:
        """Note where it is. What was noted before the arena was laid under it would be in the wrong place."""
        source = self._placement.source
        if source != self._history_source:
            self._history_source = source
            self._history.clear()
            self._ears.tell(self._history_message())
        pose = self.pose(now_s)
        if pose is not None:
            self._history.add(pose)

    def _history_message(self) -> JsonMessage:
        return {"kind": "history", "id": self.id, "poses": self._history.rows()}

    def _watch_problems(self) -> None:
        """Say what was wrong with what it sent, each once."""
        mission, camera = self._mission, self._camera
        if camera.problem:
            self._ears.notice("warning", f"drone {self.id}: {camera.problem}")
            camera.problem = ""
        if mission.problem and not mission.problem_told:
            mission.problem_told = True
            self._ears.notice("warning", f"drone {self.id}, mission: {mission.problem}")

    def _ask(self, now_s: float) -> None:
        attitudes, positions = self._motion.counts
        questions = [
            self._boot.question(now_s),
            self._camera.question(now_s),
            *self._rates.questions((attitudes, positions), now_s),
        ]
        for question in questions:
            if question is not None:
                self._ears.send(question)

    def _open_channel(self, api: SimulatorApi) -> None:
        def hear(answer: Standing) -> None:
            ahead_us = (answer.time_us or 0) - self._motion.time_us
            if ahead_us >= _OTHER_BOOT_US:
                return
            frame = answer.local_frame
            if frame is not None:
                self._placement.lay_by_frame(frame.origin_arena_m, frame.yaw_rad)
            self._judging.hear(answer, asyncio.get_running_loop().time())

        def say(level: str, text: str) -> None:
            self._ears.notice(level, f"drone {self.id}: {text}")

        self._channel = RefereeChannel(api, hear, say)
        self._channel_task = asyncio.create_task(self._run_channel(self._channel))

    async def _run_channel(self, channel: RefereeChannel) -> None:
        with suppress(asyncio.CancelledError):
            await channel.run()
