"""What QGroundControl asks a PX4 vehicle when it connects and when its buttons are pressed, in its order.

Everything is asked once: QGroundControl would ask again, and whoever watches it would wait. The time limits
are its own.
"""

import json
import lzma
import time
from math import isnan, nan

import pytest
from pymavlink import mavutil

from framerunner.wire import extra_messages
from tests.processes import simulator

mavlink = mavutil.mavlink
pytestmark = pytest.mark.realtime

ACCEPTED, DENIED = 0, 2
REQUEST_MESSAGE, DO_REPOSITION, TAKEOFF, ARM, DO_CHANGE_SPEED = 512, 192, 22, 400, 178
COMMAND_S, MISSION_S, HASH_S, FIRST_PARAMETER_S = 3.0, 1.5, 1.0, 5.0
CAMERA = 100
HOLD, LAND, RETURN, POSITION = 0x03040000, 0x06040000, 0x05040000, 0x00030000
CAMERA_HAS_VIDEO = 256
OPEN, BURST_READ, TERMINATE, ACK = 4, 15, 1, 128
END_OF_FILE = 6
FTP_S = 1.0


class Station:
    """A ground station 255/190 on the ground link."""

    def __init__(self, port, system):
        self.link = mavutil.mavlink_connection(
            f"udpin:127.0.0.1:{port}", source_system=255, source_component=190
        )
        self.system = system
        self._beat_due_s = 0.0
        self._ftp_sequence = 0

    @property
    def mav(self):
        """What packs messages; pymavlink makes another one when it hears MAVLink 2."""
        return self.link.mav

    def next(self, limit_s, wanted):
        """The next message as wanted; a heartbeat goes out once a second meanwhile."""
        end_s = time.monotonic() + limit_s
        while (now_s := time.monotonic()) < end_s:
            if now_s >= self._beat_due_s:
                self._beat_due_s = now_s + 1.0
                self.mav.heartbeat_send(mavlink.MAV_TYPE_GCS, mavlink.MAV_AUTOPILOT_INVALID, 0, 0, 4)
            message = self.link.recv_match(blocking=True, timeout=min(0.1, end_s - now_s))
            if message is not None and wanted(message):
                return message
        raise AssertionError(f"not answered within {limit_s:g} s")

    def wait(self, kind, limit_s=COMMAND_S, component=1, **fields):
        """The next message of a kind with such fields."""
        return self.next(
            limit_s,
            lambda m: (
                m.get_type() == kind
                and m.get_srcComponent() == component
                and all(getattr(m, name) == value for name, value in fields.items())
            ),
        )

    def command(self, number, *params, component=1):
        """Send a COMMAND_LONG once; its result."""
        values = (*params, *[0.0] * (7 - len(params)))
        self.mav.command_long_send(self.system, component, number, 0, *values)
        return self.wait("COMMAND_ACK", component=component, command=number).result

    def ask(self, message_id, kind, *, component=1, instance=0):
        """Request a message once; it. It may come before its acknowledgement or after it."""
        self.mav.command_long_send(self.system, component, REQUEST_MESSAGE, 0, message_id, instance, *[0] * 5)
        came = {}

        def both(message):
            if message.get_srcComponent() == component and message.get_type() in ("COMMAND_ACK", kind):
                came[message.get_type()] = message
            return len(came) == 2

        self.next(COMMAND_S, both)
        assert (came["COMMAND_ACK"].command, came["COMMAND_ACK"].result) == (REQUEST_MESSAGE, ACCEPTED)
        return came[kind]

    def modes(self):
        """Every AVAILABLE_MODES, asked for at once."""
        self.mav.command_long_send(self.system, 1, REQUEST_MESSAGE, 0, 435, 0, 0, 0, 0, 0, 0)
        modes = {}

        def all_came(message):
            if message.get_type() == "AVAILABLE_MODES":
                modes[message.mode_index] = message
                return len(modes) == message.number_modes
            return False

        self.next(COMMAND_S, all_came)
        return modes

    def parameters(self):
        """_HASH_CHECK, then the list; values by name."""
        self.mav.param_request_read_send(self.system, 1, b"_HASH_CHECK", -1)
        self.wait("PARAM_VALUE", HASH_S, param_id="_HASH_CHECK")
        self.mav.param_request_list_send(self.system, 1)
        listed = {}

        def complete(message):
            if message.get_type() == "PARAM_VALUE" and message.param_id != "_HASH_CHECK":
                listed[message.param_index] = message
                return len(listed) == message.param_count
            return False

        self.next(FIRST_PARAMETER_S, complete)
        assert sorted(listed) == list(range(len(listed)))
        return {message.param_id: message.param_value for message in listed.values()}

    def plan_count(self, kind):
        """Read a plan of a mission type; how many items it has."""
        self.mav.mission_request_list_send(self.system, 1, kind)
        count = self.wait("MISSION_COUNT", MISSION_S, mission_type=kind).count
        self.mav.mission_ack_send(self.system, 1, mavlink.MAV_MISSION_ACCEPTED, kind)
        return count

    def fetch(self, path):
        """Download an .xz file by FTP with burst reads, each asked for once; the JSON in it."""
        opened = self._ftp(OPEN, data=path.encode())
        size, content = int.from_bytes(opened[12:16], "little"), b""
        while len(content) < size:
            answer = self._ftp(BURST_READ, opened[2], len(content))
            while True:
                assert answer[3] == ACK and int.from_bytes(answer[8:12], "little") == len(content)
                content += answer[12 : 12 + answer[4]]
                if answer[6] or len(content) == size:  # the burst is complete
                    break
                answer = self._ftp_answer()
        self._ftp(TERMINATE, opened[2])
        return json.loads(lzma.decompress(content))

    def _ftp(self, opcode, session=0, offset=0, data=b""):
        """Send a request; the first answer to it."""
        self._ftp_sequence += 1
        head = self._ftp_sequence.to_bytes(2, "little") + bytes((session, opcode, len(data), 0, 0, 0))
        payload = head + offset.to_bytes(4, "little") + data
        self.mav.file_transfer_protocol_send(0, self.system, 1, payload.ljust(251, b"\0"))
        while (answer := self._ftp_answer())[5] != opcode:
            pass  # the rest of a burst that has been read
        return answer

    def _ftp_answer(self):
        answer = bytes(self.wait("FILE_TRANSFER_PROTOCOL", FTP_S).payload)
        assert answer[3] == ACK or (answer[5], answer[12]) == (BURST_READ, END_OF_FILE), answer[:16]
        return answer

    def mode(self, wanted):
        """Ask for a mode with the old SET_MODE, as its buttons do, until the heartbeat shows it."""
        armed = self.link.base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED
        self.mav.set_mode_send(self.system, mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED | armed, wanted)
        self.wait("HEARTBEAT", custom_mode=wanted)

    def landed(self, *states):
        self.next(20.0, lambda m: m.get_type() == "EXTENDED_SYS_STATE" and m.landed_state in states)

    def height(self, low_m, high_m):
        """Wait until it is at such a height over home."""
        self.next(
            20.0,
            lambda m: m.get_type() == "GLOBAL_POSITION_INT" and low_m < m.relative_alt / 1000 < high_m,
        )


@pytest.fixture
def sim(request, tmp_path, instance):
    """A simulator in real time, or as much faster as a test wants."""
    with simulator(tmp_path, instance, "--speed", getattr(request, "param", "1")) as running:
        yield running
        assert running.process.poll() is None
        assert "Traceback" not in running.err


@pytest.fixture
def station(sim, instance):
    station = Station(14550 + instance, instance + 1)
    station.wait("HEARTBEAT", 20.0)
    # pymavlink has changed to MAVLink 2; it lacks COMPONENT_METADATA.
    extra_messages.add_to(mavutil.mavlink)
    yield station
    station.link.close()


def test_everything_asked_at_connect_is_answered_at_once(station):
    began_s = time.monotonic()
    version = station.ask(148, "AUTOPILOT_VERSION")
    assert version.flight_sw_version >> 24 == 1
    for capability in (
        mavlink.MAV_PROTOCOL_CAPABILITY_MISSION_FENCE,
        mavlink.MAV_PROTOCOL_CAPABILITY_COMMAND_INT,
    ):
        assert version.capabilities & capability
    modes = station.modes()
    assert HOLD in {mode.custom_mode for mode in modes.values()}

    metadata = station.ask(397, "COMPONENT_METADATA")
    general = station.fetch(metadata.uri.removeprefix("mftp:/"))
    for described in general["metadataTypes"]:
        assert station.fetch(described["uri"].removeprefix("mftp:/"))

    parameters = station.parameters()
    needed = {"SYS_AUTOSTART", "COM_RC_IN_MODE", "RC_MAP_ROLL", "CAL_GYRO0_ID", "CAL_ACC0_ID", "CAL_MAG0_ID"}
    assert needed <= set(parameters)
    assert [station.plan_count(kind) for kind in (0, 1, 2)] == [0, 0, 0]

    station.wait("HEARTBEAT", component=CAMERA, type=mavlink.MAV_TYPE_CAMERA)
    camera = station.ask(259, "CAMERA_INFORMATION", component=CAMERA)
    assert camera.flags & CAMERA_HAS_VIDEO
    stream = station.ask(269, "VIDEO_STREAM_INFORMATION", component=CAMERA)
    assert stream.uri
    print(
        f"connected in {time.monotonic() - began_s:.2f} s, {len(parameters)} parameters, {len(modes)} modes"
    )


@pytest.mark.parametrize("sim", ["3"], indirect=True)
def test_its_buttons_and_virtual_joystick_fly(station):
    station.next(
        20.0, lambda m: m.get_type() == "SYS_STATUS" and m.onboard_control_sensors_health & 0x10000000
    )
    here = station.wait("GLOBAL_POSITION_INT")
    station.mode(HOLD)
    home_m = here.alt / 1000
    assert station.command(TAKEOFF, -1, 0, 0, nan, nan, nan, home_m + 3.0) == ACCEPTED
    assert station.command(ARM, 1) == ACCEPTED  # after it: it flies then
    station.landed(mavlink.MAV_LANDED_STATE_TAKEOFF, mavlink.MAV_LANDED_STATE_IN_AIR)
    station.wait("HEARTBEAT", 20.0, custom_mode=HOLD)
    station.height(2.6, 3.4)

    north_e7 = here.lat + 500
    station.mav.command_int_send(
        station.system,
        1,
        mavlink.MAV_FRAME_GLOBAL,
        DO_REPOSITION,
        0,
        0,
        -1,
        1,
        0,
        nan,
        north_e7,
        here.lon,
        home_m + 5,
    )
    assert station.wait("COMMAND_ACK", command=DO_REPOSITION).result == ACCEPTED
    assert station.command(DO_CHANGE_SPEED, 1, 3.0, -1) == ACCEPTED
    station.next(15.0, lambda m: m.get_type() == "GLOBAL_POSITION_INT" and abs(m.lat - north_e7) < 50)
    station.height(4.6, 5.4)
    assert station.command(DO_REPOSITION, -1, 1, 0, nan, nan, nan, nan) == ACCEPTED  # pause
    assert (
        station.command(DO_REPOSITION, -1, 1, 0, nan, nan, nan, home_m + 4.0) == ACCEPTED
    )  # change altitude
    station.height(3.6, 4.4)

    _with_sticks(station)
    station.mode(RETURN)
    station.mode(LAND)
    station.landed(mavlink.MAV_LANDED_STATE_ON_GROUND)
    station.next(
        10.0,
        lambda m: m.get_type() == "HEARTBEAT" and m.get_srcComponent() == 1 and not m.base_mode & 128,
    )


def _with_sticks(station):
    """The virtual joystick at 25 Hz: it centres, changes to position mode, then climbs."""
    due_s, end_s, asked, climbed = 0.0, time.monotonic() + 12.0, False, False
    while not climbed and time.monotonic() < end_s:
        now_s = time.monotonic()
        if now_s >= due_s:
            due_s = now_s + 0.04
            up = 750 if station.link.messages["HEARTBEAT"].custom_mode == POSITION else 500
            station.mav.manual_control_send(station.system, 0, 0, up, 0, 0)
        message = station.link.recv_match(blocking=True, timeout=0.01)
        if message is None:
            continue
        if not asked and message.get_type() == "HEARTBEAT":
            station.mav.set_mode_send(station.system, 1 | 128, POSITION)
            asked = True
        if message.get_type() == "GLOBAL_POSITION_INT":
            climbed = message.relative_alt > 4800
    assert climbed
    assert not isnan(station.wait("ATTITUDE").roll)
