"""The types of the messages, with which `tsc` checks the pages' scripts, are those of the models."""

import runpy
from pathlib import Path

WEB = Path(__file__).parents[3] / "web"


def test_the_committed_types_are_those_of_the_models():
    made = runpy.run_path(str(WEB / "page_types.py"))["page_types"]()
    assert made == (WEB / "src" / "lib" / "messages.d.ts").read_text(encoding="utf-8"), "run: make page-types"
