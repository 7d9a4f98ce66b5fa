from pathlib import Path

from firmware_py.parameters import DECLARATIONS
from firmware_py.parameters.reference import reference_page

PAGE = Path(__file__).parents[2] / "docs" / "parameters.md"


def test_the_page_is_what_the_declarations_make():
    assert PAGE.read_text(encoding="utf-8") == reference_page(), "run `make parameters`"


def test_every_parameter_has_its_row():
    rows = [line for line in reference_page().splitlines() if line.startswith("| `")]
    assert sorted(row.split("`")[1] for row in rows) == [declared.name for declared in DECLARATIONS]
