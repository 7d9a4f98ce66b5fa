"""`framerunner evaluate`: many flights, counted."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from framerunner.commands import (
    DEFAULT_MISSION,
    NamedPilot,
    Sensors,
    WholeNumber,
    check_range,
    say,
    with_sensors,
)
from framerunner.errors import SettingError
from framerunner.evaluation import COUNT, SEED

if TYPE_CHECKING:
    from framerunner.evaluation.backends import Backend, Pool
    from framerunner.evaluation.genuine_flight import GenuineUse
    from framerunner.evaluation.plan import Plan
    from framerunner.flying.simulator_process import GenuineAutopilot

_GENUINE_SPEED, _MAX_GENUINE_SPEED = 4.0, 100.0
_Level = Annotated[str | None, Parameter(help="draw scenarios of this level, name or file")]
_CountOption = Annotated[
    WholeNumber | None, Parameter(help=f"how many scenarios of the level; {COUNT} if not given")
]
_SeedOption = Annotated[
    WholeNumber | None,
    Parameter(help=f"of the first scenario; each next one has one more; {SEED} if not given"),
]
_Jobs = Annotated[
    WholeNumber | None,
    Parameter(help="flights at once; if not given one a core, with a genuine autopilot 1"),
]
_Out = Annotated[
    Path | None, Parameter(help="folder; by default one in `runs/` that the same command finds again")
]
_Response = Annotated[
    str | None,
    Parameter(
        help="a vehicle that answers late, lag=0.6,dead-time=0.15,height-wander=0.05 in seconds and metres"
    ),
]
_Px4 = Annotated[
    Path | None,
    Parameter(help="folder of a PX4 built for SITL: it flies instead of our autopilot, as in `fly --px4`"),
]
_ArduPilot = Annotated[
    Path | None,
    Parameter(help="folder of an ArduPilot built for SITL: likewise an ArduCopter, as in `fly --ardupilot`"),
]
_Speed = Annotated[
    float | None,
    Parameter(
        help="with --px4 or --ardupilot: simulated seconds a second, if the machine can, 0.01 to "
        f"{_MAX_GENUINE_SPEED:g}; {_GENUINE_SPEED:g} if not given"
    ),
]
_Again = Annotated[bool, Parameter(help="fly again what is in the folder already")]
_Backend = Annotated[
    Literal["loky", "dask", "ray"], Parameter(help="loky: this machine; the others: a cluster")
]


def evaluate(
    *scenarios: Annotated[str, Parameter(help="names, files or folders of scenarios, instead of --level")],
    level: _Level = None,
    count: _CountOption = None,
    seed: _SeedOption = None,
    mission: Annotated[str, Parameter(help="name or file of the mission")] = DEFAULT_MISSION,
    pilot: NamedPilot = None,
    sensors: Sensors = None,
    response: _Response = None,
    px4: _Px4 = None,
    ardupilot: _ArduPilot = None,
    speed: _Speed = None,
    jobs: _Jobs = None,
    out: _Out = None,
    again: _Again = False,
    compare: Annotated[Path | None, Parameter(help="folder of an earlier evaluation")] = None,
    backend: _Backend = "loky",
    address: Annotated[str | None, Parameter(help="of the cluster's scheduler")] = None,
) -> int:
    """Fly a mission on many scenarios in lockstep; report how often it lands, how well, and why it fails.

    Every flight is saved as soon as it is over. Ctrl-C loses none of them: the same command continues where
    it stopped, and ends with the same results. With --px4 or --ardupilot a genuine autopilot flies.
    Exit code 0: all were flown, 1: a fault of the program ended some of them, 2: bad input.

    **Examples**

        framerunner evaluate --level calm --count 200 --seed 1

        framerunner evaluate --level calm --mission mine.yaml --compare runs/before

        framerunner evaluate --level calm --response lag=0.6,dead-time=0.15

        framerunner evaluate test-case-1 test-case-2 calm-17 --jobs 1

        framerunner evaluate --level calm --count 10 --px4 ../PX4-Autopilot

        framerunner evaluate --level calm --backend dask --address tcp://10.0.0.1:8786
    """
    given = dict(locals())
    use = _genuine_use(_autopilot(px4, ardupilot), speed, jobs, response=response, backend=backend)
    from framerunner.evaluation import evaluate as evaluation
    from framerunner.evaluation.plan import plan_flights
    from offboard.mission import load_mission

    plan = plan_flights(scenarios, level, seed, count, load_mission(mission, pilot))
    plan = _flown_by(_sensing_by(plan, sensors), response, use)
    settings = evaluation.EvaluationSettings(
        plan=plan,
        pool=_pool(backend, jobs, address, use),
        out=plan.default_out if out is None else out,
        again=again,
        against=compare,
        mission=mission,
        pilot=pilot,
        command=_command(scenarios, given),
        genuine=use,
    )
    return evaluation.evaluate(settings)


def _sensing_by(plan: Plan, sensors: str | None) -> Plan:
    """The plan with drones that have another sensor suite."""
    if sensors is None:
        return plan
    return plan.sensing_by(sensors, [with_sensors(each, sensors) for each in plan.scenarios])


def _flown_by(plan: Plan, response: str | None, use: GenuineUse | None) -> Plan:
    """The plan with a vehicle that answers late, or that a genuine autopilot flies."""
    if response is not None:
        from framerunner.commands.options.named_numbers import response_of

        return plan.answering_late(response_of(response))
    return plan if use is None else _plan_for_genuine(plan, use.autopilot)


def _plan_for_genuine(plan: Plan, autopilot: GenuineAutopilot) -> Plan:
    """A plan for an autopilot, without scenarios with a fault of the link; says what is changed.

    Raises:
        SettingError: nothing is left, or there is no such autopilot.
    """
    from scenarios.faults.declaration import FaultPart
    from sitl.autopilots.process import version_of
    from sitl.autopilots.sensors import SUITE_INSTEAD_OF_IDEAL, with_estimable_sensors

    title, option = autopilot.title, f"--{autopilot.name} {autopilot.folder}"
    flown, ideal = [], 0
    for scenario in plan.scenarios:
        if all(fault.part is not FaultPart.LINK for fault in scenario.faults):
            flown.append(with_estimable_sensors(scenario))
            ideal += flown[-1] is not scenario
    left_out = len(plan) - len(flown)
    if not flown:
        raise SettingError(f"{option}: all flights have a fault of the link, which is {title}'s own")
    if left_out:
        whole = f"{left_out} of {len(plan)} flights have a fault of it, left out"
        say(f"{title} has its own link to the app: {whole}")
    if ideal:
        say(f"{title} takes no true state: drones with ideal sensors have {SUITE_INSTEAD_OF_IDEAL}")
    return plan.flown_by(version_of(title, _program(autopilot)), flown)


def _program(autopilot: GenuineAutopilot) -> Path:
    """Raises `SettingError` if there is none."""
    from sitl.ardupilot.build import find_build as find_ardupilot
    from sitl.px4.build import find_build as find_px4

    if autopilot.name == "ardupilot":
        return find_ardupilot(autopilot.folder)
    return find_px4(autopilot.folder) / "bin" / "px4"


def _pool(backend: Backend, jobs: int | None, address: str | None, use: GenuineUse | None) -> Pool:
    """Where flights are flown: on all cores, but with a genuine autopilot one after another."""
    from joblib import cpu_count

    from framerunner.evaluation.backends import Pool

    at_once = cpu_count() if use is None else 1
    return Pool(backend, at_once if jobs is None else jobs, address)


def _autopilot(px4: Path | None, ardupilot: Path | None) -> GenuineAutopilot | None:
    """The genuine autopilot that was chosen; None: our own."""
    from framerunner.flying.simulator_process import GenuineAutopilot

    if px4 is not None and ardupilot is not None:
        raise SettingError(f"--ardupilot {ardupilot}: PX4 flies, by --px4 {px4}; leave one of them out")
    if px4 is not None:
        return GenuineAutopilot("px4", px4.resolve())
    return None if ardupilot is None else GenuineAutopilot("ardupilot", ardupilot.resolve())


def _genuine_use(
    autopilot: GenuineAutopilot | None,
    speed: float | None,
    jobs: int | None,
    *,
    response: str | None,
    backend: str,
) -> GenuineUse | None:
    """By which a genuine autopilot is flown; refuses options that do not go with it."""
    if autopilot is None:
        if speed is not None:
            raise SettingError(f"--speed {speed:g}: is for flights with --px4 or --ardupilot; leave it out")
        return None
    option, title = f"--{autopilot.name}", autopilot.title
    if response is not None:
        raise SettingError(
            f"--response {response}: changes our autopilot's flights; leave it out with {option}"
        )
    if backend != "loky":
        raise SettingError(
            f"--backend {backend}: {title} is started on this machine; leave it out with {option}"
        )
    from framerunner.evaluation.genuine_flight import GenuineUse
    from framerunner.instances import INSTANCES

    check_range("--speed", speed, 0.01, _MAX_GENUINE_SPEED)
    check_range("--jobs", jobs, 1, INSTANCES)
    _program(autopilot)
    return GenuineUse(autopilot, _GENUINE_SPEED if speed is None else speed)


def _command(scenarios: tuple[str, ...], given: Mapping[str, object]) -> str:
    """The command that continues this evaluation; --again would start it from the beginning."""
    words = ["framerunner", "evaluate", *scenarios]
    for name, value in given.items():
        if value is not None and name not in ("scenarios", "again") and (name, value) != ("backend", "loky"):
            words += [f"--{name}", str(value)]
    return shlex.join(words)
