"""The `Drone` port: what the navigator needs of a vehicle. A mission works alike with each adapter."""

from __future__ import annotations

from collections.abc import AsyncGenerator
from dataclasses import dataclass
from math import isfinite, isnan, sqrt
from typing import Literal, Protocol

from framerunner.errors import UserError
from framerunner.geometry.vectors import Quaternion, Vec3


class DroneError(UserError):
    """The drone cannot do what was requested; the message is one line for people."""


@dataclass(frozen=True, slots=True)
class ImuInterval:
    """Means of an IMU's samples over an interval, less the biases that the vehicle has estimated.

    Attributes:
        time_us: vehicle time of its end; it began at the end of the one before, also if samples were lost.
        angular_rate_flu_rad_s: of the body.
        specific_force_flu_m_s2: likewise; at rest (0, 0, g).
    """

    time_us: int
    angular_rate_flu_rad_s: Vec3
    specific_force_flu_m_s2: Vec3


SURE_OF_POSITION_M = 0.1  # a vehicle that says more of its position does not know it


@dataclass(frozen=True, slots=True)
class ReportedAccuracy:
    """What the vehicle tells of the errors of its own estimate (standard deviations), and of its jumps.

    Attributes:
        position_std_m: of north and east, the larger one.
        height_std_m: of the height.
        velocity_std_m_s: of north and east, the larger one.
        climb_std_m_s: of the vertical velocity.
        heading_std_rad: of the heading.
        resets: how often the estimate has jumped, 0 to 255, then from 0 again.
    """

    position_std_m: float
    height_std_m: float
    velocity_std_m_s: float
    climb_std_m_s: float
    heading_std_rad: float
    resets: int = 0


@dataclass(frozen=True, slots=True)
class PlaceEstimate:
    """Where the app itself has estimated the drone to be, since its vehicle does not know that well.

    Attributes:
        position_m: arena axes.
        yaw_rad: -pi..pi.
        covariance_m2: of the position, row by row: xx, xy, xz, yx and so on, nine numbers.
        yaw_std_rad: standard deviation of the yaw.
    """

    position_m: Vec3
    yaw_rad: float
    covariance_m2: tuple[float, ...]
    yaw_std_rad: float

    @property
    def position_std_m(self) -> Vec3:
        """Standard deviations along x, y, z."""
        xx, yy, zz = self.covariance_m2[::4]
        return (sqrt(xx), sqrt(yy), sqrt(zz))


@dataclass(frozen=True, slots=True)
class DroneState:
    """The drone's state in arena axes (x forward, y left, z up, yaw counter-clockwise).

    If `offboard` is false between `motors_on` and the end of commanding, an operator has taken the drone.
    """

    time_us: int  # vehicle time, microseconds since its boot
    x: float  # metres
    y: float  # metres
    z: float  # above the arena's floor, metres
    yaw: float  # radians, -pi..pi
    velocity_arena_m_s: tuple[float, float, float] = (0.0, 0.0, 0.0)
    armed: bool = False  # by telemetry or, until that shows it, by the acknowledgement of `motors_on`
    offboard: bool = False  # it follows this app's setpoints
    mode: str = ""  # name of the flight mode, for people
    landed: bool = True  # on the ground or on the base
    position_age_s: float = 0.0  # how much older the position and the velocity are than `time_us`
    attitude_arena: Quaternion = (1.0, 0.0, 0.0, 0.0)  # body FLU to arena, with the heading `yaw`
    camera_attitude_arena: Quaternion | None = None  # of a camera on a gimbal, forward-left-up to arena
    imu: tuple[ImuInterval, ...] = ()  # since the state before, oldest first; empty: it sends none
    estimate: PlaceEstimate | None = None  # if the app has estimated itself where the drone is, and how well
    accuracy: ReportedAccuracy | None = None  # None: the vehicle does not tell
    missed: tuple[DroneState, ...] = ()  # at the ticks that were skipped before this one, oldest first

    @property
    def is_finite(self) -> bool:
        """Position, velocity and attitude are numbers."""
        values = (self.x, self.y, self.z, self.yaw, *self.velocity_arena_m_s, *self.attitude_arena)
        return all(map(isfinite, values))


@dataclass(frozen=True, slots=True)
class VelocityFluCommand:
    """A velocity in level axes turned with the yaw (forward, left, up; m/s), a yaw rate (rad/s, left)."""

    forward_m_s: float = 0.0
    left_m_s: float = 0.0
    up_m_s: float = 0.0
    yaw_rate_rad_s: float = 0.0

    @property
    def is_number(self) -> bool:
        """No component is NaN."""
        return not isnan(self.forward_m_s + self.left_m_s + self.up_m_s + self.yaw_rate_rad_s)


@dataclass(frozen=True, slots=True)
class Clip:
    """What a limit, not that of the mission's class, has changed in a command.

    Attributes:
        limit: the box, or a cap on a drone that may be real.
        quantity: such as "level speed".
        words: what was changed and why, for people.
    """

    limit: Literal["box", "cap"]
    quantity: str
    words: str


@dataclass(frozen=True, slots=True)
class LimitedCommand:
    """A command within all limits, and what box and caps have changed in it, in their order."""

    command: VelocityFluCommand
    clips: tuple[Clip, ...] = ()

    @property
    def kept_in_box(self) -> bool:
        """Whether the box has changed it."""
        return any(clip.limit == "box" for clip in self.clips)

    @property
    def remark(self) -> str:
        """What the box and the caps have changed, for people; empty if nothing."""
        return "; ".join(dict.fromkeys(clip.words for clip in self.clips))


class Drone(Protocol):
    """A vehicle. All coroutines raise `DroneError` with a reason when the vehicle does not comply.

    After `connect` and `ready`, iterate over `ticks()`; it gives the state at 20 Hz of *vehicle* time and
    raises `DroneError` when commanding must stop: link lost, state stale or not finite, disarmed by others,
    or a mode that was not requested here and is no operator's (a failsafe, most likely).

    An operator may take the vehicle, by choosing one of his modes, and give it back, by choosing offboard. In
    between the ticks continue, with `offboard` false, whatever the mode and whether armed or not, and no
    command is flown. The adapter keeps offboard possible while the ticks are iterated, by setpoints of zero
    velocity. Once a tick shows `offboard` again, the vehicle stands still until either `command` takes it
    back or `refuse` lets it hold. An adapter whose vehicle no operator can take never shows this.
    """

    @property
    def gone(self) -> str:
        """Why the vehicle exists no longer, so that nothing can be requested of it; empty: it does."""
        ...

    async def connect(self) -> None:
        """Find the vehicle; `DroneError` after a time limit."""

    async def ready(self) -> None:
        """Wait until it can be armed; the error says what is still missing."""

    def ticks(self) -> AsyncGenerator[DroneState, None]:
        """States at 20 Hz of vehicle time."""
        ...

    async def motors_on(self, *, confirmed: bool = True) -> None:
        """Enter offboard and, when telemetry shows it, arm.

        Telemetry shows arming with the next heartbeat, up to a second later, while the time of a try runs.

        Args:
            confirmed: return when telemetry shows the vehicle armed, as the flights of the paper's navigator
                do, which must not change; else when it has acknowledged the request. Then the ticks raise
                `DroneError` if telemetry does not show it within the same limit.
        """

    async def motors_off(self) -> None:
        """Stop the motors at once, in the air too; returns when telemetry shows it."""

    async def land(self) -> None:
        """Let the vehicle land by itself and wait until it is disarmed."""

    async def hold(self) -> None:
        """Stop commanding permanently and request hold, unless an operator or a failsafe has the vehicle."""

    async def land_now(self, *, demanded: bool = False) -> None:
        """Stop commanding permanently and let the vehicle land where it is; returns when it is disarmed.

        A vehicle that an operator or a failsafe has is left to them, and this returns at once, unless it
        lands already. A vehicle that cannot be brought to land gets a request for hold, as by `hold`; then
        its own failsafe acts.

        Args:
            demanded: by the operator, who overrules a failsafe that does not land; manual control keeps the
                vehicle.
        """

    async def refuse(self) -> None:
        """Let the vehicle that an operator gave back hold, and wait until it is given back again."""

    def command(self, command: VelocityFluCommand, at: DroneState | None = None) -> LimitedCommand:
        """Set the velocity to fly from now on. Never blocks.

        Args:
            command: wanted.
            at: where the app has estimated the drone to be, for its box; None: where it is reported.

        Returns:
            The velocity that is sent, by the adapter's `VelocityLimits`; zero if none is flown now.

        Raises:
            OutsideBoxError: the drone has left its box and does not come back.
        """
        ...

    def report_place(self, state: DroneState) -> None:
        """Tell the vehicle where the app has estimated it to be, if it knows that from nothing else."""

    async def close(self) -> None:
        """Release the vehicle."""
