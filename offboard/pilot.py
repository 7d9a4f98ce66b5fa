"""What a mission can read and command: the paper's interface `imu`, `cam`, `cmd`, and named primitives.

Everything public in `Pilot` can be used in a mission file: attributes and properties in guards and on the
right of assignments, `cmd`, `goal_m`, `colour` and `memory` on the left, methods as actions. A subclass may
add more. Axes are the arena's: x forward, y left, z up, yaw counter-clockwise; commands are forward, left,
up and yaw rate to the left.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite, isnan, sqrt
from types import SimpleNamespace
from typing import TYPE_CHECKING, Annotated

from pydantic import Field
from pydantic.config import JsonDict

from framerunner.errors import UserError
from framerunner.geometry.vectors import Vec3, turned
from offboard.drone import VelocityFluCommand
from offboard.limits import CONTEST, CommandLimits
from scenarios.models import COLOURS, Colour
from vision.types import Detection, Detections

FLY_M_S = 1.0  # of `fly_to_goal`: the paper's
if TYPE_CHECKING:  # it imports filterpy, which takes a second and which not every mission needs
    from offboard.navigation.navigator import Navigator

LOOK_TURN_PX = 80.0  # horizontal offset that gives 1 rad/s: the paper's gains, for its image of 320 x 240
LOOK_CLIMB_PX = 120.0  # vertical offset that gives 1 m/s
M: JsonDict = {"unit": "m"}
S: JsonDict = {"unit": "s"}
M_S: JsonDict = {"unit": "m/s"}
RAD: JsonDict = {"unit": "rad"}
RAD_S: JsonDict = {"unit": "rad/s"}

NAMES_ON_MAP = frozenset(
    {
        *("explore", "cross_frame", "step_back", "fly_path_to_goal"),
        *("frame_known", "frame_certain", "frame_crossed", "crossing_refused", "path_flown"),
    }
)
"""Members of `Pilot` that need the map of frames: only missions with `vision: frames` can use them."""


class PilotError(UserError):
    """A mission computed a command that must not be flown; the message is one line for people."""


@dataclass(frozen=True, slots=True)
class Imu:
    """Where the drone is in the arena."""

    x: Annotated[float, Field(description="forward of the floor's centre", json_schema_extra=M)] = 0.0
    y: Annotated[float, Field(description="to the left of the floor's centre", json_schema_extra=M)] = 0.0
    z: Annotated[float, Field(description="height above the floor", json_schema_extra=M)] = 0.0
    yaw: Annotated[float, Field(description="heading, counter-clockwise from x", json_schema_extra=RAD)] = 0.0
    std_m: Annotated[
        float,
        Field(
            description="standard deviation of the position; 0: the drone itself knows where it is",
            ge=0,
            json_schema_extra=M,
        ),
    ] = 0.0


@dataclass(slots=True)
class Command:
    """What the mission commands (the paper's on, velX, velY, velZ, rotZ)."""

    on: Annotated[bool, Field(description="motors on")] = False
    vel_x: Annotated[float, Field(description="speed forward", json_schema_extra=M_S)] = 0.0
    vel_y: Annotated[float, Field(description="speed to the left", json_schema_extra=M_S)] = 0.0
    vel_z: Annotated[float, Field(description="speed up", json_schema_extra=M_S)] = 0.0
    rot_z: Annotated[float, Field(description="yaw rate to the left", json_schema_extra=RAD_S)] = 0.0
    land: Annotated[
        bool, Field(description="with `on` false: land by the vehicle's own means, motors off on the ground")
    ] = False


class Memory(SimpleNamespace):
    """The mission's own variables, as declared in its file."""


class Pilot:
    """The paper's interface to missions. All times are vehicle time."""

    imu: Annotated[Imu, Field(description="position and heading")]
    cam: Annotated[Detections, Field(description="what the camera sees of the frame of each colour")]
    cmd: Annotated[Command, Field(description="the command; it stays as it is until changed")]
    colour: Annotated[Colour, Field(description="of the frame to find; assign it, then read `frame`")]
    goal_m: Annotated[Vec3, Field(description="where `fly_to_goal` flies, (x, y, z) in the arena")]
    memory: Annotated[Memory, Field(description="the mission's own variables")]
    limits: Annotated[CommandLimits, Field(description="of its commands, by its class")]
    seconds_in_state: Annotated[
        float, Field(description="since the present state was entered", ge=0, json_schema_extra=S)
    ]
    seconds_in_mission: Annotated[
        float, Field(description="since the mission started", ge=0, json_schema_extra=S)
    ]
    seconds_unseen: Annotated[
        float,
        Field(
            description="since `frame` was last wholly in view, or the mission started or continued",
            ge=0,
            json_schema_extra=S,
        ),
    ]

    def __init__(self, variables: dict[str, object] | None = None) -> None:
        """Start with motors off, and with the first values of the mission's own variables."""
        self.imu = Imu()
        self.cam = Detections()
        self.cmd = Command()
        self.colour = COLOURS[0]
        self.goal_m = (0.0, 0.0, 0.0)
        self.memory = Memory(**(variables or {}))
        self.limits = CONTEST
        self.seconds_in_state = 0.0
        self.seconds_in_mission = 0.0
        self.seconds_unseen = 0.0
        self._navigator: Navigator | None = None  # set by the engine if the mission says `vision: frames`

    @property
    def frame(self) -> Detection:
        """What the camera sees of the frame of this `colour`."""
        detection: Detection = getattr(self.cam, self.colour)
        return detection

    @property
    def frame_seen(self) -> bool:
        """The frame of this `colour` is wholly in view, so its distance is known."""
        return isfinite(self.frame.d)

    @property
    def distance_to_goal_m(self) -> Annotated[float, Field(ge=0, json_schema_extra=M)]:
        """From the present position to the goal."""
        x, y, z = self.goal_m
        imu = self.imu
        return sqrt((x - imu.x) ** 2 + (y - imu.y) ** 2 + (z - imu.z) ** 2)

    @property
    def frame_known(self) -> bool:
        """The map has the frame of this `colour`, well enough to fly towards it."""
        return self._map_user.is_known(self.colour)

    @property
    def frame_certain(self) -> bool:
        """The map has the frame of this `colour` well enough to fly through it."""
        return self._map_user.is_certain(self.colour)

    @property
    def frame_crossed(self) -> bool:
        """`cross_frame` has flown through the frame of this `colour` and is clear of it."""
        return self._map_user.has_crossed(self.colour)

    @property
    def crossing_refused(self) -> bool:
        """`cross_frame` cannot fly through the frame from here; it was lost, uncertain or missed."""
        return self._map_user.refused

    @property
    def path_flown(self) -> bool:
        """The drone is at the end of the path of `fly_path_to_goal` or `step_back`."""
        return self._map_user.arrived

    def hover(self) -> None:
        """Motors on, all rates zero (the paper's Hover)."""
        cmd = self.cmd
        cmd.on = True
        cmd.vel_x = cmd.vel_y = cmd.vel_z = cmd.rot_z = 0.0

    def fly_to_goal(self) -> None:
        """Fly straight to the goal at half the distance per second, 1 m/s at most; the yaw rate stays.

        The paper's Fly2: v = e/2 in axes turned with the yaw, scaled down to 1 m/s at most.
        """
        imu, cmd = self.imu, self.cmd
        x, y, z = self.goal_m
        x_m_s, y_m_s, up_m_s = (x - imu.x) / 2, (y - imu.y) / 2, (z - imu.z) / 2
        speed = sqrt(x_m_s**2 + y_m_s**2 + up_m_s**2)
        scale = FLY_M_S / speed if speed > FLY_M_S else 1.0
        forward_m_s, left_m_s = turned(x_m_s, y_m_s, -imu.yaw)
        cmd.vel_x, cmd.vel_y = scale * forward_m_s, scale * left_m_s
        cmd.vel_z = scale * up_m_s

    def look_to_frame(self) -> None:
        """Turn and climb to bring the frame to the image's centre; no change while it is not wholly in view.

        The paper's Look2Frame: rot_z = -((e + w) / 2) / 80, vel_z = ((n + s) / 2) / 120.
        """
        frame = self.frame
        if isfinite(frame.d):
            self.cmd.rot_z = -((frame.e + frame.w) / 2) / LOOK_TURN_PX
            self.cmd.vel_z = ((frame.n + frame.s) / 2) / LOOK_CLIMB_PX

    def explore(self) -> None:
        """Fly to where the most of the arena that was not seen yet comes into view, and look around."""
        self._fly(self._map_user.explore())

    def cross_frame(self) -> None:
        """Fly through the frame of this `colour`, clear of all other frames seen, and on to what comes next.

        The path is planned again whenever the map becomes better. Near the frame the drone waits until the
        frame is certain.
        """
        self._fly(self._map_user.cross(self.colour))

    def step_back(self) -> None:
        """Fly back from the frame of this `colour`, a little to its side, to look at it again."""
        self._fly(self._map_user.step_back(self.colour))

    def fly_path_to_goal(self) -> None:
        """Fly to the goal on a smooth path, clear of all frames seen; see `path_flown`."""
        self._fly(self._map_user.fly_to(self.goal_m))

    def motors_off(self) -> None:
        """Stop the motors at once, in the air too."""
        self.hover()
        self.cmd.on = False
        self.cmd.land = False

    def land(self) -> None:
        """Let the vehicle land by its own means and stop its motors on the ground."""
        self.hover()
        self.cmd.on = False
        self.cmd.land = True

    @property
    def _map_user(self) -> Navigator:
        if self._navigator is None:
            raise PilotError("it uses the map of frames; add the line 'vision: frames' to the mission's file")
        return self._navigator

    def _fly(self, command: VelocityFluCommand) -> None:
        """Command a velocity with motors on."""
        cmd = self.cmd
        cmd.on = True
        cmd.vel_x, cmd.vel_y, cmd.vel_z = command.forward_m_s, command.left_m_s, command.up_m_s
        cmd.rot_z = command.yaw_rate_rad_s


def velocity_command(cmd: Command) -> VelocityFluCommand:
    """The command as a velocity, not limited yet.

    A rate may be infinite, and is then limited as in the paper's stabiliser: its navigator commands infinite
    speed ahead when it loses a frame while shifting, and then flies 1 m/s forward. That is a known fault of
    that navigator, reproduced here.

    Raises:
        PilotError: a rate is no number.
    """
    return VelocityFluCommand(
        _number("vel_x", cmd.vel_x),
        _number("vel_y", cmd.vel_y),
        _number("vel_z", cmd.vel_z),
        _number("rot_z", cmd.rot_z),
    )


def _number(name: str, value: float) -> float:
    """The same value; it may be infinite. Raises `PilotError` if it is no number."""
    try:
        if not isnan(value):
            return value
    except (TypeError, ValueError):  # None, a text, an array: a subclass may assign anything
        raise PilotError(f"cmd.{name} is {value!r}, which is no number; correct what sets it") from None
    raise PilotError(f"cmd.{name} is not a number; correct the expression that sets it")
