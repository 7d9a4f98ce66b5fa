"""`framerunner vision`: how good the detectors are."""

from __future__ import annotations

import asyncio
import webbrowser
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import App, Parameter

from framerunner.commands import WholeNumber, check_range, say, write_new
from framerunner.commands.monitor import PagesPort
from framerunner.errors import SettingError

if TYPE_CHECKING:
    from framerunner.vision_evaluation.camera_chain import CameraChain
    from framerunner.vision_evaluation.evaluate import VisionSettings
    from framerunner.vision_evaluation.label_session import Head
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


@Parameter(name="*", group="Camera and frames, said the first time")
@dataclass(frozen=True, slots=True, kw_only=True)
class LabelOptions:
    """What new labels begin with.

    Attributes:
        calibration: of the camera, a file of `framerunner camera calibrate`; it is copied to FOLDER
        focal_px: focal length of a camera without distortion instead, pixels
        outer: outer width and height of the frames, metres; by default the task's, 0.42 and 0.22
        bar: width of their bars, seen from the front, metres; by default 0.02
        corners_of: which corners are clicked; by default those of the outline
    """

    calibration: Path | None = None
    focal_px: float | None = None
    outer: tuple[float, float] | None = None
    bar: float | None = None
    corners_of: Literal["outline", "opening"] | None = None


_AS_BEFORE = LabelOptions()


@app.command
def label(
    folder: Path,
    *,
    options: LabelOptions = _AS_BEFORE,
    port: PagesPort = 8091,
    browser: Annotated[bool, Parameter(negative="--no-browser")] = True,
) -> int:
    """Label your own pictures in the browser, for `vision evaluate --labelled`. Stop it with Ctrl-C.

    Four clicks a frame; its distance and the outline of its pose are shown at once. Every change is written
    to labels.json in FOLDER, which also has what camera and frames are. The page is for this machine only.

    **Examples**

        framerunner vision label my_pictures --calibration camera.yaml

        framerunner vision label my_pictures --focal-px 160.1 --outer 0.6 0.4 --bar 0.03

        framerunner vision label my_pictures

    Args:
        folder: with the pictures
        options: what camera and frames are.
        port: TCP port of the page.
        browser: open the page in the browser
    """
    from framerunner.vision_evaluation.label_session import LabelSession

    session = LabelSession(folder, None if options == _AS_BEFORE else _label_head(folder, options))
    from framerunner.vision_evaluation.label_page import serve_labels

    def started(url: str) -> None:
        say(f"labels: {url}")
        if browser:
            webbrowser.open(url)

    asyncio.run(serve_labels(session, port, started))
    return 0


def _label_head(folder: Path, options: LabelOptions) -> Head:
    """Check the options."""
    from framerunner.camera_calibration.calibration_file import load_calibration
    from framerunner.geometry.gate_shape import BAR_LIMITS_M, PAPER_GATE, SIZE_LIMITS_M
    from framerunner.vision_evaluation.label_session import Head
    from framerunner.vision_evaluation.own_pictures import PictureLabels, PictureShape, keep_calibration

    if (options.calibration is None) == (options.focal_px is None):
        raise SettingError("the first time, give either --calibration or --focal-px")
    check_range("--focal-px", options.focal_px, 2.0, 1e5)
    bar_m = PAPER_GATE.bar_m if options.bar is None else options.bar
    check_range("--bar", bar_m, *BAR_LIMITS_M)
    width_m, height_m = options.outer or (PAPER_GATE.outer_width_m, PAPER_GATE.outer_height_m)
    for size_m in (width_m, height_m):
        check_range("--outer", size_m, SIZE_LIMITS_M[0] + 2 * bar_m, SIZE_LIMITS_M[1])
    path = options.calibration
    calibration = None if path is None else load_calibration(path)
    labels = PictureLabels.model_construct(
        focal_px=options.focal_px,
        calibration=None if calibration is None else keep_calibration(calibration, folder, str(path)),
        shape=PictureShape(outer_width_m=width_m, outer_height_m=height_m, bar_m=bar_m, depth_m=bar_m),
        corners_of=options.corners_of or "outline",
        images=(),
    )
    return Head(labels, calibration)


@app.command
def labels(
    folder: Path,
    *,
    source: Annotated[Literal["tii"], Parameter(name="--from")],
    opening: tuple[float, float],
    bar: float,
    calibration: Path,
    colour: Literal["red", "green", "blue", "cyan", "magenta"] = "red",
) -> int:
    """Make labels.json of the labels of a public data set, for `vision evaluate --labelled`.

    `tii` is "Race Against the Machine" (https://github.com/tii-racing/drone-racing-dataset), which you
    download yourself: pictures, and for each a text file of the same name with the corners of the openings.

    **Example**

        framerunner vision labels flight-01a --from tii --opening 1.5 1.5 --bar 0.3 --calibration calib.json

    Args:
        folder: with pictures and text files, in it or in folders of it; labels.json is written to it
        source: the data set
        opening: width and height of its gates between the bars, metres
        bar: width of the bars, seen from the front, metres
        calibration: of its camera: a JSON file of the data set, or one of `framerunner camera calibrate`
        colour: by which the detector to be rated calls these gates
    """
    from framerunner.geometry.gate_shape import BAR_LIMITS_M, SIZE_LIMITS_M
    from framerunner.vision_evaluation.own_pictures import FILE, PictureShape
    from framerunner.vision_evaluation.tii_labels import convert

    check_range("--bar", bar, *BAR_LIMITS_M)
    for size_m in opening:
        check_range("--opening", size_m, SIZE_LIMITS_M[0], SIZE_LIMITS_M[1] - 2 * bar)
    outer_width_m, outer_height_m = (size_m + 2 * bar for size_m in opening)
    shape = PictureShape(outer_width_m=outer_width_m, outer_height_m=outer_height_m, bar_m=bar, depth_m=bar)
    if (folder / FILE).exists():
        raise SettingError(f"{folder / FILE}: is there already and is left as it is; move it away")
    converted = convert(folder, shape, colour, calibration)
    write_new({folder / FILE: converted.labels.as_text()}, "FOLDER")
    pictures = converted.labels.images
    whole = sum(gate.whole for picture in pictures for gate in picture.frames)
    say(f"{FILE}: {len(pictures)} pictures, {whole} gates wholly in view")
    if converted.unlabelled:
        say(f"{converted.unlabelled} pictures have no text file and are left out")
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
