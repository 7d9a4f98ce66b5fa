"""`FrameChallenge-v0`: an agent flies by velocities and observes what a mission sees."""

from __future__ import annotations

from math import isfinite, pi
from pathlib import Path
from typing import Any

import cv2
import gymnasium
import numpy as np
import numpy.typing as npt
from gymnasium import spaces
from gymnasium.error import ResetNeeded

from framerunner.errors import SettingError
from framerunner.flying.plan import FlightPlan
from framerunner.gym.flight import SteppedFlight, final_reward
from offboard.drone import DroneState, VelocityFluCommand
from scenarios.loader import load_scenario
from scenarios.models import COLOURS, Camera, Scenario
from scenarios.random_scenarios import load_level, random_scenario
from scenarios.verdict import Verdict
from vision.types import Detection, Detections, Image

Action = npt.NDArray[np.float32]
Observation = dict[str, Any]
"""Arrays by name; see `observe`."""

FAR_M = 1000.0
"""Positions and distances are clipped to this; none is reached at 1 m/s."""
LONGEST_TRY_S = 36_000.0
_OPTIONS = ("scenario", "level")
_SEEDS = 1 << 31


class FrameChallengeEnv(gymnasium.Env[Observation, Action]):
    """One try an episode, in lockstep and in simulated time.

    An action is held for a tick of the mission, 50 ms: forward, left, up (m/s) and yaw rate to the left
    (rad/s), each from -1 to 1. Observations are as late as a mission's. See docs/gymnasium.md.

    Args:
        scenario: name, file or `Scenario`, the same in every episode; None for random ones.
        level: of the random ones, see `framerunner scenario random`.
        image: add the camera's image to the observation.
        ticks_per_step: ticks of 50 ms for which an action is held.
        render_mode: "rgb_array" or None.

    Raises:
        SettingError: a setting that cannot be used.
        ScenarioError: there is no such scenario or level.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 20}  # noqa: RUF012 - so declared by Gymnasium

    def __init__(
        self,
        scenario: str | Path | Scenario | None = None,
        *,
        level: str = "calm",
        image: bool = False,
        ticks_per_step: int = 1,
        render_mode: str | None = None,
    ) -> None:
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise SettingError(f"render_mode {render_mode!r}: use 'rgb_array' or None")
        if not 1 <= ticks_per_step <= 200:
            raise SettingError(f"ticks_per_step {ticks_per_step}: must be from 1 to 200")
        self.render_mode = render_mode
        self._scenario = None if scenario is None else _scenario(scenario)
        self._level = load_level(level)
        self._with_image = image
        self._ticks_per_step = ticks_per_step
        self._camera = Camera() if self._scenario is None else self._scenario.camera
        self.metadata = {**self.metadata, "render_fps": max(1, round(20 / ticks_per_step))}
        self.observation_space = observation_space(self._camera, image=image)
        self.action_space = spaces.Box(-1.0, 1.0, (4,), np.float32)
        self._flight: SteppedFlight | None = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin a try: the drone stands on its start with its motors on.

        Args:
            seed: of all episodes from here on.
            options: for this episode only, "scenario" (name, file or `Scenario`) or "level".

        Raises:
            SettingError: an unknown option, or a scenario with another image size.
            ScenarioError: there is no such scenario or level.
        """
        super().reset(seed=seed)
        self._flying = self._choose(options or {})
        # Drawn only where it has an effect, so that all other episodes stay as they are.
        flight_seed = int(self.np_random.random() * _SEEDS) if self._flying.wind.blows else 0
        self._flight = SteppedFlight(FlightPlan(self._flying, seed=flight_seed))
        return self._observe(self._flight), self._info(self._flight)

    def step(self, action: Action) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Fly for a step.

        Args:
            action: forward, left, up (m/s) and yaw rate to the left (rad/s); clipped to -1 and 1.

        Raises:
            SettingError: the action is not four finite numbers.
            ResetNeeded: the episode is over, or none has begun.
        """
        flight = self._flight
        if flight is None or flight.over or flight.failed_order:
            raise ResetNeeded("the episode is over, or none has begun; call reset()")
        command = _command(action)
        for _ in range(self._ticks_per_step):
            flight.step(command)
            if flight.over:
                break
        reward = flight.reward()
        over = flight.over or flight.failed_order
        info = self._info(flight)
        timed_out = False
        if over:
            report = flight.report()
            timed_out = report.verdict is Verdict.TIMED_OUT
            reward += final_reward(report)
            info["report"] = report.model_dump(mode="json")
        return self._observe(flight), reward, over and not timed_out, timed_out, info

    def render(self) -> Image | None:
        """Return the camera's latest image, RGB, shape (height, width, 3); None without a render mode."""
        if self.render_mode is None or self._flight is None:
            return None
        return _rgb(self._flight.image)

    def close(self) -> None:
        """Delete the simulation."""
        self._flight = None

    def _choose(self, options: dict[str, Any]) -> Scenario:
        unknown = [name for name in options if name not in _OPTIONS]
        if unknown:
            raise SettingError(f"reset option {unknown[0]!r} is unknown; there are {', '.join(_OPTIONS)}")
        if "scenario" in options:
            chosen = _scenario(options["scenario"])
        elif "level" in options or self._scenario is None:
            level = load_level(options["level"]) if "level" in options else self._level
            # Not `integers`: numpy promises the same numbers for `random` only, see `random_stream`.
            chosen = random_scenario(level, int(self.np_random.random() * _SEEDS))
        else:
            chosen = self._scenario
        size = (chosen.camera.width_px, chosen.camera.height_px)
        if size != (self._camera.width_px, self._camera.height_px):
            raise SettingError(
                f"scenario '{chosen.name}': its camera has {size[0]} x {size[1]} pixels; "
                "give it to make(), not to reset()"
            )
        return chosen

    def _observe(self, flight: SteppedFlight) -> Observation:
        left_s = min(self._flying.try_limit_s, LONGEST_TRY_S) - flight.referee.try_time_s
        return observe(flight.state, flight.detections(), left_s, flight.image if self._with_image else None)

    def _info(self, flight: SteppedFlight) -> dict[str, Any]:
        now = flight.referee.snapshot()
        return {
            "scenario": self._flying.name,
            "time_us": flight.state.time_us,
            "try_time_s": now.try_time_s,
            "penalty_s": now.penalty_s,
            "crossed": now.crossed,
            "next_colour": now.next_colour,
            "contacts": now.contacts,
            "inside": now.inside,
        }


def _scenario(scenario: str | Path | Scenario) -> Scenario:
    return scenario if isinstance(scenario, Scenario) else load_scenario(scenario)


def _command(action: Action) -> VelocityFluCommand:
    rates = [float(rate) for rate in np.asarray(action).reshape(-1)]
    if len(rates) != 4 or not all(map(isfinite, rates)):
        raise SettingError(f"action {action!r}: must be four finite numbers, forward, left, up, yaw rate")
    forward, left, up, yaw_rate = (min(max(rate, -1.0), 1.0) for rate in rates)
    return VelocityFluCommand(forward, left, up, yaw_rate)


def observation_space(camera: Camera, *, image: bool) -> spaces.Dict:
    """The space of `observe`, for a size of image; with the image itself, if `image`."""
    right_px, top_px = camera.width_px / 2, camera.height_px / 2
    low = np.array([-top_px, -top_px, -right_px, -right_px, 0.0, 0.0], np.float32)
    high = np.array([top_px, top_px, right_px, right_px, FAR_M, 180.0], np.float32)
    place = np.array([FAR_M, FAR_M, FAR_M, 4.0], np.float32)  # pi is a little more in 32 bits
    found: dict[str, spaces.Space[Any]] = {
        "imu": spaces.Box(-place, place, dtype=np.float32),
        "cam": spaces.Box(np.tile(low, (3, 1)), np.tile(high, (3, 1)), dtype=np.float32),
        "seen": spaces.MultiBinary([3, 2]),
        "time_left_s": spaces.Box(0.0, LONGEST_TRY_S, (1,), np.float32),
    }
    if image:
        found["image"] = spaces.Box(0, 255, (camera.height_px, camera.width_px, 3), np.uint8)
    return spaces.Dict(found)


def observe(
    state: DroneState, detections: Detections, time_left_s: float, image: Image | None = None
) -> Observation:
    """Put what a mission would see into arrays; the image, if given, is BGR.

    Returns:
        imu: x, y, z (metres), yaw (-pi..pi), arena axes; shape (4,).
        cam: red, green, blue; each n, s, e, w (pixels), d (metres), a (degrees), 0 where unknown; (3, 6).
        seen: red, green, blue; each whether n, s, e, w and whether d, a are known; (3, 2).
        time_left_s: shape (1,).
        image: RGB, shape (height, width, 3).
    """
    found = [getattr(detections, colour) for colour in COLOURS]
    x, y, z = (min(max(value, -FAR_M), FAR_M) for value in (state.x, state.y, state.z))
    yaw = min(max(state.yaw, -pi), pi)
    observation: Observation = {
        "imu": np.array([x, y, z, yaw], np.float32),
        "cam": np.array([_six_numbers(detection) for detection in found], np.float32),
        "seen": np.array([(detection.seen, isfinite(detection.d)) for detection in found], np.int8),
        "time_left_s": np.array([max(0.0, time_left_s)], np.float32),
    }
    if image is not None:
        observation["image"] = _rgb(image)
    return observation


def _rgb(image: Image) -> Image:
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2RGB), np.uint8)


def _six_numbers(detection: Detection) -> tuple[float, ...]:
    if not detection.seen:
        return (0.0,) * 6
    edges = (detection.n, detection.s, detection.e, detection.w)
    if not isfinite(detection.d):
        return (*edges, 0.0, 0.0)
    return (*edges, min(detection.d, FAR_M), detection.a)
