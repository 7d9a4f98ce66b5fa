"""All pools give the same rows, and a flight that ends its process does not stop the others."""

import itertools

import pytest

from framerunner.errors import SettingError
from framerunner.evaluation import backends
from framerunner.evaluation.backends import Pool, check_pool
from framerunner.evaluation.plan import plan_files
from framerunner.evaluation.rows import csv_text
from framerunner.evaluation.runner import fly_all, fly_alone
from framerunner.extras import install_advice
from framerunner.flying.plan import FlightPlan
from offboard.mission import load_mission
from offboard.pilot_file import PilotFile
from tests.framerunner.evaluation.flights import short_scenario, write_scenarios

SEEDS = (1, 2, 3, 4)
DEADLY = """
import os
import signal

from offboard.pilot import Pilot


class Deadly(Pilot):
    def hover(self):
        super().hover()
        if abs(self.imu.x - {x_m}) < 0.1:  # of its start, by which it recognises the scenario
            {end}
"""


@pytest.fixture(scope="module")
def plan(tmp_path_factory):
    folder = write_scenarios(tmp_path_factory.mktemp("plan") / "short", SEEDS)
    return plan_files([str(folder)], load_mission("frame_challenge"))


def table(rows):
    return csv_text(sorted(rows, key=lambda row: row.scenario))


@pytest.fixture(scope="module")
def alone(plan):
    """The rows of one process."""
    return table(fly_all(plan.tasks(), Pool(jobs=1)))


def test_two_processes_fly_as_one_does(plan, alone):
    assert table(fly_all(plan.tasks(), Pool(jobs=2))) == alone
    backwards = reversed(list(plan.tasks()))
    assert table(fly_all(backwards, Pool(jobs=2))) == alone


def test_a_dask_cluster_of_processes_flies_as_one_does(plan, alone, tmp_path):
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=2,
        threads_per_worker=2,
        processes=True,
        dashboard_address=None,
        local_directory=str(tmp_path),
        silence_logs=50,
    ) as cluster:
        pool = Pool("dask", address=cluster.scheduler_address)
        assert table(fly_all(plan.tasks(), pool)) == alone


@pytest.mark.parametrize("jobs", [1, 2])
def test_flights_are_sent_only_as_others_end(jobs):
    mission = load_mission("frame_challenge")
    seeds = itertools.count()
    endless = (FlightPlan(short_scenario(next(seeds), 0.2), mission) for _ in itertools.repeat(None))
    rows = fly_all(endless, Pool(jobs=jobs))
    names = {next(rows).scenario for _ in range(3)}
    rows.close()
    assert len(names) == 3
    assert next(seeds) <= 3 + 4 * jobs


def deadly(victim, end):
    """A mission that ends its process when it flies one of the scenarios."""
    return load_mission(
        "frame_challenge", PilotFile("deadly.py", DEADLY.format(x_m=victim.start.x_m, end=end))
    )


def test_a_flight_that_ends_its_process_is_found_and_the_others_fly(plan, alone):
    victim = plan.scenarios[1]
    mission = deadly(victim, "os.kill(os.getpid(), signal.SIGKILL)")
    rows = list(fly_all((FlightPlan(each, mission) for each in plan.scenarios), Pool(jobs=2)))
    assert len(rows) == len(plan)
    (dead,) = [row for row in rows if row.verdict == "error"]
    assert dead.scenario == victim.name
    assert dead.reason == "WorkerDiedError: the flight ended its process (signal SIGKILL)"
    others = [line for line in alone.splitlines() if not line.startswith(f"{victim.name},")]
    assert [line for line in table(rows).splitlines() if not line.startswith(f"{victim.name},")] == others


def test_a_flight_alone_may_end_its_process(plan):
    victim = plan.scenarios[0]
    row = fly_alone(FlightPlan(victim, deadly(victim, "os._exit(7)")))
    assert (row.verdict, row.ended_in) == ("error", "WorkerDiedError")
    assert row.reason.endswith("(exit code 7)")


def test_a_flight_alone_is_the_same_flight(plan, alone):
    (task,) = itertools.islice(plan.tasks(), 1)
    assert table([fly_alone(task)]).splitlines() == alone.splitlines()[:2]


@pytest.mark.parametrize(
    ("pool", "message"),
    [
        (Pool("cray"), "--backend cray: is not known; use loky, dask, ray"),
        (Pool(jobs=0), "--jobs 0: must be 1 or more"),
        (Pool("dask"), "--backend dask: needs the scheduler's address"),
        (Pool(address="tcp://10.0.0.1:8786"), "--address tcp://10.0.0.1:8786: is for a cluster"),
    ],
)
def test_contradicting_settings_of_a_pool_are_refused(pool, message):
    with pytest.raises(SettingError) as caught:
        check_pool(pool)
    assert str(caught.value).startswith(message)


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:1", "nonsense://x", "tcp://127.0.0.1:notaport"])
def test_a_scheduler_that_does_not_answer_is_reported(plan, monkeypatch, address):
    pytest.importorskip("distributed")
    monkeypatch.setattr(backends, "CONNECT_S", 0.5)
    with pytest.raises(SettingError, match=rf"--address {address}: no Dask scheduler there"):
        next(fly_all(plan.tasks(), Pool("dask", address=address)))


def test_a_package_that_is_missing_is_named(plan, monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, "ray", None)
    monkeypatch.setitem(sys.modules, "distributed", None)
    for backend in ("ray", "dask"):
        with pytest.raises(ModuleNotFoundError) as missing:
            next(fly_all(plan.tasks(), Pool(backend, address="tcp://10.0.0.1:1")))
        assert f"pip install 'framerunner[{backend}]'" in install_advice(missing.value.name)
