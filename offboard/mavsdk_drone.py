"""The `Drone` port over MAVSDK: any multicopter with PX4 or ArduPilot, simulated or real."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncGenerator
from math import inf
from pathlib import Path
from typing import Any

from mavsdk.asyncio import Mavsdk, MavsdkError
from mavsdk.asyncio.plugins.mavlink_direct import MavlinkDirectAsync
from mavsdk.asyncio.plugins.telemetry import TelemetryAsync

from framerunner.geometry.axes import ArenaAlignment, Pose
from framerunner.wire.transports.urls import parse_url
from offboard.drone import DroneError, DroneState, LimitedCommand, VelocityFluCommand
from offboard.limits import STILL, VelocityLimits
from offboard.link.autopilots import open_dialect
from offboard.link.companion import Companion
from offboard.link.connections import check_is_free, new_mavsdk, open_connections
from offboard.link.dialect import Dialect
from offboard.link.direct import DirectMessages, synchronous
from offboard.link.inertial import InertialFeed
from offboard.link.place_sender import PlaceSender
from offboard.link.process_guard import ProcessGuard
from offboard.link.reported_state import reported_state
from offboard.link.resets import ResetFeed, followed
from offboard.link.telemetry import CHECKS, TelemetryFeed, pose_of
from offboard.link.ticks import (
    CONFIRM_S,
    SHOWN_S,
    PendingRequests,
    Requester,
    TickSource,
    VehicleClock,
    not_shown,
)
from offboard.link.tlog import TlogRecorder
from offboard.link.tracking import CommandTracker
from offboard.link.watchdog import PATIENT_LIMITS, Watchdog
from offboard.safety.rules import AbortAction

STAND_STILL_S = 0.5  # wall time without a tick after which a velocity of zero is sent
LINK_LOST_S = 1.0  # wall time without telemetry
HEARTBEAT_LOST_S = 6.0  # wall time; there is one a second, and a lossy link may lose three in a row
HOLD_ATTEMPTS = 3
LAND_LIMIT_S = 120.0  # vehicle time
STREAM_BEFORE_OFFBOARD_S = 0.3  # PX4 enters offboard only with fresh setpoints
FIRST_MODE_S = 8.0  # wall time for PX4's checks to pass in the mode it starts in


class MavsdkDrone:
    """A vehicle over MAVLink. What PX4 and ArduPilot do differently is in their dialects (`offboard/link/`).

    Axes: the vehicle is on `start_arena` when it connects; its telemetry there gives the transform between
    its local axes and the arena's (see `ArenaAlignment`), so it must be disarmed then; see `followed` for
    resets.

    Time: its clock is the time stamp of its ATTITUDE messages, which may run slower or faster than the
    wall's. Wall time is used only to find out whether link and app are alive.

    Safety: setpoints are sent by MAVSDK's own thread at 20 Hz, so a watchdog guards the app (see
    `Watchdog`). While the vehicle is out of offboard during a flight, this class requests no mode; when an
    operator gives it back, `refuse` requests hold. While an operator has it, a velocity of zero is sent with
    each tick, because PX4 refuses offboard without setpoints; that ends when the app hangs, and with the link
    or the flight.

    Args:
        url: udpin://, udpout://, tcpout://, tcpin:// or serial:// (see `parse_url`).
        start_arena: where the drone is: x, y, z (metres) and yaw (radians), arena axes.
        connect_limit_s: wall time to find the vehicle.
        ready_limit_s: wall time until it can be armed; None: the autopilot's usual one.
        guard: ends a hung app; closed here only if it was not given.
        limits: of each command that is sent; None: there are none.
        corrects: commands are corrected if the vehicle answers late; see `CommandTracker`.
        system_id: of the vehicle that was checked, by MAVLink; no other one is flown. None: any.
        when_hung: what is requested for a vehicle in offboard when this app hangs.
        reports_place: the vehicle is sent where it is, at first where it stands.

    Attributes:
        recording_problem: why recording ended before the flight; set by `disconnect`.

    Raises:
        LinkError: bad address; nothing is opened yet.
    """

    def __init__(
        self,
        url: str,
        *,
        start_arena: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0),
        connect_limit_s: float = 10.0,
        ready_limit_s: float | None = None,
        guard: ProcessGuard | None = None,
        limits: VelocityLimits | None = None,
        corrects: bool = True,
        system_id: int | None = None,
        when_hung: AbortAction = "hold",
        reports_place: bool = False,
    ) -> None:
        self.recording_problem = ""
        self._url = parse_url(url)
        self._start_arena = Pose(start_arena[:3], start_arena[3])
        self._connect_limit_s = connect_limit_s
        self._ready_limit_s = ready_limit_s
        self._feed = TelemetryFeed()
        self._ticks = TickSource(self._feed)
        self._resets = ResetFeed()
        self._inertial = InertialFeed()
        self._sent = VelocityFluCommand()
        self._system_id = system_id
        self._advice = "give another address"
        self._alignment: ArenaAlignment | None = None
        self._mavsdk: Mavsdk | None = None
        self._dialect: Dialect | None = None  # from `connect` on
        self._telemetry: Any = None
        self._direct: Any = None  # kept, because MAVSDK ends the subscriptions of a plugin that is deleted
        self._requests = PendingRequests()
        self._requester = Requester(self._feed, self._ticks, self._requests)
        self._tracker = CommandTracker()
        self._corrects = corrects
        self._latest: DroneState | None = None
        self._commanding = False
        self._flown_manually = False
        self._tlog_path: Path | None = None
        self._recorder: TlogRecorder | None = None
        self._companion: Companion | None = None
        self._guard, self._owns_guard = guard or ProcessGuard(), guard is None
        self._watchdog = Watchdog(self._stand_still, self._stop_from_watchdog, self._guard)
        self._when_hung, self._asked_when_hung = when_hung, "stopped sending"
        self._shared_with: list[str] = []
        self._limits = limits or VelocityLimits()
        self._place = PlaceSender(self._start_arena) if reports_place else None

    def record_to(self, path: Path) -> None:
        """Record all MAVLink traffic as a tlog from `connect` to `close`."""
        self._tlog_path = path

    def use_companion(self, companion: Companion) -> None:
        """Let a companion send over this link, which stays open until `disconnect` then."""
        self._companion = companion

    def share_with(self, url: str) -> None:
        """Forward between the vehicle and a ground station at this address."""
        self._shared_with.append(url)

    def use_clock(self, clock: VehicleClock, system_id: int) -> None:
        """Let the time of the vehicle with this MAVLink id wait for this app from `ready` on."""
        self._ticks.use_clock(clock)
        self._system_id, self._advice = system_id, "choose another --instance"
        self._watchdog.limits = PATIENT_LIMITS

    @property
    def ticks_in_flight(self) -> tuple[int, int]:
        """How many ticks the flight had, and how many of them this app did not get in time."""
        return self._ticks.in_flight, self._ticks.late

    @property
    def gone(self) -> str:
        """See `Drone`."""
        return self._ticks.gone

    def vehicle_time_us(self, wall_s: float) -> int | None:
        """Vehicle time at a monotonic wall time, as telemetry shows it; None before any has arrived."""
        return self._feed.time_at_us(wall_s)

    async def connect(self) -> None:
        """Find the vehicle and subscribe to its telemetry."""
        check_is_free(self._url, self._advice)
        self._mavsdk = new_mavsdk()
        self._recorder = await open_connections(
            self._mavsdk, (*self._shared_with, self._url.text), self._tlog_path, self._companion
        )
        if (system := await self._mavsdk.first_autopilot(self._connect_limit_s)) is None:
            raise DroneError(
                f"no vehicle was found on {self._url.text} within {self._connect_limit_s:g} s; "
                "is it running and sending to this address?"
            )
        system_id = await system.get_system_id()
        if self._system_id not in (None, system_id):
            raise DroneError(
                f"another vehicle (system {system_id}) sends to {self._url.text}; stop it, or {self._advice}"
            )
        for component in (self._recorder, self._companion):
            if component is not None:
                component.announce(system_id)
        self._telemetry = TelemetryAsync(system)
        self._direct = MavlinkDirectAsync(system)
        box = self._limits.box
        room_m = inf if box is None else box.high_m[2] - self._start_arena.position_m[2]
        steps = self._ticks.steps
        self._dialect = new = await open_dialect(system, self._direct, self._feed, room_m, stepped=steps)
        self._feed.subscribe(synchronous(self._telemetry), synchronous(self._direct), new.kind.numbered_modes)
        self._inertial.subscribe(synchronous(self._direct), tells_accuracy=new.kind.tells_accuracy)
        if new.has_resets:
            self._resets.subscribe(synchronous(self._direct))
        if self._place is not None:
            self._place.begin(DirectMessages(self._direct, system_id))
        if new.exchange is None:
            await self._requests.wait(new.request_streams())

    def report_place(self, state: DroneState) -> None:
        """See `Drone.report_place`."""
        if self._place is not None and self._commanding:
            self._place.send(state)

    async def ready(self) -> None:
        """Wait until the vehicle can be armed; then determine the axes."""
        limit_s = self._ready_limit_s or self._stream.kind.ready_limit_s
        await self._ticks.begin_exchange(self._stream, self._requests)
        try:
            await self._wait_for_checks(limit_s)
        except TimeoutError:
            if not self._feed.armed:  # else it may be in the air, and another app's
                missing = ", ".join(self._feed.missing())
                await self._hold_on_ground()
                raise DroneError(
                    f"not ready within {limit_s:g} s: {missing}{self._feed.recent_texts()}; "
                    f"framerunner doctor --drone {self._url.text} says what is missing"
                ) from None
        if self._feed.armed:
            raise DroneError("the vehicle is armed already; land and disarm it, then put it on its start")
        await self._ticks.before_arming(self._telemetry, self._resets.request, self._inertial.request)
        self._resets.take()  # those until now are in the start's pose
        self._alignment = ArenaAlignment(self._start_arena, pose_of(self._feed))
        await self._ticks.begin()

    async def _wait_for_checks(self, limit_s: float) -> None:
        """Wait until nothing is missing.

        PX4's checks are those of the mode it is in. At first that is hold, which requires a global position:
        in a hall, without GPS, they never pass; offboard's do. So offboard is tried when only they fail.
        ArduPilot's first mode requires less than GUIDED, so it always enters that.
        """
        if self._stream.kind.checks_in_offboard:
            async with asyncio.timeout(limit_s):
                while not self._in_offboard and not self._feed.armed:
                    with contextlib.suppress(MavsdkError):  # refused without a position
                        await self._ticks.until_done(self._requests.wait(self._stream.request_offboard()))
                    await self._requester.becomes(lambda: self._in_offboard, SHOWN_S)
        with contextlib.suppress(TimeoutError):  # with an exchange its checks have had their time
            first_s = 0.0 if self._stream.exchange else min(FIRST_MODE_S, limit_s / 2)
            await self._requester.until(lambda: not self._feed.missing(), first_s)
        if self._feed.missing() == [CHECKS] and not self._feed.armed:
            await self._stream_before_offboard()
            await self._requester.request("offboard mode", self._stream.request_offboard())
        await self._requester.until(lambda: not self._feed.missing(), limit_s)

    async def ticks(self) -> AsyncGenerator[DroneState, None]:
        """States at 20 Hz of vehicle time; ticks that were not waited for are skipped."""
        while True:
            command = self._sent if self._commanding and not self._flown_manually else None
            received = await self._ticks.next(STAND_STILL_S, command)
            if not received and not self._ticks.waits:
                self._stand_still()
                received = await self._ticks.next(LINK_LOST_S - STAND_STILL_S, command)
            self._check_alive(received)
            state = self._newest_state()
            self._check_state(state)
            self._latest = state
            if self._flown_manually:
                self._send(VelocityFluCommand())
            elif self._commanding:
                self._stream.repeat()
            yield state

    async def motors_on(self, *, confirmed: bool = True) -> None:
        """Enter offboard with zero setpoints, then arm: so the motors never run in another mode."""
        await self._stream_before_offboard()
        self._watchdog.start()
        try:
            offboard, request = self._stream.kind.modes.offboard, self._stream.request_offboard()
            await self._requester.request(
                f"{offboard.lower()} mode", request, lambda: self._feed.mode == offboard
            )
            armed = (lambda: bool(self._feed.armed)) if confirmed else None
            await self._requester.request("arming", self._stream.arm(), armed)
        except BaseException:
            self._watchdog.stop()
            await self._hold_on_ground()
            raise
        self._feed.arming.acknowledge(self._feed.time_us + round(CONFIRM_S * 1e6))
        self._feed.take_samples()  # those until now are of no flight
        self._tracker.reset()
        self._flown_manually = False
        self._commanding = True

    async def _stream_before_offboard(self) -> None:
        if self._feed.armed:  # a vehicle that somebody else has armed may be flying
            raise DroneError("the vehicle was armed by others before the flight; land and disarm it")
        self._send(VelocityFluCommand())
        for _ in range(round(STREAM_BEFORE_OFFBOARD_S / 0.05)):
            await self._ticks.next(0.05)
            self._send(VelocityFluCommand())

    async def _hold_on_ground(self) -> None:
        """Leave offboard when there will be no flight."""
        with contextlib.suppress(MavsdkError, asyncio.CancelledError):
            await self._ticks.until_done(self._requests.wait(self._stream.request_hold()))

    async def motors_off(self) -> None:
        """Stop the motors at once (forced disarm), in the air too."""
        self._commanding = False
        self._feed.arming.forget()
        await self._requester.request(
            "stopping the motors", self._stream.kill(), lambda: self._feed.armed is False
        )
        self._watchdog.stop()
        with contextlib.suppress(MavsdkError):
            await self._ticks.until_done(self._requests.wait(self._stream.request_hold()))

    async def land(self) -> None:
        """Let the vehicle land and wait until it has disarmed itself."""
        feed = self._feed

        def armed() -> bool:
            return feed.arming.is_armed(feed.time_us)

        self._commanding = False
        request, land = self._stream.land(), self._stream.kind.modes.land
        await self._requester.request("landing", request, lambda: feed.mode == land or not armed())
        self._watchdog.stop()
        limit_us = feed.time_us + int(LAND_LIMIT_S * 1e6)
        while armed():
            self._check_alive(await self._ticks.next(LINK_LOST_S))
            # One heartbeat has mode and arming, but MAVSDK passes them on one after the other.
            if feed.mode != land and not await self._requester.becomes(lambda: not armed(), 0.5):
                raise DroneError(f"landing was interrupted: mode {feed.mode}{feed.recent_texts()}")
            if feed.time_us > limit_us:
                raise DroneError(f"still not landed after {LAND_LIMIT_S:g} s{feed.recent_texts()}")

    async def land_now(self, *, demanded: bool = False) -> None:
        """Stop commanding permanently and let the vehicle land; see `Drone.land_now`."""
        self._stand_still()  # repeated until the vehicle leaves offboard
        self._commanding = self._flown_manually = False
        if self._dialect is None:
            await self.hold()
            return
        await self._know_mode()
        modes, mode = self._dialect.kind.modes, self._feed.mode
        if mode not in (modes.offboard, modes.land) and not (demanded and mode not in modes.manual):
            await self.hold()
            return
        try:
            await self.land()
        except DroneError as error:
            await self.hold()
            raise DroneError(f"{error}; hold was requested instead") from None

    async def hold(self) -> None:
        """Stop commanding permanently and request hold, unless the vehicle has left offboard already."""
        self._commanding = self._flown_manually = False
        self._watchdog.stop()
        if self._dialect is None:
            return
        await self._know_mode()
        modes = self._dialect.kind.modes
        if self._in_offboard:
            await self._leave_offboard()
            if (mode := self._feed.mode) != modes.hold and mode not in modes.manual:
                raise DroneError(f"the vehicle is in {mode} instead{self._feed.recent_texts()}")
        else:
            await asyncio.to_thread(self._stream.end)

    async def _know_mode(self) -> None:
        """Wait for a new heartbeat after a stop of this process or a silence: others may have the vehicle."""
        watchdog, feed = self._watchdog, self._feed
        left_s = SHOWN_S if watchdog.stood_still else SHOWN_S - feed.heard_for_s()
        if left_s > 0.0:
            await self._requester.becomes(lambda: False, left_s)
        if watchdog.stood_still and feed.heartbeat_age_s() > SHOWN_S:
            raise DroneError("the vehicle is not heard, so nothing is requested of it; its failsafe acts")
        watchdog.stood_still = False

    async def refuse(self) -> None:
        """Let the vehicle that was given back hold, and wait until it is given back again."""
        if self._in_offboard:
            await self._leave_offboard()

    async def _leave_offboard(self) -> None:
        """Request hold until telemetry shows another mode than offboard.

        The first request ends the setpoints: a vehicle that receives no request leaves offboard by its own
        failsafe. The link may lose a request, its answer or the heartbeat that shows its effect.
        """
        stream, refusal = self._stream, None
        for _ in range(HOLD_ATTEMPTS):
            refusal = None
            try:
                await self._requester.request("hold", stream.request_hold())
            except DroneError as error:
                refusal = error
            if await self._requester.becomes(lambda: not self._in_offboard, SHOWN_S):
                return
        raise refusal or DroneError(
            f"requested {HOLD_ATTEMPTS} times and acknowledged, but telemetry still shows offboard; "
            "setpoints have ended, so the vehicle's failsafe for that has to act"
        )

    def command(self, command: VelocityFluCommand, at: DroneState | None = None) -> LimitedCommand:
        """Set the velocity to fly; ignored without motors on, or while an operator has the vehicle."""
        latest = self._latest
        if not self._commanding:
            return LimitedCommand(STILL)
        if self._flown_manually:
            if latest is None or not latest.offboard:
                return LimitedCommand(STILL)
            self._flown_manually = False
            self._tracker.reset()  # the vehicle was moved by others
        limited = self._limits.limit(command, at or latest, self._correct if self._corrects else None)
        self._send(limited.command)
        return limited

    def _correct(self, command: VelocityFluCommand, _at: DroneState) -> VelocityFluCommand:
        """What a vehicle that answers late must be sent: by its own reports."""
        assert self._latest is not None, "there was a tick"
        return self._tracker.correct(command, self._latest)

    async def close(self) -> None:
        """End all commanding, let a disarmed vehicle hold and, without a companion, disconnect."""
        self._commanding = False
        self._watchdog.stop()
        self._ticks.release()
        if self._place is not None:
            self._place.end()
        if self._dialect is not None and self._in_offboard and self._feed.armed is False:
            await self._hold_on_ground()
        await self._requests.wait_for_all()
        if self._companion is None:
            await self.disconnect()
        elif self._dialect is not None:
            await asyncio.to_thread(self._dialect.end)  # even if hold failed

    async def disconnect(self) -> None:
        """Close the link and the recording; may be called again."""
        await self._requests.wait_for_all()
        if self._mavsdk is not None:
            await asyncio.to_thread(self._mavsdk.destroy)
            self._mavsdk = None
        if self._owns_guard:
            self._guard.close()
        if self._recorder is not None:
            self.recording_problem = self._recorder.problem
            self._recorder.close()
            self._recorder = None

    def _stand_still(self) -> None:
        """Send a velocity of zero, because MAVSDK's thread would repeat the last one; from any thread."""
        if self._commanding and not self._flown_manually:
            self._send(VelocityFluCommand())

    @property
    def _stream(self) -> Dialect:
        assert self._dialect is not None, "connect() comes first"
        return self._dialect

    @property
    def _in_offboard(self) -> bool:
        return self._feed.mode == self._stream.kind.modes.offboard

    def _send(self, command: VelocityFluCommand) -> None:
        if not self._watchdog.tripped_after_s:
            self._sent = command
            self._stream.send(command)

    def _newest_state(self) -> DroneState:
        """The state at the last tick; it holds those of the ticks that were skipped before it."""
        assert self._alignment is not None, "ready() comes first"
        sample, missed = self._feed.take_samples()
        for jump in self._resets.take():
            self._alignment = followed(self._alignment, jump, drifts=self._inertial.drifts)
            self._tracker.reset()
        feed, alignment, dialect = self._feed, self._alignment, self._stream
        skipped = tuple(reported_state(before, feed, alignment, dialect) for before in missed)
        return reported_state(sample, feed, alignment, dialect, skipped, inertial=self._inertial)

    def _check_alive(self, tick_received: bool) -> None:
        hung_s = self._watchdog.tripped_after_s
        if hung_s and self._commanding:  # afterwards the vehicle is only watched
            if self._watchdog.stood_still:
                raise DroneError(f"this app was stopped for {hung_s:.1f} s; it commands no more")
            did = self._asked_when_hung
            raise DroneError(f"this app hung for more than {hung_s:.1f} s; its watchdog {did}")
        if self._ticks.waits:
            if not tick_received:
                raise DroneError("link lost: the simulator runs, but its telemetry does not arrive")
            return
        feed = self._feed
        if (age_s := feed.age_s()) > LINK_LOST_S:
            raise DroneError(f"link lost: no telemetry for {age_s:.1f} s")
        if not tick_received:
            raise DroneError("link lost: the vehicle's clock stands still")
        if (heartbeat_age_s := feed.heartbeat_age_s()) > HEARTBEAT_LOST_S:
            raise DroneError(f"link lost: no heartbeat for {heartbeat_age_s:.1f} s")

    def _check_state(self, state: DroneState) -> None:
        if not all(one.is_finite for one in (*state.missed, state)):
            raise DroneError("the vehicle's position, velocity or attitude is not finite")
        if self._commanding and self._feed.arming.is_overdue(state.time_us):
            raise DroneError(not_shown(self._feed, "arming"))
        if not self._commanding or self._flown_manually:
            return
        leaves = not state.offboard and state.mode not in self._stream.kind.modes.manual
        if not state.armed or (leaves and not self._feed.armed):
            raise DroneError(f"the vehicle was disarmed by others{self._feed.recent_texts()}")
        if leaves:
            texts = self._feed.recent_texts()
            raise DroneError(f"the pilot or a failsafe took over: mode {state.mode}{texts}")
        self._flown_manually = not state.offboard

    def _stop_from_watchdog(self) -> None:
        """On the watchdog's thread: end the native stream and, in offboard, request hold or landing.

        A vehicle that an operator has must not be given back to a hung app, so the stream ends permanently.
        The mode that is known is old when the whole process stood still: then nothing is requested here.
        """
        with contextlib.suppress(Exception):  # without setpoints the vehicle's failsafe acts
            if self._watchdog.stood_still or not self._in_offboard:
                self._stream.end()
                return
            lands = self._when_hung == "land"
            self._asked_when_hung = "requested landing" if lands else "requested hold"
            (self._stream.request_land_blocking if lands else self._stream.request_hold_blocking)()
