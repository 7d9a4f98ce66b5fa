from itertools import pairwise
from math import inf, nan, radians

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from firmware_py.mavlink.camera.component import CameraComponent
from firmware_py.mavlink.camera.model import FixedCamera, PictureSpace, VideoEncoding, VideoStream
from firmware_py.status import CommandResult, FlightMode
from firmware_py.types import VehicleState
from framerunner.vehicle.geodesy import GeodeticPoint
from framerunner.wire.dialect import mavlink

MODEL = FixedCamera(320, 240, radians(90.0), 10.0)
STREAMS = (
    VideoStream("5600", VideoEncoding.H264_RTP, 320, 240, 10.0, 90.0),
    VideoStream("http://127.0.0.1:8100/video", VideoEncoding.MJPEG_HTTP, 320, 240, 10.0, 90.0),
)
CAMERA, ALL, AUTOPILOT = (1, 100), (1, 0), (1, 1)
ACCEPTED, DENIED, UNSUPPORTED, FAILED = 0, 2, 3, 4
REQUEST, START, STOP = 512, 2000, 2001


class Album:
    """Keeps pictures by name, until it is broken."""

    can_record = True
    is_recording = False

    def __init__(self):
        self.taken = []
        self.broken = False

    def capture(self, time_us, index):
        if self.broken:
            return None
        self.taken.append((time_us, index))
        return f"mftp:///DCIM/{index}.jpg"

    def start_video(self, index):
        self.is_recording = not self.broken
        return self.is_recording

    def stop_video(self):
        self.is_recording = False

    def format(self):
        self.taken.clear()
        return not self.broken

    def space(self):
        return PictureSpace(100.0, 25.0)


@pytest.fixture
def album():
    return Album()


@pytest.fixture
def viewer(autopilot, make_peer, album):
    return make_peer(autopilot, node_options={"camera": MODEL, "captures": album, "video": STREAMS})


def acks(messages):
    return [(m.get_srcComponent(), m.command, m.result) for m in messages if m.get_type() == "COMMAND_ACK"]


def named(messages, name):
    return [m for m in messages if m.get_type() == name]


def pictures(received, link="onboard"):
    return [m for on, m in received if on == link and m.get_type() == "CAMERA_IMAGE_CAPTURED"]


def test_its_heartbeat_is_a_cameras_once_a_second_on_every_link(viewer):
    received = viewer.advance(3.0)
    for link in ("onboard", "ground"):
        beats = [m for on, m in received if on == link and m.get_srcComponent() == 100]
        assert [(m.get_type(), m.type, m.autopilot) for m in beats] == [("HEARTBEAT", 30, 8)] * 3


def test_its_heartbeat_has_the_vehicles_mode_as_mavsdks_follow_me_requires(viewer, autopilot):
    autopilot.status.mode = FlightMode.FOLLOW
    (_, beat), *_ = [came for came in viewer.advance(1.5) if came[1].get_srcComponent() == 100]
    assert (beat.base_mode & 1, beat.custom_mode) == (1, FlightMode.FOLLOW.custom_mode)


def test_without_a_camera_its_component_does_not_answer(peer):
    assert peer.ask(peer.long(REQUEST, 259, target=CAMERA)) == []
    assert {m.get_srcComponent() for _, m in peer.advance(2.0)} == {1}
    assert acks(peer.ask(peer.long(START, 0, 0, 1, target=ALL))) == [(1, START, UNSUPPORTED)]


@pytest.mark.parametrize("question", [(REQUEST, 259), (521, 1)])
def test_information_describes_the_lens(viewer, question):
    answers = viewer.ask(viewer.long(*question, target=CAMERA))
    assert acks(answers) == [(100, question[0], ACCEPTED)]
    (camera,) = named(answers, "CAMERA_INFORMATION")
    assert (camera.resolution_h, camera.resolution_v) == (320, 240)
    assert camera.sensor_size_v == pytest.approx(camera.sensor_size_h * 0.75)
    assert camera.focal_length == pytest.approx(camera.sensor_size_h / 2)  # 90 degrees
    assert camera.flags == 1 | 2 | 4 | 8 | 16 | 256
    assert bytes(camera.vendor_name).rstrip(b"\0") == b"framerunner"


@pytest.mark.parametrize(
    ("message_id", "elder", "name"),
    [
        (260, 522, "CAMERA_SETTINGS"),
        (261, 525, "STORAGE_INFORMATION"),
        (262, 527, "CAMERA_CAPTURE_STATUS"),
        (269, 2504, "VIDEO_STREAM_INFORMATION"),
        (270, 2505, "VIDEO_STREAM_STATUS"),
    ],
)
def test_every_message_can_be_requested_by_the_new_and_the_old_command(viewer, message_id, elder, name):
    for question in (viewer.long(REQUEST, message_id, target=CAMERA), viewer.int(elder, 1, target=CAMERA)):
        answers = viewer.ask(question)
        assert answers[-1].get_type() == "COMMAND_ACK"
        assert answers[-1].result == ACCEPTED
        assert named(answers, name)


def test_streams_have_their_addresses(viewer):
    answers = named(viewer.ask(viewer.long(REQUEST, 269, 0, target=CAMERA)), "VIDEO_STREAM_INFORMATION")
    assert [(m.stream_id, m.count, m.uri, m.type, m.encoding) for m in answers] == [
        (1, 2, "5600", mavlink.VIDEO_STREAM_TYPE_RTPUDP, mavlink.VIDEO_STREAM_ENCODING_H264),
        (2, 2, "http://127.0.0.1:8100/video", mavlink.VIDEO_STREAM_TYPE_TCP_MPEG, 0),
    ]
    one = named(viewer.ask(viewer.long(REQUEST, 269, 2, target=CAMERA)), "VIDEO_STREAM_INFORMATION")
    assert [m.stream_id for m in one] == [2]
    assert acks(viewer.ask(viewer.long(REQUEST, 269, 3, target=CAMERA))) == [(100, REQUEST, DENIED)]


def test_the_status_of_streams_brings_their_information_the_preferred_last(viewer):
    answers = viewer.ask(viewer.long(REQUEST, 270, nan, target=CAMERA))
    told = [(m.get_type(), m.stream_id) for m in answers[:-1]]
    assert told == [
        ("VIDEO_STREAM_INFORMATION", 2),
        ("VIDEO_STREAM_INFORMATION", 1),
        ("VIDEO_STREAM_STATUS", 1),
        ("VIDEO_STREAM_STATUS", 2),
    ]


def test_storage_has_room_or_is_not_there(viewer, autopilot, make_peer):
    (storage,) = named(viewer.ask(viewer.long(REQUEST, 261, target=CAMERA)), "STORAGE_INFORMATION")
    assert (storage.status, storage.total_capacity, storage.available_capacity) == (2, 100.0, 75.0)
    without = make_peer(autopilot, node_options={"camera": MODEL})
    (storage,) = named(without.ask(without.long(REQUEST, 261, target=CAMERA)), "STORAGE_INFORMATION")
    assert (storage.status, storage.storage_count) == (0, 0)


@pytest.mark.parametrize("message_id", [0, 30, 148, 435, 9999, nan, inf, -5, 1e30])
def test_what_it_does_not_know_is_denied(viewer, message_id):
    assert acks(viewer.ask(viewer.long(REQUEST, message_id, target=CAMERA))) == [(100, REQUEST, DENIED)]


@pytest.mark.parametrize("target", [CAMERA, ALL])
def test_a_picture_is_reported_with_position_and_attitude(viewer, autopilot, album, target):
    autopilot.state = VehicleState(attitude=(0.8, 0.0, 0.0, 0.6))
    autopilot.place = GeodeticPoint(47.4, 8.5, 492.0)
    answers = viewer.ask(viewer.long(START, 0, 0, 1, 1, target=target))
    assert acks(answers) == [(100, START, ACCEPTED)]
    (told,) = named(answers, "CAMERA_IMAGE_CAPTURED")
    assert told.get_srcComponent() == 100
    assert (told.lat, told.lon, told.alt, told.relative_alt) == (474000000, 85000000, 492000, 3000)
    assert told.q == pytest.approx([0.8, 0.0, 0.0, 0.6])
    assert (told.image_index, told.capture_result, told.file_url) == (0, 1, "mftp:///DCIM/0.jpg")
    assert album.taken == [(0, 0)]
    again = viewer.ask(viewer.long(REQUEST, 263, 0, target=CAMERA))
    assert named(again, "CAMERA_IMAGE_CAPTURED")[0].file_url == told.file_url
    assert acks(viewer.ask(viewer.long(REQUEST, 263, 1, target=CAMERA))) == [(100, REQUEST, DENIED)]


def test_the_autopilot_takes_no_pictures(viewer, album):
    assert acks(viewer.ask(viewer.long(START, 0, 0, 1, target=AUTOPILOT))) == [(1, START, UNSUPPORTED)]
    assert album.taken == []


def test_a_command_to_all_that_is_not_the_cameras_is_the_autopilots_alone(viewer):
    assert acks(viewer.ask(viewer.long(400, 1, target=ALL))) == [(1, 400, ACCEPTED)]
    assert acks(viewer.ask(viewer.long(400, 1, target=CAMERA))) == [(100, 400, UNSUPPORTED)]
    assert acks(viewer.ask(viewer.long(START, 0, 0, 1, target=(2, 100)))) == []


def test_a_repeated_command_takes_no_second_picture(viewer, album):
    viewer.ask(viewer.long(START, 0, 0, 1, 7, target=CAMERA))
    repeated = viewer.long(START, 0, 0, 1, 7, target=CAMERA)
    repeated.confirmation = 1
    assert acks(viewer.ask(repeated)) == [(100, START, ACCEPTED)]
    assert len(album.taken) == 1
    repeated = viewer.long(START, 0, 0, 1, 8, target=CAMERA)  # another picture, whose first request was lost
    repeated.confirmation = 1
    viewer.ask(repeated)
    assert len(album.taken) == 2


def test_a_series_has_its_interval_and_count(viewer, album):
    viewer.send(viewer.long(START, 0, 0.5, 3, target=CAMERA))
    told = pictures(viewer.advance(5.0))
    assert [m.image_index for m in told] == [0, 1, 2]
    assert [m.time_boot_ms for m in told] == [0, 500, 1000]
    (status,) = named(viewer.ask(viewer.long(REQUEST, 262, target=CAMERA)), "CAMERA_CAPTURE_STATUS")
    assert (status.image_status, status.image_count) == (0, 3)


def test_a_series_without_end_is_stopped(viewer):
    viewer.send(viewer.long(START, 0, 0.2, 0, target=CAMERA))
    viewer.advance(1.0)
    (status,) = named(viewer.ask(viewer.long(REQUEST, 262, target=CAMERA)), "CAMERA_CAPTURE_STATUS")
    assert (status.image_status, status.image_count) == (2, 6)
    assert status.image_interval == pytest.approx(0.2)
    assert acks(viewer.ask(viewer.long(STOP, target=CAMERA))) == [(100, STOP, ACCEPTED)]
    assert pictures(viewer.advance(1.0)) == []


def test_pictures_cannot_follow_faster_than_the_cameras_rate(viewer):
    viewer.send(viewer.long(START, 0, 0.0, 0, target=CAMERA))
    assert len(pictures(viewer.advance(1.0))) == 11


def test_a_picture_is_taken_after_each_distance(viewer, autopilot, album):
    assert acks(viewer.ask(viewer.long(206, 1.0, target=CAMERA))) == [(100, 206, ACCEPTED)]
    for step in range(26):
        autopilot.state.position_ned_m = (step * 0.1, 0.0, 0.0)
        viewer.advance(0.1)
    assert len(album.taken) == 3
    viewer.ask(viewer.long(206, 0.0, target=CAMERA))
    autopilot.state.position_ned_m = (9.0, 0.0, 0.0)
    viewer.advance(0.1)
    assert len(album.taken) == 3


def test_a_picture_that_fails_is_reported_as_failed(viewer, album):
    album.broken = True
    answers = viewer.ask(viewer.long(START, 0, 0, 1, target=CAMERA))
    assert acks(answers) == [(100, START, FAILED)]
    assert named(answers, "CAMERA_IMAGE_CAPTURED")[0].capture_result == 0


@pytest.mark.parametrize(
    ("command", "params", "result"),
    [
        (203, [0, 0, 0, 0, 1], ACCEPTED),
        (203, [0, 1], UNSUPPORTED),
        (526, [1, 1], ACCEPTED),
        (526, [0, 1, 1], ACCEPTED),
        (526, [1, 0], DENIED),
        (526, [2, 1], DENIED),
        (529, [1], ACCEPTED),
        (530, [0, 0], ACCEPTED),
        (530, [0, 1], ACCEPTED),
        (530, [0, 2], DENIED),
        (531, [1, 1], UNSUPPORTED),
        (532, [1, 1], UNSUPPORTED),
        (START, [0, -1, 0], DENIED),
        (START, [0, inf, 0], DENIED),
        (START, [0, 1, -1], DENIED),
        (START, [nan, nan, nan, nan], ACCEPTED),
        (206, [inf], DENIED),
        (214, [nan], DENIED),
        (214, [500], ACCEPTED),
        (2500, [], ACCEPTED),
        (2501, [], ACCEPTED),
        (2502, [0], ACCEPTED),
        (2502, [3], DENIED),
        (2503, [0], ACCEPTED),
        (2503, [1], ACCEPTED),
        (2503, [2], DENIED),
        (2503, [3], DENIED),
    ],
)
def test_other_commands(viewer, command, params, result):
    assert acks(viewer.ask(viewer.long(command, *params, target=CAMERA))) == [(100, command, result)]


def status_of(viewer):
    (status,) = named(viewer.ask(viewer.long(REQUEST, 262, target=CAMERA)), "CAMERA_CAPTURE_STATUS")
    return status


def test_a_recording_is_reported_as_often_as_wanted_until_it_is_stopped(viewer, album):
    answers = viewer.ask(viewer.long(2500, 0, 2.0, target=CAMERA))
    assert acks(answers) == [(100, 2500, ACCEPTED)]
    assert album.is_recording
    told = [m for on, m in viewer.advance(2.0) if on == "ground" and m.get_type() == "CAMERA_CAPTURE_STATUS"]
    assert [(m.video_status, m.recording_time_ms) for m in told] == [
        (1, 500),
        (1, 1000),
        (1, 1500),
        (1, 2000),
    ]
    viewer.ask(viewer.long(2500, 0, 0.0, target=CAMERA))  # a repeated command begins no other recording
    assert status_of(viewer).recording_time_ms == 2000
    answers = viewer.ask(viewer.long(2501, target=CAMERA))
    assert [m.video_status for m in named(answers, "CAMERA_CAPTURE_STATUS")] == [0]
    assert not album.is_recording


def test_a_recording_that_ends_by_itself_is_reported(viewer, album):
    viewer.ask(viewer.long(2500, 0, 0.0, target=CAMERA))
    assert status_of(viewer).video_status == 1
    album.stop_video()
    told = [m for on, m in viewer.advance(0.1) if on == "onboard" and m.get_type() == "CAMERA_CAPTURE_STATUS"]
    assert [m.video_status for m in told] == [0]
    album.broken = True
    assert acks(viewer.ask(viewer.long(2500, target=CAMERA))) == [(100, 2500, FAILED)]


def test_formatting_resets_the_count_of_pictures(viewer, album):
    viewer.send(viewer.long(START, 0, 0.1, 3, target=CAMERA))
    viewer.advance(1.0)
    assert acks(viewer.ask(viewer.long(526, 1, 1, 1, target=CAMERA))) == [(100, 526, ACCEPTED)]
    assert status_of(viewer).image_count == 0
    assert acks(viewer.ask(viewer.long(REQUEST, 263, 0, target=CAMERA))) == [(100, REQUEST, DENIED)]


def test_without_a_recorder_there_is_neither_video_nor_its_mode(autopilot, make_peer):
    viewer = make_peer(autopilot, node_options={"camera": MODEL})
    (camera,) = named(viewer.ask(viewer.long(REQUEST, 259, target=CAMERA)), "CAMERA_INFORMATION")
    assert camera.flags == 2
    for command, params, result in (
        (530, [0, 1], DENIED),
        (2500, [], UNSUPPORTED),
        (526, [1, 1], UNSUPPORTED),
    ):
        assert acks(viewer.ask(viewer.long(command, *params, target=CAMERA))) == [(100, command, result)]


def test_the_mode_is_told(viewer):
    answers = viewer.ask(viewer.long(530, 0, 1, target=CAMERA))
    assert [m.mode_id for m in named(answers, "CAMERA_SETTINGS")] == [1]
    viewer.ask(viewer.long(529, 1, target=CAMERA))
    assert [m.mode_id for m in named(viewer.ask(viewer.long(522, 1, target=CAMERA)), "CAMERA_SETTINGS")] == [
        0
    ]


def test_streams_in_rtp_stop_and_those_over_http_go_on(autopilot, make_peer):
    switched = []
    options = {"camera": MODEL, "video": STREAMS, "switch_video": switched.append}
    viewer = make_peer(autopilot, node_options=options)
    for command, running in ((2503, [0, 1]), (2502, [1, 1])):
        viewer.ask(viewer.long(command, 0, target=CAMERA))
        told = named(viewer.ask(viewer.long(REQUEST, 270, 0, target=CAMERA)), "VIDEO_STREAM_STATUS")
        assert [m.flags for m in told] == running
    assert switched == [False, True]


def test_a_mission_reaches_the_camera(viewer, album):
    (camera,) = (service for service in viewer.node.services if isinstance(service, CameraComponent))
    assert camera.mission_commands[START]((0.0, 0.0, 1.0, nan, nan, nan, nan)) is CommandResult.ACCEPTED
    assert len(album.taken) == 1
    assert 400 not in camera.mission_commands


AWKWARD = st.one_of(st.sampled_from([0.0, 1.0, -1.0, nan, inf, -inf, 3e38, 259.0]), st.floats(width=32))


@settings(max_examples=200, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.lists(
        st.tuples(
            st.sampled_from([REQUEST, START, STOP, 203, 206, 214, 521, 525, 528, 530, 2002, 2504, 2505]),
            st.lists(AWKWARD, min_size=7, max_size=7),
            st.sampled_from([CAMERA, ALL]),
        ),
        max_size=8,
    )
)
def test_awkward_parameters_break_nothing(autopilot, make_peer, sent):
    peer = make_peer(autopilot, node_options={"camera": MODEL, "captures": Album(), "video": STREAMS})
    for command, params, target in sent:
        answers = peer.ask(peer.long(command, *params, target=target))
        assert (100, command) in [(where, what) for where, what, _ in acks(answers)] or target == ALL
        peer.advance(0.02)
    assert peer.node.failed_messages == 0
    assert autopilot.calls == []


def test_each_component_counts_its_own_packets(make_peer, autopilot):
    peer = make_peer(autopilot, node_options={"camera": MODEL})
    sent = [message for link, message in peer.advance(3.0) if link == "ground"]
    for component in (1, 100):
        numbers = [m.get_seq() for m in sent if m.get_srcComponent() == component]
        assert len(numbers) >= 3
        assert all((after - before) % 256 == 1 for before, after in pairwise(numbers))
