"""Who is compared, and how each is set."""

from __future__ import annotations

from dataclasses import dataclass

IMAGE_RATES_HZ = (5, 10, 30)
"""Rates that all programs can take images at."""


@dataclass(frozen=True, slots=True)
class Contender:
    """A peer with its settings.

    Attributes:
        peer: key of its package.
        name: for people.
        variant: key of its settings, known to its module.
        settings: for people.
        module: runs it, in the peers' environment.
        target: how many times cheaper our flight is to be.
    """

    peer: str
    name: str
    variant: str
    settings: str
    module: str
    target: float

    @property
    def key(self) -> str:
        """Names it in files."""
        return f"{self.peer}-{self.variant}"


_MUJOCO = "benchmarks.peers.mujoco_flight"
_PYFLYT = "benchmarks.peers.pyflyt_flight"

CONTENDERS = (
    Contender("mujoco", "MuJoCo", "default", "as it comes", _MUJOCO, 4.0),
    Contender("mujoco", "MuJoCo", "alike", "drawn like ours", _MUJOCO, 4.0),
    Contender("mujoco", "MuJoCo", "fastest", "fastest", _MUJOCO, 4.0),
    Contender("pyflyt", "PyFlyt", "default", "as it comes", _PYFLYT, 15.0),
    Contender("pyflyt", "PyFlyt", "fastest", "fastest", _PYFLYT, 15.0),
)


def chosen(peers: str) -> tuple[Contender, ...]:
    """The contenders of a choice: "none", "all" or the key of one peer."""
    return tuple(each for each in CONTENDERS if peers in ("all", each.peer))
