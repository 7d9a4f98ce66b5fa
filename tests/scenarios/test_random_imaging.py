"""Camera effects, light and clutter of random scenarios."""

import pytest

from scenarios.random_scenarios import LEVEL_FILES, Level, LevelError, load_level, random_scenario

INDOOR = load_level("indoor")


def test_indoor_has_the_layouts_of_calm():
    calm, indoor = (random_scenario(load_level(name), 17) for name in ("calm", "indoor"))
    assert indoor.frames == calm.frames
    assert (indoor.base, indoor.start) == (calm.base, calm.start)
    assert indoor.sensors == "mocap"


def test_every_seed_has_its_own_camera_light_and_clutter():
    one, other = (random_scenario(INDOOR, seed) for seed in (1, 2))
    assert one == random_scenario(INDOOR, 1)
    assert one.camera.effects.lens != other.camera.effects.lens
    assert one.light.sun_direction_arena != other.light.sun_direction_arena
    assert one.patches != other.patches
    assert len(one.patches) == INDOOR.clutter.posters + INDOOR.clutter.marks


def test_draws_are_within_their_ranges():
    for seed in range(60):
        scenario = random_scenario(INDOOR, seed)
        effects = scenario.camera.effects
        for field in ("exposure_s", "readout_s", "vignetting", "illumination", "read_noise", "shot_noise"):
            drawn = getattr(INDOOR.camera, field)
            assert drawn.low <= getattr(effects, field) <= drawn.high
        assert INDOOR.camera.k1.low <= effects.lens.k1 <= INDOOR.camera.k1.high
        assert scenario.light.sun_direction_arena[2] < 0.0
        hall, half_m = scenario.hall, scenario.arena.length_x_m / 2
        for patch in scenario.patches:
            assert abs(patch.across_m) <= half_m + hall.beyond_m
            assert patch.border_m is None or patch.border_m < patch.height_m


def test_leaving_out_a_section_changes_nothing_else():
    fields = INDOOR.model_dump(exclude_none=True)
    without = random_scenario(Level.model_validate({**fields, "clutter": None}), 5)
    whole = random_scenario(INDOOR, 5)
    assert without.patches == ()
    assert without.hall is None
    assert without.camera == whole.camera
    assert without.light == whole.light
    assert without.frames == whole.frames


@pytest.mark.parametrize(
    ("section", "message"),
    [
        ("camera:\n  k1: {low: -0.9, high: 0.0}", "folds the image's corners"),
        ("camera:\n  exposure_s: {low: 0.0, high: 0.2}", "exposure_s.high 0.2 cannot be flown"),
        (
            "light:\n  elevation_rad: {low: 0.0, high: 1.0}\n  ambient: {low: 0.5, high: 0.5}",
            "elevation_rad.low",
        ),
    ],
)
def test_ranges_that_cannot_be_drawn_from_are_refused(section, message):
    layout = """
name: bad
layout:
  x_m: {low: -4.0, high: 4.0}
  y_m: {low: -4.0, high: 4.0}
  apart_m: 1.5
  frame_z_m: {low: 0.5, high: 2.5}
  frame_yaw_rad: {low: -3.141, high: 3.141}
  start_yaw_rad: {low: -3.141, high: 3.141}
"""
    with pytest.raises(LevelError, match=message):
        LEVEL_FILES.parse(layout + section, "bad.yaml")


def test_textures_are_drawn_from_streams_of_their_own():
    fields = INDOOR.model_dump(exclude_none=True)
    textured = Level.model_validate({**fields, "textures": {"floor": ["wood", "carpet"], "walls": ["brick"]}})
    drawn = [random_scenario(textured, seed) for seed in range(20)]
    assert {scenario.floor_texture.pattern for scenario in drawn} == {"wood", "carpet"}
    assert len({scenario.floor_texture.seed for scenario in drawn}) == len(drawn)
    assert {scenario.hall.wall_texture.pattern for scenario in drawn} == {"brick"}
    plain = random_scenario(INDOOR, 5)
    hall = drawn[5].hall.model_copy(update={"wall_texture": None})
    assert drawn[5].model_copy(update={"floor_texture": None, "hall": hall}) == plain


def test_hall_has_the_layouts_of_calm_and_is_full_of_things():
    calm, scenario = (random_scenario(load_level(name), 17) for name in ("calm", "hall"))
    clutter = load_level("hall").clutter
    assert scenario.frames == calm.frames
    assert scenario.sensors == "ideal"
    hall = scenario.hall
    counts = (len(hall.windows), len(hall.pictures), len(hall.people))
    assert counts == (clutter.windows, clutter.pictures, clutter.people)
    for person in hall.people:
        beyond_m = max(abs(person.x_m), abs(person.y_m)) - 5.0
        assert scenario.arena.margin_m < beyond_m < clutter.beyond_m
    assert random_scenario(load_level("hall"), 18).hall.people != hall.people
