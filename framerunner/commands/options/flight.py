"""Options of flights that several commands have, in groups as help shows them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Group, Parameter

from framerunner.commands import within
from framerunner.commands.options.rules import OptionRule

if TYPE_CHECKING:
    from framerunner.flying.simulator_process import GenuineAutopilot

SETTINGS = "--settings"
SettingsFile = Annotated[
    Path | None,
    Parameter(
        name=SETTINGS,
        help="YAML file of options, such as `max-speed: 0.5`; the command line counts before it",
    ),
]
DRONE_GROUP = Group("Drone and camera", sort_key=1)
SIMULATION_GROUP = Group("Simulation", sort_key=2)
OUTPUT_GROUP = Group("Files and monitor", sort_key=3)
HARDWARE_GROUP = Group("Safety of a real drone", sort_key=4)
Response = Annotated[
    str | None,
    Parameter(
        help="a vehicle that answers late, lag=0.6,dead-time=0.15,height-wander=0.05 in seconds and metres"
    ),
]
CameraDelay = Annotated[
    float | None,
    within(0.0, 0.5),
    Parameter(
        help="age in s of an image that arrives without a time stamp; by default that of the calibration, "
        "else 0.1"
    ),
]
Lifeline = Annotated[bool, Parameter(show=False, help="stop when standard input ends")]


@Parameter(name="*", group=SIMULATION_GROUP)
@dataclass(frozen=True, slots=True, kw_only=True)
class GenuineOptions:
    """A genuine autopilot that flies the simulated drone instead of ours.

    Attributes:
        px4: folder of a PX4 built for SITL, which flies instead
        ardupilot: folder of an ArduPilot built for SITL, which flies instead
    """

    px4: Path | None = None
    ardupilot: Path | None = None

    @property
    def autopilot(self) -> GenuineAutopilot | None:
        """The autopilot that is chosen; None: our own."""
        from framerunner.flying.simulator_process import GenuineAutopilot

        if self.px4 is not None:
            return GenuineAutopilot("px4", self.px4.resolve())
        return None if self.ardupilot is None else GenuineAutopilot("ardupilot", self.ardupilot.resolve())


GENUINE = ("px4", "ardupilot")
ONE_AUTOPILOT = OptionRule(
    "ardupilot", "PX4 flies, by --px4 {given[px4]}; leave one of them out", excludes=("px4",)
)


def program_of(autopilot: GenuineAutopilot) -> Path:
    """The program in the folder of an autopilot. Raises `SettingError` if there is none."""
    from sitl.ardupilot.build import find_build as find_ardupilot
    from sitl.px4.build import find_build as find_px4

    if autopilot.name == "ardupilot":
        return find_ardupilot(autopilot.folder)
    return find_px4(autopilot.folder) / "bin" / "px4"
