"""A mission to begin with, written for whoever has not seen one."""

from __future__ import annotations

import shlex
from dataclasses import dataclass
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined

TEMPLATES = Path(__file__).parent / "templates"


@dataclass(frozen=True, slots=True)
class Starter:
    """Files of a new mission.

    Attributes:
        mission: the mission file.
        pilot: the Python file that goes with it, if there is one.
        texts: what is to stand in each.
    """

    mission: Path
    pilot: Path | None
    texts: dict[Path, str]

    @property
    def arguments(self) -> str:
        """The files as they stand in a command after the mission's place."""
        option = "" if self.pilot is None else f" --pilot {shlex.quote(str(self.pilot))}"
        return f"{shlex.quote(str(self.mission))}{option}"


def starter(name: str, folder: Path, *, python: bool = False) -> Starter:
    """Compose a new mission; nothing is written.

    Args:
        name: of the mission, small letters, digits and _.
        folder: where it will stand.
        python: with a Python file.
    """
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
    words = {
        "name": name,
        "python": python,
        "yaml": mission.name,
        "option": "" if pilot is None else f" --pilot {pilot.name}",
    }
    texts = {mission: templates.get_template("mission.yaml.j2").render(words)}
    if pilot is not None:
        texts[pilot] = templates.get_template("pilot.py.j2").render(words)
    return Starter(mission, pilot, texts)
