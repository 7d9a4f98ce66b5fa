"""What a release has: built once, from the sdist. `make release-check` installs it and flies."""

import tarfile
import zipfile

import pytest

from tests.release.artefacts import build, metadata_defects, sdist_defects, wheel_defects


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
