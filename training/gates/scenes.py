"""Painted images with gates before many backgrounds, and where the gates' corners are in them: a data set.

python -m training.gates.scenes --photographs DIR --images 9000 --seed 100000 OUT
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

from framerunner.vision_evaluation.backgrounds import Backgrounds
from framerunner.vision_evaluation.camera_chain import CameraChain
from framerunner.vision_evaluation.labelled_images import GateLabel, LabelledImage, labelled_images
from scenarios.random_scenarios import load_level
from training.gates.backdrops import training_backgrounds
from vision.calibration.lens import Lens

SIZE = (240, 320)
MAX_GATES = 6
FARTHEST_M, MOST_OBLIQUE_DEG, LEAST_PX = 7.5, 78.0, 3.5

_LIT = CameraChain(noise=2.0, blur_px=(0.0, 1.0), light=(0.35, 1.0), tint=(0.75, 1.2))
_SENT = CameraChain(noise=2.5, blur_px=(0.2, 0.9), light=(0.45, 1.0), tint=(0.8, 1.15), h264_mbit_s=2.0)


@dataclass(frozen=True, slots=True)
class Part:
    """A part of the data set."""

    level: str
    share: float
    chain: CameraChain
    photographs: bool


PARTS = (
    Part("calm", 0.20, _LIT, True),
    Part("calm", 0.06, CameraChain(), True),
    Part("sizes", 0.18, _LIT, True),
    Part("crowded", 0.16, _LIT, True),
    Part("indoor", 0.05, CameraChain(), False),
    Part("crowded", 0.05, _LIT, False),
    Part("calm", 0.18, _SENT, True),
    Part("sizes", 0.12, _SENT, True),
)


def corners_in(labelled: LabelledImage, gate: GateLabel) -> npt.NDArray[np.float32] | None:
    """The corners of a gate's outline, columns and rows, shape (4, 2); None if behind the camera."""
    if not gate.corners_px:
        return None
    places = np.array(gate.corners_px)
    if not labelled.calibration.is_ideal:
        places = Lens(labelled.calibration).all_seen(places)
    height, width = labelled.image.shape[:2]
    return (places + np.array([(width - 1) / 2, (height - 1) / 2])).astype(np.float32)


def rows_of(labelled: LabelledImage) -> npt.NDArray[np.float32]:
    """The gates of an image, shape (MAX_GATES, 9): 1 for one to be found, -1 for one that may be; corners.

    One may be found that is partly hidden, very far, or nearly edge-on. Rows of none begin with 0.
    """
    rows = np.zeros((MAX_GATES, 9), np.float32)
    height, width = labelled.image.shape[:2]
    found = []
    for gate in labelled.gates:
        corners = corners_in(labelled, gate) if gate.seen else None
        if corners is None:
            continue
        centre = corners.mean(axis=0)
        if not (0 <= centre[0] < width and 0 <= centre[1] < height):
            continue
        inside = bool(((corners > 0) & (corners < [width - 1, height - 1])).all())
        spans = corners.max(axis=0) - corners.min(axis=0)
        sure = (
            (gate.whole or not inside)
            and gate.distance_m <= FARTHEST_M
            and gate.angle_deg <= MOST_OBLIQUE_DEG
            and spans.min() >= LEAST_PX
        )
        found.append((gate.distance_m, [1.0 if sure else -1.0, *corners.reshape(-1).tolist()]))
    found.sort()
    for k, (_, row) in enumerate(found[:MAX_GATES]):
        rows[k] = row
    return rows


def images(count: int, seed: int, backgrounds: Backgrounds) -> Iterator[LabelledImage]:
    """The images of all parts."""
    for k, part in enumerate(PARTS):
        behind = backgrounds if part.photographs else None
        yield from labelled_images(
            load_level(part.level), round(part.share * count), seed + 1_000_000 * k, part.chain, behind
        )


def write(out: Path, count: int, seed: int, folder: Path) -> None:
    """Write `images.npy` and `gates.npy` into a folder."""
    out.mkdir(parents=True, exist_ok=True)
    backgrounds = training_backgrounds(folder, np.random.default_rng(seed))
    total = sum(round(part.share * count) for part in PARTS)
    pictures = np.lib.format.open_memmap(out / "images.npy", "w+", np.uint8, (total, *SIZE, 3))
    gates = np.zeros((total, MAX_GATES, 9), np.float32)
    for k, labelled in enumerate(images(count, seed, backgrounds)):
        pictures[k] = labelled.image
        gates[k] = rows_of(labelled)
    np.save(out / "gates.npy", gates)
    print(f"{total} images with {int((gates[..., 0] > 0).sum())} gates in {out}")


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=Path)
    parser.add_argument("--photographs", type=Path, required=True)
    parser.add_argument("--images", type=int, default=9000)
    parser.add_argument("--seed", type=int, default=100_000)
    options = parser.parse_args()
    cv2.setNumThreads(1)
    write(options.out, options.images, options.seed, options.photographs)


if __name__ == "__main__":
    main()
