from dataclasses import dataclass, field
from math import nan
from types import SimpleNamespace

import pytest

from firmware_py.estimation.ideal_estimator import ideal_report
from firmware_py.estimation.report import EstimatorReport
from firmware_py.mavlink.node import MavlinkNode, NodeOptions
from firmware_py.mavlink.telemetry.profiles import GROUND, ONBOARD
from firmware_py.missions.store import MissionStore
from firmware_py.navigator import MissionNavigator
from firmware_py.parameters import Parameters
from firmware_py.status import CommandResult, FlightMode, LandedState, VehicleStatus
from firmware_py.types import FlightRecord, MotorOutput, StatusText, VehicleState
from framerunner.vehicle.airframe import Airframe, load_airframe
from framerunner.vehicle.geodesy import GeodeticPoint, LocalProjection, is_on_earth
from framerunner.vehicle.measurements import BatteryState
from framerunner.wire.dialect import mavlink
from framerunner.wire.framing import PacketReader
from tests.firmware_py.mavlink.lossy import LossyPeer
from tests.node_input import deliver

HOME = GeodeticPoint(47.397742, 8.545594, 489.0)


@dataclass
class FakeAutopilot:
    """Records the calls of its methods and returns `result`."""

    airframe: Airframe
    parameters: Parameters = field(default_factory=Parameters)
    state: VehicleState = field(default_factory=VehicleState)
    status: VehicleStatus = field(default_factory=lambda: VehicleStatus(ready=True, home=HOME, origin=HOME))
    output: MotorOutput = field(default_factory=MotorOutput)
    battery: BatteryState = field(default_factory=BatteryState)
    flight: FlightRecord = field(default_factory=FlightRecord)
    missions: MissionStore = field(default_factory=MissionStore)
    wind: None = None
    place: GeodeticPoint | None = HOME
    result: CommandResult = CommandResult.ACCEPTED
    calls: list[tuple] = field(default_factory=list)
    setpoints: list = field(default_factory=list)
    texts: list[StatusText] = field(default_factory=list)
    ground_station_heard_count: int = 0
    report: EstimatorReport | None = None  # None: of ideal sensors
    poses: list = field(default_factory=list)

    def __post_init__(self):
        self.navigator = MissionNavigator(self.missions, self.parameters)

    @property
    def estimator(self):
        report = self.report or ideal_report(self.state, self.status.origin, has_position=True)
        return SimpleNamespace(report=lambda: report, take_external_pose=self.poses.append)

    def _called(self, *call):
        self.calls.append(call)
        return self.result

    def arm(self, *, force=False):
        return self._called("arm", force)

    def disarm(self, *, force=False):
        return self._called("disarm", force)

    def set_mode(self, mode: FlightMode):
        return self._called("set_mode", mode)

    def takeoff(self, altitude_amsl_m=nan):
        return self._called("takeoff", altitude_amsl_m)

    def land(self):
        return self._called("land")

    def terminate(self):
        return self._called("terminate")

    def reposition(self, target_ned_m, yaw_rad=nan, speed_m_s=nan):
        return self._called("reposition", target_ned_m, yaw_rad, speed_m_s)

    def orbit(self, orbit):
        return self._called("orbit", orbit)

    def change_speed(self, speed_m_s):
        return self._called("change_speed", speed_m_s)

    def look_at(self, point_ned_m):
        return self._called("look_at", point_ned_m)

    def set_home(self, point):
        return self._called("set_home", point)

    def set_origin(self, point):
        return self._called("set_origin", point)

    def manual_input(self, sticks):
        self.calls.append(("manual_input", sticks))

    def ground_station_heard(self):
        self.ground_station_heard_count += 1

    def follow_target(self, position_ned_m, velocity_ned_m_s):
        self.calls.append(("follow_target", position_ned_m, velocity_ned_m_s))

    def check_mission(self):
        status = self.status
        projection = None if status.origin is None else LocalProjection(status.origin)
        geo = SimpleNamespace(projection=projection, home=status.home, home_ned_m=status.home_ned_m)
        landed = status.landed_state is LandedState.ON_GROUND
        self.texts += self.navigator.check_mission(self.state, geo, landed=landed)

    def take_issued_commands(self):
        return []

    def accept_setpoint(self, setpoint):
        self.setpoints.append(setpoint)

    def say(self, severity, text):
        self.texts.append(StatusText(severity, text))

    def take_texts(self):
        taken, self.texts = self.texts, []
        return taken

    def global_position(self):
        return self.place

    def local_position(self, point):
        return LocalProjection(HOME).to_local(point) if is_on_earth(point) else None


class Peer:
    """A client on both links: sends messages to a node and reads its answers without streams."""

    def __init__(self, autopilot, *, system=245, component=191, links=(ONBOARD, GROUND), node_options=None):
        self.autopilot = autopilot
        truth = {"truth": lambda: (autopilot.state, HOME)}
        self.node = MavlinkNode(autopilot, links, NodeOptions(**truth | (node_options or {})))
        self.packer = mavlink.MAVLink(None, system, component)
        self.time_us = 0
        self._readers = {profile.name: PacketReader() for profile in links}
        self.advance(0)

    def advance(self, seconds, *, step_us=4000):
        """Update the node up to a time; all it sent, as (link, message)."""
        end_us = self.time_us + round(seconds * 1e6)
        received = []
        while True:
            self.node.update(self.time_us)
            received += self.take()
            if self.time_us >= end_us:
                return received
            self.time_us = min(self.time_us + step_us, end_us)

    def take(self):
        return [
            (link, message)
            for link, data in self.node.take_output()
            for message in self._readers[link].feed(data)
        ]

    def send(self, message, link="onboard", **options):
        deliver(self.node, link, message.pack(self.packer, **options))

    def ask(self, message, link="onboard"):
        """Send a message and give the answers, sent at once on that link."""
        self.send(message, link)
        return [answer for answered, answer in self.take() if answered == link]

    def long(self, command, *params, target=(1, 1)):
        values = (*params, *[0.0] * (7 - len(params)))
        return mavlink.MAVLink_command_long_message(*target, command, 0, *values)

    def int(self, command, *params, target=(1, 1), frame=6):
        p = (*params, *[0.0] * (7 - len(params)))
        return mavlink.MAVLink_command_int_message(
            *target, frame, command, 0, 0, p[0], p[1], p[2], p[3], int(p[4]), int(p[5]), p[6]
        )

    def meet_ground_station(self, link="ground"):
        self.send(mavlink.MAVLink_heartbeat_message(mavlink.MAV_TYPE_GCS, 8, 0, 0, 4, 3), link)


@pytest.fixture(scope="session")
def airframe():
    return load_airframe("abejorro")


@pytest.fixture
def autopilot(airframe):
    return FakeAutopilot(airframe)


@pytest.fixture
def peer(autopilot):
    return Peer(autopilot)


@pytest.fixture
def make_peer():
    return Peer


@pytest.fixture
def make_lossy_peer():
    return LossyPeer
