"""Missions: found by name or path, checked, loaded, drawn; and the files of a new one."""

from __future__ import annotations

import contextlib
import shlex
from collections.abc import Callable
from dataclasses import dataclass, field, fields
from functools import cached_property
from pathlib import Path

from framerunner.files.extensions import extension_names, find_extension
from framerunner.files.text_file import TextError, TextFault, read_text
from framerunner.files.yaml_text import Place
from framerunner.geometry.gate_shape import GateShape
from offboard.chart.check import check
from offboard.chart.mission_texts import Message
from offboard.chart.problems import (
    MissionError,
    MissionProblem,
    ProblemList,
    cut,
    did_you_mean,
    mission_error,
)
from offboard.chart.read import read_mission_file
from offboard.chart.spec import Leaf, MissionFile, State, all_states, expand, leaves, merge_extended
from offboard.chart.table import ChartTable
from offboard.pilot import Pilot
from offboard.pilot_file import PilotFile, PilotSource, class_of, find_pilot
from scenarios.models import MissionClass
from vision.types import Vision

__all__ = [
    "Mission",
    "MissionError",
    "list_missions",
    "load_mission",
    "mermaid",
    "mission_from_text",
    "new_mission",
]

MAX_FILE_BYTES = 1_000_000
MISSIONS = Path(__file__).parent / "missions"
BaseReader = Callable[[MissionFile], MissionFile]
"""Reads the mission that one extends."""
TEMPLATES = Path(__file__).parent / "templates"
_FAULTS: dict[TextFault, str] = {
    "missing": "file.unreadable",
    "unreadable": "file.unreadable",
    "too_large": "file.too_large",
    "utf16": "file.utf16",
    "not_utf8": "file.not_utf8",
}


@dataclass(frozen=True)
class Mission:
    """A checked mission, ready to fly. It can be pickled: another process builds the chart again.

    Attributes:
        spec: the expanded chart.
        pilot: what the mission was checked against: a contestant's file or a class.
        mission_class: by which limits it flies.
        vision: how it sees gates.
        detector: name of another package's detector that finds them; empty: the vision's own.
        gate: shape of gates of which the scenario tells nothing; None: that of the frame challenge.
        remarks: the checker's warnings and advice.
    """

    name: str
    description: str
    path: Path
    spec: MissionFile = field(repr=False)
    pilot: PilotSource = field(repr=False)
    mission_class: MissionClass = "contest"
    vision: Vision = "boxes"
    detector: str = ""
    gate: GateShape | None = None
    remarks: tuple[MissionProblem, ...] = field(default=(), repr=False)

    def __getstate__(self) -> dict[str, object]:
        """Only the fields: the table's functions cannot be pickled."""
        return {part.name: getattr(self, part.name) for part in fields(self)}

    @cached_property
    def table(self) -> ChartTable:
        """The chart as the engine runs it."""
        return ChartTable(self.spec)

    @property
    def chart_text(self) -> str:
        """The expanded chart as a text: equal if missions with the same variables and rules fly alike."""
        return repr((self.spec.name, self.spec.initial, self.spec.states))

    @property
    def rules(self) -> str:
        """By which limits it flies and how it sees, in words."""
        rules = f"class {self.mission_class}, vision {self.vision}"
        added = find_extension("detector", self.detector) if self.detector else None
        return rules if added is None else f"{rules}, detector {added}"

    @cached_property
    def states(self) -> dict[str, State]:
        """All states, superstates too, by full id, in document order."""
        return {state.id: state for state in all_states(self.spec.states)}

    @cached_property
    def leaves(self) -> dict[str, Leaf]:
        """States without states of their own, by full id."""
        return {leaf.state.id: leaf for leaf in leaves(self.spec.states)}

    @cached_property
    def finishes(self) -> frozenset[str]:
        """States in which the mission is over."""
        return frozenset(leaf_id for leaf_id, row in self.table.rows.items() if row.finish)

    def new_pilot(self) -> Pilot:
        """A pilot with the mission's own variables; `MissionError` if a contestant's class fails."""
        variables = dict(self.spec.variables)
        if isinstance(self.pilot, PilotFile):
            return self.pilot.new_pilot(variables)
        return self.pilot(variables)


def list_missions() -> list[str]:
    """Names of the installed missions: of this package, and those that others add."""
    return sorted({*own_missions(), *extension_names("mission")})


def own_missions() -> list[str]:
    """Names of the missions of this package, sorted."""
    return sorted(path.stem for path in MISSIONS.glob("*.yaml"))


def installed_mission(name: str) -> Path | None:
    """The file of an installed mission; None if there is none of this name.

    Raises:
        ExtensionError: another package adds it, but it cannot be used.
    """
    if name in own_missions():
        return MISSIONS / f"{name}.yaml"
    added = find_extension("mission", name)
    return None if added is None else added.path()


def load_mission(name_or_path: str | Path, pilot: str | Path | PilotSource | None = None) -> Mission:
    """Read, expand, check and load a mission.

    Args:
        name_or_path: a name of `list_missions()` or a YAML file.
        pilot: a subclass of `Pilot`, the name of one that another package adds, a contestant's Python file,
            which is executed, or such a file from `read_pilot`; None for `Pilot` itself.

    Raises:
        MissionError: every problem, one a line, as `file:line: text`, with the file as it was named.
        ExtensionError: what another package adds cannot be used.
    """
    pilot = find_pilot(pilot) if isinstance(pilot, str | Path) else pilot
    name = str(name_or_path)
    path = _find(name, Path.cwd(), Place(name))
    label = name if _is_file_name(name) else path.name
    return _checked(read_mission_file(_read_text(path, label), path, label), path, pilot, read_base)


def mission_from_text(text: str, pilot: PilotSource | None = None, *, file: str = "mission.yaml") -> Mission:
    """Load a mission that is not in a file, as `load_mission`; it may extend missions of the package only.

    Args:
        text: as a mission file has it.
        pilot: see `load_mission`.
        file: its name in messages; nothing is read there.

    Raises:
        MissionError: every problem, one a line, as `file:line: text`.
    """
    path = Path(file)
    if len(text) > MAX_FILE_BYTES:
        raise mission_error(Place(path.name), Message("file.too_large"))
    written = read_mission_file(text.replace("\r\n", "\n").replace("\r", "\n"), path)
    return _checked(written, path, pilot, read_package_base)


def _checked(written: MissionFile, path: Path, pilot: PilotSource | None, open_base: BaseReader) -> Mission:
    pilot = Pilot if pilot is None else pilot
    problems = ProblemList()
    spec = expand_and_check(written, class_of(pilot), problems, open_base)
    problems.raise_if_any()
    mission = Mission(
        spec.name,
        spec.description,
        path,
        spec,
        pilot,
        mission_class=spec.mission_class or "contest",
        vision=spec.vision or "boxes",
        detector=spec.detector,
        gate=spec.gate,
        remarks=problems.all,
    )
    mission.new_pilot()  # now, so that an error in the pilot is raised now
    return mission


def expand_and_check(
    written: MissionFile, pilot_class: type[Pilot], problems: ProblemList, open_base: BaseReader
) -> MissionFile:
    """Merge a mission file with what it extends, expand it and check it; `problems` takes what is found.

    Args:
        written: the file.
        pilot_class: whose names it uses.
        problems: see above.
        open_base: reads what a mission extends: `read_base` or `read_package_base`.

    Raises:
        MissionError: what it extends cannot be read, or it is too large.
    """
    spec = expand(merge_extended(written, open_base), problems)
    check(spec, pilot_class, problems)
    return spec


def read_base(mission: MissionFile) -> MissionFile:
    """Read the mission that one extends: an installed one, or a file in its own folder or below.

    Raises:
        MissionError: there is none, or it is elsewhere: a mission shall not read any file that it names.
    """
    folder = mission.path.parent
    path = _find(mission.extends, folder, mission.place)
    is_installed = not _is_file_name(mission.extends) or path.parent == MISSIONS
    if not is_installed and not path.is_relative_to(folder.resolve()):
        raise mission_error(mission.place, Message("extends.elsewhere", name=mission.extends))
    label = path.name if path.name != mission.path.name else str(path)
    return read_mission_file(_read_text(path, label), path, label)


def read_package_base(mission: MissionFile) -> MissionFile:
    """Read the mission that one extends, an installed one only: files beside it may be others'.

    Raises:
        MissionError: none of that name is installed.
    """
    known = list_missions()
    if mission.extends not in known:
        message = Message("extends.package_only", name=cut(mission.extends), names=", ".join(known))
        raise mission_error(mission.place, message)
    return read_base(mission)


def _find(name: str, folder: Path, place: Place) -> Path:
    """A file if it looks like one, otherwise an installed mission."""
    if _is_file_name(name):
        path = folder / name
        with contextlib.suppress(RuntimeError):  # links in a loop, before Python 3.13
            path = path.resolve()
        if path.is_file():
            return path
        code = "file.irregular" if path.exists() else "file.missing"
        raise mission_error(place, Message(code, name=name))
    installed = installed_mission(name)
    if installed is not None:
        return installed
    known = list_missions()
    advice = did_you_mean(name, known, Message("file.known", names=", ".join(known)))
    raise mission_error(place, Message("file.unknown", name=name, advice=advice))


def _is_file_name(name: str) -> bool:
    return name.endswith((".yaml", ".yml")) or "/" in name


def _read_text(path: Path, label: str) -> str:
    try:
        return read_text(path, MAX_FILE_BYTES)
    except TextError as error:
        raise unreadable(label, error) from None


def unreadable(label: str, error: TextError) -> MissionError:
    """The error for a mission file that is no text, by its name in messages."""
    return mission_error(Place(label, error.line), Message(_FAULTS[error.fault], reason=error.reason))


def mermaid(mission: Mission, active: str | None = None) -> str:
    """The expanded chart as a Mermaid state diagram.

    Transitions out of one state are numbered in order of priority, as Stateflow does.

    Args:
        mission: what to draw.
        active: full id of the state to highlight, such as "red.turning".
    """
    return mermaid_of(mission.spec, active)


def mermaid_of(chart: MissionFile, active: str | None = None) -> str:
    """The same of an expanded chart."""
    lines = ["stateDiagram-v2", f"    [*] --> {chart.initial}"]
    for state in chart.states:
        _draw(state, "    ", lines)
    if active:
        lines += ["    classDef active fill:#ffd166,stroke:#333", f"    class {active} active"]
    return "\n".join(lines) + "\n"


def _draw(state: State, indent: str, lines: list[str]) -> None:
    if state.states:
        lines.append(f'{indent}state "{state.name}" as {state.id} {{')
        initial = f"{state.id}.{state.initial}"
        again = state.resume is not None and state.resume.to == initial
        lines.append(f"{indent}    [*] --> {initial}{' : also after a pause' if again else ''}")
        if state.resume and not again and state.resume.to.startswith(f"{state.id}."):
            lines.append(f"{indent}    [*] --> {state.resume.to} : after a pause")
        for child in state.states:
            _draw(child, indent + "    ", lines)
        lines.append(f"{indent}}}")
    else:
        lines.append(f'{indent}state "{state.name}" as {state.id}')
        if state.final:
            lines.append(f"{indent}{state.id} --> [*]")
    for what, actions in (("enter", state.enter), ("during", state.during), ("exit", state.exit)):
        if actions and not state.states:
            lines.append(f"{indent}{state.id} : {what} / {', '.join(map(str, actions))}")
    several = len(state.transitions) > 1
    for number, transition in enumerate(state.transitions, 1):
        order = f"{number} " if several else ""
        guard = f"[{transition.when}]" if transition.when else ""
        done = f" / {', '.join(map(str, transition.actions))}" if transition.actions else ""
        label = f" : {order}{guard}{done}" if order or guard or done else ""
        lines.append(f"{indent}{state.id} --> {transition.to}{label}")
    if state.then:
        lines.append(f"{indent}{state.id} --> {state.then.to}")
    if state.resume and not state.resume.to.startswith(f"{state.id}."):
        lines.append(f"{indent}{state.id} --> {state.resume.to} : after a pause")


@dataclass(frozen=True, slots=True)
class NewMission:
    """The files of a new mission, and the text of each."""

    mission: Path
    pilot: Path | None
    texts: dict[Path, str]

    @property
    def arguments(self) -> str:
        """The files as command-line arguments of a mission."""
        option = "" if self.pilot is None else f" --pilot {shlex.quote(str(self.pilot))}"
        return f"{shlex.quote(str(self.mission))}{option}"


def new_mission(name: str, folder: Path, *, python: bool = False) -> NewMission:
    """Compose a first mission with comments, with or without a Python file; nothing is written."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined  # noqa: PLC0415 - slow to import

    templates = Environment(
        loader=FileSystemLoader(TEMPLATES),
        undefined=StrictUndefined,
        autoescape=False,
        keep_trailing_newline=True,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    mission = folder / f"{name}.yaml"
    pilot = folder / f"{name}.py" if python else None
    values = {
        "name": name,
        "python": python,
        "yaml": mission.name,
        "option": "" if pilot is None else f" --pilot {pilot.name}",
    }
    texts = {mission: templates.get_template("mission.yaml.j2").render(values)}
    if pilot is not None:
        texts[pilot] = templates.get_template("pilot.py.j2").render(values)
    return NewMission(mission, pilot, texts)
