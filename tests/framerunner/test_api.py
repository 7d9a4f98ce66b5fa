"""The public interface: what `import framerunner` promises, and how long it takes."""

import asyncio
import inspect
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from pydantic import BaseModel

import framerunner
from framerunner.cli import run

STORED = Path(__file__).with_name("public_api.txt")
HEAVY = ("aiohttp", "cv2", "jsbsim", "mavsdk", "numpy", "pydantic", "scipy", "yaml")


def described(name):
    """A public name with what else is promised of it: its parameters, or its attributes and methods.

    What files hold has schemas of its own, and a mission's chart is no interface.
    """
    value = getattr(framerunner, name)
    if isinstance(value, type) and not issubclass(value, BaseModel) and name != "Mission":
        members = {*vars(value), *getattr(value, "__annotations__", {})}
        return [name, *(f"{name}.{each}" for each in sorted(members) if not each.startswith("_"))]
    if inspect.isfunction(value):
        kinds = {inspect.Parameter.KEYWORD_ONLY: "=", inspect.Parameter.VAR_POSITIONAL: "*"}
        parameters = inspect.signature(value).parameters.values()
        return [f"{name}({', '.join(kinds.get(each.kind, '') + each.name for each in parameters)})"]
    return [name]


def test_the_public_interface_is_the_stored_one():
    """A line that changes or goes breaks programs of others; a new one is a new promise."""
    found = [line for name in sorted(framerunner.__all__) for line in described(name)]
    assert found == STORED.read_text(encoding="utf-8").splitlines()


def test_every_public_name_is_documented():
    text = (Path(__file__).parents[2] / "docs" / "api.md").read_text(encoding="utf-8")
    assert [name for name in framerunner.__all__ if f"`{name}" not in text] == []


def test_the_import_loads_nothing_heavy():
    program = f"import framerunner, sys; print([each for each in {HEAVY} if each in sys.modules])"
    command = [sys.executable, "-X", "importtime", "-c", program]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"
    line = next(each for each in done.stderr.splitlines() if each.endswith("| framerunner"))
    assert int(line.split("|")[1]) < 100_000  # microseconds


def test_flights_and_simulators_need_no_extras():
    """As after an installation of `locks/small.txt`."""
    project = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text(encoding="utf-8"))
    extras = project["project"]["optional-dependencies"]
    needed = [each for name in ("monitor", "recording", "video") for each in extras[name]]
    packages = [re.match(r"[A-Za-z0-9-]+", each).group() for each in needed if "framerunner[" not in each]
    modules = [*packages, "multipart", "sqlalchemy", "PIL"]
    program = (
        f"import sys; sys.modules.update(dict.fromkeys({modules}))\n"
        "import framerunner; print([getattr(framerunner, name) for name in framerunner.__all__])"
    )
    subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)


def test_unknown_names_are_attribute_errors():
    with pytest.raises(AttributeError, match="has no attribute 'land'"):
        framerunner.land  # noqa: B018
    assert set(framerunner.__all__) <= set(dir(framerunner))


def test_a_flight_is_that_of_the_command_line(tmp_path):
    flown = framerunner.fly("test-case-1", "hover", seed=3)
    command = [
        "fly",
        "test-case-1",
        "--mission",
        "hover",
        "--lockstep",
        "--seed",
        "3",
        "--out",
        str(tmp_path),
    ]
    assert run(command) == 1
    (file,) = tmp_path.glob("*/result.json")
    result = framerunner.FlightResult.model_validate_json(file.read_bytes())
    assert flown.try_time_s > 10.0
    assert flown.state_sha256 == result.state_sha256


def test_a_flight_can_be_flown_within_an_event_loop():
    """As in a notebook."""

    async def cell():
        scenario = framerunner.load_scenario("calm-17").model_copy(update={"try_limit_s": 1.0})
        return framerunner.fly(scenario)

    assert asyncio.run(cell()).reason.startswith("timed out")


def test_an_evaluation_has_rows_in_order_and_their_summary():
    scenarios = [
        framerunner.random_scenario(framerunner.load_level("calm"), seed).model_copy(
            update={"try_limit_s": 1.0}
        )
        for seed in (3, 2)
    ]
    found = framerunner.evaluate(*scenarios, jobs=1)
    assert [row.scenario for row in found.rows] == ["calm-3", "calm-2"]
    assert (found.summary.flights, found.summary.landed.count) == (2, 0)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: framerunner.fly("nowhere"), 'unknown scenario "nowhere"'),
        (lambda: framerunner.fly("calm-17", "nothing"), "unknown mission 'nothing'"),
        (lambda: framerunner.fly("calm-17", pilot="nobody"), "nobody: unknown pilot; installed: none"),
        (
            lambda: framerunner.fly("calm-17", detector="none"),
            "unknown detector 'none'; installed packages add",
        ),
        (
            lambda: framerunner.fly("calm-17", framerunner.load_mission("hover"), pilot=framerunner.Pilot),
            "pilot: mission hover has one already",
        ),
        (lambda: framerunner.fly("calm-17", seed=-1), "seed -1: must be a whole number from 0 to"),
        (lambda: framerunner.fly("calm-17", seed="1"), "seed '1': must be a whole number from 0 to"),
        (lambda: framerunner.evaluate(level="calm", count=1.5), "count 1.5: must be a whole number"),
        (framerunner.evaluate, "say what to fly"),
        (lambda: framerunner.evaluate("calm-17", level="calm"), "--level calm: does not go with calm-17"),
        (lambda: framerunner.evaluate("calm-17", count=3), "--count 3: is for scenarios of a level"),
        (
            lambda: framerunner.fly("calm-17", detector=lambda calibration: 1 / 0),
            "detector <lambda> cannot be made: ZeroDivisionError",
        ),
        (
            lambda: framerunner.fly("calm-17", detector=lambda calibration: lambda image, time_us: 3),
            "detector <lambda> gave int; it must give Detections",
        ),
    ],
)
def test_what_cannot_be_flown_is_refused_in_one_line(call, words):
    with pytest.raises(framerunner.UserError, match=r"^[^\n]*$") as refused:
        call()
    assert words in str(refused.value)


def test_a_detector_of_ones_own_sees_instead_of_the_missions():
    seen = []

    def blind(calibration):
        def detect(image, time_us):
            seen.append((image.shape, time_us, calibration.width_px))
            return framerunner.Detections()

        return detect

    scenario = framerunner.load_scenario("calm-17").model_copy(update={"try_limit_s": 2.0})
    assert framerunner.fly(scenario, detector=blind).frames_crossed == ()
    shape, time_us, width_px = seen[0]
    assert (shape[1], shape[2]) == (width_px, 3)
    assert isinstance(time_us, int)
