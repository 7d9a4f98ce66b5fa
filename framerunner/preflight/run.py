"""The checks before a real drone is armed: measured, judged, told, and written on the flight card."""

from __future__ import annotations

import asyncio
import sys
import threading
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from framerunner.camera_calibration.camera_delay import UNMEASURED, CameraDelay
from framerunner.doctor.camera_times import days_since, measure_camera
from framerunner.doctor.checks import examine
from framerunner.doctor.listen import listen
from framerunner.errors import UserError
from framerunner.flying.plan import FlightPlan
from framerunner.geometry.axes import ArenaAlignment, Pose
from framerunner.preflight.check_names import CHECK_NAMES, RENAMED, REPLACED
from framerunner.preflight.kept import OPTION, KeptState, write_kept
from framerunner.preflight.link import open_client
from framerunner.vehicle.geodesy import GeodeticPoint, LocalProjection
from framerunner.wire.dialect import degrees_e7
from framerunner.wire.session.client import TIME_REQUESTS, VehicleClient
from framerunner.wire.session.fence import (
    FenceItem,
    Vertex,
    download_fence,
    is_same_fence,
    polygon_fence,
    upload_fence,
)
from framerunner.wire.session.record import Record
from framerunner.wire.session.session import ParameterValue, VehicleError
from offboard.safety.check import Check, Outcome, accept, check_names, failures, passed
from offboard.safety.failsafes import failsafe_checks, failsafe_rows, rows_by_known_names, values_to_set
from offboard.safety.fence import FlightFence, flight_fence
from offboard.safety.rules import AbortAction
from offboard.safety.vehicle_checks import (
    battery_check,
    calibration_checks,
    camera_checks,
    estimator_check,
    link_checks,
)

LISTEN_S = 5.0
FENCED = ("PX4", "ArduPilot")
"""Autopilots that take a fence as mission items."""
CAMERA_S = 3.0
KEPT_PARAMETERS = "parameters-before{}.params"


class NotArmedError(UserError):
    """Checks before arming failed; the message is one line for people."""


@dataclass(frozen=True, slots=True)
class PreflightSettings:
    """What to check.

    Attributes:
        drone_url: of the vehicle.
        camera_url: of its camera; None: it is not checked.
        camera_delay: of images without time stamps.
        set_parameters: failsafe parameters that fail are set, and their old values kept.
        accepted: names of checks that may fail.
        folder: where the old values are written.
        abort: what the drone does when the flight is aborted.
    """

    drone_url: str
    camera_url: str | None = None
    camera_delay: CameraDelay = UNMEASURED
    set_parameters: bool = False
    accepted: tuple[str, ...] = ()
    folder: Path = Path()
    abort: AbortAction = "land"


@dataclass(frozen=True, slots=True)
class ParameterChange:
    """A parameter that was set before the flight."""

    name: str
    before: float
    after: float


@dataclass(frozen=True, slots=True)
class PreflightReport:
    """What the checks have found.

    Attributes:
        vehicle: the drone in words.
        system_id: its MAVLink id.
        checks: all, in the order in which they are told.
        fence: of the flight.
        changes: of parameters.
        kept: the file with their old values and the old fence; None if nothing was changed.
    """

    vehicle: str
    system_id: int
    checks: tuple[Check, ...]
    fence: FlightFence
    changes: tuple[ParameterChange, ...] = ()
    kept: Path | None = None

    @property
    def may_arm(self) -> bool:
        """Whether no check prevents arming."""
        return not failures(self.checks)

    @property
    def verdict(self) -> str:
        """Whether it may be armed, in words, and what prevents it."""
        names = [check.name for check in failures(self.checks)]
        if not names:
            return "it may be armed"
        what = "a check has failed" if len(names) == 1 else f"{len(names)} checks have failed"
        each = "it, or accept it" if len(names) == 1 else "them, or accept each"
        return f"not armed: {what} ({', '.join(names)}); correct {each} by --accept NAME"

    def require(self) -> None:
        """Raise `NotArmedError` if a check prevents arming."""
        if not self.may_arm:
            raise NotArmedError(self.verdict)


@dataclass(frozen=True, slots=True)
class _Measured:
    """What was found on the link, on a thread."""

    record: Record
    round_trips_s: tuple[float, ...]
    checks: tuple[Check, ...]
    changes: tuple[ParameterChange, ...]
    kept: Path | None


async def run_preflight(plan: FlightPlan, settings: PreflightSettings) -> PreflightReport:
    """Check a disarmed vehicle and its camera; takes some eight seconds.

    Raises:
        VehicleError: the vehicle is not heard or does not answer.
        LinkError: its link cannot be opened.
        SettingError: a name that is accepted is no check's, or the old parameters cannot be kept.
    """
    check_names(settings.accepted, CHECK_NAMES)
    fence = flight_fence(plan.box, plan.start_pose[:3])
    cancelled = threading.Event()
    url, watching = settings.camera_url, None
    if url is not None:
        watching = asyncio.create_task(measure_camera(url, CAMERA_S))
    try:
        measured = await asyncio.to_thread(_measure, plan, settings, fence, cancelled)
        times = None if watching is None else await watching
    finally:
        cancelled.set()
        if watching is not None:
            watching.cancel()
            await asyncio.gather(watching, return_exceptions=True)
    record = measured.record
    checks = [
        *(
            replace(each, name=RENAMED.get(each.name, each.name))
            for each in examine(record)
            if each.name not in REPLACED  # by checks with a limit
        ),
        estimator_check(record.estimator, "EKF_STATUS_REPORT" if record.is_ardupilot else "ESTIMATOR_STATUS"),
        battery_check(*record.charge),
        *link_checks(record.packets.lost_share, measured.round_trips_s, TIME_REQUESTS),
        *measured.checks,
        _caps_check(plan, fence),
    ]
    if times is not None:
        clock_ms = record.clock_ms[-1] if record.clock_ms else None
        checks += camera_checks(times.facts(clock_ms, settings.camera_delay))
        if plan.chart.vision == "frames":
            checks += calibration_checks(plan.calibration, times.size_px, days_since)
    accepted = tuple(accept(checks, settings.accepted))
    vehicle = (
        f"{record.autopilot_name}, {record.type_name}, system {record.system_id}, mode {record.mode_name}"
    )
    return PreflightReport(vehicle, record.vehicle, accepted, fence, measured.changes, measured.kept)


def tell(report: PreflightReport) -> None:
    """Print each check on a line, and what was changed, on standard error.

    Where the old values are was told when they were written: what follows may fail.
    """
    lines = [check.line for check in report.checks]
    lines += [f"set      {each.name}: {each.before:g} -> {each.after:g}" for each in report.changes]
    print("\n".join(lines), file=sys.stderr, flush=True)


def _measure(
    plan: FlightPlan, settings: PreflightSettings, fence: FlightFence, cancelled: threading.Event
) -> _Measured:
    """All that is done on the link; blocks."""
    standing = Pose(plan.start_pose[:3], plan.start_pose[3]) if plan.alone else None
    with open_client(settings.drone_url, cancelled, standing) as client:
        listen(client, LISTEN_S)
        record = client.session
        round_trips_s = client.round_trips_s()
        has_position = record.has_global_position
        checks: list[Check] = []
        rows = failsafe_rows(record.autopilot_name.lower(), settings.abort)
        if not rows:
            advice = "check them by hand, then accept it by --accept failsafes"
            checks.append(Check("failsafes", Outcome.FAIL, "no table for this autopilot", "", advice))
        values = client.read_parameters([name for row in rows for name in row.names])
        rows = rows_by_known_names(rows, values)
        wanted: dict[str, float] = {}
        if settings.set_parameters and not record.armed:
            numbers = {name: each.value for name, each in values.items()}
            wanted = values_to_set(numbers, fence, has_global_position=has_position, rows=rows)
        upload = _FenceUpload(client, plan, fence)
        kept = _keep(client, wanted, values, upload, settings.folder)
        for name, value in wanted.items():
            client.set_parameter(ParameterValue(name, value, values[name].kind))
        changes = tuple(ParameterChange(name, values[name].value, value) for name, value in wanted.items())
        values |= client.read_parameters([*wanted])
        numbers = {name: each.value for name, each in values.items()}
        checks += failsafe_checks(numbers, fence, has_global_position=has_position, rows=rows)
        checks.append(upload.check())
    return _Measured(record, round_trips_s, tuple(checks), changes, kept)


def _keep(
    client: VehicleClient,
    wanted: Mapping[str, float],
    values: Mapping[str, ParameterValue],
    upload: _FenceUpload,
    folder: Path,
) -> Path | None:
    """Write what will be changed to a file, and tell where that is; None if nothing will be.

    Raises:
        SettingError: the file cannot be written.
    """
    if not wanted and not upload.replaces:
        return None
    fence = upload.before if upload.replaces else None
    uid, _ = client.identity()
    kept, path = KeptState(uid, tuple(values[name] for name in wanted), fence), _unused(folder)
    write_kept(path, client.session.vehicle, kept)
    what = " and ".join((*(["old values"] if wanted else []), *(["old fence"] if upload.replaces else [])))
    hint = f"return them by framerunner preflight {OPTION} {path}"
    print(f"{what}: {path}; {hint}", file=sys.stderr, flush=True)
    return path


def _unused(folder: Path) -> Path:
    """A new file for old values, so that those of an earlier flight are never lost."""
    numbers = ("", *(f"-{number}" for number in range(2, 1000)))
    paths = (folder / KEPT_PARAMETERS.format(number) for number in numbers)
    return next(path for path in paths if not path.exists())


def fence_vertices(record: Record, plan: FlightPlan, fence: FlightFence) -> tuple[Vertex, ...] | None:
    """The fence's corners on Earth, by the pose that the vehicle reports on its start; None: not known."""
    origin = record.latest.get("GPS_GLOBAL_ORIGIN")
    attitude, position = record.telemetry.attitude, record.telemetry.position
    if origin is None or attitude is None or position is None:
        return None
    start = Pose(plan.start_pose[:3], plan.start_pose[3])
    alignment = ArenaAlignment(start, Pose(position.position_ned_m, attitude.yaw_ned_rad))
    projection = LocalProjection(GeodeticPoint(origin.latitude / 1e7, origin.longitude / 1e7, 0.0))
    points = [projection.to_geodetic(corner) for corner in fence.corners_ned_m(alignment)]
    return tuple((degrees_e7(each.latitude_deg), degrees_e7(each.longitude_deg)) for each in points)


class _FenceUpload:
    """The flight's fence in the place of the vehicle's.

    Attributes:
        before: the fence that the vehicle has; None if it was not downloaded.
        problem: the check's result if nothing can be uploaded.
        replaces: the vehicle has another one, which is replaced.
    """

    def __init__(self, client: VehicleClient, plan: FlightPlan, fence: FlightFence) -> None:
        self._client = client
        self._limit = f"{len(fence.corners_arena_m)} corners within {fence.radius_m:g} m of the start"
        self._wanted: tuple[FenceItem, ...] = ()
        self.before: tuple[FenceItem, ...] | None = None
        self.problem = self._obstacle(plan, fence)
        if self.problem is None:
            try:
                self.before = download_fence(client)
            except VehicleError as error:
                advice = "none is uploaded, as the old one would be lost; or fly in a net and --accept fence"
                self.problem = Check("fence", Outcome.FAIL, str(error), self._limit, advice)
        self.replaces = self.before is not None and not is_same_fence(self.before, self._wanted)

    def check(self) -> Check:
        """Upload the fence and read it back."""
        name, limit = "fence", self._limit
        if self.problem is not None:
            return self.problem
        try:
            if self.replaces:
                upload_fence(self._client, self._wanted)
            same = is_same_fence(download_fence(self._client), self._wanted)
        except VehicleError as error:
            return Check(name, Outcome.FAIL, str(error), limit, "or fly inside a net and --accept fence")
        value = "uploaded and read back" if same else "another fence is read back"
        return passed(name, same, value, limit, "try again; another station may write to it")

    def _obstacle(self, plan: FlightPlan, fence: FlightFence) -> Check | None:
        """Why none can be uploaded; None if it can."""
        record, name, limit = self._client.session, "fence", self._limit
        if record.armed:
            return Check(name, Outcome.FAIL, "not uploaded to an armed vehicle", limit, "land and disarm it")
        if record.autopilot_name not in FENCED:
            advice = "set one by hand, then accept it by --accept fence"
            return Check(name, Outcome.FAIL, "not uploaded: this autopilot's is not known", limit, advice)
        if not record.has_global_position:
            words = "the vehicle has no global position, so its fence has no effect"
            advice = "only the app's box and a net keep it in; put up a net"
            return Check(name, Outcome.NOTE, words, limit, advice)
        vertices = fence_vertices(record, plan, fence)
        if vertices is None:
            advice = "wait until it reports attitude and position"
            return Check(name, Outcome.FAIL, "the vehicle's pose is not known", limit, advice)
        self._wanted = polygon_fence(vertices)
        return None


def _caps_check(plan: FlightPlan, fence: FlightFence) -> Check:
    limits, height_m = plan.command_limits, plan.box.high_m[2] - plan.start_pose[2]
    caps = plan.caps
    if caps is None:
        return Check("caps", Outcome.FAIL, "none", "", "give --max-speed")
    value = f"{replace(caps, height_m=None).words}, {height_m:.1f} m above the start"
    limit = f"below the fence, {fence.height_m:g} m"
    if height_m >= fence.height_m:
        return Check("caps", Outcome.FAIL, value, limit, "give a lower --max-height")
    if limits.forward_m_s > caps.level_m_s or max(limits.up_m_s, limits.down_m_s) > caps.vertical_m_s:
        return Check("caps", Outcome.NOTE, value, limit, "they are below what the mission may ask for")
    return Check("caps", Outcome.PASS, value, limit)
