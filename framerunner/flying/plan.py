"""What is known of a flight before it begins, for all that flies, judges or shows it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, TypeVar

from framerunner.flying.response import ResponseDelay
from framerunner.geometry.gate_shape import PAPER_GATE, GateShapes
from framerunner.vehicle.airframe import Airframe, load_airframe
from offboard.limits import CONTEST, Box, Caps, CommandLimits, VelocityLimits, flight_box
from offboard.navigation.view import Surroundings
from scenarios.imaging.effects import CameraEffects
from scenarios.models import Camera, Scenario, start_position
from scenarios.part import Part
from scenarios.referee import Referee
from sitl.sensors.suite import load_suite
from vision.calibration.model import Calibration

if TYPE_CHECKING:  # it imports the statechart library, which the virtual camera does not need
    from offboard.mission import Mission
    from vision.detectors import DetectorMaker

P = TypeVar("P", bound=Part)
StartPose = tuple[float, float, float, float]
"""x, y, z of the drone's centre (metres) and yaw (radians), arena axes."""


@dataclass(frozen=True)
class FlightPlan:
    """One flight: where, with what, by which rules.

    Attributes:
        scenario: the layout, as declared.
        mission: the chart that flies; None if an agent or an operator flies.
        seed: of everything random; None in real time, which does not repeat.
        lift_m: how much higher than declared the gates and the ceiling are. A drone that starts from the
            floor, without a base, measures heights from there, and its app takes that for the base's top.
            Lifted by the base's height, everything is as high above the real floor as the scenario says.
        drone_limits: of a real drone, for a mission of the class `open`; None: those of the airframe.
        response: how late the simulated vehicle of a lockstep flight answers; None: as its autopilot does.
        calibration: of the camera; None: it is the scenario's.
        detector: with which its mission sees, a package's name for it or what makes it; None: the mission's.
        caps: on the speed and the height of the drone, whatever the mission asks; None: there are none.
    """

    scenario: Scenario
    mission: Mission | None = None
    seed: int | None = 0
    lift_m: float = 0.0
    drone_limits: CommandLimits | None = None
    response: ResponseDelay | None = None
    calibration: Calibration | None = None
    caps: Caps | None = None
    detector: str | DetectorMaker | None = None

    @property
    def chart(self) -> Mission:
        """The mission of a plan that must have one; ValueError if it has none."""
        if self.mission is None:
            raise ValueError("the plan has no mission to be flown")
        return self.mission

    @property
    def title(self) -> str:
        """Scenario and mission, for people."""
        return f"{self.scenario.name}: {self.chart.name}"

    @cached_property
    def airframe(self) -> Airframe:
        """The drone; AirframeError if there is none of the scenario's name."""
        return load_airframe(self.scenario.airframe)

    @cached_property
    def start_pose(self) -> StartPose:
        """Where the drone stands before take-off, on the base if its start is over it."""
        x_m, y_m, surface_m = start_position(self.scenario)
        return (x_m, y_m, surface_m + self.airframe.envelope_m[2] / 2, self.scenario.start.yaw_rad)

    @cached_property
    def layout(self) -> Scenario:
        """The scenario with its gates, ceiling and tops of obstacles `lift_m` higher than declared."""
        scenario, lift_m = self.scenario, self.lift_m
        if not lift_m:
            return scenario
        return scenario.model_copy(
            update={
                "frames": tuple(_raised(gate, "z_m", lift_m) for gate in scenario.frames),
                "decoys": tuple(_raised(decoy, "z_m", lift_m) for decoy in scenario.decoys),
                "poles": tuple(_raised(pole, "height_m", lift_m) for pole in scenario.poles),
                "walls": tuple(_raised(wall, "height_m", lift_m) for wall in scenario.walls),
                "arena": _raised(scenario.arena, "height_m", lift_m),
            }
        )

    @property
    def surroundings(self) -> Surroundings:
        """What a navigator knows before the flight: all but the layout."""
        layout = self.layout
        return Surroundings(layout.arena, layout.base, self.camera, self.gate_shapes, self.alone)

    @cached_property
    def alone(self) -> bool:
        """Whether the drone knows its place only by what the app estimates with camera and IMU."""
        pose = load_suite(self.scenario.sensors).external_pose
        return pose is not None and pose.source == "app"

    @property
    def gate_shapes(self) -> GateShapes:
        """The shapes that the drone is told: the scenario's; of colours that it has not, the mission's."""
        other = None if self.mission is None else self.mission.gate
        return GateShapes(self.scenario.gate_shapes, other or PAPER_GATE)

    @property
    def camera(self) -> Camera:
        """The camera as the navigator knows it: the scenario's, or what its calibration says of it."""
        camera, calibration = self.scenario.camera, self.calibration
        if calibration is None:
            return camera
        mounting = calibration.mounting
        place_m = None if mounting is None else mounting.position_flu_m
        return camera.model_copy(
            update={
                "width_px": calibration.width_px,
                "height_px": calibration.height_px,
                "horizontal_fov_rad": calibration.horizontal_fov_rad,
                "effects": CameraEffects(readout_s=calibration.readout_s),
                "mounting_frd_rad": (0.0, 0.0, 0.0) if mounting is None else mounting.angles_frd_rad,
                "position_flu_m": camera.position_flu_m if place_m is None else place_m,
            }
        )

    @property
    def box(self) -> Box:
        """The space that the drone is kept in, whatever its mission commands."""
        box = flight_box(self.scenario, self.lift_m)
        return box if self.caps is None else self.caps.box(box, self.start_pose[2])

    @property
    def command_limits(self) -> CommandLimits:
        """What the mission may command: the contest's limits or, in the class `open`, the drone's."""
        if self.mission is None or self.mission.mission_class == "contest":
            return CONTEST
        return self.drone_limits or airframe_limits(self.airframe)

    def velocity_limits(self) -> VelocityLimits:
        """What limits the velocities of one flight; an agent's are limited by its actions, and by caps."""
        if self.mission is None:
            return VelocityLimits(caps=self.caps)
        return VelocityLimits(self.command_limits, self.box, self.caps)

    @property
    def corrects_commands(self) -> bool:
        """Whether commands are corrected on their way to a vehicle that answers late.

        A mission that sees gates by shape corrects its own.
        """
        return self.mission is not None and self.mission.vision == "boxes"

    @property
    def limit_s(self) -> float:
        """Longest try, motors on to motors off."""
        return self.scenario.try_limit_s

    def new_referee(self) -> Referee:
        """A referee for one try."""
        return Referee(self.layout, self.airframe.envelope_m, self.lift_m)

    def lifted(self, lift_m: float) -> FlightPlan:
        """The same flight with another `lift_m`."""
        return replace(self, lift_m=lift_m)


def airframe_limits(airframe: Airframe) -> CommandLimits:
    """What an airframe can fly; sideways as forward, although it may be slower there."""
    own, speed_m_s = airframe.limits, airframe.level_speed_m_s
    return CommandLimits(
        forward_m_s=speed_m_s,
        left_m_s=speed_m_s,
        up_m_s=own.speed_up_m_s,
        down_m_s=own.speed_down_m_s,
        yaw_rate_rad_s=own.yaw_rate_rad_s,
        level_m_s=speed_m_s,
    )


def _raised(part: P, field: str, lift_m: float) -> P:
    """A part of a scenario with a height raised, unless it has none of its own."""
    height_m: float | None = getattr(part, field)
    return part if height_m is None else part.model_copy(update={field: height_m + lift_m})
