"""Runs of one flight, half of them beside others in other processes: one hash."""

from math import inf, nextafter

from framerunner.evaluation.backends import Pool
from framerunner.evaluation.runner import fly_all, fly_task
from framerunner.flying.lockstep import StateHash
from framerunner.flying.plan import FlightPlan
from offboard.mission import load_mission
from scenarios.loader import load_scenario
from scenarios.models import TrueState

MISSION = load_mission("frame_challenge")
LIMIT_S = 5.0


def task(number, name="test-case-1"):
    """The same flight under another name: a name is no input of the physics."""
    update = {"name": f"run-{number}", "try_limit_s": LIMIT_S}
    return FlightPlan(load_scenario(name).model_copy(update=update), MISSION)


def test_runs_of_one_flight_have_one_hash():
    alone = [fly_task(task(number)) for number in range(12)]
    ours = [task(number) for number in range(12, 24)]
    others = [task(number, "test-case-3") for number in range(24, 30)]
    mixed = [each for pair in zip(ours[::2], others, ours[1::2], strict=True) for each in pair]
    together = list(fly_all(mixed, Pool(jobs=2)))
    own = {each.scenario.name for each in ours}
    hashes = {row.state_sha256 for row in alone} | {
        row.state_sha256 for row in together if row.scenario in own
    }
    assert len(together) == 18
    assert len(hashes) == 1
    assert {row.state_sha256 for row in together if row.scenario not in own}.isdisjoint(hashes)


def hash_of(numbers):
    x, y, z, u, v, w, *attitude = numbers[1:11]
    state_hash = StateHash()
    state_hash.add(TrueState(int(numbers[0]), (x, y, z), (u, v, w), tuple(attitude), bool(numbers[11])))
    return state_hash.hexdigest()


def test_every_number_of_a_state_is_in_the_hash_to_the_last_bit():
    numbers = [float(number) for number in range(1, 13)]
    others = [[*numbers[:at], nextafter(numbers[at], inf), *numbers[at + 1 :]] for at in range(1, 11)]
    others += [[2.0, *numbers[1:]], [*numbers[:11], 0.0]]
    assert len({hash_of(numbers), *map(hash_of, others)}) == 13
