"""The app holds no gain, mass, inertia or drag of an airframe: it identifies in flight what it needs."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import offboard
from firmware_py.control.design import design
from framerunner.vehicle.airframe import load_airframe

AIRFRAMES = ("abejorro", "racer-3in", "x500")
PERIOD_S = 0.004
DIGITS = 3  # numbers of fewer digits are everybody's
SAME = 5e-4  # share by which a rounded copy may differ


def test_no_number_in_offboard_is_one_of_a_shipped_airframe():
    known = {number: name for name in AIRFRAMES for number in map(abs, _numbers_of(name))}
    assert len(known) > 30
    found = {
        f"{path.name}:{line}: {literal} of {name}"
        for path in Path(offboard.__file__).parent.rglob("*.py")
        for literal, line in _literals(path)
        for number, name in known.items()
        if abs(literal - number) < SAME * number
    }
    assert not found


def _numbers_of(name: str) -> Iterator[float]:
    """An airframe's mass, inertia and drag, and its gains, also as quotients, as cascaded loops have them."""
    airframe = load_airframe(name)
    mass_kg, inertia, drag = airframe.mass_kg, airframe.inertia_kg_m2, airframe.drag
    yield mass_kg
    yield from inertia
    for force in drag.force_n_s2_m2:
        yield from (force, force / mass_kg)
    for moment, about in zip(drag.moment_nm_s2, inertia, strict=True):
        yield from (moment, moment / about)
    gains = design(airframe, PERIOD_S)
    kx, ki = gains.kx, gains.ki
    for moment, angle, rate, velocity, integral in ((1, 0, 2, 6, 1), (2, 1, 3, 5, 0)):  # see `level_law`
        for gain in (kx[moment, rate], kx[moment, velocity], ki[moment, integral]):
            yield float(gain / kx[moment, angle])
    for gain, scale in (
        (kx[0, 7], mass_kg),
        (ki[0, 2], mass_kg),
        (kx[3, 4], inertia[2]),
        (ki[3, 3], inertia[2]),
    ):
        yield from (float(gain), float(gain / scale))


def _literals(path: Path) -> Iterator[tuple[float, int]]:
    """The numbers in a module that have so many digits that they are hardly there by chance."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Constant) and isinstance(node.value, float):
            digits = f"{node.value:e}".split("e")[0].strip("0").replace(".", "")
            if len(digits) >= DIGITS:
                yield node.value, node.lineno
