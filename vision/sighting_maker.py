"""Sightings from corners that a detector of others has found, with the poses that explain them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from framerunner.geometry.gate_shape import GateShapes
from vision.calibration.lens import Lens
from vision.calibration.model import Calibration
from vision.gate_model import GateModel
from vision.gate_pose import as_seen, find_poses
from vision.types import GateCorner, GateSighting

_MOST_STDS = 4.0  # root mean square, by which a pose may miss the corners


class SightingMaker:
    """Makes `GateSighting`s of four corners each.

    Args:
        calibration: of the camera.
        shapes: of the gates of each colour; None: all have that of the frame challenge.
    """

    def __init__(self, calibration: Calibration, shapes: GateShapes | None = None) -> None:
        self._lens = Lens(calibration)
        self._shapes = shapes or GateShapes()

    def sighting(
        self,
        colour: str,
        corners: Sequence[tuple[float, float]],
        std_px: float = 0.5,
        *,
        whole: bool = True,
    ) -> GateSighting:
        """A gate in an image.

        Args:
            colour: of the gate.
            corners: of its outline, column and row, whole numbers at pixel centres: upper left, upper right,
                lower right, lower left as seen. They may be outside the image.
            std_px: standard deviation of each of these numbers, by which the map weighs the gate.
            whole: nothing of the gate is hidden or outside the image.

        Returns:
            It has no poses if no upright gate looks so.
        """
        columns, rows = self._lens.size_px
        places = np.array(corners, np.float64) - ((columns - 1) / 2, (rows - 1) / 2)
        ideal = [(right, down) for right, down in self._lens.ideal(places).tolist()]
        upper_left, upper_right, lower_right, lower_left = (
            GateCorner(right, down, std_px, std_px) for right, down in ideal
        )
        model = GateModel.of_corners(self._shapes.of(colour), self._lens.focal_px)
        poses = find_poses(ideal, model, _MOST_STDS * std_px)
        return GateSighting(
            colour,
            (upper_left, upper_right, lower_right, lower_left),
            whole,
            tuple(as_seen(pose) for pose in poses),
        )
