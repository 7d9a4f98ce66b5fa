"""`framerunner vision`: how good the detectors are."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from cyclopts import App, Parameter

from framerunner.commands import WholeNumber, check_range

if TYPE_CHECKING:
    from framerunner.vision_evaluation.evaluate import VisionSettings

_MAX_IMAGES = 1_000_000

app = App(name="vision", help="Evaluate the detectors on images of known scenes.")


@Parameter(name="*", group="Images")
@dataclass(frozen=True, slots=True, kw_only=True)
class ImageOptions:
    """Which images are painted.

    Attributes:
        level: draw scenarios of this level, name or file
        images: how many images, five of a scenario
        seed: of the first scenario, and of the poses
        noise: standard deviation of noise in every channel, 0 to 100
        blur: standard deviation of a blur, 0 to 10 pixels
        light: factor of brightness, 0.05 to 2
        jpeg: compress with this quality, 1 to 100
    """

    level: str = "calm"
    images: WholeNumber = 300
    seed: WholeNumber = 1
    noise: float = 0.0
    blur: float = 0.0
    light: float = 1.0
    jpeg: WholeNumber | None = None


_USUAL = ImageOptions()


@app.command
def evaluate(
    *,
    options: ImageOptions = _USUAL,
    detector: str | None = None,
    out: Path | None = None,
) -> int:
    """Tell how often and how exactly frames are found: by shape, and by the paper's boxes.

    The images are painted from random poses in random scenarios; the same options give the same images.
    A detector that a package adds is rated by what it gives: boxes, frames, or both.
    Printed and written are rates of detection, false alarms, errors of distance, bearing and tilt by distance
    and by angle, and the time an image takes.

    **Examples**

        framerunner vision evaluate --level calm --images 300

        framerunner vision evaluate --level crowded --noise 4 --blur 0.7 --light 0.7 --jpeg 90

    Args:
        options: which images.
        detector: one that a package adds, to be rated beside ours
        out: folder for the report and the picture
    """
    from framerunner.vision_evaluation.evaluate import evaluate_vision

    default = Path("runs") / f"vision-{Path(options.level).stem}-{options.images}-{options.seed}"
    settings = _settings(options, out or default)
    evaluate_vision(replace(settings, detector=detector))
    return 0


@app.command
def dataset(
    folder: Path,
    *,
    options: ImageOptions = _USUAL,
) -> int:
    """Write such images, and what is to be seen in them, for your own detector.

    **Example**

        framerunner vision dataset my_images --level crowded --images 1000

    Args:
        folder: for the images and labels.json
        options: which images.
    """
    from framerunner.vision_evaluation.evaluate import write_dataset

    write_dataset(_settings(options, folder))
    return 0


def _settings(options: ImageOptions, out: Path) -> VisionSettings:
    """Check the options."""
    from framerunner.vision_evaluation.evaluate import VisionSettings
    from framerunner.vision_evaluation.labelled_images import Disturbance
    from scenarios.random_numbers import MAX_SEED
    from scenarios.random_scenarios import load_level

    check_range("--images", options.images, 1, _MAX_IMAGES)
    check_range("--seed", options.seed, 0, MAX_SEED - _MAX_IMAGES)
    check_range("--noise", options.noise, 0.0, 100.0)
    check_range("--blur", options.blur, 0.0, 10.0)
    check_range("--light", options.light, 0.05, 2.0)
    check_range("--jpeg", options.jpeg, 1, 100)
    harder = Disturbance(options.noise, options.blur, options.light, options.jpeg)
    return VisionSettings(load_level(options.level), options.images, options.seed, harder, out)
