"""`framerunner evaluate`: many flights, counted."""

from __future__ import annotations

import shlex
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Group, Parameter

from framerunner.commands import (
    DEFAULT_MISSION,
    NamedPilot,
    Sensors,
    WholeNumber,
    check_range,
    say,
    with_sensors,
    within,
)
from framerunner.commands.options.flight import (
    GENUINE,
    ONE_AUTOPILOT,
    SIMULATION_GROUP,
    GenuineOptions,
    Response,
    program_of,
)
from framerunner.commands.options.rules import OptionRule, check_rules, given_in, words_of
from framerunner.errors import SettingError
from framerunner.evaluation import COUNT, SEED
from sitl.autopilots import TITLES

if TYPE_CHECKING:
    from framerunner.evaluation.backends import Pool
    from framerunner.evaluation.plan import EvaluationPlan
    from framerunner.evaluation.runner import GenuineUse
    from framerunner.flying.simulator_process import GenuineAutopilot

_GENUINE_SPEED, _MAX_GENUINE_SPEED = 4.0, 100.0
_RULES = (
    ONE_AUTOPILOT,
    OptionRule("speed", "is for flights with --px4 or --ardupilot; leave it out", needs=GENUINE),
    OptionRule("response", "changes our autopilot's flights; leave it out with {found}", excludes=GENUINE),
    *(
        OptionRule(
            "backend", f"{TITLES[name]} is started on this machine; leave it out with {{found}}", (name,)
        )
        for name in GENUINE
    ),
)


@Parameter(name="*", group=Group("Scenarios", sort_key=1))
@dataclass(frozen=True, slots=True, kw_only=True)
class ScenarioOptions:
    """Which scenarios are flown, if none are named.

    Attributes:
        level: draw scenarios of this level, name or file
        count: how many scenarios of the level.
        seed: of the first scenario.
    """

    level: str | None = None
    count: Annotated[
        WholeNumber | None, Parameter(help=f"how many scenarios of the level; {COUNT} if not given")
    ] = None
    seed: Annotated[
        WholeNumber | None,
        Parameter(help=f"of the first scenario; each next one has one more; {SEED} if not given"),
    ] = None


@Parameter(name="*", group=SIMULATION_GROUP)
@dataclass(frozen=True, slots=True, kw_only=True)
class FlightOptions:
    """How the simulated drones differ from the scenarios'."""

    sensors: Sensors = None
    response: Response = None
    speed: Annotated[
        float | None,
        within(0.01, _MAX_GENUINE_SPEED),
        Parameter(
            help="with --px4 or --ardupilot: simulated seconds a second, if the machine can, 0.01 to "
            f"{_MAX_GENUINE_SPEED:g}; {_GENUINE_SPEED:g} if not given"
        ),
    ] = None


@Parameter(name="*", group=Group("Machines and files", sort_key=3))
@dataclass(frozen=True, slots=True, kw_only=True)
class EvaluationOptions:
    """Where flights are flown, and what is left of them.

    Attributes:
        jobs: flights at once; if not given one a core, with a genuine autopilot 1
        out: folder; by default one in `runs/` that the same command finds again
        again: fly again what is in the folder already
        compare: folder of an earlier evaluation
        backend: loky: this machine; the others: a cluster
        address: of the cluster's scheduler
    """

    jobs: WholeNumber | None = None
    out: Path | None = None
    again: bool = False
    compare: Path | None = None
    backend: Literal["loky", "dask", "ray"] = "loky"
    address: str | None = None


_SCENARIOS, _SIMULATION, _OWN = ScenarioOptions(), FlightOptions(), GenuineOptions()
_EVALUATION = EvaluationOptions()


def evaluate(
    *scenarios: str,
    drawn: ScenarioOptions = _SCENARIOS,
    mission: str = DEFAULT_MISSION,
    pilot: NamedPilot = None,
    simulated: FlightOptions = _SIMULATION,
    genuine: GenuineOptions = _OWN,
    options: EvaluationOptions = _EVALUATION,
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

    Args:
        scenarios: names, files or folders of scenarios, instead of --level
        drawn: which scenarios, if none are named.
        mission: name or file of the mission
        pilot: primitives of your own.
        simulated: a simulated drone.
        genuine: a genuine autopilot.
        options: where flights are flown, and what is left.
    """
    given = given_in(drawn, simulated, genuine, options)
    check_rules(_RULES, given)
    use = _genuine_use(genuine.autopilot, simulated.speed, options.jobs)
    from framerunner.evaluation import evaluate as evaluation
    from framerunner.evaluation.plan import plan_flights
    from offboard.mission import load_mission

    plan = plan_flights(scenarios, drawn.level, drawn.seed, drawn.count, load_mission(mission, pilot))
    plan = _flown_by(_sensing_by(plan, simulated.sensors), simulated.response, use)
    flown = {"mission": mission} if pilot is None else {"mission": mission, "pilot": pilot}
    given.pop("again", None)  # to continue, not from the beginning
    settings = evaluation.EvaluationSettings(
        plan=plan,
        pool=_pool(options, use),
        out=plan.default_out if options.out is None else options.out,
        again=options.again,
        against=options.compare,
        mission=mission,
        pilot=pilot,
        command=shlex.join(["framerunner", "evaluate", *scenarios, *words_of({**flown, **given})]),
        genuine=use,
    )
    return evaluation.evaluate(settings)


def _sensing_by(plan: EvaluationPlan, sensors: str | None) -> EvaluationPlan:
    """The plan with drones that have another sensor suite."""
    if sensors is None:
        return plan
    return plan.sensing_by(sensors, [with_sensors(each, sensors) for each in plan.scenarios])


def _flown_by(plan: EvaluationPlan, response: str | None, use: GenuineUse | None) -> EvaluationPlan:
    """The plan with a vehicle that answers late, or that a genuine autopilot flies."""
    if response is not None:
        from framerunner.commands.options.named_numbers import response_of

        return plan.answering_late(response_of(response))
    return plan if use is None else _plan_for_genuine(plan, use.autopilot)


def _plan_for_genuine(plan: EvaluationPlan, autopilot: GenuineAutopilot) -> EvaluationPlan:
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
    return plan.flown_by(version_of(title, program_of(autopilot)), flown)


def _pool(options: EvaluationOptions, use: GenuineUse | None) -> Pool:
    """Where flights are flown: on all cores, but with a genuine autopilot one after another."""
    from joblib import cpu_count

    from framerunner.evaluation.backends import Pool

    at_once = cpu_count() if use is None else 1
    return Pool(options.backend, at_once if options.jobs is None else options.jobs, options.address)


def _genuine_use(
    autopilot: GenuineAutopilot | None, speed: float | None, jobs: int | None
) -> GenuineUse | None:
    """By which a genuine autopilot is flown, if one is chosen."""
    if autopilot is None:
        return None
    from framerunner.evaluation.runner import GenuineUse
    from framerunner.instances import INSTANCES

    check_range("--jobs", jobs, 1, INSTANCES)
    program_of(autopilot)
    return GenuineUse(autopilot, _GENUINE_SPEED if speed is None else speed)
