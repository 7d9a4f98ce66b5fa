"""`framerunner vision`: how good the detectors are."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from cyclopts import App, Parameter

from framerunner.commands import WholeNumber, check_range
from framerunner.errors import SettingError

if TYPE_CHECKING:
    from framerunner.vision_evaluation.camera_chain import CameraChain
    from framerunner.vision_evaluation.evaluate import VisionSettings
    from framerunner.vision_evaluation.own_pictures import OwnPictures

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
        backgrounds: folder of photographs, parts of which are behind frames, base and obstacles
        preset: of the camera: plain; tint: random light, tint and blur, noise; jpeg, h264: compressed, too
        noise: standard deviation of noise in every channel, 0 to 20; instead of the preset's
        blur: standard deviation of the lens's blur, 0 to 10 pixels; the same
        light: factor of brightness, 0.05 to 2; the same
        tint: by up to this share each channel is brighter or darker, 0 to 0.5; the same
        jpeg: compress with this quality, 1 to 100, and half the resolution of colour
        h264: take images from an H.264 stream of this rate, 0.1 to 50 Mbit/s, at 30 images a second
    """

    level: str = "calm"
    images: WholeNumber = 300
    seed: WholeNumber = 1
    backgrounds: Path | None = None
    preset: Literal["plain", "tint", "jpeg", "h264"] = "plain"
    noise: float | None = None
    blur: float | None = None
    light: float | None = None
    tint: float | None = None
    jpeg: WholeNumber | None = None
    h264: float | None = None


_USUAL = ImageOptions()


@app.command
def evaluate(
    *,
    options: ImageOptions = _USUAL,
    detector: str | None = None,
    labelled: Path | None = None,
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

        framerunner vision evaluate --backgrounds my_photographs --preset h264

        framerunner vision evaluate --labelled my_pictures

    Args:
        options: which images.
        detector: one that a package adds, to be rated beside ours
        labelled: folder of your own pictures and their labels.json, instead of painted images
        out: folder for the report and the picture
    """
    from framerunner.vision_evaluation.evaluate import evaluate_vision

    pictures = None if labelled is None else _own_pictures(labelled, options)
    default = Path("runs") / f"vision-{Path(options.level).stem}-{options.images}-{options.seed}"
    if pictures is not None:
        default = Path("runs") / f"vision-{pictures.folder.name}"
    settings = _settings(options, out or default)
    if pictures is not None:
        settings = replace(settings, pictures=pictures, images=len(pictures.labels.images))
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


def _own_pictures(folder: Path, options: ImageOptions) -> OwnPictures:
    from framerunner.vision_evaluation.own_pictures import OwnPictures

    if options != _USUAL:
        raise SettingError(
            "--labelled: rates your pictures as they are; leave out the options of painted images"
        )
    return OwnPictures.of_folder(folder)


def _settings(options: ImageOptions, out: Path) -> VisionSettings:
    """Check the options."""
    from framerunner.vision_evaluation.backgrounds import Backgrounds
    from framerunner.vision_evaluation.evaluate import VisionSettings
    from scenarios.random_numbers import MAX_SEED
    from scenarios.random_scenarios import load_level

    check_range("--images", options.images, 1, _MAX_IMAGES)
    check_range("--seed", options.seed, 0, MAX_SEED - _MAX_IMAGES)
    backgrounds = None if options.backgrounds is None else Backgrounds.of_folder(options.backgrounds)
    return VisionSettings(
        load_level(options.level), options.images, options.seed, _chain(options), out, backgrounds
    )


def _chain(options: ImageOptions) -> CameraChain:
    """The preset, with what options say instead."""
    from framerunner.vision_evaluation.camera_chain import PRESETS

    check_range("--noise", options.noise, 0.0, 20.0)
    check_range("--blur", options.blur, 0.0, 10.0)
    check_range("--light", options.light, 0.05, 2.0)
    check_range("--tint", options.tint, 0.0, 0.5)
    check_range("--jpeg", options.jpeg, 1, 100)
    check_range("--h264", options.h264, 0.1, 50.0)
    chain = PRESETS[options.preset]
    if options.noise is not None:
        chain = replace(chain, noise=options.noise)
    if options.blur is not None:
        chain = replace(chain, blur_px=(options.blur, options.blur))
    if options.light is not None:
        chain = replace(chain, light=(options.light, options.light))
    if options.tint is not None:
        chain = replace(chain, tint=(1.0 - options.tint, 1.0 + options.tint))
    if options.jpeg is not None:
        chain = replace(chain, jpeg=options.jpeg)
    if options.h264 is not None:
        chain = replace(chain, h264_mbit_s=options.h264)
    return chain
