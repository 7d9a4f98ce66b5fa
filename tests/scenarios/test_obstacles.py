"""Decoys, poles and walls in scenario files, and what they are for the referee."""

from math import pi

import pytest

from scenarios.loader import dump_yaml, parse_scenario
from scenarios.models import Decoy, Doorway, Pole, Scenario, ScenarioError, TrueState, Wall
from scenarios.referee import Referee

CROWD = Scenario(
    name="crowd",
    decoys=(
        Decoy(colour="cyan", x_m=2, y_m=0, z_m=1),
        Decoy(colour="cyan", x_m=-2, y_m=0, z_m=1),
        Decoy(colour="magenta", x_m=0, y_m=3, z_m=2),
    ),
    poles=(Pole(x_m=1, y_m=2), Pole(x_m=1, y_m=-2, edge_m=0.2, height_m=1.5)),
    walls=(
        Wall(x_m=3, y_m=-2, end_x_m=3, end_y_m=2, doorway=Doorway(offset_m=1.5)),
        Wall(x_m=-3, y_m=0, end_x_m=-3, end_y_m=1.2, doorway=Doorway(offset_m=0.6), height_m=2),
    ),
)
FAULTS = [
    ("decoys: [{colour: red, x_m: 1, y_m: 1, z_m: 1}]", "colour is \"red\": must be 'cyan' or 'magenta'"),
    ("decoys: [{colour: cyan, x_m: 1, y_m: 1, z_m: 5}]", "z_m 5.0 is above the arena; use 4.0 or less"),
    ("poles: [{x_m: 6, y_m: 1}]", "x_m 6.0 is outside the arena; keep within ±5.0 or enlarge the arena"),
    ("poles: [{x_m: 2, y_m: 1, height_m: 4.1}]", "height_m 4.1 is above the arena; use 4.0 or less"),
    ("poles: [{x_m: 2, y_m: 1, edge_m: 9}]", "edge_m is 9: must be at most 2.0"),
    ("poles: [{x_m: 0.3, y_m: 0}]", "x_m 0.3 is over the start; keep the pole 0.3 m from its centre"),
    (
        "base: {x_m: 2}\npoles: [{x_m: 2, y_m: 0.4}]",
        "x_m 2.0 is over the base; keep the pole 0.354 m from its centre",
    ),
    (
        "walls: [{x_m: -2, y_m: -2, end_x_m: 2, end_y_m: 2}]",
        "x_m -2.0 is over the start; keep the wall 0.3 m from its centre",
    ),
    (
        "walls: [{x_m: 1, y_m: 1, end_x_m: 1, end_y_m: -9}]",
        "end_y_m -9.0 is outside the arena; keep within ±5.0",
    ),
    (
        "walls: [{x_m: 1, y_m: 1, end_x_m: 1, end_y_m: 1}]",
        "end_x_m 1.0 makes the wall shorter than it is thick",
    ),
    (
        "walls: [{x_m: 1, y_m: 1, end_x_m: 1, end_y_m: 4, doorway: {offset_m: 0.5}}]",
        "doorway.offset_m 0.5 puts the doorway past an end of the wall, which is 3 m long",
    ),
    (
        "walls: [{x_m: 1, y_m: 1, end_x_m: 1, end_y_m: 4, doorway: {offset_m: 1.5, width_m: 0.9}}]",
        "doorway.width_m is 0.9: must be at least 1.0",
    ),
    (
        "walls: [{x_m: 1, y_m: 1, end_x_m: 1, end_y_m: 4, doorway: {offset_m: 1.5, widh_m: 1}}]",
        "doorway.widh_m is not a known field; did you mean width_m?",
    ),
]


@pytest.mark.parametrize(("text", "message"), FAULTS)
def test_faults_give_one_line_with_the_field(text, message):
    with pytest.raises(ScenarioError) as caught:
        parse_scenario(f"name: a\n{text}", "f.yaml")
    assert message in str(caught.value)
    assert len(str(caught.value).splitlines()) == 1


def test_they_round_trip_and_a_scenario_without_them_is_written_without_them():
    assert parse_scenario(dump_yaml(CROWD)) == CROWD
    assert not {"decoys", "poles", "walls"} & set(Scenario(name="a").model_dump())


def test_poles_and_walls_are_boxes_on_the_floor_with_the_doorway_left_free():
    pole, low_pole, before, after = CROWD.prisms  # a wall with a doorway as long as itself has no parts
    assert (pole.centre_arena_m, pole.half_extents_m) == ((1, 2, 2), (0.075, 0.075, 2))
    assert (low_pole.centre_arena_m[2], low_pole.half_extents_m) == (0.75, (0.1, 0.1, 0.75))
    assert before.centre_arena_m == pytest.approx((3, -2 + 0.45, 2))
    assert before.half_extents_m == pytest.approx((0.45, 0.05, 2))
    assert after.centre_arena_m == pytest.approx((3, 1.05, 2))
    assert after.half_extents_m == pytest.approx((0.95, 0.05, 2))
    assert before.yaw_rad == pytest.approx(pi / 2)
    assert before.plan_distance_m(3, -0.5) == pytest.approx(0.6)


def test_the_referee_counts_what_is_touched_and_no_crossing_of_a_decoy():
    referee = Referee(CROWD, (0.25, 0.25, 0.045))

    def see(time_s, x_m, contacts=()):
        at = TrueState(
            round(time_s * 1e6), (x_m, 0.0, 1.0), (1.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0), True, contacts
        )
        referee.update(at)

    for step in range(60):
        see(step / 20, step / 20)
    see(3.1, 3.0, ("wall", "drone 2"))
    see(3.2, 3.0, ("pole",))
    see(3.3, 3.0, ("cyan",))
    see(3.4, 3.0, ("magenta", "floor"))
    report = referee.report()
    assert report.contact_frames == ("wall", "pole", "cyan", "magenta")
    assert report.frames_crossed == ()
