"""A simulated MAVLink drone with a camera, and an autopilot of its own that flies it.

`__all__` is the public interface (docs/api.md); all else may change. Each name is imported when it is first
used, so `import framerunner` takes no time.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from framerunner.api import Evaluation, evaluate, fly
    from framerunner.errors import UserError
    from framerunner.simulator import Simulator
    from offboard.mission import Mission, load_mission
    from offboard.pilot import Pilot
    from scenarios.loader import load_scenario
    from scenarios.models import Scenario, TrueState
    from scenarios.random_scenarios import Level, load_level, random_scenario
    from scenarios.result import FlightResult
    from vision.calibration.model import Calibration
    from vision.detectors import Detector, DetectorMaker, SightingMaker, new_detector
    from vision.types import Detection, Detections, GateCorner, GatePose, GateSighting

    __version__: str

_MODULES = {
    "Calibration": "vision.calibration.model",
    "Detection": "vision.types",
    "Detections": "vision.types",
    "Detector": "vision.detectors",
    "DetectorMaker": "vision.detectors",
    "Evaluation": "framerunner.api",
    "FlightResult": "scenarios.result",
    "GateCorner": "vision.types",
    "GatePose": "vision.types",
    "GateSighting": "vision.types",
    "Level": "scenarios.random_scenarios",
    "Mission": "offboard.mission",
    "Pilot": "offboard.pilot",
    "Scenario": "scenarios.models",
    "SightingMaker": "vision.detectors",
    "Simulator": "framerunner.simulator",
    "TrueState": "scenarios.models",
    "UserError": "framerunner.errors",
    "evaluate": "framerunner.api",
    "fly": "framerunner.api",
    "load_level": "scenarios.random_scenarios",
    "load_mission": "offboard.mission",
    "load_scenario": "scenarios.loader",
    "new_detector": "vision.detectors",
    "random_scenario": "scenarios.random_scenarios",
}

__all__ = [
    "Calibration",
    "Detection",
    "Detections",
    "Detector",
    "DetectorMaker",
    "Evaluation",
    "FlightResult",
    "GateCorner",
    "GatePose",
    "GateSighting",
    "Level",
    "Mission",
    "Pilot",
    "Scenario",
    "SightingMaker",
    "Simulator",
    "TrueState",
    "UserError",
    "__version__",
    "evaluate",
    "fly",
    "load_level",
    "load_mission",
    "load_scenario",
    "new_detector",
    "random_scenario",
]


def __getattr__(name: str) -> object:
    """Import a public name when it is first used."""
    if name == "__version__":
        value: object = import_module("importlib.metadata").version("framerunner")
    elif name in _MODULES:
        value = getattr(import_module(_MODULES[name]), name)
    else:
        raise AttributeError(f"module 'framerunner' has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
