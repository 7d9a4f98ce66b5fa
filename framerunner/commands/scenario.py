"""`framerunner scenario`: what can be flown."""

from __future__ import annotations

import json
from pathlib import Path

from cyclopts import App

from framerunner.commands import WholeNumber, say, write_new
from framerunner.errors import SettingError

app = App(name="scenario", help="List, show and check scenarios.")


@app.command(name="list")
def list_() -> int:
    """List the scenarios that come with the package.

    **Example**

        framerunner scenario list
    """
    from scenarios.loader import list_scenarios, load_scenario

    for name in list_scenarios():
        description = " ".join(load_scenario(name).description.split())
        print(f"{name:14s} {description}")
    return 0


@app.command
def show(
    scenario: str,
    *,
    out: Path | None = None,
) -> int:
    """Draw a scenario from above and from the side, and print it.

    **Examples**

        framerunner scenario show test-case-1

        framerunner scenario show my.yaml --out my.png

    Args:
        scenario: name or file
        out: PNG file to write; by default `<name>.png`
    """
    from framerunner.runs import check_plot_format
    from scenarios.loader import dump_yaml, load_scenario

    loaded = load_scenario(scenario)
    path = out or Path(f"{loaded.name}.png")
    check_plot_format(path)
    from framerunner.runs.plots import draw_scenario, save_figure

    save_figure(draw_scenario(loaded), path)
    print(dump_yaml(loaded), end="")
    say(f"drawn to {path}")
    return 0


@app.command
def check(file: Path) -> int:
    """Say whether a scenario file is good, or what is wrong and where.

    **Example**

        framerunner scenario check my.yaml

    Args:
        file: YAML file
    """
    from scenarios.loader import load_scenario

    loaded = load_scenario(file)
    print(f"{file}: good, scenario '{loaded.name}' with {loaded.contents}")
    return 0


@app.command
def schema() -> int:
    """Print the JSON Schema of scenario files, for editors.

    **Example**

        framerunner scenario schema > scenario.schema.json
    """
    from scenarios.loader import json_schema

    print(json.dumps(json_schema(), indent=2))
    return 0


@app.command
def random(
    *,
    level: str,
    seed: WholeNumber,
    out: Path | None = None,
) -> int:
    """Draw a scenario at random.

    **Examples**

        framerunner scenario random --level calm --seed 17

        framerunner scenario random --level calm --seed 17 --out calm-17.yaml

    Args:
        level: level of difficulty, name or file
        seed: a whole number; the same seed gives the same scenario
        out: YAML file to write; by default it is printed
    """
    from scenarios.loader import dump_yaml
    from scenarios.random_scenarios import load_level, random_scenario

    drawn = random_scenario(load_level(level), seed)
    if out is None:
        print(dump_yaml(drawn), end="")
        return 0
    write_new({out: dump_yaml(drawn)})
    say(f"scenario '{drawn.name}' written to {out}")
    return 0


@app.command
def markers(
    scenario: str,
    *,
    out: Path = Path("base-markers.pdf"),
) -> int:
    """Make the printed markers of a scenario's base as PDF, true to size, with where each belongs.

    With `base: {marker: {edge_m: 0.27}}` in its file, the drone's camera reads them.

    **Example**

        framerunner scenario markers my.yaml --out base-markers.pdf

    Args:
        scenario: name or file
        out: PDF file to write
    """
    from scenarios.loader import load_scenario

    loaded = load_scenario(scenario)
    if out.exists():
        raise SettingError(f"{out} is there already and is left as it is; choose another --out")
    from framerunner.runs.marker_sheets import write_marker_sheets

    say(f"{out}: {write_marker_sheets(loaded, out)} pages; print them at 100 %")
    return 0
