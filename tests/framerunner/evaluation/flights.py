"""Short flights and made-up rows for the tests of evaluations."""

from framerunner.evaluation.rows import EvaluationRow
from scenarios.loader import dump_yaml
from scenarios.random_scenarios import load_level, random_scenario

LIMIT_S = 1.0


def short_scenario(seed, limit_s=LIMIT_S):
    return random_scenario(load_level("calm"), seed).model_copy(update={"try_limit_s": limit_s})


def write_scenarios(folder, seeds=(1, 2, 3), limit_s=LIMIT_S):
    """A folder of scenarios whose tries end soon."""
    folder.mkdir(parents=True)
    for seed in seeds:
        scenario = short_scenario(seed, limit_s)
        (folder / f"{scenario.name}.yaml").write_text(dump_yaml(scenario), encoding="utf-8")
    return folder


def made_row(scenario="calm-1", verdict="clean", **values):
    """A row; what is not given is as of a flight that landed."""
    landed = verdict in ("clean", "completed")
    usual = {
        "mission": "frame_challenge",
        "seed": 0,
        "reason": f"{verdict} after 90.0 s",
        "frames_crossed": ("red", "green", "blue") if landed else ("red",),
        "crossing_times_s": (20.0, 40.0, 60.0) if landed else (20.0,),
        "crossing_offsets_m": (0.01, 0.02, 0.03) if landed else (0.01,),
        "crossing_sides": ("front", "back", "front") if landed else ("front",),
        "try_time_s": 90.0 if landed else 180.0,
        "total_time_s": 90.0 if landed else 180.0,
        "landed_on_base": landed,
        "landing_error_m": 0.02 if landed else None,
        "path_length_m": 30.0,
        "longest_gap_s": 0.004,
        "mission_state": "landing.stop" if landed else "green.turning",
        "ended": "finished" if landed else "timed out",
        "seconds_in_state": {"turning": 10.0, "crossing": 4.0},
        "judged_by": "truth",
        "state_sha256": "0" * 64,
        "version": "0.1.0",
    }
    return EvaluationRow(scenario=scenario, verdict=verdict, **{**usual, **values})
