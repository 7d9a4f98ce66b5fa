"""`framerunner mission`: missions, which are statecharts."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Literal

from cyclopts import App

from framerunner.commands import NamedPilot, say, write_new
from framerunner.errors import SettingError

app = App(name="mission", help="List, show, check, create, export and import missions.")

MAX_IMPORT_BYTES = 1_000_000
_NAME = re.compile(r"[a-z][a-z0-9_]{0,59}")


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
def show(mission: str, *, pilot: NamedPilot = None) -> int:
    """Print a mission's diagram in Mermaid's language (paste it into any Markdown page or mermaid.live).

    **Examples**

        framerunner mission show explorer

        framerunner mission show my_mission.yaml > my_mission.mmd

        framerunner mission show my_mission.yaml --pilot my_mission.py

    Args:
        mission: name or file
        pilot: primitives of your own.
    """
    from offboard.mission import load_mission, mermaid

    print(mermaid(load_mission(mission, pilot)))
    return 0


@app.command
def check(file: Path, *, pilot: NamedPilot = None) -> int:
    """Say whether a mission file is good, or every fault with its line; then what may go wrong with it.

    A warning names a part that does nothing, such as a transition that is never taken; advice, a state that
    may wait for ever. Missions with warnings and advice are flown.

    **Examples**

        framerunner mission check my_mission.yaml

        framerunner mission check my_mission.yaml --pilot my_mission.py

    Args:
        file: YAML file
        pilot: primitives of your own.
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
    mission: str,
    *,
    format: Literal["scxml", "mermaid"] = "scxml",  # noqa: A002 - the option's name
    pilot: NamedPilot = None,
    out: Path | None = None,
) -> int:
    """Print or write a mission for other programs: as SCXML for statechart editors, or as a Mermaid diagram.

    **Examples**

        framerunner mission export frame_challenge --format scxml --out frame_challenge.scxml

        framerunner mission export my_mission.yaml --format mermaid

    Args:
        mission: name or file
        format: W3C State Chart XML, or Mermaid's language
        pilot: primitives of your own.
        out: file to write; it must not exist
    """
    from offboard.authoring import export_scxml
    from offboard.mission import load_mission, mermaid

    loaded = load_mission(mission, pilot)
    text = export_scxml(loaded.spec) if format == "scxml" else mermaid(loaded)
    _print_or_write(text, out)
    return 0


@app.command(name="import")
def import_(
    file: Path,
    *,
    pilot: NamedPilot = None,
    out: Path | None = None,
) -> int:
    """Print or write the mission that an SCXML file describes, and say what the checker finds in it.

    What a mission cannot express or the checker refuses is told, one line for each, and nothing is written.

    **Examples**

        framerunner mission import chart.scxml

        framerunner mission import chart.scxml --out my_mission.yaml

    Args:
        file: SCXML file
        pilot: primitives of your own.
        out: mission file to write; it must not exist
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
    write_new({out: text})
    print(f"written: {out}")


@app.command
def new(
    name: str,
    *,
    python: bool = False,
    out: Path = Path("."),
) -> int:
    """Create a mission: write a small one that flies, with comments that explain it.

    Nothing is ever overwritten.

    **Examples**

        framerunner mission new my_mission

        framerunner mission new my_mission --python --out missions

    Args:
        name: of the mission: small letters, digits and _
        python: with a Python file that adds a primitive of its own
        out: folder to write to
    """
    from offboard.mission import new_mission

    if not _NAME.fullmatch(name):
        raise SettingError(
            f"NAME '{name}': use small letters, digits and _, a letter first, such as 'my_mission'"
        )
    files = new_mission(name, out, python=python)
    write_new(files.texts, "NAME or --out", makes_folder=True)
    print(f"written: {', '.join(map(str, files.texts))}\n")
    print(f"  framerunner mission check {files.arguments}")
    print(f"  framerunner fly test-case-1 --lockstep --mission {files.arguments}\n")
    print("The first says whether it is good, the second flies it. The comments in the file explain it.")
    print("It crosses red only, so the referee will judge the flight aborted: add green and blue yourself.")
    return 0
