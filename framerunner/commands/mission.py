"""`framerunner mission`: missions, which are statecharts."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import App, Parameter

from framerunner.commands import NamedPilot, say
from framerunner.errors import SettingError
from framerunner.files.text_file import make_file

if TYPE_CHECKING:
    from offboard.mission import NewMission

app = App(name="mission", help="List, show, check, create, export and import missions.")

MAX_IMPORT_BYTES = 1_000_000
_NAME = re.compile(r"[a-z][a-z0-9_]{0,59}")
PilotOption = Annotated[
    Path | None, Parameter(help="Python file with a subclass of Pilot that the mission uses; it is executed")
]


@app.command(name="list")
def list_() -> int:
    """List the installed missions.

    **Example**

        framerunner mission list
    """
    from offboard.mission import list_missions, load_mission

    names = list_missions()
    width = max(map(len, names))
    for name in names:
        mission = load_mission(name)
        print(f"{name:{width}s}  {mission.description} ({mission.rules})")
    return 0


@app.command
def show(mission: Annotated[str, Parameter(help="name or file")], *, pilot: NamedPilot = None) -> int:
    """Print a mission's diagram in Mermaid's language (paste it into any Markdown page or mermaid.live).

    **Examples**

        framerunner mission show explorer

        framerunner mission show my_mission.yaml > my_mission.mmd

        framerunner mission show my_mission.yaml --pilot my_mission.py
    """
    from offboard.mission import load_mission, mermaid

    print(mermaid(load_mission(mission, pilot)))
    return 0


@app.command
def check(file: Annotated[Path, Parameter(help="YAML file")], *, pilot: NamedPilot = None) -> int:
    """Say whether a mission file is good, or every fault with its line; then what may go wrong with it.

    A warning names a part that does nothing, such as a transition that is never taken; advice, a state that
    may wait for ever. Missions with warnings and advice are flown.

    **Examples**

        framerunner mission check my_mission.yaml

        framerunner mission check my_mission.yaml --pilot my_mission.py
    """
    from offboard.mission import load_mission

    loaded = load_mission(file, pilot)
    with_pilot = f" and {pilot}" if pilot is not None else ""
    print(
        f"{file}{with_pilot}: good, mission '{loaded.name}' with {len(loaded.leaves)} states, {loaded.rules}"
    )
    for remark in loaded.remarks:
        if remark.place.file == str(file):
            print(remark)
    return 0


@app.command
def export(
    mission: Annotated[str, Parameter(help="name or file")],
    *,
    format: Annotated[  # noqa: A002 - the option's name
        Literal["scxml", "mermaid"], Parameter(help="W3C State Chart XML, or Mermaid's language")
    ] = "scxml",
    pilot: NamedPilot = None,
    out: Annotated[Path | None, Parameter(help="file to write; it must not exist")] = None,
) -> int:
    """Print or write a mission for other programs: as SCXML for statechart editors, or as a Mermaid diagram.

    **Examples**

        framerunner mission export frame_challenge --format scxml --out frame_challenge.scxml

        framerunner mission export my_mission.yaml --format mermaid
    """
    from offboard.authoring import export_scxml
    from offboard.mission import load_mission, mermaid

    loaded = load_mission(mission, pilot)
    text = export_scxml(loaded.spec) if format == "scxml" else mermaid(loaded)
    _print_or_write(text, out)
    return 0


@app.command(name="import")
def import_(
    file: Annotated[Path, Parameter(help="SCXML file")],
    *,
    pilot: NamedPilot = None,
    out: Annotated[Path | None, Parameter(help="mission file to write; it must not exist")] = None,
) -> int:
    """Print or write the mission that an SCXML file describes, and say what the checker finds in it.

    What a mission cannot express or the checker refuses is told, one line for each, and nothing is written.

    **Examples**

        framerunner mission import chart.scxml

        framerunner mission import chart.scxml --out my_mission.yaml
    """
    from offboard.authoring import Document, check_document, import_scxml
    from offboard.pilot_file import class_of, find_pilot

    pilot_class = class_of(None if pilot is None else find_pilot(pilot))
    text = import_scxml(_read(file), file.stem)
    findings = check_document(Document.from_text(text, out or file.with_suffix(".yaml")), pilot_class)
    errors = [found.message for found in findings if found.severity == "error"]
    if errors:
        advice = (
            "correct it there"
            if pilot is not None
            else "correct it there, or give --pilot for names of your own"
        )
        raise SettingError("\n".join((*errors, f"{file}: nothing was written; {advice}")))
    _print_or_write(text, out)
    for found in findings:
        say(f"{found.file}:{found.line}: {found.severity}: {found.message}")
    return 0


def _read(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            return file.read(MAX_IMPORT_BYTES + 1)
    except OSError as error:
        raise SettingError(f"{path}: cannot be read ({error.strerror}); name an SCXML file") from None


def _print_or_write(text: str, out: Path | None) -> None:
    if out is None:
        print(text, end="")
        return
    try:
        make_file(out, text)
    except FileExistsError:
        raise SettingError(f"{out} is there already and is left as it is; choose another --out") from None
    except OSError as error:
        raise SettingError(f"{out}: cannot be written ({error.strerror}); choose another --out") from None
    print(f"written: {out}")


@app.command
def new(
    name: Annotated[str, Parameter(help="of the mission: small letters, digits and _")],
    *,
    python: Annotated[bool, Parameter(help="with a Python file that adds a primitive of its own")] = False,
    out: Annotated[Path, Parameter(help="folder to write to")] = Path("."),
) -> int:
    """Create a mission: write a small one that flies, with comments that explain it.

    Nothing is ever overwritten.

    **Examples**

        framerunner mission new my_mission

        framerunner mission new my_mission --python --out missions
    """
    from offboard.mission import new_mission

    if not _NAME.fullmatch(name):
        raise SettingError(
            f"NAME '{name}': use small letters, digits and _, a letter first, such as 'my_mission'"
        )
    files = new_mission(name, out, python=python)
    _write(files)
    print(f"written: {', '.join(map(str, files.texts))}\n")
    print(f"  framerunner mission check {files.arguments}")
    print(f"  framerunner fly test-case-1 --lockstep --mission {files.arguments}\n")
    print("The first says whether it is good, the second flies it. The comments in the file explain it.")
    print("It crosses red only, so the referee will judge the flight aborted: add green and blue yourself.")
    return 0


def _write(files: NewMission) -> None:
    """Write all files or, if one of them is there already, none."""
    for path in files.texts:
        if path.exists():
            raise SettingError(f"{path} is there already and is left as it is; choose another NAME or --out")
    path = files.mission.parent
    try:
        path.mkdir(parents=True, exist_ok=True)
        for path, text in files.texts.items():
            make_file(path, text)
    except OSError as error:
        raise SettingError(f"{path}: cannot be written ({error.strerror}); choose another --out") from None
