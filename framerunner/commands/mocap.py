"""`framerunner mocap`: poses of a motion capture for any MAVLink vehicle."""

from __future__ import annotations

from contextlib import closing
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from framerunner.commands import check_range, within
from framerunner.errors import SettingError

if TYPE_CHECKING:
    from framerunner.mocap.facts import RoomOrigin, SendSettings


@Parameter(name="*")
@dataclass(frozen=True, slots=True, kw_only=True)
class Sending:
    """How poses are sent.

    Attributes:
        rate: poses a second that are sent at most, 1 to 250
        delay: milliseconds by which poses are older than they seem here, 0 to 500
        position_sigma: standard deviation of positions, m
        attitude_sigma: standard deviation of attitudes, rad
        velocity_sigma: standard deviation of velocities, m/s, if the source has them
        origin: LATITUDE,LONGITUDE,ALTITUDE of the room, degrees and metres: set in a drone that has none
    """

    rate: Annotated[float, within(1.0, 250.0)] = 50.0
    delay: Annotated[float, within(0.0, 500.0)] = 0.0
    position_sigma: Annotated[float, within(0.0, 10.0)] = 0.005
    attitude_sigma: Annotated[float, within(0.0, 3.0)] = 0.01
    velocity_sigma: Annotated[float, within(0.0, 10.0)] = 0.05
    origin: Annotated[str | None, Parameter(allow_leading_hyphen=True)] = None


def mocap(
    source: str,
    *,
    drone: str = "udpin://0.0.0.0:14540",
    frame: Literal["flu", "ned", "enu", "yup"] = "flu",
    forward: Annotated[float, within(-360.0, 360.0)] = 0.0,
    body: str | None = None,
    sending: Sending | None = None,
    seconds: Annotated[float | None, within(1.0, 1e6)] = None,
) -> int:
    """Send a motion capture's poses to a drone with PX4 or ArduPilot, and check that it uses them.

    While it runs, one line says each second how many poses are sent, whether the drone's estimator uses them,
    how far they are from the drone's own estimate, and, once the drone has been turned, whether the axes are
    right and how old the poses are. At the end a report says what is missing and what to do. Nothing is set
    in the drone except the rates of this link's messages and, with `--origin`, where on Earth the room is.
    When the source stops, nothing is sent: an old pose is never repeated.

    `sitl` is the true pose that a simulated drone sends on the same link: `framerunner sim --sensors
    external`, PX4's SIH on its display link, or ArduPilot's SITL.

    Exit code 0: the drone uses the poses and nothing is wrong, 1: something is missing, 2: bad input.

    **Examples**

        framerunner mocap udpin://0.0.0.0:9870 --drone serial:///dev/ttyUSB0:921600

        framerunner mocap optitrack://192.168.1.5 --frame yup --body drone

        framerunner mocap poses.csv --drone udpin://0.0.0.0:14550

        framerunner mocap sitl --drone udpin://127.0.0.1:19410

        framerunner mocap poses.csv --drone udpin://0.0.0.0:14550 --origin 40.4168,-3.7038,650

    Args:
        source: where poses come from: udpin://HOST:PORT, optitrack://HOST, vicon://HOST, qualisys://HOST,
            vrpn://HOST, a .csv or .jsonl file, or sitl
        drone: MAVLink URL of the drone
        frame: axes of room and body, for poses that do not name theirs
        forward: degrees from the tracked body's x axis to the drone's forward, counter-clockwise
        body: name of the tracked body; by default the first that comes
        sending: how poses are sent.
        seconds: stop after this many seconds; if not given at Ctrl-C
    """
    return _send(source, drone, (frame, body), _settings(sending or Sending(), forward), seconds)


def _settings(sending: Sending, forward: float) -> SendSettings:
    from framerunner.mocap.facts import SendSettings

    return SendSettings(
        rate_hz=sending.rate,
        forward_deg=forward,
        delay_s=sending.delay / 1000.0,
        position_sigma_m=sending.position_sigma,
        attitude_sigma_rad=sending.attitude_sigma,
        velocity_sigma_m_s=sending.velocity_sigma,
        origin=None if sending.origin is None else _origin(sending.origin),
    )


def _origin(text: str) -> RoomOrigin:
    from framerunner.mocap.facts import RoomOrigin

    try:
        latitude, longitude, altitude = (float(part) for part in text.split(","))
    except ValueError:
        raise SettingError(
            f"--origin {text}: must be LATITUDE,LONGITUDE,ALTITUDE, such as 40.4168,-3.7038,650"
        ) from None
    check_range("latitude of --origin", latitude, -90.0, 90.0)
    check_range("longitude of --origin", longitude, -180.0, 180.0)
    check_range("altitude of --origin", altitude, -1000.0, 10_000.0)
    if latitude == longitude == 0.0:
        raise SettingError(
            f"--origin {text}: latitude and longitude 0 mean that none is known; give the room's"
        )
    return RoomOrigin(latitude, longitude, altitude)


def _send(
    source: str,
    drone: str,
    frame_and_body: tuple[str, str | None],
    settings: SendSettings,
    seconds: float | None,
) -> int:
    from rich.console import Console

    from framerunner.mocap.poses import Axes
    from framerunner.mocap.run import run_session
    from framerunner.mocap.session import COMPONENT_ID, SYSTEM_ID
    from framerunner.mocap.sources import open_source
    from framerunner.wire.transports.vehicle_link import VehicleLink

    frame, body = frame_and_body
    with (
        closing(open_source(source, Axes(frame), body)) as poses,
        closing(VehicleLink(drone, system_id=SYSTEM_ID, component_id=COMPONENT_ID)) as link,
    ):
        fine = run_session(link, poses, settings, seconds, Console(highlight=False))
    return 0 if fine else 1
