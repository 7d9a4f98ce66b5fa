"""A library of artificial runs."""

import contextlib
import dataclasses
from math import cos, pi, sin

import cv2
import numpy as np

from framerunner.monitor.ports import RunError, RunInfo
from scenarios.loader import load_scenario
from tests.framerunner.monitor import serving as serving_module
from tests.framerunner.monitor.serving import serving

MARKUP = "<img src=x onerror=alert(1)><b>bold</b>"
STATES = ["take_off.start", "red.crossing", "green.turning", "landing.stop"]
CHART = {
    "name": "frame_challenge",
    "mermaid": "stateDiagram-v2\n    [*] --> take_off\n"
    + "".join(
        f'    state "{group}" as {group} {{\n        state "{leaf}" as {group}.{leaf}\n    }}\n'
        for group, leaf in (state.split(".") for state in STATES)
    ),
    "states": STATES,
    "source": "name: frame_challenge",
}
END_S = 40.0


def a_run(name="first", end_s=END_S, **changes):
    """Ten seconds in each state, flying a circle, red crossed at 12 s and green at 25 s."""
    times = [round(-1.0 + 0.05 * tick, 3) for tick in range(round((end_s + 1.0) / 0.05) + 1)]
    poses = [
        {
            "t": t,
            "p": [3 * cos(t / 10), 3 * sin(t / 10), 1.0 + t / 100],
            "q": [cos(t / 20 + pi / 4), 0.0, 0.0, sin(t / 20 + pi / 4)],
            "v": [0.3, 0.0, 0.01],
            "r": 0.1,
            "c": [0.3, 0.0, 0.01, 0.1],
            "on": 0.0 <= t < end_s - 1.0,
            "s": min(3, max(0, int(t // 10))),
        }
        for t in times
    ]
    transitions = [
        {
            "time_s": 10.0 * number,
            "from": STATES[number - 1],
            "to": STATES[number],
            "when": "frame.d < 0.45",
            "values": [["frame.d", 0.44]],
            "seconds": 10.0,
        }
        for number in (1, 2, 3)
    ]
    result = {
        "scenario": "test-case-1",
        "verdict": "clean",
        "reason": f"clean after 39.0 s {MARKUP}",
        "frames_crossed": ["red", "green"],
        "crossing_times_s": [12.0, 25.0],
        "contacts": 0,
        "try_time_s": end_s - 1.0,
        "penalty_s": 0.0,
        "total_time_s": end_s - 1.0,
    }
    return {
        "name": name,
        "world": {
            "scenario": load_scenario("test-case-1").model_dump(mode="json"),
            "lift_m": 0.0,
            "source": "truth",
        },
        "chart": CHART,
        "states": STATES,
        "poses": poses,
        "detections": [
            {"t": t, "width": 32, "height": 24, "boxes": {"red": [4, -4, 6, -6, 1.5, 20.0], "green": None}}
            for t in (5.0, 15.0)
        ],
        "maps": [],
        "transitions": transitions,
        "images": [0.5 * number for number in range(60)],
        "crossings": [{"t": 12.0, "colour": "red"}, {"t": 25.0, "colour": "green"}],
        "result": result,
        **changes,
    }


class Library:
    """Runs by name; an image's blue channel is its number."""

    def __init__(self, *runs, infos=None):
        self._runs = {run["name"]: run for run in runs}
        self.infos = infos or [info_of(run) for run in runs]
        self.read = []
        self.closed = False

    def runs(self):
        return self.infos

    def recording(self, name):
        self.read.append(name)
        if name not in self._runs:
            raise RunError(f"run '{name}': there is no such run")
        return self._runs[name]

    def kept(self, name):
        return None

    def close(self):
        self.closed = True

    def image(self, name, index):
        if index >= len(self.recording(name)["images"]):
            raise RunError(f"run '{name}': has no image {index}")
        image = np.full((24, 32, 3), (4 * index, 0, 0), np.uint8)
        return cv2.imencode(".jpg", image)[1].tobytes()


def info_of(run):
    result = run["result"] or {}
    return RunInfo(
        run["name"],
        "test-case-1",
        "frame_challenge",
        result.get("verdict", ""),
        result.get("total_time_s"),
        "2026-01-02T03:04:05+00:00",
    )


@contextlib.asynccontextmanager
async def serving_runs(monkeypatch, library):
    """The monitor with the replay's modules and a library; yields a `Served`."""
    plain = serving_module.equipment()
    monkeypatch.setattr(serving_module, "equipment", lambda: dataclasses.replace(plain, runs=library))
    async with serving(
        monkeypatch, "framerunner.monitor.replay_api", "framerunner.monitor.pages.table"
    ) as served:
        yield served
