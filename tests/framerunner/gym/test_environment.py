"""FrameChallenge-v0: Gymnasium's own checks, episodes that repeat, and rewards."""

import subprocess
import sys
import warnings
from math import cos, sin

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.utils.env_checker import check_env

import framerunner.gym
from framerunner.errors import SettingError
from framerunner.gym.environment import FrameChallengeEnv
from framerunner.gym.flight import CONTACT, CROSSING, FAILURE, LANDING
from scenarios.models import Scenario, ScenarioError
from scenarios.random_numbers import LevelError

UP = np.array([0.0, 0.0, 1.0, 0.0], np.float32)
STILL = np.zeros(4, np.float32)


def frame(colour, x_m, z_m=1.0):
    return {"colour": colour, "x_m": x_m, "y_m": 0.0, "z_m": z_m}


def scenario(*frames, **fields):
    return Scenario.model_validate(
        {
            "name": "line",
            "base": {"x_m": 0.0, "y_m": 0.0},
            "start": {"x_m": 0.0, "y_m": 0.0},
            "frames": list(frames),
            **fields,
        }
    )


def make(**options):
    return gymnasium.make(framerunner.gym.ENVIRONMENT_ID, disable_env_checker=True, **options)


def towards(observation, goal_m):
    """The action that flies straight to a position, as a mission's fly_to_goal does."""
    x, y, z, yaw = observation["imu"].tolist()
    dx, dy, dz = (0.5 * (goal - now) for goal, now in zip(goal_m, (x, y, z), strict=True))
    forward, left = cos(yaw) * dx + sin(yaw) * dy, cos(yaw) * dy - sin(yaw) * dx
    return np.clip([forward, left, dz, 0.0], -0.6, 0.6).astype(np.float32)


class Episode:
    """An episode, with all its rewards."""

    def __init__(self, env, **reset):
        self.env = env
        self.observation, self.info = env.reset(**reset)
        self.rewards = []
        self.terminated = self.truncated = False

    @property
    def over(self):
        return self.terminated or self.truncated

    @property
    def rewarded(self):
        return [round(reward, 6) for reward in self.rewards if reward]

    def step(self, action):
        self.observation, reward, self.terminated, self.truncated, self.info = self.env.step(action)
        self.rewards.append(reward)

    def fly_to(self, *goal_m, near_m=0.06, limit=400):
        for _ in range(limit):
            if self.over or np.linalg.norm(self.observation["imu"][:3] - goal_m) < near_m:
                return
            self.step(towards(self.observation, goal_m))
        raise AssertionError(f"{goal_m} is not reached; now at {self.observation['imu']}")


@pytest.mark.parametrize(
    "options",
    [{}, {"image": True}, {"scenario": "test-case-1", "ticks_per_step": 2, "render_mode": "rgb_array"}],
    ids=["random", "image", "fixed"],
)
def test_gymnasium_s_checks_pass(options):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        env = gymnasium.make(framerunner.gym.ENVIRONMENT_ID, **options)
        check_env(env.unwrapped)
        env.close()


def test_it_is_made_by_its_module_s_name():
    code = "import gymnasium; print(gymnasium.make('framerunner.gym:FrameChallenge-v0').action_space)"
    made = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert made.stdout.strip() == "Box(-1.0, 1.0, (4,), float32)"


def test_without_gymnasium_one_line_says_what_to_install():
    code = "import sys; sys.modules['gymnasium'] = None; import framerunner.gym"
    failed = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    last = failed.stderr.splitlines()[-1]
    assert last.startswith("ImportError: framerunner.gym needs Gymnasium")
    assert "pip install 'framerunner[gym]'" in last


def test_same_seed_and_actions_give_the_same_episode():
    actions = np.random.default_rng(5).uniform(-1, 1, (60, 4)).astype(np.float32)
    actions[:20] = UP
    flown = []
    for env in (make(), make()):
        env.reset(seed=3)  # another episode before: it must not affect the next one
        env.step(UP)
        episode = Episode(env, seed=11)
        seen = [episode.observation]
        for action in actions:
            episode.step(action)
            seen.append(episode.observation)
        flown.append((episode.info, episode.rewards, seen))
    assert flown[0][:2] == flown[1][:2]
    for one, other in zip(flown[0][2], flown[1][2], strict=True):
        assert all(np.array_equal(one[name], other[name]) for name in one)


def test_each_episode_in_one_windy_scenario_has_another_wind():
    env = make(scenario=scenario(frame("red", 2.0), wind={"turbulence_m_s": 0.3, "gust_m_s": 1.0}))

    def place(**reset):
        episode = Episode(env, **reset)
        for _ in range(30):
            episode.step(UP)
        return episode.observation["imu"].tolist()

    first, second = place(seed=1), place()
    assert place(seed=1) == first != second


def test_each_episode_has_another_scenario_of_the_level():
    env = make()
    names = [env.reset(seed=1)[1]["scenario"], *(env.reset()[1]["scenario"] for _ in range(2))]
    assert len(set(names)) == 3
    assert all(name.startswith("calm-") for name in names)
    assert env.reset(seed=1)[1]["scenario"] == names[0]


def test_the_drone_waits_with_its_motors_on_and_climbs_on_command():
    episode = Episode(make(scenario=scenario()))
    first = episode.observation
    assert first["imu"][:2] == pytest.approx([0, 0], abs=0.01)
    assert 0.5 < first["imu"][2] < 0.6  # on the base
    for _ in range(10):
        episode.step(STILL)
    assert episode.observation["imu"] == pytest.approx(first["imu"], abs=0.01)
    for _ in range(30):
        episode.step(UP)
    assert 1.0 < episode.observation["imu"][2] < 2.2
    assert episode.rewarded == []
    assert 178 > episode.observation["time_left_s"][0] > 176


def test_left_and_yaw_have_the_arena_s_signs():
    episode = Episode(make(scenario=scenario()))
    for _ in range(30):
        episode.step(UP)
    for _ in range(30):
        episode.step(np.array([0, 0.5, 0, 0.5], np.float32))
    _, y, _, yaw = episode.observation["imu"]
    assert y > 0.2
    assert yaw > 0.4


def test_each_gate_and_the_landing_are_rewarded():
    episode = Episode(make(scenario=scenario(frame("red", 1.0), frame("green", 2.0))))
    episode.fly_to(0, 0, 1)
    episode.fly_to(1.5, 0, 1)
    assert (episode.rewarded, episode.info["crossed"], episode.info["next_colour"]) == (
        [CROSSING],
        ("red",),
        "green",
    )
    episode.fly_to(2.6, 0, 1)
    episode.fly_to(2.6, 0, 2)
    episode.fly_to(0, 0, 2)
    episode.fly_to(0, 0, 0.4)  # below the base's top: its motors stop before
    assert (episode.terminated, episode.truncated) == (True, False)
    assert episode.rewarded == [CROSSING, CROSSING, LANDING]
    assert episode.info["report"]["verdict"] == "clean", episode.info["report"]["reason"]
    with pytest.raises(ResetNeeded):
        episode.env.unwrapped.step(UP)


def test_landing_without_all_gates_is_not_rewarded():
    episode = Episode(make(scenario=scenario(frame("red", 3.0))))
    episode.fly_to(0, 0, 1.2)
    for _ in range(400):
        episode.step(-UP)  # the autopilot stops the motors after the landing
        if episode.over:
            break
    assert (episode.terminated, episode.rewarded) == (True, [])
    assert "landed on the base without crossing red" in episode.info["report"]["reason"]


def test_an_agent_that_never_takes_off_is_disarmed_by_the_autopilot():
    episode = Episode(make(scenario=scenario(), ticks_per_step=20))
    while not episode.over:
        episode.step(STILL)
    assert (episode.terminated, episode.rewarded) == (True, [])
    assert 9 < episode.info["try_time_s"] < 12
    assert "preflight disarming" in episode.info["report"]["reason"]


def test_a_gate_in_the_wrong_order_ends_the_episode():
    episode = Episode(make(scenario=scenario(frame("green", 1.0), frame("red", 3.0))))
    episode.fly_to(0, 0, 1)
    episode.fly_to(1.5, 0, 1)
    assert (episode.terminated, episode.rewarded) == (True, [FAILURE])
    assert episode.info["report"]["verdict"] == "wrong order"


def test_a_contact_has_a_negative_reward():
    episode = Episode(make(scenario=scenario(frame("red", 1.0, 1.08))))
    episode.fly_to(0, 0, 1, near_m=0.03)
    for _ in range(60):
        episode.step(np.array([0.5, 0, 0, 0], np.float32))
        if episode.info["contacts"]:
            break
    assert episode.info["contacts"] == 1
    assert episode.rewarded[0] == CONTACT


def test_time_runs_out():
    episode = Episode(make(scenario=scenario(try_limit_s=3.0), ticks_per_step=20))
    while not episode.over:
        assert episode.observation["time_left_s"][0] > 0
        episode.step(UP / 4)
    assert (episode.terminated, episode.truncated) == (False, True)
    assert episode.observation["time_left_s"][0] == 0
    assert episode.info["report"]["verdict"] == "timed out"


def test_what_is_not_seen_is_zero_and_not_marked_as_seen():
    episode = Episode(make(scenario=scenario(frame("red", 2.0), frame("blue", -2.0))))
    episode.fly_to(0, 0, 1)
    cam, seen = episode.observation["cam"], episode.observation["seen"]
    assert seen.tolist() == [[1, 1], [0, 0], [0, 0]]
    n, s, e, w, d, a = cam[0]
    assert n > s
    assert e > 0 > w
    assert d == pytest.approx(2.0, abs=0.2)
    assert a < 30
    assert not cam[1:].any()


def test_the_image_is_rgb_and_as_late_as_the_detections():
    env = make(scenario=scenario(frame("red", 1.0, 1.0)), image=True, render_mode="rgb_array")
    episode = Episode(env)
    episode.fly_to(0, 0, 1)
    image = episode.observation["image"]
    n, _, e, w = episode.observation["cam"][0][:4]
    pixel = image[round(119.5 - n), round(159.5 + (e + w) / 2)].astype(int)
    assert pixel[0] > pixel[1] + 50
    assert pixel[0] > pixel[2] + 50
    assert np.array_equal(env.render(), image)
    env.render()[:] = 0
    assert image.any()


def test_a_reset_may_choose_a_scenario_or_a_level():
    env = make()
    assert env.reset(options={"scenario": "test-case-2"})[1]["scenario"] == "test-case-2"
    assert env.reset(seed=1, options={"level": "calm"})[1]["scenario"].startswith("calm-")
    assert env.reset()[1]["scenario"].startswith("calm-")


def test_bad_settings_are_refused_with_a_reason():
    with pytest.raises(SettingError, match="ticks_per_step 0"):
        make(ticks_per_step=0)
    with pytest.raises(SettingError, match="render_mode 'ansi'"):
        FrameChallengeEnv(render_mode="ansi")
    with pytest.raises(ScenarioError, match="unknown scenario"):
        make(scenario="nowhere")
    with pytest.raises(LevelError, match="unknown level"):
        make(level="stormy")
    env = make(scenario="empty")
    with pytest.raises(SettingError, match="reset option 'wind' is unknown"):
        env.reset(options={"wind": 3})
    wide = scenario(camera={"width_px": 640, "height_px": 480})
    with pytest.raises(SettingError, match="640 x 480"):
        env.reset(options={"scenario": wide})
    env.reset()
    for action in ([0, 0, 0], [0, 0, 0, np.nan], [[0, 0, np.inf, 0]]):
        with pytest.raises(SettingError, match="four finite numbers"):
            env.unwrapped.step(np.array(action))


def test_another_camera_makes_another_space():
    wide = scenario(frame("red", 2.0), camera={"width_px": 640, "height_px": 480})
    env = make(scenario=wide, image=True)
    observation, _ = env.reset()
    assert observation["image"].shape == (480, 640, 3)
    assert observation in env.observation_space
