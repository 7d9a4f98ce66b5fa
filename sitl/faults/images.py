"""Faults of the camera: changes the images that a feed delivers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property

import numpy as np

from framerunner.geometry.solids import Solid
from scenarios.faults.declaration import Fault, FaultKind, FaultPart
from scenarios.models import Scenario
from sitl.camera import CameraFeed, Exposure
from sitl.faults.effects import Effect, LinkChannel, new_effect
from sitl.faults.faults import Faults
from sitl.optics.painter import Image


def new_feed(
    scenario: Scenario, faults: Faults, seed: int, drones: Callable[[], Sequence[Solid]] = tuple
) -> CameraFeed:
    """The camera's feed; one with faults only if the scenario declares some of the camera.

    Args:
        scenario: camera settings and what is to be seen.
        faults: of the drone.
        seed: of the flight.
        drones: see `CameraFeed`.
    """
    has_faults = any(fault.part is FaultPart.CAMERA for fault in scenario.faults)
    return CameraFeed(scenario, drones, seed, _ImageFaults(faults, seed) if has_faults else None)


class _ImageFaults:
    """The camera's active faults."""

    def __init__(self, faults: Faults, seed: int) -> None:
        self._faults, self._seed = faults, seed
        self._changes: dict[Fault, Effect[Exposure]] = {}

    def __call__(self, now_us: int, exposure: Exposure | None) -> Exposure | None:
        active = self._faults.camera
        if active != tuple(self._changes):
            kept = self._changes
            self._changes = {fault: kept.get(fault) or _new_change(fault, self._seed) for fault in active}
        for change in self._changes.values():
            exposure = change(now_us, exposure)
        return exposure


def _new_change(fault: Fault, seed: int) -> Effect[Exposure]:
    """What a fault does from now on; late images that have not arrived at its end are lost."""
    return _blacken if fault.kind is FaultKind.BLACK else new_effect(fault, _EXPOSURES, seed)


class _Changed(Exposure):
    """An exposure whose image is made by a function when it is first asked for."""

    def __init__(self, time_us: int, make: Callable[[], Image]) -> None:
        self.time_us = time_us
        self._make = make

    @cached_property
    def image(self) -> Image:
        """BGR, shape (height, width, 3), uint8."""
        return self._make()


def _blacken(_now_us: int, exposure: Exposure | None) -> Exposure | None:
    if exposure is None:
        return None
    return _Changed(exposure.time_us, lambda: np.zeros_like(exposure.image))


def _frozen(first: Exposure, now: Exposure) -> Exposure:
    """The first image with a new time: the sensor hangs, its driver does not."""
    return _Changed(now.time_us, lambda: first.image)


_EXPOSURES: LinkChannel[Exposure] = LinkChannel(
    0, add=lambda exposure, _by: exposure, scale=lambda exposure, _factor: exposure, freeze=_frozen
)
"""Images are no numbers: nothing is added, and no fault scales them."""
