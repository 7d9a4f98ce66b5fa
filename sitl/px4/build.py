"""A PX4 that the user has built: found and started."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping
from pathlib import Path

from framerunner.errors import SettingError
from sitl.autopilots.parameters import Value, text_of
from sitl.autopilots.process import AutopilotProcess

MODEL = "none_iris"
"""The start-up script of PX4's that waits for a simulator on TCP; its parameters are overwritten by ours."""
_TAKEN = "already running for instance"  # PX4's own words, before it ends
_PLACES = ("", "build/px4_sitl_default", "px4_sitl_default")


def environment(parameters: Mapping[str, Value]) -> dict[str, str]:
    """The variables by which an unmodified PX4 takes these parameters at its start, and the model."""
    chosen = {f"PX4_PARAM_{name}": text_of(value) for name, value in parameters.items()}
    return {"PX4_SIM_MODEL": MODEL, **chosen}


def find_build(folder: Path) -> Path:
    """The folder with bin/px4 and etc: the given one, or a build for SITL in PX4's sources.

    Raises:
        SettingError: there is none.
    """
    for place in _PLACES:
        build = folder / place
        if os.access(build / "bin" / "px4", os.X_OK) and (build / "etc").is_dir():
            return build.resolve()
    raise SettingError(
        f"--px4 {folder}: has no bin/px4; give PX4's folder after `make px4_sitl_default`, or its build"
    )


def _processor(instance: int) -> int | None:
    """One processor for all of PX4's threads, so that only one runs at a time; None: not on this system.

    With real-time priorities, which PX4 asks for, their order is then the same each time.
    """
    if sys.platform != "linux":
        return None
    allowed = sorted(os.sched_getaffinity(0))
    return allowed[-1 - instance % len(allowed)]


class Px4Process(AutopilotProcess):
    """PX4 as a child process, which never outlives this one.

    Args:
        build: as `find_build` returns.
        instance: shifts its ports and its system id.
        folder: where it runs and keeps parameters and logs; its output is in px4.log there. None: a temporary
            one, which is removed in the end.
        parameters: for its start.
    """

    def __init__(
        self, build: Path, instance: int, folder: Path | None, parameters: Mapping[str, Value]
    ) -> None:
        super().__init__("PX4", "--px4", folder, environment(parameters), _processor(instance))
        self._build, self._instance = build, instance

    def command(self) -> list[str]:
        """PX4's own options."""
        return [
            *(str(self._build / "bin" / "px4"), "-d", "-i", str(self._instance)),
            *("-w", str(self.folder), str(self._build / "etc")),
        ]

    async def ended(self) -> str:
        """Wait until it ends; how, in words, and what to do where another PX4 has its instance."""
        words = await super().ended()
        return f"{words}; choose another --instance" if _TAKEN in words else words

    def inherits(self, name: str) -> bool:
        """Not what would set a parameter."""
        return super().inherits(name) and not name.startswith("PX4_")
