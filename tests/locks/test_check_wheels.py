"""Which requirements of a lock file a Raspberry Pi installs."""

from pathlib import Path

import pytest

from tests.locks.check_wheels import SYSTEMS, requirements_on

LOCKS = Path(__file__).parents[2] / "locks"


@pytest.mark.parametrize("system", SYSTEMS, ids=lambda each: each.python)
def test_markers_are_those_of_the_pi(system):
    text = (
        "a==1 ; platform_machine != 'aarch64' \\\n    --hash=sha256:1\n"
        "b==2 ; python_full_version < '3.12' \\\n    --hash=sha256:2\n    --hash=sha256:3\n    # via a\n"
        "b==3 ; python_full_version >= '3.12' \\\n    --hash=sha256:4\n"
    )
    found = requirements_on(text, system)
    expected = {"3.11": "b==2 \\\n    --hash=sha256:2 \\\n    --hash=sha256:3\n", "3.13": "b==3"}
    assert list(found) == ["b"]
    assert found["b"].startswith(expected[system.python].split(" ")[0])


@pytest.mark.parametrize("lock", ["framerunner.txt", "small.txt"])
def test_a_companion_computer_installs_no_simulator_but_all_else(lock):
    found = requirements_on((LOCKS / lock).read_text(), SYSTEMS[0])
    assert "jsbsim" not in found
    assert {"mavsdk", "pymavlink", "opencv-python-headless", "numpy", "scipy"} <= set(found)
