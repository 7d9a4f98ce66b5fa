"""One drone of the server: its simulation, its links and its video."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from types import MappingProxyType

from firmware_py.mavlink.camera.model import FixedCamera
from firmware_py.mavlink.node import MavlinkNode, NodeOptions
from firmware_py.mavlink.telemetry.profiles import ONBOARD
from firmware_py.storage import Path, Storage
from firmware_py.ulog import UlogRecorder
from framerunner.geometry.solids import Solid
from framerunner.wire.dialect import mavlink
from framerunner.wire.transports.urls import in_url
from sitl.link_hub import LinkHub
from sitl.pacing.time_grants import TimeGrants, Velocity
from sitl.parameter_file import ParameterKeeper, open_parameters
from sitl.payload.album import CameraAlbum
from sitl.server_settings import ServerSettings
from sitl.simulation import Simulation
from sitl.storage import open_storage
from sitl.streaming.streams import video_streams
from sitl.video import DroneVideo
from sitl.world import CONTROL_PERIOD_US

_REQUESTED_US = MappingProxyType(
    {
        mavlink.MAVLINK_MSG_ID_HIGHRES_IMU: CONTROL_PERIOD_US,
        mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED: 20_000,
        mavlink.MAVLINK_MSG_ID_ODOMETRY: 100_000,
    }
)
"""What the program that grants time will request: before that, too, it gets what it gets in lockstep."""
_REPEAT_S = 0.1  # wall time; while time stands before the first grant, the app finds the drone by that


class ServedDrone:
    """Puts one simulation on MAVLink and video; it advances when `tick` is called.

    Args:
        simulation: of the drone.
        settings: of this drone.
        boot_unix_us: time now, microseconds since 1970.
        notice: called with lines for people.
        grants: how far simulated time may advance; None: without a limit.

    Raises:
        StorageFolderError: the folder for its files cannot be used.
        ParameterFileError: the file of its parameters cannot be read, or a line is wrong.

    Attributes:
        simulation: as given.
        node: its MAVLink services.
    """

    def __init__(
        self,
        simulation: Simulation,
        settings: ServerSettings,
        boot_unix_us: int,
        notice: Callable[[str], None] = lambda line: None,
        grants: TimeGrants | None = None,
    ) -> None:
        self.simulation = simulation
        self._settings, self._grants = settings, grants
        self._keeper: ParameterKeeper | None = None
        if settings.parameters is not None:
            self._keeper = open_parameters(
                simulation.autopilot.parameters, settings.parameters, notice, settings.instance + 1
            )
        storage = open_storage(settings.storage, settings.instance)
        camera = simulation.scenario.camera
        model = FixedCamera(camera.width_px, camera.height_px, camera.horizontal_fov_rad, camera.rate_hz)
        self._album = CameraAlbum(storage, boot_unix_us, camera.rate_hz)
        self._recorder = flight_recorder(storage, boot_unix_us)
        self.node = MavlinkNode(
            simulation.autopilot,
            options=NodeOptions(
                system_id=settings.instance + 1,
                boot_unix_us=boot_unix_us,
                signing_key=settings.signing_key,
                video=video_streams(self._settings, self.simulation.scenario.camera),
                storage=storage,
                shell=settings.shell,
                log_text=self._recorder.hear_text,
                camera=model if settings.camera else None,
                captures=self._album,
                switch_video=self._switch_rtp,
                gimbal=simulation.gimbal,
                gripper=simulation.scenario.gripper,
                failures=simulation.faults,
                truth=simulation.true_state,
            ),
        )
        self._notice = simulation.faults.notice = notice
        self._hub = LinkHub(self.node, self._warn, lambda: simulation.faults.link)
        self._video = DroneVideo(simulation, settings, grants)

    async def open_links(self) -> None:
        """Open the links and send at once.

        Raises:
            LinkError: one cannot be opened.
        """
        for profile, addresses in self._settings.default_links:
            is_apps = self._grants is not None and profile.name == ONBOARD.name
            used = replace(profile, requested_us=_REQUESTED_US) if is_apps else profile
            await self._hub.open_udp(used, addresses)
        if self._settings.payload is not None:
            await self._hub.open_payload(*self._settings.payload)
        self._hub.update(0)
        if self._keeper is not None:
            self._keeper.start()
        for link in self._settings.links:
            await self._hub.open(link)

    async def open_video(self, others: Callable[[], Sequence[Solid]] = tuple) -> None:
        """Serve the camera's images.

        Args:
            others: called at each exposure for the boxes of other drones.

        Raises:
            VideoError: a port is in use or an address is wrong.
        """
        await self._video.open(others)

    def _switch_rtp(self, on: bool) -> None:  # the interface's
        self._video.sends_rtp = on

    def _warn(self, line: str) -> None:
        """Show a line at the terminal and at ground stations."""
        self._notice(line)
        self.simulation.autopilot.say(mavlink.MAV_SEVERITY_WARNING, line)

    def tick(self) -> None:
        """Advance by one control period, then serve the log, the links and the video."""
        simulation = self.simulation
        # Not the estimate's time, which does not advance while sensors are unusable.
        sampled_us = simulation.time_us
        simulation.tick()
        self._recorder.update(simulation.autopilot)
        self._hub.update(sampled_us)
        image = self._video.step()
        if image is not None:
            self._album.show(image, self._video.image_us)

    @property
    def holds(self) -> bool:
        """Whether the next tick must wait for the program that grants time.

        Its flight begins, like one in lockstep, when the drone first gets ready; without a grant no time
        passes after that.
        """
        grants = self._grants
        if grants is None:
            return False
        return self.simulation.time_us > grants.until_us or (
            not grants.used and self.simulation.autopilot.status.ready
        )

    async def hold(self) -> None:
        """Wait until simulated time may advance."""
        grants = self._grants
        assert grants is not None, "time is granted"

        def received() -> Velocity | None:
            self._hub.read()  # on a flooded link, a setpoint may still wait
            return self.simulation.autopilot.setpoints.newest_velocity()

        if not grants.used:
            while not await grants.first(_REPEAT_S):
                self._hub.repeat()
            return
        await grants.hold(self.simulation.time_us - CONTROL_PERIOD_US, self._video.image_us, received)

    async def close(self) -> None:
        """Finish the log, save the parameters, stop the video and close the links."""
        self._recorder.finish(self.simulation.autopilot)
        self._album.close()
        if self._keeper is not None:
            await self._keeper.close()
        await self._video.close()
        self._hub.close()

    def greeting(self) -> str:
        """One line for people: airframe, scenario and addresses."""
        scenario, settings = self.simulation.scenario, self._settings
        assert settings.onboard.remote is not None
        assert settings.ground.remote is not None
        ports = f"{settings.onboard.remote[1]} and {settings.ground.remote[1]}"
        page = f"http://{in_url(settings.bind, settings.http_port)}/"
        rtp = "" if settings.video_rtp is None else f" and as RTP to UDP {settings.video_rtp[1]}"
        return f"{scenario.airframe} in {scenario.name}: MAVLink to UDP {ports}, video on {page}{rtp}"


def _utc(unix_us: int, form: str) -> str:
    return datetime.fromtimestamp(unix_us / 1e6, UTC).strftime(form)


def flight_recorder(storage: Storage, boot_unix_us: int) -> UlogRecorder:
    """A recorder that names logs as PX4 does, `log/2026-11-20/14_05_59.ulg` (UTC).

    Args:
        storage: where the logs are written.
        boot_unix_us: time of boot in microseconds since 1970.
    """

    def name_log(time_us: int) -> Path:
        began_us = boot_unix_us + time_us
        return ("log", _utc(began_us, "%Y-%m-%d"), _utc(began_us, "%H_%M_%S.ulg"))

    return UlogRecorder(storage, name_log, boot_unix_us=boot_unix_us)
