"""The real app and its MAVSDK adapter over a bad link, in simulated time.

All of the app runs: mission, box, `MavsdkDrone`, its telemetry feed, `CameraPerception` and the detector.
MAVSDK and UDP are replaced by a link that loses, swaps, duplicates, delays and stops in both directions, by a
seed; at its other end are the simulation's autopilot and camera. The event loop's clock is the simulation's:
where it would wait, the simulation advances. So a flight needs no real time and repeats exactly.
"""

from __future__ import annotations

import asyncio
import heapq
import json
import selectors
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from math import degrees, inf, radians
from random import Random
from types import SimpleNamespace

from mavsdk.exceptions import MavsdkError

from firmware_py.offboard_requests import setpoint_from_body_velocity
from firmware_py.status import CommandResult, FlightMode, LandedState
from framerunner.flying.plan import FlightPlan
from offboard.app import MissionEnd, Moment, fly_mission
from offboard.limits import CONTEST, Box, Caps, VelocityLimits
from offboard.link.px4 import Px4Dialect
from offboard.link.telemetry import TelemetryFeed
from offboard.link.ticks import Requester, TickSource
from offboard.link.watchdog import LIMITS
from offboard.mavsdk_drone import MavsdkDrone
from offboard.mission import Mission
from offboard.perception import CameraPerception
from offboard.safety.rules import SIMULATED, AbortAction, SafetyRules
from scenarios.models import Scenario, TrueState
from sitl.camera import CameraFeed
from sitl.simulation import Simulation
from vision.types import CameraFrame

TELEMETRY_US = 20_000
HEARTBEAT_US = 1_000_000
SETPOINT_US = 50_000
LATENCY_US = 2_000
OVERTAKEN_BY_US = 8_000
AFTER_S = 2.5
STILL_US = 1_000_000  # a vehicle that is disarmed stays where it is


@dataclass(frozen=True)
class Impairment:
    """What a link does to datagrams, in both directions, and to images.

    Attributes:
        loss: share that is lost.
        swap_every_s: time between two datagrams that are overtaken by the next one.
        doubled: share that is received twice.
        delay_s: of each.
        jitter_s: maximum of a uniform further delay.
        silent_s: vehicle time from and to which all are lost.
    """

    loss: float = 0.0
    swap_every_s: float = 0.0
    doubled: float = 0.0
    delay_s: float = 0.0
    jitter_s: float = 0.0
    silent_s: tuple[float, float] = (0.0, 0.0)


class Direction:
    """One direction of a link. A datagram is a function that is called when it arrives."""

    def __init__(self, impairment: Impairment, random: Random):
        self._is, self._random = impairment, random
        self._under_way = []
        self._overtaken = None
        self._swap_us = impairment.swap_every_s * 1e6
        self._number = 0

    def send(self, now_us, arrive):
        how, draw = self._is, self._random.random
        if how.silent_s[0] <= now_us / 1e6 < how.silent_s[1] or draw() < how.loss:
            return
        if how.swap_every_s and now_us >= self._swap_us and self._overtaken is None:
            self._swap_us = now_us + how.swap_every_s * 1e6
            self._overtaken = arrive
            return
        self._put(now_us, arrive)
        if self._overtaken is not None:
            self._put(now_us + OVERTAKEN_BY_US, self._overtaken)
            self._overtaken = None
        if draw() < how.doubled:
            self._put(now_us, arrive)

    def deliver(self, now_us):
        while self._under_way and self._under_way[0][0] <= now_us:
            heapq.heappop(self._under_way)[2]()

    def _put(self, now_us, arrive):
        how = self._is
        delay_us = LATENCY_US + 1e6 * (how.delay_s + how.jitter_s * self._random.random())
        self._number += 1
        heapq.heappush(self._under_way, (now_us + delay_us, self._number, arrive))


class LinkedVehicle:
    """A simulation and the link to it."""

    def __init__(self, scenario: Scenario, impairment: Impairment, seed: int):
        self.simulation = Simulation(scenario)
        self.autopilot = self.simulation.autopilot
        self.truths: list[TrueState] = []
        self.down = Direction(impairment, Random(f"down {seed}"))
        self.up = Direction(impairment, Random(f"up {seed}"))
        self.video = Direction(impairment, Random(f"video {seed}"))
        self.beats = Direction(impairment, Random(f"beats {seed}"))  # the app's heartbeats
        self.app: asyncio.Task[MissionEnd] | None = None
        self.telemetry, self.direct = Callbacks(), Callbacks()
        self.offboard = Offboard(self)
        self.images: asyncio.Queue[CameraFrame] = asyncio.Queue()
        self.watchdog: SimulatedWatchdog | None = None
        self.events: list[tuple[float, Callable[[LinkedVehicle], None]]] = []
        self._camera = CameraFeed(scenario)
        self._telemetry_us = self._heartbeat_us = 0

    @property
    def time_us(self):
        return self.simulation.time_us

    def time_s(self):
        return self.simulation.time_us / 1e6

    def hang(self, seconds):
        """Let the app's event loop stand still: call it as an event."""
        end_us = self.time_us + seconds * 1e6
        while self.time_us < end_us:
            self.tick()

    def tick(self):
        self.simulation.tick()
        truth, now_us = self.simulation.truth, self.time_us
        self.truths.append(truth)
        if truth.time_us >= self._camera.next_us and (arrived := self._camera.step(truth)) is not None:
            frame = CameraFrame(image=arrived[1], time_us=arrived[0], received_s=now_us / 1e6)
            self.video.send(now_us, lambda: self.images.put_nowait(frame))
        if now_us >= self._telemetry_us:
            self._telemetry_us += TELEMETRY_US
            self._tell_motion(now_us)
        if now_us >= self._heartbeat_us:
            self._heartbeat_us += HEARTBEAT_US
            self._tell_condition(now_us)
            self.beats.send(now_us, self.autopilot.ground_station_heard)
        self.offboard.update(now_us)
        if self.watchdog is not None:
            self.watchdog.check(now_us / 1e6)
        while self.events and self.events[0][0] <= now_us / 1e6:
            self.events.pop(0)[1](self)
        for way in (self.up, self.down, self.video, self.beats):
            way.deliver(now_us)

    def _tell_motion(self, now_us):
        state = self.autopilot.state
        euler = SimpleNamespace(
            roll_deg=degrees(state.roll_rad),
            pitch_deg=degrees(state.pitch_rad),
            yaw_deg=degrees(state.yaw_rad),
            timestamp_us=state.time_us,
        )
        fields = {"time_boot_ms": state.time_us // 1000}
        fields |= zip("xyz", state.position_ned_m, strict=True)
        fields |= zip(("vx", "vy", "vz"), state.velocity_ned_m_s, strict=True)
        position = SimpleNamespace(system_id=1, component_id=1, fields_json=json.dumps(fields))

        def arrive():
            self.direct.call("LOCAL_POSITION_NED", position)
            self.telemetry.call("attitude_euler", euler)

        self.down.send(now_us, arrive)

    def _tell_condition(self, now_us):
        status = self.autopilot.status
        armed, mode, ready = status.armed, status.mode, status.ready
        landed = status.landed_state is LandedState.ON_GROUND

        def arrive():
            self.offboard.hear_mode(mode)
            call = self.telemetry.call
            call("armed", armed)
            call("flight_mode", SimpleNamespace(name=mode.name))
            call("landed_state", SimpleNamespace(name="ON_GROUND" if landed else "IN_AIR"))
            call("health", SimpleNamespace(is_armable=ready))

        self.down.send(now_us, arrive)

    async def command(self, act):
        """As MAVSDK: sent four times, half a second apart, until an acknowledgement is received."""
        answered = asyncio.get_running_loop().create_future()

        def at_vehicle():
            result = act()
            self.down.send(self.time_us, lambda: answered.done() or answered.set_result(result))

        for _ in range(4):
            self.up.send(self.time_us, at_vehicle)
            try:
                result = await asyncio.wait_for(asyncio.shield(answered), 0.5)
            except TimeoutError:
                continue
            if result is not CommandResult.ACCEPTED:
                raise MavsdkError(result.name)
            return
        raise MavsdkError("TIMEOUT")


class Callbacks:
    """Subscriptions."""

    def __init__(self):
        self._called = {}

    def __getattr__(self, name):
        return lambda callback: self._called.__setitem__(name.removeprefix("subscribe_"), callback)

    def subscribe_message(self, name, callback):
        self._called[name] = callback

    def call(self, name, value):
        if name in self._called:
            self._called[name](value, None)


class Offboard:
    """As MAVSDK's plugin: sends a setpoint at once and then at 20 Hz, until another mode is received."""

    def __init__(self, vehicle):
        self._vehicle = vehicle
        self._plugin = self
        self._velocity = None
        self._due_us = self._asked_us = 0

    def set_velocity_body(self, sent):
        self._velocity = ((sent.forward_m_s, sent.right_m_s, sent.down_m_s), radians(sent.yawspeed_deg_s))
        self._due_us = 0
        self.update(self._vehicle.time_us)

    def update(self, now_us):
        if self._velocity is None or now_us < self._due_us:
            return
        self._due_us = now_us + SETPOINT_US
        (velocity, yaw_rate), autopilot = self._velocity, self._vehicle.autopilot

        def arrive():
            state = autopilot.state
            autopilot.accept_setpoint(setpoint_from_body_velocity(velocity, yaw_rate, state, state.time_us))

        self._vehicle.up.send(now_us, arrive)

    def hear_mode(self, mode):
        if mode is not FlightMode.OFFBOARD and self._vehicle.time_us > self._asked_us + 3_000_000:
            self._velocity = None

    def destroy(self):
        self._velocity = None

    async def start(self):
        self._asked_us = self._vehicle.time_us
        await self._vehicle.command(lambda: self._vehicle.autopilot.set_mode(FlightMode.OFFBOARD))

    async def stop(self):
        self._velocity = None
        await self._vehicle.command(lambda: self._vehicle.autopilot.set_mode(FlightMode.HOLD))


class SimulatedWatchdog:
    """As the adapter's watchdog, with simulated time for its thread's and the event loop's."""

    def __init__(self, stand_still, stop_commanding):
        self.tripped_after_s, self.stood_still = 0.0, False
        self._stand_still, self._stop_commanding = stand_still, stop_commanding
        self._runs = self._stood = False
        self._beat_s = 0.0

    def start(self):
        self._runs = True

    def stop(self):
        self._runs = False

    def beat(self, now_s):
        """The event loop runs."""
        self._beat_s, self._stood = now_s, False

    def check(self, now_s):
        """What the thread does at a time."""
        hung_s = now_s - self._beat_s
        if not self._runs or self.tripped_after_s:
            return
        if hung_s > LIMITS.stand_s and not self._stood:
            self._stood = True
            self._stand_still()
        if hung_s > LIMITS.hang_s:
            self.tripped_after_s = hung_s
            self._stop_commanding()


class LinkedDrone(MavsdkDrone):
    """The adapter with the simulated link in place of MAVSDK's."""

    def __init__(
        self,
        vehicle: LinkedVehicle,
        scenario: Scenario,
        limits: VelocityLimits,
        when_hung: AbortAction,
    ):
        start = FlightPlan(scenario).start_pose
        url = "udpin://127.0.0.1:14540"
        super().__init__(url, start_arena=start, limits=limits, when_hung=when_hung)
        self._vehicle = vehicle
        self._feed = TelemetryFeed(vehicle.time_s)
        self._ticks = TickSource(self._feed)
        self._requester = Requester(self._feed, self._ticks, self._requests)
        self._watchdog = vehicle.watchdog = SimulatedWatchdog(self._stand_still, self._stop_from_watchdog)

    async def connect(self):
        vehicle, autopilot = self._vehicle, self._vehicle.autopilot
        action = SimpleNamespace(
            arm=lambda: vehicle.command(autopilot.arm),
            kill=lambda: vehicle.command(lambda: autopilot.disarm(force=True)),
            land=lambda: vehicle.command(autopilot.land),
            hold=vehicle.offboard.stop,
            _plugin=SimpleNamespace(land=lambda: vehicle.up.send(vehicle.time_us, autopilot.land)),
        )
        self._dialect = Px4Dialect(vehicle.offboard, action)
        self._telemetry = SimpleNamespace(
            set_rate_attitude_euler=_refuse,
            set_rate_imu=_refuse,
            set_rate_odometry=_refuse,
            set_rate_position_velocity_ned=_refuse,
        )
        self._feed.subscribe(vehicle.telemetry, vehicle.direct)


async def _refuse(_rate_hz):
    raise MavsdkError("UNSUPPORTED")


class _Selector(selectors.DefaultSelector):
    """Waits by advancing the simulation until something happens in the loop."""

    vehicle: LinkedVehicle
    loop: SimulatedTimeLoop

    def select(self, timeout=None):
        ready = super().select(0)
        if self.vehicle.watchdog is not None:
            self.vehicle.watchdog.beat(self.vehicle.time_s())
        end_s = float("inf") if timeout is None else self.vehicle.time_s() + timeout
        while not ready and not self.loop._ready and self.vehicle.time_s() < end_s:
            self.vehicle.tick()
            if self.vehicle.watchdog is not None:
                self.vehicle.watchdog.beat(self.vehicle.time_s())
        return ready


class SimulatedTimeLoop(asyncio.SelectorEventLoop):
    """An event loop whose clock is a simulation's."""

    def __init__(self, vehicle: LinkedVehicle):
        self._vehicle = vehicle
        selector = _Selector()
        selector.vehicle, selector.loop = vehicle, self
        super().__init__(selector)

    def time(self):
        return self._vehicle.time_s()

    def run_in_executor(self, executor, func, *args):
        future = self.create_future()
        future.set_result(func(*args))
        return future


@dataclass
class LinkedFlight:
    """The result of a flight.

    Attributes:
        outcome: as the app reports it.
        flown: how many true states there were when the app ended.
        box: in which the drone is kept.
        truths: true states of every control tick, to some seconds after the end.
        mode: of the vehicle at the end.
        armed: at the end.
        moments: every tick of the mission.
    """

    outcome: MissionEnd
    flown: int
    box: Box
    truths: list[TrueState]
    mode: FlightMode
    armed: bool
    frames: tuple[str, ...]
    moments: list[Moment] = field(default_factory=list)

    @property
    def ended_safely(self) -> bool:
        """Completed and disarmed, or in hold or landing (or landed)."""
        if self.outcome.ended == "finished":
            return not self.armed
        return not self.armed or self.mode in (FlightMode.HOLD, FlightMode.LAND)

    @property
    def farthest_outside_m(self) -> float:
        """Largest distance outside the box, horizontally and upwards; below 0 inside."""
        low, high = self.box.low_m, self.box.high_m
        return max(
            max(low[0] - x, x - high[0], low[1] - y, y - high[1], z - high[2])
            for x, y, z in (truth.position_arena_m for truth in self.truths)
        )

    def lowest_m(self, start_radius_m: float = 1.2) -> float:
        """The minimum height away from the start while the app flew; infinite if it stayed there."""
        start_x, start_y = self.box.start_m
        return min(
            (
                z
                for x, y, z in (truth.position_arena_m for truth in self.truths[: self.flown])
                if (x - start_x) ** 2 + (y - start_y) ** 2 > start_radius_m**2
            ),
            default=inf,
        )


def fly_over(
    impairment: Impairment,
    scenario: Scenario,
    mission: Mission,
    *,
    seed: int = 0,
    boxed: bool = True,
    safety: SafetyRules = SIMULATED,
    caps: Caps | None = None,
    events: Sequence[tuple[float, Callable[[LinkedVehicle], None]]] = (),
    parameters: Mapping[str, float] | None = None,
    after_s: float = AFTER_S,
) -> LinkedFlight:
    """Fly a mission over a bad link.

    Args:
        impairment: of the link.
        scenario: that is flown.
        mission: that flies it.
        seed: of the link.
        boxed: the app keeps the drone in its box.
        safety: rules of the flight.
        caps: on the commands.
        events: what happens at times in seconds, in order.
        parameters: of the vehicle, set before.
        after_s: for which the vehicle is followed when the app has ended, or shortly if it is disarmed.
    """
    vehicle = LinkedVehicle(scenario, impairment, seed)
    vehicle.events.extend(events)
    for name, value in (parameters or {}).items():
        vehicle.autopilot.parameters.set(name, value)
    box = FlightPlan(scenario, caps=caps).box
    moments: list[Moment] = []

    async def fly() -> MissionEnd:
        limits = VelocityLimits(CONTEST, box if boxed else None, caps)
        vehicle.app = asyncio.current_task()
        drone = LinkedDrone(vehicle, scenario, limits, safety.abort)
        perception = CameraPerception(_Camera(vehicle))
        return await fly_mission(
            drone,
            perception,
            mission,
            limit_s=scenario.try_limit_s,
            observer=moments.append,
            safety=safety,
        )

    with asyncio.Runner(loop_factory=lambda: SimulatedTimeLoop(vehicle)) as runner:
        outcome = runner.run(fly())
    flown = len(vehicle.truths)
    end_us, status, armed_us = vehicle.time_us + after_s * 1e6, vehicle.autopilot.status, vehicle.time_us
    while vehicle.time_us < end_us and (vehicle.events or vehicle.time_us - armed_us < STILL_US):
        vehicle.tick()
        armed_us = vehicle.time_us if status.armed else armed_us
    frames = vehicle.simulation.referee.snapshot().crossed
    return LinkedFlight(outcome, flown, box, vehicle.truths, status.mode, status.armed, frames, moments)


class _Camera:
    def __init__(self, vehicle):
        self._vehicle = vehicle

    async def frames(self):
        while True:
            yield await self._vehicle.images.get()
