"""Wind in scenarios and levels: what is refused, what is written, what is drawn."""

import pytest

from framerunner.files.yaml_text import to_yaml
from scenarios.air import Wind
from scenarios.loader import dump_yaml, parse_scenario
from scenarios.models import Scenario, ScenarioError
from scenarios.random_numbers import LevelError
from scenarios.random_scenarios import LEVEL_FILES, load_level, random_scenario

CALM = to_yaml(load_level("calm").model_dump(exclude_unset=True))
WINDY = """\
wind:
  speed_m_s: {low: 1.0, high: 3.0}
  turbulence_m_s: {low: 0.2, high: 0.6}
  gust_m_s: {low: 0.0, high: 1.5}
  length_m: 3.0
airframe: racer-3in
sensors: somewhere/noisy.yaml
"""


def drawn(text, seed):
    return random_scenario(LEVEL_FILES.parse(text, "f.yaml"), seed)


def test_wind_is_written_and_read_unless_the_air_is_still():
    windy = Scenario(name="windy", wind=Wind(speed_m_s=2.0, direction_rad=1.0, gust_m_s=3.0))
    assert parse_scenario(dump_yaml(windy)) == windy
    assert windy.wind.blows
    still = Scenario(name="still")
    assert not still.wind.blows
    assert "wind" not in still.model_dump(mode="json")
    assert Wind(turbulence_m_s=0.1).blows
    assert Wind(gust_m_s=0.1).blows


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{speed_m_s: 26}", "wind.speed_m_s is 26: must be at most 25.0"),
        ("{length_m: 0}", "wind.length_m is 0: must be at least 0.1"),
        (
            "{gust_m_s: 1, gust_s: 10}",
            "wind.gust_s 10.0 leaves no time between gusts; use less than gust_period_s 10",
        ),
        ("{speed: 1}", "wind.speed is not a known field; did you mean speed_m_s?"),
    ],
)
def test_faults_give_one_line(text, message):
    with pytest.raises(ScenarioError) as caught:
        parse_scenario(f"name: a\nwind: {text}\n", "f.yaml")
    assert str(caught.value) == f"f.yaml:2: {message}"


def test_a_level_draws_wind_and_changes_nothing_else():
    winds = []
    for seed in range(60):
        calm, windy = drawn(CALM, seed), drawn(CALM + WINDY, seed)
        assert (windy.airframe, windy.sensors) == ("racer-3in", "somewhere/noisy.yaml")
        changed = {"wind": Wind(), "airframe": calm.airframe, "sensors": calm.sensors}
        assert windy.model_copy(update=changed) == calm
        winds.append(windy.wind)
    assert drawn(CALM + WINDY, 7).wind == winds[7]
    assert all(1.0 <= wind.speed_m_s <= 3.0 and wind.length_m == 3.0 for wind in winds)
    for values, low, high in (
        ([wind.direction_rad for wind in winds], -3.141, 3.141),
        ([wind.turbulence_m_s for wind in winds], 0.2, 0.6),
        ([wind.gust_m_s for wind in winds], 0.0, 1.5),
    ):
        assert low <= min(values) < low + 0.1 * (high - low)
        assert high - 0.1 * (high - low) < max(values) <= high


def test_a_range_of_wind_does_not_change_the_other_numbers_of_the_wind():
    wind = drawn(CALM + WINDY, 3).wind
    stronger = drawn(CALM + WINDY.replace("high: 3.0", "high: 9.0"), 3).wind
    assert stronger.speed_m_s > wind.speed_m_s
    assert stronger.model_copy(update={"speed_m_s": wind.speed_m_s}) == wind


def test_a_level_refuses_wind_that_cannot_be():
    with pytest.raises(LevelError, match=r"f\.yaml:21: wind\.speed_m_s\.high 30\.0 cannot be flown"):
        LEVEL_FILES.parse(CALM + "wind:\n  speed_m_s: {low: 0.0, high: 30.0}\n", "f.yaml")
    with pytest.raises(LevelError, match=r"wind\.gust_s 5\.0 leaves no time between gusts"):
        LEVEL_FILES.parse(CALM + "wind: {gust_s: 5.0, gust_period_s: 4.0}\n", "f.yaml")


@pytest.mark.parametrize("level", ["breeze", "gusts"])
def test_windy_levels_have_the_layouts_of_calm_and_wind_of_their_own(level):
    windy, calm = (random_scenario(load_level(name), 17) for name in (level, "calm"))
    assert (windy.frames, windy.base, windy.start) == (calm.frames, calm.base, calm.start)
    assert (windy.airframe, windy.sensors) == ("racer-3in", "mocap")
    assert 2.0 <= windy.wind.speed_m_s <= 3.0
    assert windy.wind.turbulence_m_s >= 0.4
    assert (windy.wind.gust_m_s > 0.0) is (level == "gusts")
