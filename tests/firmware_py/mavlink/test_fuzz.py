"""Valid packets with random content, handled by the real autopilot."""

import random
from math import inf, isfinite, nan
from struct import pack

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from firmware_py.autopilot import Autopilot
from firmware_py.commands import FlightLimits
from firmware_py.mavlink.camera.model import FixedCamera
from firmware_py.mavlink.node import MavlinkNode, NodeOptions
from firmware_py.mavlink.telemetry.profiles import ONBOARD
from firmware_py.status import FlightMode
from firmware_py.types import MotorOutput
from framerunner.vehicle.geodesy import GeodeticPoint
from framerunner.vehicle.measurements import Sensors
from framerunner.wire.dialect import mavlink
from scenarios.loader import load_scenario
from scenarios.models import Gimbal
from sitl.payload.gimbal import SimulatedGimbal
from sitl.simulation import Simulation
from tests.node_input import deliver

LINKS = ("onboard", "ground")
ORIGIN = GeodeticPoint(47.397742, 8.545594, 489.0)
EXTREMES = (nan, inf, -inf, 3e38)
AWKWARD = [
    0.0,
    -0.0,
    1.0,
    -1.0,
    5.0,
    21196.0,
    0.5,
    1e-40,
    3e38,
    -3e38,
    float("nan"),
    float("inf"),
    -float("inf"),
]


@pytest.fixture
def real(airframe):
    autopilot = Autopilot(airframe, ORIGIN)
    for tick in range(300):
        autopilot.step(standing(tick * 4000))
    return autopilot


def standing(time_us):
    return Sensors(time_us, (0.0,) * 3, (0.0,) * 3, (1.0, 0.0, 0.0, 0.0), (0.0,) * 3, (0.0, 0.0, -9.80665))


def frame(message_type, payload, sequence, source):
    """A MAVLink 2 packet with a right checksum, whatever the payload."""
    number = message_type.id
    header = pack(
        "<BBBBBBBHB", 0xFD, len(payload), 0, 0, sequence % 256, *source, number & 0xFFFF, number >> 16
    )
    crc = mavlink.x25crc(header[1:] + payload + bytes([message_type.crc_extra])).crc
    return header + payload + pack("<H", crc)


def aimed(message_type, payload, rng):
    """Half of the packets name us as their target, or all targets."""
    buffer = bytearray(payload)
    names = message_type.ordered_fieldnames
    if "target_system" not in names or rng.random() < 0.5:
        return bytes(buffer)
    probe = [bytes(a) if isinstance(a, bytes) else a for a in message_type.unpacker.unpack(bytes(buffer))]
    place = sum(max(1, length) for length in message_type.lengths[: names.index("target_system")])
    probe[place] = rng.choice((0, 1))
    if "target_component" in names:
        place = sum(max(1, length) for length in message_type.lengths[: names.index("target_component")])
        probe[place] = rng.choice((0, 1))
    return message_type.unpacker.pack(*probe)


def test_twenty_thousand_sound_packets_of_every_id_with_random_content(real, make_peer):
    rng = random.Random(20_000)
    peer = make_peer(real)
    kinds = sorted(mavlink.mavlink_map.values(), key=lambda kind: kind.id)
    for count in range(20_000):
        kind = kinds[count % len(kinds)]
        payload = aimed(kind, rng.randbytes(kind.unpacker.size), rng)
        source = (rng.randrange(2, 256), rng.randrange(256))
        deliver(peer.node, LINKS[count % 2], frame(kind, payload, count, source))
        if count % 50 == 0:
            peer.time_us += 4000
            real.step(standing(1_200_000 + peer.time_us))
            peer.node.update(peer.time_us)
            peer.take()
    assert peer.node.failed_messages == 0
    assert not real.status.armed
    assert real.status.mode is FlightMode.HOLD
    assert real.parameters.version == 0


ALL_DEVICES = {
    "camera": FixedCamera(320, 240, 1.57, 10.0),
    "gimbal": SimulatedGimbal(Gimbal()),
    "gripper": True,
    "shell": True,
}


@pytest.fixture(scope="module")
def handled(airframe):
    """Kinds of all messages that a vehicle with all devices handles, all commands, a strategy of messages."""
    services = MavlinkNode(Autopilot(airframe, ORIGIN), (ONBOARD,), NodeOptions(**ALL_DEVICES)).services
    ids = {message_id for service in services for message_id in service.handlers}
    kinds = [mavlink.mavlink_map[message_id] for message_id in sorted(ids)]
    return kinds, sorted({command for service in services for command in service.commands}), messages(kinds)


COMMANDS = [20, 21, 22, 176, 262, 300, 400, 401, 410, 420, 510, 511, 512, 519, 520, 2000, 31999]
NAMES = [b"MIS_TAKEOFF_ALT", b"COM_OBL_RC_ACT", b"_HASH_CHECK", b"", b"\xff" * 16, b"A" * 16]


def limits(type_name):
    """The least and the largest value of an integer type, such as uint8_t."""
    bits = int("".join(filter(str.isdigit, type_name)))
    return (0, 2**bits - 1) if type_name.startswith("u") else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)


def content(kind, field, type_name, array_length):
    """Values of one field: often valid ones where these reach more code, extreme ones elsewhere."""
    if field == "command":
        return st.sampled_from(COMMANDS)
    if field in ("target_system", "target_component"):
        return st.sampled_from([1, 1, 1, 0, 2])
    if type_name == "char":
        return st.sampled_from(NAMES) if field == "param_id" else st.binary(max_size=8)
    if field == "param_type":
        return st.sampled_from([6, 9, 0])
    if field == "coordinate_frame":
        return st.sampled_from([1, 8, 7])
    if type_name == "float":
        element = st.one_of(st.sampled_from(AWKWARD), st.floats(width=32))
    else:
        element = st.integers(*limits(type_name))
    return st.lists(element, min_size=array_length, max_size=array_length) if array_length else element


def fields_of(kind):
    """Name, type and array length (0: no array) of each field."""
    lengths = dict(zip(kind.ordered_fieldnames, kind.array_lengths, strict=True))
    return [
        (name, type_name, lengths[name])
        for name, type_name in zip(kind.fieldnames, kind.fieldtypes, strict=True)
    ]


def messages(kinds):
    return st.one_of(
        *[st.builds(kind, *[content(kind, *field) for field in fields_of(kind)]) for kind in kinds]
    )


def ordinary(kind):
    """A message for us with ordinary content, as a dictionary."""
    values = {}
    for name, type_name, length in fields_of(kind):
        value = 0.5 if type_name == "float" else 1
        values[name] = b"" if type_name == "char" else [value] * length if length else value
    return values


def one_extreme_each(kind, **given):
    """Messages with one field that is extreme, and ordinary content elsewhere."""
    plain = ordinary(kind) | given
    for name, type_name, length in fields_of(kind):
        if type_name != "char" and name not in given:
            for value in EXTREMES if type_name == "float" else limits(type_name):
                yield kind(**plain | {name: [value] * length if length else value})


def test_each_number_of_each_handled_message_may_be_extreme(handled, make_peer):
    kinds, commands, _ = handled
    simulation = Simulation(load_scenario("open-field").model_copy(update={"sensors": "external"}))
    autopilot = simulation.autopilot
    peer = make_peer(autopilot, node_options=ALL_DEVICES)
    with_command = (mavlink.MAVLink_command_long_message, mavlink.MAVLink_command_int_message)
    sent = [message for kind in kinds if kind not in with_command for message in one_extreme_each(kind)]
    sent += [
        message for kind in with_command for c in commands for message in one_extreme_each(kind, command=c)
    ]
    internal = []
    for count, message in enumerate(sent):
        peer.send(message)
        internal += [said.text for said in autopilot.take_texts() if said.text.startswith("Internal error")]
        if count % 100 == 0:
            simulation.tick()
            peer.advance(0.004)
    assert internal == []
    assert peer.node.failed_messages == 0
    assert len(kinds) > 40
    assert all(map(isfinite, autopilot.output.speeds_rad_s))


@settings(max_examples=300, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.data())
def test_awkward_content_in_handled_messages(airframe, make_peer, handled, data):
    autopilot = Autopilot(airframe, ORIGIN, stabiliser=Calm())
    peer = make_peer(autopilot)
    autopilot.step(standing(0))
    sent = data.draw(st.lists(handled[2], min_size=1, max_size=8))
    for place, message in enumerate(sent):
        peer.send(message, LINKS[place % 2])
        autopilot.step(standing(4000 * (place + 1)))
        peer.advance(0.004)
    assert peer.node.failed_messages == 0
    assert all(map(isfinite, autopilot.output.speeds_rad_s))


class Calm:
    """A stabiliser that does nothing, quickly built."""

    def __init__(self):
        self.limits = FlightLimits(1.0)

    def reset(self):
        pass

    def idle(self):
        return MotorOutput()

    def step(self, state, command, *, grounded=False):
        return self.idle()


@settings(max_examples=200, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(st.binary(max_size=400), max_size=10))
def test_random_bytes_are_no_messages(autopilot, make_peer, pieces):
    peer = make_peer(autopilot)
    for piece in pieces:
        deliver(peer.node, "ground", piece)
    assert peer.take() == []
    assert autopilot.calls == []
    assert peer.node.failed_messages == 0


def test_an_internal_error_is_counted_and_reported_and_ends_nothing(autopilot, peer):
    def broken():
        raise RuntimeError("worn out")

    autopilot.land = broken
    peer.send(peer.long(21))
    assert peer.node.failed_messages == 1
    assert [said.text for said in autopilot.texts] == [
        "Internal error on COMMAND_LONG: RuntimeError('worn out')"
    ]
    assert peer.ask(peer.long(400, 1))
