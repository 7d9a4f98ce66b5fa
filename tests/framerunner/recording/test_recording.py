"""What a recording holds, read with MCAP's own reader and with framerunner's."""

import json
from base64 import b64decode
from dataclasses import replace
from math import inf, nan, pi

import cv2
import jsonschema
import numpy as np
import pytest
from mcap.reader import make_reader

from framerunner.geometry.gate_shape import GateShape
from framerunner.recording.events import Crossed, RecordedImage, RecordingError, TruePlace
from framerunner.recording.mcap_reader import McapRecording
from framerunner.recording.mcap_writer import FlightRecording
from framerunner.recording.recording_messages import (
    box_edges,
    camera_transform,
    detections,
    gate_map,
    map_scene,
    scene,
    time_of,
)
from framerunner.recording.schemas import TOPICS, schema_texts
from framerunner.runs.track import Track
from offboard.app import Moment
from offboard.drone import DroneState, PlaceEstimate, VelocityFluCommand
from offboard.mission import load_mission
from offboard.navigation.view import GateEstimate, NavigationView
from scenarios.loader import load_scenario, parse_scenario
from scenarios.result import FlightResult
from tests.framerunner.recording.conftest import record
from vision.detector import detect
from vision.types import CameraFrame, Detection, Detections

RESULT = FlightResult(
    verdict="clean",
    reason="clean after 9.0 s",
    frames_crossed=("red", "green"),
    crossing_times_s=(1.5, 4.25),
    crossing_offsets_m=(0.01, 0.02),
    crossing_sides=("front", "back"),
)


def messages(path, *topics):
    """Topic, log time in nanoseconds and content of each message."""
    with path.open("rb") as file:
        return [
            (channel.topic, message.log_time, json.loads(message.data))
            for _, channel, message in make_reader(file).iter_messages(topics or None)
        ]


def track_at(*times_s, **paths):
    still = [0.0] * len(times_s)
    return Track(times_s, still, still, still, [""] * len(times_s), **paths)


def moment_at(time_us, state="a.b", **fields):
    drone = DroneState(time_us, 1.0, 2.0, 0.5, 0.25)
    seen = fields.get("seen", Detections())
    flight_time_s, navigation = fields.get("flight_time_s", 0.0), fields.get("navigation")
    return Moment(drone, VelocityFluCommand(), seen, state, flight_time_s, navigation=navigation)


def new_recording(path):
    return FlightRecording(path, load_scenario("test-case-1"), load_mission("frame_challenge"), None)


def plain_types(schema, at="message"):
    """Fail where a schema has anything that Foxglove's reader of JSON Schemas refuses."""
    assert schema["type"] == "object", at
    for name, field in schema["properties"].items():
        where = f"{at}.{name}"
        if "oneOf" in field:
            assert all(isinstance(each["const"], int) for each in field["oneOf"]), where
            continue
        inner = field["items"] if field["type"] == "array" else field
        assert inner["type"] in ("boolean", "string", "number", "integer", "object"), where
        assert inner.get("contentEncoding") in (None, "base64"), where
        if inner["type"] == "object":
            plain_types(inner, where)


@pytest.mark.parametrize("name", sorted(schema_texts()))
def test_each_schema_is_valid_named_and_of_types_that_foxglove_reads(name):
    schema = json.loads(schema_texts()[name])
    jsonschema.Draft202012Validator.check_schema(schema)
    assert schema["title"] == name
    plain_types(schema)


def test_every_message_is_as_its_schema_says(recorded):
    with recorded.path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        validators = {
            name: jsonschema.Draft202012Validator(json.loads(text)) for name, text in schema_texts().items()
        }
        seen = set()
        for schema, channel, message in reader.iter_messages():
            assert (schema.encoding, channel.message_encoding) == ("jsonschema", "json")
            assert schema.data == schema_texts()[schema.name]
            content = json.loads(message.data)
            validators[schema.name].validate(content)
            assert content.keys() <= json.loads(schema.data)["properties"].keys()
            seen.add(channel.topic)
    assert seen == TOPICS.keys() - {
        "/crossing",
        "/estimate",
        "/estimate/scene",
        "/map",
        "/map/scene",
        "/path",
    }


def test_counts_and_times_are_those_of_the_flight(recorded):
    ticks_ns = [moment.state.time_us * 1000 for moment in recorded.moments]
    assert len(ticks_ns) > 80
    for topic in ("/telemetry", "/setpoint"):
        assert [time_ns for _, time_ns, _ in messages(recorded.path, topic)] == ticks_ns
    images_ns = [time_ns for _, time_ns, _ in messages(recorded.path, "/camera/image")]
    assert images_ns == [time_us * 1000 for time_us, _ in recorded.images]
    for _, time_ns, content in messages(recorded.path, "/telemetry", "/camera/image", "/detections"):
        stamp = content["timestamp"]
        assert stamp["sec"] * 10**9 + stamp["nsec"] == time_ns


def test_states_follow_each_other_without_a_gap(recorded):
    states = [content for _, _, content in messages(recorded.path, "/mission")]
    assert [state["state"] for state in states][:2] == ["take_off.start", "take_off.set_base"]
    assert [state["previous"] for state in states] == ["", *(state["state"] for state in states[:-1])]
    assert states[-1]["state"] == recorded.flown.outcome.mission_state
    texts = [content["message"] for _, _, content in messages(recorded.path, "/log")]
    assert texts[0] == "take_off.start"
    assert texts[-1] == recorded.flown.result.reason


def test_images_are_kept_without_loss(recorded):
    kept = messages(recorded.path, "/camera/image")
    for (_, _, content), (_, image) in zip(kept, recorded.images, strict=True):
        assert content["format"] == "png"
        data = np.frombuffer(b64decode(content["data"]), np.uint8)
        assert np.array_equal(cv2.imdecode(data, cv2.IMREAD_COLOR), image)


def test_a_recording_gives_back_what_the_flight_s_observer_saw(recorded):
    recording = McapRecording(recorded.path)
    events = list(recording.events())
    recording.close()
    moments = [event for event in events if isinstance(event, Moment)]
    assert moments == recorded.moments
    assert any(abs(moment.state.attitude_arena[2]) > 0.01 for moment in moments)  # it pitches
    assert any(moment.detections.red.seen for moment in moments)
    images = [event for event in events if isinstance(event, RecordedImage)]
    assert [image.time_us for image in images] == [time_us for time_us, _ in recorded.images]
    assert recording.result == recorded.flown.result
    assert recording.title == "test-case-1: frame_challenge"


def test_equal_flights_leave_equal_bytes(recorded, tmp_path):
    again = record(tmp_path / "again.mcap")
    assert again.path.read_bytes() == recorded.path.read_bytes()


def test_a_recording_has_scenario_mission_and_result_attached(recorded):
    with recorded.path.open("rb") as file:
        reader = make_reader(file)
        attached = {each.name: each.data.decode() for each in reader.iter_attachments()}
        (about,) = reader.iter_metadata()
    assert attached.keys() == {"scenario.yaml", "mission.yaml", "result.json"}
    assert parse_scenario(attached["scenario.yaml"]).try_limit_s == 5.0
    assert "frame_challenge" in attached["mission.yaml"]
    assert json.loads(attached["result.json"])["state_sha256"] == recorded.flown.result.state_sha256
    assert about.metadata["seed"] == "7"


def test_crossings_have_the_vehicle_time_at_which_they_were_flown(tmp_path):
    path = tmp_path / "flight.mcap"
    with new_recording(path) as recording:
        recording.see(moment_at(3_000_000))
        recording.see(moment_at(12_000_000))
        recording.finish(RESULT, track_at(-0.5, 8.5))  # so the try began at 3.5 s
    assert [(time_ns, content["colour"]) for _, time_ns, content in messages(path, "/crossing")] == [
        (5_000_000_000, "red"),
        (7_750_000_000, "green"),
    ]
    recording = McapRecording(path)
    crossed = [event for event in recording.events() if isinstance(event, Crossed)]
    recording.close()
    assert crossed == [Crossed(5_000_000, "red"), Crossed(7_750_000, "green")]


def test_where_the_app_estimated_the_drone_to_be_and_where_it_was_are_read_back(tmp_path):
    place = PlaceEstimate((1.2, 2.0, 0.5), 0.3, (0.04, 0.01, 0.0, 0.01, 0.09, 0.0, 0.0, 0.0, 0.01), 0.05)
    moments = [
        replace(moment_at(3_000_000 + 50_000 * tick), place=place if tick else None) for tick in (0, 1)
    ]
    path = tmp_path / "flight.mcap"
    with new_recording(path) as recording:
        for moment in moments:
            recording.see(moment)
        recording.finish(RESULT, track_at(0.0, 0.05, true_path=[(0.0, 1.0, 2.0, 0.4), (0.1, 1.1, 2.0, 0.4)]))
    for topic, _, content in messages(path, "/estimate", "/estimate/scene", "/truth"):
        jsonschema.validate(content, json.loads(schema_texts()[TOPICS[topic]]))
    (scene_message,) = messages(path, "/estimate/scene")
    assert scene_message[2]["entities"][0]["spheres"][0]["size"] == pytest.approx(
        {"x": 0.8, "y": 1.2, "z": 0.4}
    )
    recording = McapRecording(path)
    events = list(recording.events())
    recording.close()
    assert [event for event in events if isinstance(event, Moment)] == moments
    assert [event for event in events if isinstance(event, TruePlace)] == [
        TruePlace(3_000_000, (1.0, 2.0, 0.4)),
        TruePlace(3_100_000, (1.1, 2.0, 0.4)),
    ]


def test_the_map_and_the_path_are_written_when_they_change_and_read_back(tmp_path):
    sure = GateEstimate("red", (3, 2, 2), 0.5, (0.02, 0.01, 0.03), 0.1, False, True, 12, 2_950_000)
    shape = GateShape(0.8, 0.5, 0.03, 0.01)
    guessed = GateEstimate("yellow", (1, 0, 1), -1.5, (0.4, 0.5, 0.1), inf, True, False, 1, 2_900_000, shape)
    views = [
        None,
        NavigationView(goal="explore"),
        NavigationView((sure, guessed), (), "explore"),
        NavigationView((sure, guessed), ((0.0, 0.0, 1.0), (3.0, 2.0, 2.0)), "cross red"),
        NavigationView((sure, guessed), ((0.0, 0.0, 1.0), (3.0, 2.0, 2.0)), "cross red"),
        NavigationView((sure,), (), "land"),
    ]
    moments = [
        moment_at(3_000_000 + 50_000 * tick, navigation=view)
        for tick, view in enumerate(view for view in views for _ in range(4))
    ]
    path = tmp_path / "flight.mcap"
    with new_recording(path) as recording:
        for moment in moments:
            recording.see(moment)
    ticks = {topic: [] for topic in ("/map", "/map/scene", "/path")}
    for topic, time_ns, content in messages(path, *ticks):
        jsonschema.validate(content, json.loads(schema_texts()[TOPICS[topic]]))
        ticks[topic].append((time_ns - 3_000_000_000) // 50_000_000)
    assert ticks == {"/map": [4, 8, 12, 20], "/map/scene": [4, 8, 12, 20], "/path": [12, 20]}
    recording = McapRecording(path)
    assert list(recording.events()) == moments
    recording.close()


def test_the_drawn_map_has_dashed_outlines_until_a_gate_is_certain():
    sure = GateEstimate("red", (3, 2, 2), 0.0, (0.02, 0.01, 0.03), 0.1, False, True, 12, 0)
    wide = GateShape(outer_width_m=1.0)
    unsure = GateEstimate("green", (1, 1, 1), pi / 2, (inf, 0.1, 0.1), 0.1, False, False, 1, 0, wide)
    lost = GateEstimate("blue", (nan, 1, 1), 0.0, (0.1, 0.1, 0.1), 0.1, False, False, 1, 0)
    view = NavigationView((sure, unsure, lost))
    assert [each["colour"] for each in gate_map(view, 0)["frames"]] == ["red", "green"]
    drawn = map_scene(view, 0)
    assert [each["type"] for each in drawn["deletions"]] == [1]
    red, green = drawn["entities"]
    assert [len(each["lines"][0]["points"]) for each in (red, green)] == [8, 32]
    (ellipsoid,) = red["spheres"]
    assert ellipsoid["size"] == {"x": 0.08, "y": 0.04, "z": 0.12}  # two standard deviations each way
    assert green["spheres"] == []
    edges = [point["y"] for point in red["lines"][0]["points"]]
    assert (min(edges), max(edges)) == pytest.approx((2 - 0.21, 2 + 0.21))
    across = [point["x"] for point in green["lines"][0]["points"]]
    assert (min(across), max(across)) == pytest.approx((1 - 0.5, 1 + 0.5))


def test_what_is_not_known_is_left_out():
    seen = Detections(red=Detection(n=120, s=-10, e=20, w=-20), time_us=1_250_000)
    message = detections(seen, 1_300_000)
    assert message["red"] == {"seen": True, "n": 120, "s": -10, "e": 20, "w": -20}
    assert message["green"] == {"seen": False}
    assert message["image_timestamp"] == time_of(1_250_000) == {"sec": 1, "nsec": 250_000_000}


def test_boxes_enclose_the_pixels_that_were_seen():
    image = np.full((240, 320, 3), 128, np.uint8)
    image[50:70, 200:241] = (0, 0, 255)
    assert box_edges(detect(image).red, (320, 240)) == (200, 50, 241, 70)


def test_the_scene_shows_obstacles():
    (obstacles,) = (
        each for each in scene(load_scenario("crowded-17"), 0)["entities"] if each["id"] == "obstacles"
    )
    assert len(obstacles["cubes"]) == 2 * 4 + 3 + 2  # bars of decoys, poles, parts of the wall


def test_the_scene_shows_each_bar_the_base_and_the_drone():
    scenario = load_scenario("test-case-1")
    entities = {each["id"]: each for each in scene(scenario, 0)["entities"]}
    assert entities.keys() == {"arena", "base", "red frame", "green frame", "blue frame", "drone"}
    assert entities["drone"]["frame_id"] == "drone"
    red = next(gate for gate in scenario.frames if gate.colour == "red")
    bars = entities["red frame"]["cubes"]
    assert len(bars) == 4
    for axis, value in zip("xyz", red.position_arena_m, strict=True):
        assert np.mean([bar["pose"]["position"][axis] for bar in bars]) == pytest.approx(value)
    assert max(bar["size"]["y"] for bar in bars) == pytest.approx(red.outer_width_m)
    base = entities["base"]["cubes"][0]
    assert base["pose"]["position"]["z"] + base["size"]["z"] / 2 == pytest.approx(scenario.base.top_m)


def test_the_camera_looks_ahead():
    q = camera_transform(load_scenario("test-case-1"), 0)["rotation"]
    w, x, y, z = q["w"], q["x"], q["y"], q["z"]
    rotation = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    assert rotation @ [0, 0, 1] == pytest.approx([1, 0, 0])  # into the image: forward
    assert rotation @ [1, 0, 0] == pytest.approx([0, -1, 0])  # to its right: right
    assert rotation @ [0, 1, 0] == pytest.approx([0, 0, -1])  # down in it: down


def test_compressed_images_are_kept_as_received(tmp_path):
    path = tmp_path / "flight.mcap"
    image = np.zeros((24, 32, 3), np.uint8)
    jpeg = bytes(cv2.imencode(".jpg", image)[1])
    with new_recording(path) as recording:
        recording.see_frame(CameraFrame(image, None, 0.0, jpeg))  # no time yet: left out
        recording.see(moment_at(2_000_000))
        recording.see_frame(CameraFrame(image, None, 0.0, jpeg))
        recording.see_frame(CameraFrame(image, 2_025_000, 0.0, jpeg))
    kept = messages(path, "/camera/image")
    assert [time_ns for _, time_ns, _ in kept] == [2_000_000_000, 2_025_000_000]
    assert all(b64decode(content["data"]) == jpeg and content["format"] == "jpeg" for _, _, content in kept)


def test_an_interrupted_flight_keeps_what_was_recorded(tmp_path):
    path = tmp_path / "flight.mcap"

    def fly():
        with new_recording(path) as recording:
            recording.see(moment_at(2_000_000))
            recording.see_image(2_025_000, np.zeros((24, 32, 3), np.uint8))
            raise KeyError("whatever")

    with pytest.raises(KeyError, match="whatever"):
        fly()
    assert {topic for topic, _, _ in messages(path)} >= {"/telemetry", "/camera/image", "/scene"}


def test_a_flight_that_did_not_start_leaves_no_recording(tmp_path):
    with new_recording(tmp_path / "flight.mcap"):
        pass
    assert list(tmp_path.iterdir()) == []


def test_a_full_disk_stops_the_recording_only(tmp_path):
    path = tmp_path / "full"
    path.symlink_to("/dev/full")
    noise = np.random.default_rng(1).integers(0, 255, (240, 320, 3), np.uint8)
    with new_recording(path) as recording:
        for tick in range(20):
            recording.see(moment_at(2_000_000 + 50_000 * tick))
            recording.see_image(2_000_000 + 50_000 * tick, noise)
        recording.finish(RESULT, track_at(0.0))
    assert recording.problem == "recording stopped: No space left on device"


def test_a_file_that_cannot_be_written_is_refused(tmp_path):
    with pytest.raises(RecordingError, match=r"cannot write .*missing.*No such file"):
        new_recording(tmp_path / "missing" / "flight.mcap")
