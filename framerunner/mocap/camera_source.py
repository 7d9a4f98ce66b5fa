"""Poses by the drone's own camera and IMU: what `framerunner vio` sends."""

from __future__ import annotations

import asyncio
import threading
from collections import deque
from dataclasses import dataclass, replace
from math import nan
from types import MappingProxyType

import cv2

from framerunner.flying.plan import StartPose
from framerunner.geometry.axes import ArenaAlignment, Pose, flip_vector
from framerunner.geometry.rotations import quaternion_from_euler
from framerunner.geometry.vectors import ZERO3, Vec3
from framerunner.mocap.poses import MeasuredPose
from framerunner.mocap.sources import PoseSource, TimedPose
from framerunner.wire.dialect import Message, mavlink
from offboard.drone import DroneState, ReportedAccuracy
from offboard.link.inertial import RATE_HZ, InertialFeed
from offboard.link.place_feedback import PERIOD_US, PlaceFeedback
from offboard.navigation.goals import CONTEST
from offboard.navigation.view import Surroundings
from offboard.navigation.world_model import WorldModel
from vision.calibration.lens import Lens
from vision.calibration.model import Calibration
from vision.detectors import new_detector
from vision.sources import open_source
from vision.tracks.tracker import DetectorWithTracks, PointTracker
from vision.types import CameraError, CameraFrame, Detections

IMAGES_WAITING = 32
SPACED_US = 35_000  # between two attitudes from which a pose is made: of 50 Hz every second one
_ACCURACY = ReportedAccuracy(1.0, 0.1, 1.0, 0.1, 1.0)  # of a vehicle that does not tell
_ON_GROUND = int(mavlink.MAV_LANDED_STATE_ON_GROUND)


@dataclass(frozen=True, slots=True)
class CameraSettings:
    """The drone's camera.

    Attributes:
        url: as `vision.sources.open_source` has it.
        calibration: of it.
        delay_s: from exposure to arrival, of images without a time stamp.
    """

    url: str
    calibration: Calibration
    delay_s: float


class CameraPoses(PoseSource):
    """The place by followed points and the vehicle's IMU; before the drone flies, where it was put.

    Args:
        camera: the drone's.
        surroundings: what is known of the arena.
        start: where the drone stands: x, y, z (metres) and yaw (radians), arena axes.
    """

    streams_hz = MappingProxyType(
        {mavlink.MAVLINK_MSG_ID_HIGHRES_IMU: RATE_HZ, mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: 5.0}
    )

    def __init__(self, camera: CameraSettings, surroundings: Surroundings, start: StartPose) -> None:
        super().__init__(f"the camera {camera.url}")
        self._images = _Images(camera)
        self._world = WorldModel(replace(surroundings, alone=True), CONTEST)
        self._start = Pose(start[:3], start[3])
        self._feedback = PlaceFeedback(self._start)
        self._inertial = InertialFeed()
        self._alignment: ArenaAlignment | None = None
        self._position: Message | None = None  # the last LOCAL_POSITION_NED
        self._landed = True
        self._tick_us = 0
        self._poses: list[TimedPose] = []
        self._passed_s = 0.0

    def take(self, message: Message, now_s: float) -> None:
        """Take a message of the vehicle."""
        kind = message.get_type()
        if kind == "HIGHRES_IMU":
            self._inertial.take_imu(message)
        elif kind == "ODOMETRY":
            self._inertial.take_odometry(message)
        elif kind == "LOCAL_POSITION_NED":
            self._position = message
        elif kind == "EXTENDED_SYS_STATE":
            self._landed = message.landed_state == _ON_GROUND
        elif kind == "ATTITUDE":
            time_us = message.time_boot_ms * 1000
            self._images.note_time(time_us)
            if not 0 <= time_us - self._tick_us < SPACED_US:
                self._tick_us = time_us
                self._tick(message, time_us, now_s)

    def poll(self, now_s: float) -> list[TimedPose]:
        """The poses since the last call."""
        self.failure = self._images.problem
        self.ended = bool(self.failure)
        if self._feedback.stands and now_s - self._passed_s >= PERIOD_US * 1e-6:
            self._pass(self._feedback.standing(0), ZERO3, now_s, None)  # without one, it has no clock
        poses, self._poses = self._poses, []
        return poses

    def close(self) -> None:
        """Close the camera."""
        self._images.close()

    def _tick(self, attitude: Message, time_us: int, now_s: float) -> None:
        state = self._state(attitude, time_us)
        if state is not None:
            estimated = self._world.observe(state, self._images.take())
            velocity_ned_m_s = flip_vector(estimated.velocity_arena_m_s)
            self._pass(self._feedback.flying(estimated), velocity_ned_m_s, now_s, time_us)

    def _pass(self, sent: Message, velocity_ned_m_s: Vec3, now_s: float, time_us: int | None) -> None:
        w, x, y, z = sent.q
        pose = MeasuredPose(nan, (sent.x, sent.y, sent.z), (w, x, y, z), velocity_ned_m_s)
        self._poses.append(TimedPose(pose, now_s, time_us))
        self._passed_s = now_s

    def _state(self, attitude: Message, time_us: int) -> DroneState | None:
        """The state that the vehicle reports; None before it has a place."""
        position = self._position
        if position is None:
            return None
        position_ned_m = (position.x, position.y, position.z)
        if self._alignment is None:
            self._alignment = ArenaAlignment(self._start, Pose(position_ned_m, attitude.yaw))
        alignment = self._alignment
        pose = alignment.pose(Pose(position_ned_m, attitude.yaw))
        turned = quaternion_from_euler(attitude.roll, attitude.pitch, attitude.yaw)
        return DroneState(
            time_us,
            *pose.position_m,
            pose.yaw_rad,
            alignment.vector((position.vx, position.vy, position.vz)),
            armed=True,  # it is estimated from the beginning
            landed=self._landed,
            position_age_s=max(0.0, time_us * 1e-6 - position.time_boot_ms * 1e-3),
            attitude_arena=alignment.attitude(turned),
            imu=self._inertial.take(time_us),
            accuracy=self._inertial.accuracy or _ACCURACY,
        )


class _Images:
    """Images of a camera, and the points in them, found on a thread.

    Attributes:
        problem: why there are no more; empty while there are.
    """

    def __init__(self, camera: CameraSettings) -> None:
        self.problem = ""
        self._camera = camera
        calibration = camera.calibration
        lens = None if calibration.is_ideal else Lens(calibration)
        finder = new_detector("frames", calibration=calibration)
        self._detect = DetectorWithTracks(finder, PointTracker(lens))
        self._found: deque[Detections] = deque(maxlen=IMAGES_WAITING)
        self._offset_us: float | None = None  # vehicle time less this machine's, of the quickest message
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._run, name="camera", daemon=True)
        self._thread.start()

    def note_time(self, time_us: int) -> None:
        """A message of this vehicle time has arrived."""
        offset_us = time_us - self._loop.time() * 1e6
        before_us = self._offset_us
        jumped = before_us is None or abs(offset_us - before_us) > 1e6
        self._offset_us = offset_us if jumped or before_us is None else max(offset_us, before_us)

    def take(self) -> tuple[Detections, ...]:
        """What the images since the last call showed."""
        taken = []
        while self._found:
            taken.append(self._found.popleft())
        return tuple(taken)

    def close(self) -> None:
        """Close the camera."""
        self._loop.call_soon_threadsafe(lambda: [task.cancel() for task in asyncio.all_tasks(self._loop)])
        self._thread.join(2.0)

    def _run(self) -> None:
        cv2.setNumThreads(1)
        try:
            self._loop.run_until_complete(self._watch())
        except asyncio.CancelledError:
            self.problem = "the camera was closed"
        except CameraError as error:
            self.problem = str(error)

    async def _watch(self) -> None:
        async with open_source(self._camera.url, reconnects=True) as source:
            async for frame in source.frames():
                time_us = self._exposed_us(frame)
                if time_us is not None:
                    self._found.append(self._detect(frame.image, time_us))
        self.problem = "the camera's stream ended"

    def _exposed_us(self, frame: CameraFrame) -> int | None:
        if frame.time_us is not None or self._offset_us is None:
            return frame.time_us
        return round((frame.received_s - self._camera.delay_s) * 1e6 + self._offset_us)
