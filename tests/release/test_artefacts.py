"""What a release has: built once, from the sdist. `make release-check` installs it and flies."""

import tarfile
import zipfile

import pytest
from packaging.requirements import Requirement

from tests.release.artefacts import build, metadata_defects, sdist_defects, wheel_defects
from tests.release.run_installed import python_versions
from tests.release.sizes import (
    BEGIN,
    DEPENDENCIES,
    DOCUMENT,
    END,
    EXTRAS,
    NOT_FOR_USERS,
    PROJECT,
    Environment,
)


@pytest.fixture(scope="module")
def artefacts(tmp_path_factory):
    return build(tmp_path_factory.mktemp("release"))


def test_the_wheel_has_the_six_packages_with_their_data_and_nothing_else(artefacts):
    assert wheel_defects(artefacts.wheel) == []


def test_the_sdist_has_what_the_wheel_is_built_from(artefacts):
    assert sdist_defects(artefacts.sdist) == []


def test_the_metadata_is_what_pyproject_says(artefacts):
    assert metadata_defects(artefacts.wheel) == []


def test_a_file_that_is_missing_strange_or_changed_is_found(artefacts, tmp_path):
    changed = tmp_path / artefacts.wheel.name
    with zipfile.ZipFile(artefacts.wheel) as old, zipfile.ZipFile(changed, "w", zipfile.ZIP_DEFLATED) as new:
        for name in old.namelist():
            if name != "vision/py.typed":
                new.writestr(name, old.read(name) + b"#" * (name == "sitl/world.py"))
        new.writestr("tests/test_world.py", "")
    assert wheel_defects(changed) == [
        "top-level packages: firmware_py, framerunner, offboard, scenarios, sitl, tests, vision",
        "not in the wheel: vision/py.typed",
        "in the wheel, but not in the repository: tests/test_world.py",
        "in the wheel with other contents: sitl/world.py",
    ]


def test_an_sdist_without_a_readme_is_found(artefacts, tmp_path):
    changed = tmp_path / artefacts.sdist.name
    with tarfile.open(artefacts.sdist) as old, tarfile.open(changed, "w:gz") as new:
        for member in old.getmembers():
            if not member.name.endswith("/README.md"):
                new.addfile(member, old.extractfile(member) if member.isfile() else None)
    assert sdist_defects(changed) == ["not in the sdist: README.md"]


def test_every_dependency_and_extra_is_explained_and_measured():
    assert sorted(DEPENDENCIES) == sorted(Requirement(each).name for each in PROJECT["dependencies"])
    assert set(EXTRAS) == set(PROJECT["optional-dependencies"]) - NOT_FOR_USERS
    text = DOCUMENT.read_text(encoding="utf-8")
    written = text[text.index(BEGIN) : text.index(END)]
    assert [name for name in DEPENDENCIES if f"\n| {name} | " not in written] == []
    assert [name for name in EXTRAS if f"\n| `{name}` | " not in written] == []


def test_what_only_a_package_needs_counts_for_it(tmp_path):
    """a needs b and, with its extra, c; both b and c need d."""
    needs = {"a": ["b", "c ; extra == 'more'"], "b": ["d"], "c": ["d"], "d": []}
    for name, lines in needs.items():
        (tmp_path / f"{name}.py").write_bytes(b"#" * 500_000)
        folder = tmp_path / f"{name}-1.dist-info"
        folder.mkdir()
        required = "".join(f"Requires-Dist: {line}\n" for line in lines)
        (folder / "METADATA").write_text(f"Metadata-Version: 2.4\nName: {name}\nVersion: 1\n{required}")
        (folder / "RECORD").write_text(f"{name}.py,,\n")
    environment = Environment(tmp_path)
    assert environment.needed("a") == {"a", "b", "d"}
    assert environment.needed("a[more]") == {"a", "b", "c", "d"}
    assert environment.needed("a", without="b") == {"a"}
    assert environment.needed("a[more]", without="b") == {"a", "c", "d"}
    assert environment.mb(environment.needed("a")) == 1.5


def test_a_python_that_is_not_at_hand_is_none():
    assert python_versions(("3.999",)) == {"3.999": None}
