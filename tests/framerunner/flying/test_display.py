"""What the terminal shows during a flight."""

import asyncio
from io import StringIO

import pytest
from rich.console import Console

from framerunner.flying.display import FlightDisplay, result_lines
from framerunner.runs.recorder import FlightRecorder
from offboard.app import Moment
from offboard.drone import DroneState, VelocityFluCommand
from scenarios.result import FlightResult, RefereeSnapshot
from scenarios.verdict import Verdict
from vision.types import Detection, Detections

SEEN = Detection(n=10, s=-10, e=20, w=-20, d=2.345, a=31.0)
IN_PART = Detection(n=120, s=-10, e=20, w=-20)


class Judge:
    source = "test"
    now = RefereeSnapshot(0, 1.0, 0.0, ("red",), "green", 2, True, True, False, False)

    async def standing(self):
        return self.now


@pytest.fixture
def flight():
    recorder = FlightRecorder()
    return recorder, FlightDisplay("a place: a mission", 180.0, recorder, Judge())


def see(recorder, time_s, state, mode="OFFBOARD", **fields):
    drone = DroneState(round(time_s * 1e6), 1.25, -2.5, 0.75, 0.5, armed=True, mode=mode)
    detections = Detections(red=SEEN, green=IN_PART)
    recorder.see(Moment(drone, VelocityFluCommand(), detections, state, time_s, **fields))


async def shown(display, recorder, moments):
    """Run the display while moments are seen."""
    async with display:
        for time_s, state, *how in moments:
            see(recorder, time_s, state, **(how[0] if how else {}))
            await asyncio.sleep(0.25)


async def test_without_a_terminal_a_line_is_printed_at_each_state_and_each_ten_seconds(flight, capsys):
    recorder, display = flight
    times = [(0.0, "take_off.start"), (0.1, "take_off.start"), (0.2, "red.turning"), (9.0, "red.turning")]
    await shown(display, recorder, [*times, (10.3, "red.turning")])
    lines = capsys.readouterr().err.splitlines()
    assert [line.split()[:3] for line in lines] == [
        ["0.0", "s", "take_off.start"],
        ["0.2", "s", "red.turning"],
        ["10.3", "s", "red.turning"],
    ]
    assert all("crossed: red" in line for line in lines)
    assert "x  1.25" in lines[0] and "y -2.50" in lines[0] and "z 0.75" in lines[0]


async def test_a_pause_is_a_line_and_its_end_another(flight, capsys):
    recorder, display = flight
    taken = {"mode": "POSCTL", "paused": True}
    refused = {"mode": "HOLD", "paused": True, "remark": "the drone stands on the ground"}
    moments = [(1.0, "red.turning"), (1.2, "red.turning", taken), (1.4, "red.turning", taken)]
    await shown(display, recorder, [*moments, (1.6, "red.turning", refused), (1.8, "red.turning")])
    ends = [line.partition("crossed: red")[2].strip() for line in capsys.readouterr().err.splitlines()]
    assert ends == [
        "",
        "paused: the pilot has the sticks (POSCTL)",
        "paused: given back (HOLD), but the drone stands on the ground",
        "",
    ]


def test_the_table_shows_a_pause(flight):
    recorder, display = flight
    see(recorder, 12.3, "red.turning", "POSCTL", paused=True)
    text = rendered(display._table(None))
    assert "paused" in text and "the pilot has the sticks (POSCTL)" in text


def test_the_result_says_that_a_flight_was_of_the_class_open():
    result = FlightResult(verdict=Verdict.CLEAN, reason="clean", judged_by="truth")
    assert "class" not in result_lines(result)
    assert "judged by truth, class open" in result_lines(result.model_copy(update={"mission_class": "open"}))


async def test_before_the_first_tick_nothing_is_printed(flight, capsys):
    recorder, display = flight
    await shown(display, recorder, [])
    assert capsys.readouterr().err == ""


def rendered(table):
    console = Console(width=100, record=True, file=StringIO())
    console.print(table)
    return console.export_text()


def test_in_a_terminal_a_table_shows_state_position_and_detections(flight):
    recorder, display = flight
    assert "waiting until the drone is ready" in rendered(display._table(None))
    see(recorder, 12.3, "red.turning")
    text = rendered(display._table(Judge.now))
    for part in (
        "a place: a mission",
        "red.turning",
        "12.3 s of 180 s",
        "OFFBOARD",
        "2.35 m away, 31 degrees",
    ):
        assert part in text
    assert "seen in part" in text
    assert "not seen" in text
    assert "contacts: 2" in text
    assert "crossed" not in rendered(display._table(None))
