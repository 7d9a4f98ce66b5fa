"""Where poses come from: a file, a UDP stream, a motion capture server, or the truth of a simulator."""

from __future__ import annotations

import socket
import sys
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from math import cos, inf, isnan, radians
from pathlib import Path
from random import Random
from subprocess import DEVNULL, PIPE, Popen, TimeoutExpired
from types import MappingProxyType

from framerunner.extras import install_advice, is_installed
from framerunner.geometry.rotations import multiply, normalized
from framerunner.geometry.vectors import Quaternion, Vec3
from framerunner.mocap.capture import KINDS
from framerunner.mocap.poses import Axes, MeasuredPose, PoseError, parse_line, read_poses
from framerunner.wire.dialect import Message, mavlink
from framerunner.wire.transports.sockets import UdpSocket, bind_udp
from framerunner.wire.transports.urls import UrlRules, parse_url

_METRES = 111_319.5e-7  # a unit of latitude, 1e-7 degrees
_SPAN_S = 0.4  # in which a step of the source's clock is followed
_LOW = 0.2  # share of the differences that may be wrong without an effect
_QUEUED = 0.3  # poses that come faster than their stamps by more than this share come from a queue
_GAP_S = 0.2  # a longer time without poses counts as this long
MAX_LATE_S = 0.1  # of a pose that is used
_MAX_DIFFERENCES = 400
_END_S = 2.0
_STREAM = UrlRules("bad source '{}'", "udpin://0.0.0.0:9870, poses.csv, sitl, optitrack://192.168.1.5")


@dataclass(frozen=True, slots=True)
class TimedPose:
    """A pose and when it was taken, in seconds of this program's clock."""

    pose: MeasuredPose
    taken_s: float
    vehicle_time_us: int | None = None  # if the source gives it in vehicle time


class PoseSource(ABC):
    """Delivers poses as they come.

    Attributes:
        label: what it is, for people.
        ended: it will deliver nothing more.
        fault: what was wrong with data that it received last; empty: nothing was.
        faults: how often that happened.
        failure: why it has ended; empty: it has not, or as it should.
        needs_truth: it is made from a simulated vehicle's true pose.
        streams_hz: rates of messages, by their ids, of which it is made otherwise.
    """

    ended = False
    fault = ""
    faults = 0
    failure = ""
    needs_truth = False
    streams_hz: Mapping[int, float] = MappingProxyType({})

    def __init__(self, label: str) -> None:
        self.label = label

    @abstractmethod
    def poll(self, now_s: float) -> list[TimedPose]:
        """The poses that have come since the last call, oldest first."""

    def take(self, message: Message, now_s: float) -> None:  # noqa: B027 - most need none
        """Take a message of the vehicle, of which a source may be made."""

    def close(self) -> None:  # noqa: B027 - some have nothing open
        """Close it."""


class SourceClock:
    """Converts a source's time stamps into this program's time, and leaves out poses with wrong ones.

    The usual difference between arrival and time stamp stands for a way without queues, whose length cannot
    be measured from here: a pose counts as taken when it would have arrived by it. What remains is the
    constant delay of the motion capture.

    The usual difference stays between the least and a low quantile of those of the last `_SPAN_S`. So a
    single one does not change it, and a step of the source's clock does after that time. Until then the poses
    are as late as those from a queue, which come faster than their stamps and never change it.
    """

    def __init__(self) -> None:
        self._differences: deque[tuple[float, float]] = deque(maxlen=_MAX_DIFFERENCES)  # by `_heard_s`
        self._usual_s = inf
        self._heard_s = self._arrived_s = 0.0  # time in which poses came; the last arrival

    def taken_s(self, stamp_s: float, now_s: float) -> float | None:
        """When a pose was taken, None: it is unknown; without a time stamp (NaN) it is when it arrives."""
        if isnan(stamp_s):
            return now_s
        difference_s = now_s - stamp_s
        self._heard_s += min(now_s - self._arrived_s, _GAP_S)
        self._arrived_s = now_s
        self._differences.append((self._heard_s, difference_s))
        while self._differences[0][0] < self._heard_s - _SPAN_S:
            self._differences.popleft()
        oldest_s, before_s = self._differences[0]
        if before_s - difference_s <= _QUEUED * (self._heard_s - oldest_s):
            self._usual_s = max(self._usual_s, min(each for _, each in self._differences))
        ordered = sorted(each for _, each in self._differences)
        self._usual_s = min(self._usual_s, ordered[int(_LOW * len(ordered))])
        late_s = difference_s - self._usual_s
        return now_s - max(late_s, 0.0) if late_s <= MAX_LATE_S else None


class FileSource(PoseSource):
    """Plays a file of poses in real time, once.

    Raises:
        PoseError: the file cannot be used.
    """

    def __init__(self, path: Path, axes: Axes, name: str | None) -> None:
        super().__init__(str(path))
        self._poses = deque(read_poses(path, axes, name))
        self._began_s: float | None = None
        self._first_s = self._poses[0].time_s

    def poll(self, now_s: float) -> list[TimedPose]:
        """Those whose time has come."""
        if self._began_s is None:
            self._began_s = now_s
        due = []
        while self._poses:
            taken_s = self._began_s + self._poses[0].time_s - self._first_s
            if taken_s > now_s:
                break
            due.append(TimedPose(self._poses.popleft(), taken_s))
        self.ended = not self._poses
        return due


class UdpSource(PoseSource):
    """Lines of JSON in UDP datagrams.

    Args:
        receiver: the socket on which they come.
        label: of the source, for people.
        axes: of records that name none.
        name: of the tracked body; None: the first that comes.
    """

    def __init__(self, receiver: UdpSocket, label: str, axes: Axes, name: str | None) -> None:
        super().__init__(label)
        self._socket, self._axes, self._name = receiver, axes, name
        self._any_name = name is None
        self._clock = SourceClock()

    def poll(self, now_s: float) -> list[TimedPose]:
        """Those that have arrived; a line that is no pose is counted."""
        found = []
        for data, _ in self._socket.read_all():
            for line in data.splitlines():
                if not line.strip():
                    continue
                try:
                    record = parse_line(line)
                    if self._is_wanted(record.name):
                        pose = record.pose(self._axes)
                        found.append(TimedPose(pose, self._taken_s(pose.time_s, now_s)))
                except PoseError as error:
                    self.fault, self.faults = str(error), self.faults + 1
        return found

    def _taken_s(self, stamp_s: float, now_s: float) -> float:
        taken_s = self._clock.taken_s(stamp_s, now_s)
        if taken_s is None:
            raise PoseError(
                f"time_s: {stamp_s:g} is more than {MAX_LATE_S:g} s behind its arrival, by the poses before"
            )
        return taken_s

    def _is_wanted(self, name: str | None) -> bool:
        if self._any_name and self._name is None:
            self._name = name
        if self._any_name and name != self._name:
            raise PoseError(f"name: {name} is tracked as well as {self._name}; choose one with --body")
        return self._any_name or name == self._name

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()


class ServerSource(UdpSource):
    """A motion capture server, through the program `framerunner.mocap.capture`.

    Args:
        kind: one of `KINDS`.
        host: of the server.
        axes: of room and body.
        name: of the tracked body; None: the first that comes.

    Raises:
        PoseError: the library is not installed.
    """

    def __init__(self, kind: str, host: str, axes: Axes, name: str | None) -> None:
        if not is_installed("motioncapture"):
            raise PoseError(f"{kind}://{host}: {install_advice('motioncapture')}")
        opened = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        opened.bind(("127.0.0.1", 0))
        port = opened.getsockname()[1]
        super().__init__(UdpSocket(opened), f"{kind}://{host}", axes, name)
        self._program = Popen(
            [sys.executable, "-m", "framerunner.mocap.capture", kind, host, str(port)],
            stdin=PIPE,
            stdout=DEVNULL,
            stderr=PIPE,
            text=True,
        )

    def poll(self, now_s: float) -> list[TimedPose]:
        """Those that have arrived.

        Raises:
            PoseError: the program has ended; the message is its last line.
        """
        if self._program.poll() is not None:
            lines = (self._program.stderr.read() if self._program.stderr else "").strip().splitlines()
            raise PoseError(lines[-1] if lines else f"{self.label}: its client has ended")
        return super().poll(now_s)

    def close(self) -> None:
        """End the program."""
        if self._program.stdin is not None:
            self._program.stdin.close()
        try:
            self._program.wait(_END_S)
        except TimeoutExpired:
            self._program.kill()
            self._program.wait()
        super().close()


class SitlSource(PoseSource):
    """The true state that a simulated vehicle sends: HIL_STATE_QUATERNION, or ArduPilot's SIM_STATE.

    Its origin is where the vehicle is first heard. White noise is added, as a motion capture has it: the
    messages have latitudes in steps of 1 cm, and an estimator takes a pose that never changes for a fault.

    Args:
        position_noise_m: standard deviation of each axis.
        attitude_noise_rad: standard deviation about each axis.
    """

    needs_truth = True

    def __init__(self, position_noise_m: float = 0.002, attitude_noise_rad: float = 0.003) -> None:
        super().__init__("the simulator's truth")
        self._noise = (position_noise_m, attitude_noise_rad)
        self._random = Random(1)
        self._origin: tuple[int, int, float] | None = None
        self._taken: list[TimedPose] = []

    def take(self, message: Message, now_s: float) -> None:
        """Take a true state."""
        truth = _truth(message)
        if truth is None:
            return
        latitude, longitude, altitude_m = truth.place
        origin = self._origin = self._origin or truth.place
        position = (
            (latitude - origin[0]) * _METRES,
            (longitude - origin[1]) * _METRES * cos(radians(origin[0] * 1e-7)),
            origin[2] - altitude_m,
        )
        sigma_m, sigma_rad = self._noise
        north_m, east_m, down_m = (value + self._random.gauss(0.0, sigma_m) for value in position)
        half = [self._random.gauss(0.0, sigma_rad / 2.0) for _ in range(3)]
        attitude = normalized(multiply(truth.attitude, (1.0, half[0], half[1], half[2])))
        pose = MeasuredPose(truth.time_us / 1e6, (north_m, east_m, down_m), attitude, truth.velocity_ned_m_s)
        self._taken.append(TimedPose(pose, now_s, truth.time_us or None))

    def poll(self, now_s: float) -> list[TimedPose]:
        """Those that have come."""
        taken, self._taken = self._taken, []
        return taken


@dataclass(frozen=True, slots=True)
class _Truth:
    """A true state: latitude and longitude in 1e-7 degrees with the altitude in metres; 0 us: no time."""

    time_us: int
    place: tuple[int, int, float]
    attitude: Quaternion
    velocity_ned_m_s: Vec3


def _truth(message: Message) -> _Truth | None:
    """The state in a message; None if it has none."""
    number = message.get_msgId()
    if number == mavlink.MAVLINK_MSG_ID_HIL_STATE_QUATERNION:
        w, x, y, z = message.attitude_quaternion
        velocity = (message.vx / 100.0, message.vy / 100.0, message.vz / 100.0)
        place = (message.lat, message.lon, message.alt / 1000.0)
        return _Truth(message.time_usec, place, (w, x, y, z), velocity)  # PX4 leaves the time out
    if number == mavlink.MAVLINK_MSG_ID_SIM_STATE:
        attitude = (message.q1, message.q2, message.q3, message.q4)
        velocity = (message.vn, message.ve, message.vd)
        return _Truth(0, (message.lat_int, message.lon_int, message.alt), attitude, velocity)
    return None


def open_source(text: str, axes: Axes, name: str | None) -> PoseSource:
    """A source by its name: `sitl`, a udpin:// address, a server of `KINDS`, or a file.

    Raises:
        PoseError: a file cannot be used.
        LinkError: an address cannot be used.
    """
    if text == "sitl":
        return SitlSource()
    scheme, separator, address = text.partition("://")
    if not separator:
        return FileSource(Path(text), axes, name)
    if scheme in KINDS and address:
        return ServerSource(scheme, address, axes, name)
    parsed = parse_url(text, _STREAM)
    if parsed.scheme != "udpin":
        raise PoseError(f"{text}: a stream of poses comes by UDP, such as udpin://0.0.0.0:{parsed.number}")
    return UdpSource(bind_udp(parsed.place, "choose another port"), parsed.text, axes, name)
