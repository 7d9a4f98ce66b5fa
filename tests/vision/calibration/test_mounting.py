"""The mounting of a camera from gates seen in flight: found where it can be known, and refused where not."""

from math import degrees, radians

import numpy as np
import pytest

from tests.vision.calibration.seen_gates import FOCAL_PX, GATES, TRUE, fly, sightings, survey
from vision.calibration.mounting import MountingFit, fit_mounting, missing_for, movement_of
from vision.calibration.sightings import Values

RULER = Values((0.0, 0.0, 0.0), (0.08, 0.0, 0.0), 0.0)


def errors_deg(fit: MountingFit | None, true: Values = TRUE) -> list[float]:
    assert fit is not None
    return [degrees(a - b) for a, b in zip(fit.values.angles_frd_rad, true.angles_frd_rad, strict=True)]


@pytest.mark.parametrize("angles_deg", [(2, 5, -3), (-4, -30, 8), (0, 25, -12)])
def test_it_is_found_among_gates_and_a_poster(angles_deg: tuple[float, float, float]) -> None:
    roll, pitch, yaw = map(radians, angles_deg)
    true = Values((roll, pitch, yaw), TRUE.position_flu_m, 0.0)
    images, motion = fly(survey, 40.0, true=true)
    seen = sightings(images, motion)
    fit = fit_mounting(seen, motion, FOCAL_PX, RULER)
    assert max(map(abs, errors_deg(fit, true))) < 0.15
    assert missing_for(movement_of(seen, motion, fit), fit) == ()
    assert fit is not None and "green" in fit.sightings.colours
    for place in fit.gates_m:  # the poster, 2.2 times as large as a gate, is none
        assert min(np.linalg.norm(place - np.array(each.position_m)) for each in GATES) < 0.05


def test_the_delay_of_images_without_times_is_found() -> None:
    images, motion = fly(survey, 40.0, delay_s=0.13)
    known = Values(RULER.angles_frd_rad, RULER.position_flu_m, 0.1)
    fit = fit_mounting(sightings(images, motion, 0.1), motion, FOCAL_PX, known)
    assert max(map(abs, errors_deg(fit))) < 0.15
    assert fit is not None
    assert fit.values.delay_s == pytest.approx(0.13, abs=0.002)
    assert fit.std.delay_s < 0.002


def test_the_standard_deviations_are_those_of_the_errors() -> None:
    ratios = []
    for seed in range(8):
        images, motion = fly(survey, 25.0, seed=seed, noise_px=0.4, rate_hz=4.0)
        fit = fit_mounting(sightings(images, motion), motion, FOCAL_PX, RULER)
        assert fit is not None
        std_deg = np.degrees(fit.std.angles_frd_rad)
        ratios.append(np.array(errors_deg(fit)) / std_deg)
    assert 0.1 < np.sqrt(np.mean(np.square(ratios))) < 1.5


def hovering(time_s: float) -> tuple[float, float, float, float, float, float]:
    return (0.01 * np.sin(time_s), 0.0, 1.2, 0.0, 0.0, 0.02 * np.sin(time_s))


def turning(time_s: float) -> tuple[float, float, float, float, float, float]:
    return (0.0, 0.0, 1.2, 0.0, 0.0, 0.5 * time_s)


def test_without_movement_it_is_said_what_is_missing() -> None:
    def missing(path, seconds: float = 30.0, **what) -> tuple[str, ...]:
        images, motion = fly(path, seconds, **what)
        seen = sightings(images, motion)
        fit = fit_mounting(seen, motion, FOCAL_PX, RULER)
        return missing_for(movement_of(seen, motion, fit), fit)

    gates, *_ = missing(survey, rectangles=())
    assert gates.startswith("let the camera see frames") and "0 different views so far" in gates
    *_, turn, approach = missing(hovering)
    assert turn.startswith("yaw the drone by 20 degrees at least") and "(2 so far)" in turn
    assert approach.startswith("fly towards a frame and away from it, by 0.6 m at least")
    (approach,) = missing(turning)
    assert approach == "fly towards a frame and away from it, by 0.6 m at least (0.0 m so far)"
