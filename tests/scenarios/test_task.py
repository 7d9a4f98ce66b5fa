"""What an app may know of a scenario."""

import json
from dataclasses import asdict

from scenarios.loader import load_scenario
from scenarios.task import Task


def numbers(value):
    if isinstance(value, dict):
        return {number for part in value.values() for number in numbers(part)}
    if isinstance(value, list):
        return {number for part in value for number in numbers(part)}
    return {value} if isinstance(value, float) else set()


def test_a_task_has_no_number_of_the_layout():
    scenario = load_scenario("crowded-17")
    written = scenario.model_dump(mode="json")
    placed = [each for name in ("frames", "decoys", "poles", "walls") for each in written[name]]
    places = {each[axis] for each in placed for axis in ("x_m", "y_m", "yaw_rad") if axis in each}
    told = json.loads(Task.of(scenario).model_dump_json())
    assert len(places) > 10 and not places & numbers(told)
    assert told["colours"] == ["red", "green", "blue"] and told["try_limit_s"] == 180.0
    assert told["shapes"]["red"] == asdict(scenario.frames[0].shape)
    assert Task.of(scenario, show_layout=True).scenario == scenario


def test_another_layout_has_another_mark():
    marks = {Task.of(load_scenario(f"calm-{seed}")).layout_mark for seed in range(3)}
    assert len(marks) == 3 and all(len(mark) == 4 for mark in marks)
