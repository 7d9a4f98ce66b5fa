"""The `Drone` port over MAVSDK: any MAVLink vehicle that speaks PX4's modes, simulated or real."""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import AsyncIterator, Awaitable, Callable
from math import isfinite
from pathlib import Path
from typing import Any, TextIO

from mavsdk.asyncio import Configuration, ForwardingOption, Mavsdk, MavsdkError
from mavsdk.asyncio.component_type import ComponentType
from mavsdk.asyncio.plugins.action import ActionAsync
from mavsdk.asyncio.plugins.offboard import OffboardAsync
from mavsdk.asyncio.plugins.telemetry import TelemetryAsync
from mavsdk.logging import log_subscribe

from offboard.drone import DroneError, DroneState, VelocityCommand
from offboard.link.alignment import Alignment, Pose
from offboard.link.companion import Companion
from offboard.link.setpoints import SetpointStream
from offboard.link.telemetry import TelemetryFeed
from offboard.link.tlog import TlogRecorder
from offboard.link.tracking import CommandTracker
from offboard.link.url import check_free, parse_url
from offboard.link.watchdog import Watchdog

LINK_LOST_S = 1.0  # wall time without telemetry
CONFIRM_S = (
    6.0  # until a heartbeat (one a second) shows what was asked for; simulations may run at half speed
)
LAND_LIMIT_S = 120.0  # vehicle time
STREAM_BEFORE_OFFBOARD_S = 0.3  # PX4 enters offboard only with fresh setpoints
PRESENT_MODE_S = 8.0
WANTED_RATE_HZ = 50.0
PILOT_MODES = ("MANUAL", "ALTCTL", "POSCTL", "ACRO", "STABILIZED", "RATTITUDE")

_CHECKS = "pre-arm checks not passed"

logger = logging.getLogger(__name__)


class MavsdkDrone:
    """A vehicle over MAVLink.

    Axes: the vehicle stands on `start_arena` when it connects; from its telemetry there the way between its
    local axes and the arena's is fixed once (see `Alignment`), so it must be disarmed then.

    Time: its clock is the time stamp of its ATTITUDE messages, which may run slower or faster than the
    wall's. Wall time is used only where the question is whether link and app are alive.

    Safety: setpoints are sent by MAVSDK's own thread at 20 Hz, so a watchdog guards the app (see
    `Watchdog`). Whoever takes the vehicle out of offboard keeps it: this class never asks for a mode then,
    lest it take the sticks from a pilot. While a pilot has it, setpoints that stand still go on, one with
    each tick, because PX4 lets nobody choose offboard without; they end when the app hangs, and with the
    link or the flight.
    """

    def __init__(
        self,
        url: str,
        *,
        start_arena: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0),
        connect_limit_s: float = 10.0,
        ready_limit_s: float = 30.0,
        hang_report: TextIO | None = None,
    ) -> None:
        """Check the address; nothing is opened yet.

        Args:
            url: udpin://, udpout://, tcpout://, tcpin:// or serial:// (see `parse_url`).
            start_arena: where the drone stands: x, y, z (metres) and yaw (radians), arena axes.
            connect_limit_s: wall time to find the vehicle.
            ready_limit_s: wall time until it can be armed.
            hang_report: a real file for the stack of a hung app; by default standard error.

        Raises:
            DroneError: bad address.
        """
        self._url = parse_url(url)
        self._start_arena = Pose(start_arena[:3], start_arena[3])
        self._connect_limit_s = connect_limit_s
        self._ready_limit_s = ready_limit_s
        self._feed = TelemetryFeed()
        self._alignment: Alignment | None = None
        self._mavsdk: Mavsdk | None = None
        self._system: Any = None
        self._action: Any = None
        self._setpoints: SetpointStream | None = None
        self._telemetry: Any = None
        self._tracker = CommandTracker()
        self._latest: DroneState | None = None
        self._commanding = False
        self._pilot_has_it = False
        self._tlog_path: Path | None = None
        self._recorder: TlogRecorder | None = None
        self._companion: Companion | None = None
        self._watchdog = Watchdog(self._stop_from_watchdog, hang_report)
        self._guests: list[str] = []

    def record_to(self, path: Path) -> None:
        """Record all MAVLink traffic as a tlog from `connect` to `close`."""
        self._tlog_path = path

    def tell_through(self, companion: Companion) -> None:
        """Let a companion speak over this link. As it may have more to say, only `let_go` closes it then."""
        self._companion = companion

    def share_with(self, url: str) -> None:
        """Let a ground station at this address in on the link: it hears the vehicle and can speak to it."""
        self._guests.append(url)

    async def connect(self) -> None:
        """Find the vehicle and listen to it.

        Raises:
            DroneError: port taken, device missing, no vehicle within the limit.
        """
        check_free(self._url)
        log_subscribe(_log)
        # As a ground station: PX4 sends the reasons of its refusals (STATUSTEXT) to no one else.
        configuration = Configuration.create_with_component_type(ComponentType.GROUND_STATION)
        self._mavsdk = Mavsdk(configuration)
        await self._start_recorder()
        await self._let_companion_in()
        try:
            for url in (*self._guests, self._url.text):
                await self._mavsdk.add_any_connection(url, ForwardingOption.ON)
        except MavsdkError as error:
            raise DroneError(f"cannot open {self._url.text}: {error}") from None
        self._system = await self._mavsdk.first_autopilot(self._connect_limit_s)
        if self._system is None:
            raise DroneError(
                f"no vehicle was heard on {self._url.text} within {self._connect_limit_s:g} s; "
                "is it running and sending to this address?"
            )
        if self._recorder is not None:
            self._recorder.announce(await self._system.get_system_id())
        if self._companion is not None:
            self._companion.announce(await self._system.get_system_id())
        self._action = ActionAsync(self._system)
        self._setpoints = SetpointStream(OffboardAsync(self._system))
        self._telemetry = TelemetryAsync(self._system)
        self._feed.subscribe(_synchronous(self._telemetry))

    async def ready(self) -> None:
        """Wait until the vehicle can be armed; then fix the axes.

        Raises:
            DroneError: with what is missing; or the vehicle is armed already.
        """
        try:
            await self._wait_for_checks()
        except TimeoutError:
            missing = ", ".join(self._missing())
            await self._leave_offboard()
            raise DroneError(
                f"not ready within {self._ready_limit_s:g} s: {missing}{self._feed.recent_texts()}"
            ) from None
        if self._feed.armed:
            raise DroneError("the vehicle is armed already; land and disarm it, then put it on its start")
        await self._ask_for_rates()
        feed = self._feed
        self._alignment = Alignment(self._start_arena, Pose(feed.position_ned_m, feed.yaw_ned_rad))

    async def _wait_for_checks(self) -> None:
        """Wait until nothing is missing.

        PX4's checks are those of the mode it is in. At first that is hold, which wants a global position:
        in a hall, without GPS, it never passes, while offboard does. So that is tried when all else is there.
        """
        with contextlib.suppress(TimeoutError):
            await self._until(lambda: not self._missing(), min(PRESENT_MODE_S, self._ready_limit_s / 2))
        if self._missing() == [_CHECKS] and not self._feed.armed:
            await self._stream_before_offboard()
            await self._ask("offboard mode", self._stream.ask_for_offboard())
        await self._until(lambda: not self._missing(), self._ready_limit_s)

    async def ticks(self) -> AsyncIterator[DroneState]:
        """States at 20 Hz of vehicle time; ticks that were not waited for are passed over.

        Raises:
            DroneError: link lost, values not finite, app hung; and, while no pilot has it: another mode,
                disarmed by others.
        """
        while True:
            came = await self._feed.next_tick(LINK_LOST_S)
            self._check_alive(came)
            state = self._state()
            self._check_state(state)
            self._latest = state
            if self._pilot_has_it:
                self._send(VelocityCommand())
            yield state

    async def motors_on(self) -> None:
        """Enter offboard with zero setpoints, then arm; both count when telemetry shows them.

        Offboard first, while disarmed: so the motors never run in another mode.
        """
        feed = self._feed
        await self._stream_before_offboard()
        self._watchdog.start()
        try:
            await self._ask("offboard mode", self._stream.ask_for_offboard())
            await self._confirm("offboard mode", lambda: feed.mode == "OFFBOARD")
            await self._ask("arming", self._action.arm())
            await self._confirm("arming", lambda: bool(feed.armed))
        except BaseException:
            self._watchdog.stop()
            await self._leave_offboard()
            raise
        self._tracker.reset()
        self._pilot_has_it = False
        self._commanding = True

    async def _stream_before_offboard(self) -> None:
        self._send(VelocityCommand())
        for _ in range(int(STREAM_BEFORE_OFFBOARD_S / 0.05)):
            await asyncio.sleep(0.05)
            self._send(VelocityCommand())

    async def _leave_offboard(self) -> None:
        """On the ground, when there will be no flight."""
        with contextlib.suppress(MavsdkError, asyncio.CancelledError):
            await self._stream.ask_for_hold()

    async def motors_off(self) -> None:
        """Stop the motors at once (forced disarm), in the air too."""
        self._commanding = False
        await self._ask("stopping the motors", self._action.kill())
        await self._confirm("stopping the motors", lambda: self._feed.armed is False)
        self._watchdog.stop()
        with contextlib.suppress(MavsdkError):
            await self._stream.ask_for_hold()

    async def land(self) -> None:
        """Let the vehicle land and wait until it has disarmed itself."""
        feed = self._feed
        self._commanding = False
        await self._ask("landing", self._action.land())
        await self._confirm("landing", lambda: feed.mode == "LAND" or feed.armed is False)
        self._watchdog.stop()
        limit_us = feed.time_us + int(LAND_LIMIT_S * 1e6)
        while feed.armed:
            came = await feed.next_tick(LINK_LOST_S)
            self._check_alive(came)
            if feed.mode != "LAND" and not await self._soon_disarmed():
                raise DroneError(f"landing was broken off: mode {feed.mode}{feed.recent_texts()}")
            if feed.time_us > limit_us:
                raise DroneError(f"still not landed after {LAND_LIMIT_S:g} s{feed.recent_texts()}")

    async def _soon_disarmed(self) -> bool:
        """One heartbeat tells of mode and arming, but MAVSDK passes them on one after the other."""
        with contextlib.suppress(TimeoutError):
            await self._until(lambda: not self._feed.armed, 0.5)
        return not self._feed.armed

    async def hold(self) -> None:
        """Stop commanding for good and ask for hold, unless another hand has the vehicle already."""
        self._commanding = self._pilot_has_it = False
        self._watchdog.stop()
        if self._setpoints is None:
            return
        if self._feed.mode == "OFFBOARD":
            await self._ask_for_hold()
            await self._confirm("hold", lambda: self._feed.mode == "HOLD")
        else:
            await asyncio.to_thread(self._stream.end)

    async def refuse(self) -> None:
        """Let the vehicle that was given back hold; go on waiting."""
        if self._feed.mode == "OFFBOARD":
            await self._ask_for_hold()
            await self._confirm("hold", lambda: self._feed.mode != "OFFBOARD")

    async def _ask_for_hold(self) -> None:
        """By other means where the watchdog has ended the stream for good."""
        stream = self._stream
        await self._ask("hold", stream.ask_for_hold() if stream.can_ask else self._action.hold())

    def command(self, command: VelocityCommand) -> None:
        """Set the velocity to fly from now on. Without motors on, or with a pilot, it is passed over."""
        latest = self._latest
        if not self._commanding:
            return
        if self._pilot_has_it:
            if latest is None or not latest.offboard:
                return
            self._pilot_has_it = False
            self._tracker.reset()  # the vehicle was moved by others
        self._send(command if latest is None else self._tracker.correct(command, latest))

    async def close(self) -> None:
        """Let go of the vehicle and finish the recording; with a companion only end all commanding."""
        self._commanding = False
        self._watchdog.stop()
        if self._companion is None:
            await self.let_go()
        elif self._setpoints is not None:
            await asyncio.to_thread(self._setpoints.end)  # whatever became of hold

    async def let_go(self) -> None:
        """Close the link and the recording; may be called again."""
        if self._mavsdk is not None:
            await asyncio.to_thread(self._mavsdk.destroy)
            self._mavsdk = None
        if self._recorder is not None:
            self._recorder.close()
            self._recorder = None

    @property
    def _stream(self) -> SetpointStream:
        assert self._setpoints is not None, "connect() comes first"
        return self._setpoints

    def _send(self, command: VelocityCommand) -> None:
        if not self._watchdog.tripped_after_s:
            self._stream.send(command)

    def _state(self) -> DroneState:
        assert self._alignment is not None, "ready() comes first"
        feed, sample = self._feed, self._feed.sample
        pose = self._alignment.pose(Pose(sample.position_ned_m, sample.yaw_ned_rad))
        return DroneState(
            time_us=sample.time_us,
            x=pose.position_m[0],
            y=pose.position_m[1],
            z=pose.position_m[2],
            yaw=pose.yaw_rad,
            velocity_arena_m_s=self._alignment.vector(sample.velocity_ned_m_s),
            armed=bool(feed.armed),
            offboard=feed.mode == "OFFBOARD",
            mode=feed.mode,
            landed=feed.landed,
        )

    def _check_alive(self, tick_came: bool) -> None:
        hung_s = self._watchdog.tripped_after_s
        if hung_s:
            did = "asked for hold" if self._stream.can_ask else "fell silent"
            raise DroneError(f"this app hung for more than {hung_s:.1f} s; its watchdog {did}")
        age_s = self._feed.age_s()
        if age_s > LINK_LOST_S:
            raise DroneError(f"link lost: no telemetry for {age_s:.1f} s")
        if not tick_came:
            raise DroneError("link lost: the vehicle's clock stands still")
        if not _synchronous(self._system).is_connected():
            raise DroneError("link lost: no heartbeat for 3 s")

    def _check_state(self, state: DroneState) -> None:
        values = (state.x, state.y, state.z, state.yaw, *state.velocity_arena_m_s)
        if not all(isfinite(value) for value in values):
            raise DroneError("the vehicle's position, velocity or heading is not finite")
        if not self._commanding or self._pilot_has_it:
            return
        if not state.armed:
            raise DroneError(f"the vehicle was disarmed by others{self._feed.recent_texts()}")
        if state.offboard:
            return
        if state.mode not in PILOT_MODES:
            texts = self._feed.recent_texts()
            raise DroneError(f"the pilot or a failsafe took over: mode {state.mode}{texts}")
        self._pilot_has_it = True

    def _missing(self) -> list[str]:
        feed, health = self._feed, self._feed.health
        missing = []
        if not feed.attitudes:
            missing.append("no attitude (ATTITUDE)")
        if not feed.positions:
            missing.append("no local position (LOCAL_POSITION_NED)")
        if feed.armed is None or not feed.mode:
            missing.append("no heartbeat")
        if health is None:
            missing.append("no health (SYS_STATUS)")
            return missing
        if not health.is_armable:
            missing.append(_CHECKS)
        return missing

    async def _ask_for_rates(self) -> None:
        """Ask for 50 Hz of attitude and position where the vehicle sends less; a refusal is no error."""
        feed = self._feed
        start_us, attitudes, positions = feed.time_us, feed.attitudes, feed.positions
        await asyncio.sleep(0.5)
        span_s = max((feed.time_us - start_us) / 1e6, 1e-3)
        wanted = WANTED_RATE_HZ
        with contextlib.suppress(MavsdkError):
            if (feed.attitudes - attitudes) / span_s < 0.9 * wanted:
                await self._telemetry.set_rate_attitude_euler(wanted)
            if (feed.positions - positions) / span_s < 0.9 * wanted:
                await self._telemetry.set_rate_position_velocity_ned(wanted)

    async def _ask(self, what: str, request: Awaitable[object]) -> None:
        try:
            await request
        except MavsdkError as error:
            result = getattr(getattr(error, "result", None), "name", str(error))
            raise DroneError(f"{what} was refused: {result}{self._feed.recent_texts()}") from None

    async def _confirm(self, what: str, shown: Callable[[], bool]) -> None:
        """No acknowledgement is trusted: PX4 sends two for a mode, the first one always "accepted"."""
        try:
            await self._until(shown, CONFIRM_S)
        except TimeoutError:
            feed = self._feed
            armed = "armed" if feed.armed else "disarmed"
            raise DroneError(
                f"{what} was acknowledged, but telemetry still shows mode {feed.mode}, {armed} "
                f"after {CONFIRM_S:g} s{feed.recent_texts()}"
            ) from None

    async def _until(self, condition: Callable[[], bool], limit_s: float) -> None:
        async with asyncio.timeout(limit_s):
            while not condition():
                await self._feed.next_tick(0.05)

    async def _start_recorder(self) -> None:
        if self._tlog_path is None or self._mavsdk is None:
            return
        try:
            self._recorder = TlogRecorder(self._tlog_path)
            url = await self._recorder.listen()
            await self._mavsdk.add_any_connection(url, ForwardingOption.ON)
        except (OSError, MavsdkError) as error:
            raise DroneError(f"cannot record to {self._tlog_path}: {error}") from None

    async def _let_companion_in(self) -> None:
        if self._companion is None or self._mavsdk is None:
            return
        try:
            await self._mavsdk.add_any_connection(self._companion.listen(), ForwardingOption.ON)
        except (OSError, MavsdkError) as error:  # the mission can be flown all the same
            logger.warning("the mission cannot be told of: %s", error)

    def _stop_from_watchdog(self) -> None:
        """On the watchdog's thread: end the native stream, ask for hold; if hold fails, silence is enough.

        Not for hold if others have the vehicle, but the stream ends for good: nobody shall give the vehicle
        back to an app that hangs.
        """
        with contextlib.suppress(Exception):
            if self._feed.mode == "OFFBOARD":
                self._stream.ask_for_hold_now()
            else:
                self._stream.end()


def _synchronous(wrapper: Any) -> Any:  # noqa: ANN401 - MAVSDK is untyped
    """The synchronous object inside one of MAVSDK's asyncio wrappers; they have no public access to it."""
    inner = getattr(wrapper, "_plugin", None)
    return wrapper._system if inner is None else inner


def _log(level: Any, message: str, _file: object, _line: object) -> bool:  # noqa: ANN401
    logger.debug("mavsdk %s: %s", getattr(level, "name", level), message)
    return True  # handled: MAVSDK prints nothing itself
