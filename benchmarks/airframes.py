"""Draws airframes that nothing was chosen by, and levels that are flown on them.

    python -m benchmarks.airframes --out runs/airframes --count 3 --seed 1
    framerunner evaluate --level runs/airframes/calm-drawn-1.yaml --count 50

Mass, inertia, drag, motors, limits of tilt and the weights of the stabiliser's design, from which its
velocity gains follow, are drawn within `RANGES`; the size stays that of the abejorro, which fits through the
frames.
"""

from __future__ import annotations

import argparse
from math import exp, log
from pathlib import Path
from random import Random

import yaml

from framerunner.vehicle.airframe import Airframe, load_airframe
from scenarios.random_scenarios import load_level

RANGES = {
    "mass_kg": (0.2, 1.0),
    "inertia of an abejorro of that mass": (0.5, 1.6),
    "time constant of the motors, s": (0.015, 0.06),
    "drag in plan by mass, 1/m": (0.05, 2.2),
    "drag along the thrust by that": (1.0, 3.5),
    "drag of tilting by that of an abejorro of that inertia": (0.05, 1.2),
    "velocity_horizontal_m_s": (0.35, 1.3),
    "velocity_vertical_m_s": (0.25, 0.7),
    "tilt_rad": (0.4, 0.9),
    "roll_pitch_rate_rad_s": (3.0, 7.0),
    "yaw_rate_rad_s": (0.4, 0.8),
}
"""Of what is drawn, with equal chances on a logarithmic scale."""
TILT_LIMITS_RAD = (
    0.52,
    0.75,
)  # one of them: with the first, velocities are followed by the law for small tilts


def drawn_airframe(seed: int) -> Airframe:
    """The airframe of a seed."""
    random, base = Random(seed), load_airframe("abejorro")
    drawn = {name: exp(random.uniform(log(low), log(high))) for name, (low, high) in RANGES.items()}
    mass_kg = drawn["mass_kg"]
    size = mass_kg / base.mass_kg
    heavier = size * drawn["inertia of an abejorro of that mass"]
    drag = mass_kg * drawn["drag in plan by mass, 1/m"]
    tilting = heavier * drawn["drag of tilting by that of an abejorro of that inertia"]
    roll, pitch, yaw = base.drag.moment_nm_s2
    weights = {name: drawn[name] for name in RANGES if name in type(base.stabiliser).model_fields}
    return Airframe.model_validate(
        base.model_dump()
        | {
            "name": f"drawn-{seed}",
            "mass_kg": mass_kg,
            "inertia_kg_m2": tuple(heavier * inertia for inertia in base.inertia_kg_m2),
            "motor": base.motor.model_dump() | {"time_constant_s": drawn["time constant of the motors, s"]},
            "drag": {
                "force_n_s2_m2": (drag, drag, drag * drawn["drag along the thrust by that"]),
                "moment_nm_s2": (tilting * roll, tilting * pitch, heavier * yaw),
            },
            "limits": base.limits.model_dump() | {"tilt_rad": random.choice(TILT_LIMITS_RAD)},
            "stabiliser": base.stabiliser.model_dump() | weights,
            "parameters": dict(base.parameters)
            | {"MPC_THR_HOVER": size * float(base.parameters["MPC_THR_HOVER"])},
        }
    )


def write(folder: Path, seed: int, level: str) -> Path:
    """Write an airframe and a level that is flown on it; the path of the level."""
    folder.mkdir(parents=True, exist_ok=True)
    airframe = drawn_airframe(seed)
    path = folder.resolve() / f"{airframe.name}.yaml"
    path.write_text(yaml.safe_dump(airframe.model_dump(mode="json"), sort_keys=False), encoding="utf-8")
    changed = {"name": f"{level}-{airframe.name}", "airframe": str(path)}
    declared = load_level(level).model_dump(mode="json", exclude_unset=True) | changed
    written = folder / f"{changed['name']}.yaml"
    written.write_text(yaml.safe_dump(declared, sort_keys=False), encoding="utf-8")
    return written


def main() -> None:
    """Write them and print the levels' names."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--out", type=Path, required=True, help="folder")
    parser.add_argument("--count", type=int, default=3)
    parser.add_argument("--seed", type=int, default=1, help="of the first; each next one has one more")
    parser.add_argument("--level", default="calm", help="that is flown")
    options = parser.parse_args()
    for seed in range(options.seed, options.seed + options.count):
        print(write(options.out, seed, options.level))


if __name__ == "__main__":
    main()
