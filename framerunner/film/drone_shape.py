"""The drone as it is drawn: arms, body and turning rotors, as large as its airframe says."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np

from firmware_py.airframe import Airframe
from framerunner.film.colours import Bgr, bgr
from framerunner.film.story import Floats, level_attitude

_BODY = bgr("#2b2f36")
_TOP = bgr("#454b55")
_ARM = bgr("#3a3f47")
_NOSE = bgr("#ff9a1f")
_DISC = bgr("#8d949e")
_BLADE = bgr("#2b2f36")
_ROUND = np.linspace(0.0, 2 * pi, 20, endpoint=False)
_TURNS_PER_S = 2.3  # as seen: true rotors would only flicker


@dataclass(frozen=True, slots=True)
class Patch:
    """A flat piece of it.

    Attributes:
        corners_m: arena axes, shape (k, 3).
        colour: of it.
        solid: 0..1, how little shines through.
    """

    corners_m: Floats
    colour: Bgr
    solid: float = 1.0


class DroneShape:
    """A drone that can be put anywhere.

    Args:
        airframe: its measures.
        scale: how many times larger than life; it must be found on a small screen.
    """

    def __init__(self, airframe: Airframe, scale: float) -> None:
        length_m, width_m, height_m = (scale * side for side in airframe.envelope_m)
        self._half_height_m = scale * airframe.envelope_m[2] / 2
        self._radius_m = scale * airframe.motor.radius_m
        hubs = [rotor.position_frd_m for rotor in airframe.rotors]
        self._hubs_m = scale * np.array([(x, -y, -z + airframe.envelope_m[2] / 2) for x, y, z in hubs])
        self._spins = [rotor.yaw_sign for rotor in airframe.rotors]
        self._body = np.array((0.2 * length_m, 0.13 * width_m, 0.5 * height_m))
        self._arm_m = 0.045 * length_m

    @property
    def radius_m(self) -> float:
        """How far it reaches from its centre."""
        return float(np.hypot(self._hubs_m[:, 0], self._hubs_m[:, 1]).max()) + self._radius_m

    def patches(self, centre_m: Floats, yaw_rad: float, time_s: float, motors_on: bool) -> list[Patch]:
        """All pieces of it, in an order in which they may be painted when it is seen from above.

        Args:
            centre_m: where it is, arena axes, shape (3,).
            yaw_rad: its heading.
            time_s: of the film, turns the rotors.
            motors_on: whether they turn.
        """
        forward, left, up = level_attitude(yaw_rad)
        axes = np.stack((forward, left, up))
        found = [self._arm(hub) for hub in self._hubs_m] + self._box()
        for hub, spin in zip(self._hubs_m, self._spins, strict=True):
            found += self._rotor(hub, -spin * 2 * pi * _TURNS_PER_S * time_s if motors_on else 0.6, motors_on)
        return [Patch(centre_m + each.corners_m @ axes, each.colour, each.solid) for each in found]

    def _arm(self, hub_m: Floats) -> Patch:
        along = hub_m[:2] / max(1e-6, float(np.hypot(*hub_m[:2])))
        across = self._arm_m / 2 * np.array((-along[1], along[0]))
        corners = [across, hub_m[:2] + across, hub_m[:2] - across, -across]
        return Patch(np.array([(x, y, 0.3 * self._half_height_m) for x, y in corners]), _ARM)

    def _box(self) -> list[Patch]:
        x, y, z = self._body
        plan = ((x, y), (x, -y), (-x, -y), (-x, y))
        sides = [
            Patch(np.array([(*a, -z), (*b, -z), (*b, z), (*a, z)]), _BODY)
            for a, b in zip(plan, (*plan[1:], plan[0]), strict=True)
        ]
        top = Patch(np.array([(*corner, z) for corner in plan]), _TOP)
        nose = Patch(np.array([(x, y, z), (x, -y, z), (0.35 * x, 0.0, z)]), _NOSE)
        return [*sides, top, nose]

    def _rotor(self, hub_m: Floats, angle_rad: float, turning: bool) -> list[Patch]:
        circle = np.stack((np.cos(_ROUND), np.sin(_ROUND), np.zeros_like(_ROUND)), axis=1)
        disc = Patch(hub_m + self._radius_m * circle, _DISC, 0.45 if turning else 0.12)
        c, s = np.cos(angle_rad), np.sin(angle_rad)
        along = self._radius_m * np.array((c, s, 0.0))
        across = 0.14 * self._radius_m * np.array((-s, c, 0.0))
        tips = (hub_m + along, hub_m - along)
        blade = np.array([tips[0] + across, tips[1] + across, tips[1] - across, tips[0] - across])
        return [disc, Patch(blade, _BLADE, 0.85)]
