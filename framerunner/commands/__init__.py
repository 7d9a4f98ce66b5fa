"""The commands, one module each, and what several share. Heavy imports wait until a command runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter, Token

from framerunner.errors import SettingError
from framerunner.files.text_file import make_file
from framerunner.terminal import say as say

if TYPE_CHECKING:
    from scenarios.models import Scenario


def _whole(_type: Any, tokens: Sequence[Token]) -> int:  # noqa: ANN401 - the library's signature
    """Accept whole numbers only: the library's own conversion accepts 1.5 as 2."""
    text = tokens[0].value
    try:
        return int(text)
    except ValueError:
        raise ValueError(f'"{text}" is not a whole number.') from None


DEFAULT_MISSION = "explorer"
MAX_FAULTS = 20  # as many as a scenario file may have
WholeNumber = Annotated[int, Parameter(converter=_whole)]


ShowLayout = Annotated[
    bool,
    Parameter(
        negative="", help="for training: tell every app where frames and obstacles are (/scenario.json)"
    ),
]

Sensors = Annotated[
    str | None,
    Parameter(help="the drone's sensor suite instead of the scenario's: ideal, mocap, outdoor, …, or a file"),
]


def with_sensors(scenario: Scenario, sensors: str | None) -> Scenario:
    """A scenario with another sensor suite, which must exist; None: its own."""
    if sensors is None:
        return scenario
    from sitl.sensors.suite import load_suite

    load_suite(sensors)
    return scenario.model_copy(update={"sensors": sensors})


def for_genuine(autopilot: str, scenario: Scenario) -> Scenario:
    """A scenario with sensors from which a genuine autopilot can estimate its state; says so if changed."""
    from sitl.autopilots.sensors import with_estimable_sensors

    chosen = with_estimable_sensors(scenario)
    if chosen is not scenario:
        say(f"{autopilot} takes no true state: the drone has the sensors {chosen.sensors} (see --sensors)")
    return chosen


def check_range(option: str, value: float | None, low: float, high: float) -> None:
    """Raise SettingError for a number outside low to high, or not a number; None is an option not given."""
    if problem := _outside(value, low, high):
        raise SettingError(f"{option} {problem}")


def within(low: float, high: float) -> Parameter:
    """Let an option take numbers from low to high only; that it is another is told as by `check_range`."""

    def validate(_type: Any, value: float | None) -> None:  # noqa: ANN401 - the library's signature
        if problem := _outside(value, low, high):
            raise ValueError(problem)

    return Parameter(validator=validate)


def _outside(value: float | None, low: float, high: float) -> str:
    if value is None or low <= value <= high:
        return ""
    given, lowest, highest = (f"{n:g}" if isinstance(n, float) else n for n in (value, low, high))
    return f"{given}: must be from {lowest} to {highest}"


NamedPilot = Annotated[
    str | None,
    Parameter(
        help="primitives of your own: a Python file with a subclass of Pilot, which is executed, or the name "
        "of a pilot that a package adds"
    ),
]

Faults = Annotated[
    tuple[str, ...],
    Parameter(
        negative="",
        help="what fails, such as `gps off at 12 s for 5 s`, in seconds after arming; may be repeated",
    ),
]
"""Faults in one line each; see `scenarios.faults.declaration`."""


def with_faults(scenario: Scenario, fault: tuple[str, ...]) -> Scenario:
    """A scenario with more faults.

    Raises:
        FaultError: one cannot be understood, or there are too many.
    """
    from scenarios.faults.declaration import FaultError, parse_fault

    faults = (*scenario.faults, *map(parse_fault, fault))
    if len(faults) > MAX_FAULTS:
        raise FaultError(f"--fault: a scenario has at most {MAX_FAULTS} faults, not {len(faults)}")
    return scenario.model_copy(update={"faults": faults}) if fault else scenario


def write_new(texts: Mapping[Path, str], options: str = "--out", *, makes_folder: bool = False) -> None:
    """Write new files, completely.

    Raises:
        SettingError: one is there already, so none is written, or one cannot be written; `options` name them.
    """
    for path in texts:
        if path.exists():
            raise SettingError(f"{path} is there already and is left as it is; choose another {options}")
    try:
        for path, text in texts.items():
            if makes_folder:
                path.parent.mkdir(parents=True, exist_ok=True)
            make_file(path, text)
    except OSError as error:
        raise SettingError(f"--out {path}: cannot be written ({error.strerror}); choose another") from None
