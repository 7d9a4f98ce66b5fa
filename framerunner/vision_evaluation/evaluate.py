"""An evaluation of the detectors from the level to the report, and the labelled images as files."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import cv2
import numpy as np
from rich import box
from rich.console import Console
from rich.progress import track
from rich.table import Table

from framerunner.errors import SettingError
from framerunner.terminal import table_console
from framerunner.vision_evaluation.backgrounds import Backgrounds
from framerunner.vision_evaluation.base_scores import BaseScores, rate_base
from framerunner.vision_evaluation.camera_chain import CameraChain
from framerunner.vision_evaluation.labelled_images import LabelledImage, labelled_images
from framerunner.vision_evaluation.own_pictures import OwnPictures
from framerunner.vision_evaluation.scores import (
    RATED_ANGLE_DEG,
    RATED_DISTANCE_M,
    ErrorRow,
    Scores,
    detect_all,
)
from framerunner.wire.finite_json import finite
from scenarios.random_scenarios import Level
from vision.detectors import DetectorMaker

_ERRORS = ("distance", "95 %", "bearing", "tilt", "95 %", "first right", "corners / std", "> 4 std")
REPORT, PICTURE, LABELS = "vision.json", "vision.png", "labels.json"


@dataclass(frozen=True, slots=True)
class VisionSettings:
    """Which images, and the folder for what is written."""

    level: Level
    images: int
    seed: int
    chain: CameraChain
    out: Path
    backgrounds: Backgrounds | None = None
    detector: str | DetectorMaker | None = None  # of others, to be rated beside ours
    pictures: OwnPictures | None = None  # instead of painted images

    @property
    def title(self) -> str:
        """What the images are, for people."""
        if self.pictures is not None:
            return f"pictures of {self.pictures.folder}"
        parts = [f"level {self.level.name}"]
        if self.backgrounds is not None:
            parts.append(f"{len(self.backgrounds.photographs)} photographs")
        return ", ".join(filter(None, [*parts, self.chain.shown()]))


def evaluate_vision(settings: VisionSettings) -> None:
    """Paint the images, run the detectors over them, print and write the report.

    Raises:
        SettingError: the folder cannot be written to.
        DetectorError, ExtensionError: the detector of others cannot be used.
    """
    _make_folder(settings.out)
    scores, examples = detect_all(_shown(settings), settings.detector)
    print_scores(scores, settings.title)
    base = None
    if settings.pictures is None:
        base = rate_base(settings.level, settings.images, settings.seed, settings.chain)
        print_base_scores(base)
    report = settings.out / REPORT
    report.write_text(json.dumps(finite(_as_json(settings, scores, base), 5), indent=1), encoding="utf-8")
    from framerunner.vision_evaluation.picture import save_picture

    save_picture(scores, examples, settings.title, settings.out / PICTURE)
    print(f"written to {report} and {PICTURE}")


def write_dataset(settings: VisionSettings) -> None:
    """Write the images as PNG files, and what is in them as JSON.

    Raises:
        SettingError: the folder cannot be written to, or has files in it.
    """
    _make_folder(settings.out)
    if any(settings.out.iterdir()):
        raise SettingError(
            f"{settings.out}: has files in it, which are left as they are; choose a new folder"
        )
    labels = []
    for number, labelled in enumerate(_shown(settings)):
        name = f"{number:06d}.png"
        if not cv2.imwrite(str(settings.out / name), labelled.image):
            raise SettingError(f"{settings.out / name}: cannot be written; choose another folder")
        entry = {
            "image": name,
            "scenario": labelled.scenario,
            "position_arena_m": labelled.position_arena_m,
            "attitude_arena": labelled.attitude_arena,
            "focal_px": labelled.focal_px,
            "distortion": labelled.calibration.distortion,
            "frames": [asdict(gate) for gate in labelled.gates],
        }
        labels.append(finite(entry, 6))
    (settings.out / LABELS).write_text(json.dumps(labels, indent=1), encoding="utf-8")
    print(f"{len(labels)} images and {LABELS} written to {settings.out}")


def _shown(settings: VisionSettings) -> Iterator[LabelledImage]:
    """The images, while a bar on standard error shows how far it is."""
    images: Iterable[LabelledImage]
    if settings.pictures is None:
        images = labelled_images(
            settings.level, settings.images, settings.seed, settings.chain, settings.backgrounds
        )
    else:
        images = settings.pictures.images()
    console = Console(stderr=True)
    yield from track(
        images,
        "images",
        total=settings.images,
        console=console,
        transient=True,
        disable=not console.is_terminal,
    )


def _make_folder(path: Path) -> None:
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise SettingError(f"{path}: cannot be a folder ({error.strerror}); choose another") from error


def _as_json(settings: VisionSettings, scores: Scores, base: BaseScores | None) -> dict[str, object]:
    painted = {"level": settings.level.name, "seed": settings.seed, "chain": asdict(settings.chain)}
    of_base: dict[str, object] = {}
    if base is not None:
        of_base["base_by_distance_m"] = [asdict(row) for row in base.rows()]
        of_base["base_false_alarms"] = {"of": base.others, "count": base.false_alarms}
    return {
        **(painted if settings.pictures is None else {"pictures": str(settings.pictures.folder)}),
        "images": scores.images,
        "detectors": [asdict(row) for row in scores.in_sum()],
        "by_distance_m": [asdict(row) for row in scores.by_distance()],
        "by_angle_deg": [asdict(row) for row in scores.by_angle()],
        **of_base,
        "false_alarms": scores.false_alarms,
        "median_ms": {kind: float(np.median(times)) for kind, times in scores.times_ms.items()},
        "p99_ms": {kind: float(np.percentile(times, 99)) for kind, times in scores.times_ms.items()},
    }


def print_scores(scores: Scores, title: str) -> None:
    """Print rates and errors of the detectors to standard output."""
    console = table_console(130)
    console.print(f"{title}: {scores.images} images", markup=False)
    console.print(
        f"wholly in view, up to {RATED_DISTANCE_M:g} m and {RATED_ANGLE_DEG:g}° off the normal", markup=False
    )
    console.print(_table("detector", [(row.kind, row) for row in scores.in_sum()]))
    for what, unit, rows in (("distance", " m", scores.by_distance()), ("angle", "°", scores.by_angle())):
        named = [(f"{row.kind}  {row.low:g} to {row.high:g}{unit}", row) for row in rows]
        console.print(_table(f"by {what}", named))
    for kind in scores.kinds:
        times_ms = np.percentile(scores.times_ms[kind], (50, 99))
        console.print(
            f"{kind}: {scores.false_alarms[kind] / max(scores.images, 1):.3f} false alarms an image, "
            f"{times_ms[0]:.2f} ms an image (99 %: {times_ms[1]:.2f} ms)",
            markup=False,
        )


def print_base_scores(scores: BaseScores) -> None:
    """Print how well the base was found to standard output."""
    console = table_console(130)
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("base, by distance", no_wrap=True)
    for column in ("images", "found", "corners", "95 %", "corners / std"):
        table.add_column(column, justify="right")
    for row in scores.rows():
        if row.images:
            table.add_row(
                f"{row.low_m:g} to {row.high_m:g} m",
                str(row.images),
                _cell(row.found, 100.0, ".1f", " %"),
                _cell(row.error_median_px, 1.0, ".2f", " px"),
                _cell(row.error_p95_px, 1.0, ".2f", " px"),
                _cell(row.deviation_rms, 1.0, ".2f", ""),
            )
    console.print(table)
    if scores.times_ms:
        times_ms = np.percentile(scores.times_ms, (50, 95))
        console.print(
            f"base: {scores.false_alarms} false alarms in {scores.others} images without it, "
            f"{times_ms[0]:.2f} ms an image (95 %: {times_ms[1]:.2f} ms)",
            markup=False,
        )


def _table(title: str, rows: Sequence[tuple[str, ErrorRow]]) -> Table:
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column(title, no_wrap=True)
    for column in ("frames", "found", *_ERRORS):
        table.add_column(column, justify="right")
    for name, row in rows:
        if row.frames:
            table.add_row(name, str(row.frames), *_cells(row))
    return table


def _cells(row: ErrorRow) -> list[str]:
    return [
        _cell(row.found, 100.0, ".1f", " %"),
        _cell(row.distance_median, 100.0, ".2f", " %"),
        _cell(row.distance_p95, 100.0, ".1f", " %"),
        _cell(row.bearing_median_deg, 1.0, ".2f", "°"),
        _cell(row.tilt_median_deg, 1.0, ".1f", "°"),
        _cell(row.tilt_p95_deg, 1.0, ".1f", "°"),
        _cell(row.first_is_right, 100.0, ".0f", " %"),
        _cell(row.deviation_rms, 1.0, ".2f", ""),
        _cell(row.outliers, 100.0, ".2f", " %"),
    ]


def _cell(number: float | None, factor: float, form: str, unit: str) -> str:
    return "-" if number is None else f"{factor * number:{form}}{unit}"
