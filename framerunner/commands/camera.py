"""`framerunner camera`: the arena's image for any drone that reports its pose; calibration of cameras."""

from __future__ import annotations

import asyncio
from dataclasses import astuple, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import App, Parameter

from framerunner.commands import ShowLayout, WholeNumber, say, within
from framerunner.errors import SettingError

if TYPE_CHECKING:
    from vision.calibration.board import CharucoBoard

app = App(name="camera")
calibration = App(name="calibrate")
app.command(calibration)


@Parameter(name="*", group="Board")
@dataclass(frozen=True, slots=True, kw_only=True)
class BoardOptions:
    """The board, as it is printed.

    Attributes:
        columns: squares from left to right, 4 to 20
        rows: squares from top to bottom, 3 to 20
        square: edge of a square, mm
        marker: edge of a marker, mm
    """

    columns: Annotated[WholeNumber, within(4, 20)] = 8
    rows: Annotated[WholeNumber, within(3, 20)] = 5
    square: Annotated[float, within(5.0, 500.0)] = 30.0
    marker: float = 22.0


_USUAL_BOARD = BoardOptions()


@app.default
def camera(
    *,
    drone: str = "udpin://127.0.0.1:14550",
    scenario: str = "test-case-1",
    no_base: bool = False,
    level: bool = False,
    bind: str = "127.0.0.1",
    port: Annotated[WholeNumber, within(1, 65535)] = 8100,
    show_layout: ShowLayout = False,
) -> int:
    """Render what a camera on a drone would see of the arena, from the pose that the drone reports.

    For a drone without frames around it: a genuine PX4 SITL, or a real drone in an empty hall. Put it on
    its start and start this while it is disarmed: the arena is placed so that the drone stands on the
    scenario's start with the start's heading, whatever its compass says. Video and `/referee.json` are
    those of `framerunner sim`. Stop it with Ctrl-C.

    **Examples**

        framerunner camera --scenario test-case-1

        framerunner camera --scenario test-case-1 --no-base --port 8081

        framerunner camera --drone serial:///dev/ttyUSB1:921600 --bind 0.0.0.0

    Args:
        drone: MAVLink URL on which the drone is heard
        scenario: name or file of the scenario whose frames are seen
        no_base: the drone starts from the floor: there is no base under it
        level: held level, as by a gimbal, whatever the drone's roll and pitch
        bind: address to serve the video on
        port: TCP port of the video
        show_layout: tell every app the layout.
    """
    from framerunner.virtual_camera.camera import VirtualCamera
    from framerunner.virtual_camera.server import COMPONENT_ID, SYSTEM_ID, CameraServer
    from framerunner.wire.transports.vehicle_link import VehicleLink
    from scenarios.loader import load_scenario
    from sitl.video import VideoServer

    loaded = load_scenario(scenario)
    link = VehicleLink(drone, system_id=SYSTEM_ID, component_id=COMPONENT_ID)
    virtual = VirtualCamera(loaded, level=level, base=not no_base)
    server = CameraServer(virtual, link, VideoServer(bind, port), say, show_layout=show_layout)
    asyncio.run(server.run())
    return 0


@calibration.command
def board(
    *,
    out: Path = Path("board.png"),
    printed: BoardOptions = _USUAL_BOARD,
) -> int:
    """Write the board, to be printed.

    Print it at 100 %, without fitting to the page, and glue it to something flat and stiff.

    **Example**

        framerunner camera calibrate board --out board.png

    Args:
        out: file to be written, PNG
        printed: the board.
    """
    from framerunner.camera_calibration.calibrate import write_board

    write_board(_board(printed), out)
    return 0


@calibration.default
def calibrate(
    sources: list[str],
    /,
    *,
    out: Path = Path("camera.yaml"),
    views: Annotated[WholeNumber, within(8, 60)] = 20,
    printed: BoardOptions = _USUAL_BOARD,
) -> int:
    """Find focal length, optical axis and lens distortion from images of the board.

    Show the board near and far, in the middle and in the corners of the image, tilted by 20 to 45 degrees to
    all sides; hold it still for each image, and let zoom and focus be as in flight. Printed are each view's
    error and what part of the image was covered.

    **Examples**

        framerunner camera calibrate photos/ --out camera.yaml

        framerunner camera calibrate rtsp://10.0.0.2/1 --views 25

        framerunner camera calibrate ost.yaml --out camera.yaml

    Args:
        sources: images, folders of images, a video, the URL or device of a camera, or a calibration file of
            ROS or OpenCV, which is converted
        out: file to be written, YAML
        views: how many different views to take from a camera, 8 to 60
        printed: the board.
    """
    from framerunner.camera_calibration.calibrate import calibrate as run

    run(_board(printed), sources, views, out, say)
    return 0


@app.command
def latency(
    source: str,
    /,
    *,
    seconds: Annotated[WholeNumber, within(8, 300)] = 20,
    led: Path | None = None,
    display_delay: Annotated[float, within(0.0, 0.2)] = 0.03,
) -> int:
    """Measure how long the camera's images take from exposure to arrival.

    The terminal blinks in white and black at random intervals, and the camera films it. The delay with which
    the images follow is what `fly --camera-delay` needs. Run it on the computer that flies the mission, with
    the camera, its settings and its link as in flight; fix the exposure if the camera lets you.

    **Examples**

        framerunner camera latency /dev/video0

        framerunner camera latency rtsp://10.0.0.2/1 --led /sys/class/leds/ACT/brightness

    Args:
        source: URL or device of the camera, as for `fly --camera`
        seconds: how long to film, 8 to 300 s
        led: file that switches an LED instead: /sys/class/leds/NAME/brightness; 1 is lit, 0 dark
        display_delay: of terminal and screen, s; it is subtracted. An LED has none
    """
    from framerunner.camera_calibration.latency import film, led_light, terminal_light

    light = terminal_light() if led is None else led_light(led)
    found = asyncio.run(film(light, source, float(seconds), say))
    if led is None:
        print(
            f"of {found.delay_s:.3f} s the terminal and the screen take {display_delay:g} s (--display-delay)"
        )
    delay_s = max(0.0, found.delay_s - (display_delay if led is None else 0.0))
    print(f"{found.images} images, {found.rate_hz:.1f} a second; correlation {found.correlation:.2f}")
    print(f"delay {delay_s:.3f} s (± {2 * found.std_s:.3f}); fly with --camera-delay {delay_s:.3f}")
    return 0


@app.command
def colours(
    swatches: list[str],
    /,
    *,
    calibration: Path = Path("camera.yaml"),
) -> int:
    """Learn the colours of your frames from swatches of their paint.

    Each swatch must fill the middle of its image, a fifth of width and height, in the light of the hall. A
    camera takes 20 images after you pressed Enter. Colours are then corrected in every image before frames
    are looked for; grey stays grey.

    **Examples**

        framerunner camera colours red=red.jpg green=green.jpg blue=blue.jpg

        framerunner camera colours red=0 green=0 blue=0 --calibration camera.yaml

    Args:
        swatches: red=SOURCE green=SOURCE blue=SOURCE: images of the paint, or a camera
        calibration: file of `framerunner camera calibrate`, which is given the colours
    """
    from framerunner.camera_calibration.colours import learn

    def ask(what: str) -> None:
        try:
            input(f"{what}, then press Enter ")
        except EOFError:
            raise SettingError("there is no terminal to press Enter in; give image files instead") from None

    learn(swatches, calibration, ask)
    return 0


@app.command
def extrinsics(
    flight: Path | None = None,
    /,
    *,
    drone: str | None = None,
    camera: str | None = None,
    calibration: Path = Path("camera.yaml"),
    position: str | None = None,
    seconds: Annotated[WholeNumber, within(20, 1800)] = 180,
) -> int:
    """Measure how the camera is mounted on the drone: roll, pitch, yaw, place, and the delay of its images.

    This is extrinsic (hand-eye) calibration by bundle adjustment. Frames are seen while the drone yaws and
    moves by a metre. Neither the frames' places nor the camera's angles need be known; the drone's position
    must be, as for a flight. From a live drone, which an operator flies or carries, it is said what movement
    is missing; nothing is commanded. Angles are refused if they are uncertain by more than 0.3 degrees.

    **Examples**

        framerunner camera extrinsics runs/20261124-120000-hall --calibration camera.yaml

        framerunner camera extrinsics --drone serial:///dev/ttyUSB0:921600 --camera 0

    Args:
        flight: a run folder of `fly --record`; without it --drone and --camera are watched
        drone: MAVLink URL on which the drone is heard
        camera: URL or device of its camera, as for `fly --camera`
        calibration: file of `framerunner camera calibrate`, which is given the mounting
        position: of the lens from the drone's centre in m, by a ruler: forward=0.08,left=0,up=0.02; by
            default that of the file, else 0.08 m forward
        seconds: s for which a live drone is watched, 20 to 1800
    """
    from framerunner.camera_calibration.mounting_report import finish, measure_recorded, place_of
    from framerunner.commands.options.named_numbers import place_of_lens

    place_m = None if position is None else place_of_lens(position)
    if flight is not None:
        if drone is not None or camera is not None:
            raise SettingError(f"{flight}: is a recorded flight; leave out --drone and --camera")
        search, known, stamped = measure_recorded(flight, calibration, place_m)
    else:
        if drone is None or camera is None:
            missing = "--drone" if drone is None else "--camera"
            raise SettingError(f"{missing}: is missing; name a run folder, or both --drone and --camera")
        from framerunner.camera_calibration.calibration_file import load_calibration
        from framerunner.camera_calibration.live_mounting import measure_live

        known = load_calibration(calibration, to_write=True)
        place = place_of(known, place_m, None)
        watch = measure_live(drone, camera, known, place, limit_s=float(seconds), say=say)
        search, stamped = asyncio.run(watch)
    finish(search, known, calibration, say, stamped=stamped)
    return 0


def _board(options: BoardOptions) -> CharucoBoard:
    """Check the options."""
    columns, rows, square, marker = astuple(options)
    from vision.calibration.board import CharucoBoard

    if not 0.4 * square <= marker <= 0.9 * square:
        raise SettingError(
            f"--marker {marker:g}: must be from {0.4 * square:g} to {0.9 * square:g}, 0.4 to 0.9 of --square"
        )
    if columns * rows > 200:
        raise SettingError(f"--columns {columns} --rows {rows}: more than 200 squares; use fewer")
    return CharucoBoard(columns, rows, square, marker)
