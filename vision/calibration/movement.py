"""How a drone moved while its camera saw frames, and what is still missing for the mounting to be known."""

from __future__ import annotations

from dataclasses import dataclass
from math import degrees, pi

import numpy as np

from vision.calibration.motion import Floats, Motion
from vision.calibration.mounting import MountingFit
from vision.calibration.sightings import Sightings

MIN_SIGHTINGS = 60
MIN_TURN_DEG = 20.0
MIN_APPROACH_M = 0.6
MAX_ANGLE_STD_DEG = 0.3
MAX_DELAY_STD_S = 0.008
MAX_POSITION_STD_M = 0.01
"""A coordinate of the camera's place is found if it is known better than this."""


@dataclass(frozen=True, slots=True)
class Movement:
    """What the drone did while frames were seen.

    Attributes:
        sightings: of frames, in images that differ.
        frames: how many frames were seen.
        turn_deg: the arc of its headings.
        approach_m: by how much its distance to some frame changed.
    """

    sightings: int
    frames: int
    turn_deg: float
    approach_m: float


def movement_of(seen: Sightings, motion: Motion, fit: MountingFit | None) -> Movement:
    """The movement at the times of the sightings that were used."""
    if fit is None:
        return Movement(len(seen), 0, 0.0 if not len(seen) else _turn_deg(seen, motion), 0.0)
    used = fit.sightings
    places = motion.positions(used.times_s)
    away = np.linalg.norm(places - fit.frames_m[fit.numbers], axis=1)
    spans = [np.ptp(away[fit.numbers == number]) for number in range(len(fit.frames_m))]
    return Movement(len(used), len(fit.frames_m), _turn_deg(used, motion), float(max(spans)))


def _turn_deg(seen: Sightings, motion: Motion) -> float:
    """The smallest arc that has all headings."""
    rotations = motion.rotations(seen.times_s)
    headings: Floats = np.sort(np.arctan2(rotations[:, 1, 0], rotations[:, 0, 0]))
    gaps = np.diff(np.append(headings, headings[0] + 2.0 * pi))
    return degrees(2.0 * pi - float(gaps.max()))


def missing_for(movement: Movement, fit: MountingFit | None) -> tuple[str, ...]:
    """What must still be done, in words; empty if the angles are known."""
    words = []
    if movement.sightings < MIN_SIGHTINGS:
        words.append(
            f"let the camera see frames, wholly in view and 1 to 5 m away: {movement.sightings} different "
            f"views so far, {MIN_SIGHTINGS} are needed"
        )
    if movement.turn_deg < MIN_TURN_DEG:
        words.append(
            f"yaw the drone by {MIN_TURN_DEG:.0f} degrees at least, so that a frame moves from one side of "
            f"the image to the other ({movement.turn_deg:.0f} so far)"
        )
    if movement.approach_m < MIN_APPROACH_M:
        words.append(
            f"fly towards a frame and away from it, by {MIN_APPROACH_M:g} m at least "
            f"({movement.approach_m:.1f} m so far)"
        )
    if words:
        return tuple(words)
    if fit is None:
        return ("let the camera see frames: nothing that was seen stays at one place and has a frame's size",)
    roll, pitch, yaw = (degrees(each) for each in fit.std.angles_frd_rad)
    if roll > MAX_ANGLE_STD_DEG:
        words.append(f"yaw the drone further with frames in view: roll is uncertain by {roll:.2f} degrees")
    uncertain = {"pitch": pitch, "yaw": yaw}
    for name, deg in uncertain.items():
        if deg > MAX_ANGLE_STD_DEG:
            words.append(
                f"fly towards frames and away from them, and past them to the side, by a metre: {name} is "
                f"uncertain by {deg:.2f} degrees"
            )
    return tuple(words)
