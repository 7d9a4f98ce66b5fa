"""Own scenarios beside the installed ones."""

import pytest

from framerunner.monitoring.scenario_library import ScenarioLibrary
from scenarios.loader import dump_yaml, list_scenarios, load_scenario
from scenarios.models import ScenarioError


def write(path, name):
    own = load_scenario("test-case-2").model_copy(update={"name": name})
    path.write_text(dump_yaml(own), encoding="utf-8")
    return own


def test_own_files_are_found_by_the_name_in_them(tmp_path):
    folder, file = tmp_path / "mine", tmp_path / "one.yaml"
    library = ScenarioLibrary([folder, file, tmp_path / "absent"])
    assert library.names() == list_scenarios()
    folder.mkdir()
    own = write(folder / "a file.yaml", "school-3")
    (folder / "broken.yaml").write_text("name: [", encoding="utf-8")
    write(file, "single")
    assert library.names() == ["school-3", "single", *list_scenarios()]
    assert library.load("school-3") == own
    assert library.argument("school-3") == str(folder / "a file.yaml")
    assert (library.argument("calm-3"), library.load("calm-3")) == ("calm-3", load_scenario("calm-3"))
    write(folder / "a file.yaml", "school-44")
    with pytest.raises(ScenarioError, match="school-3"):
        library.load("school-3")
    assert library.load("school-44").name == "school-44"
