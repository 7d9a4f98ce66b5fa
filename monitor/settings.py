"""How the monitor is started, and the error that says it cannot be."""

from __future__ import annotations

from dataclasses import dataclass, field

SHORTEST_PASSWORD = 8


class MonitorError(Exception):
    """The monitor cannot be started; the message is one line for people."""


@dataclass(frozen=True, slots=True)
class MonitorSettings:
    """Where the monitor listens, where it stores, and who may judge.

    Attributes:
        bind: address or name of the interface to listen on.
        port: TCP port; 0 lets the system choose one.
        database: SQLAlchemy URL of the competition's tables.
        password: with which judges log in; None: they are given one-time links.
    """

    bind: str = "127.0.0.1"
    port: int = 8080
    database: str = "sqlite:///framerunner.db"
    password: str | None = field(default=None, repr=False)

    def check(self) -> None:
        """See that it can be meant so.

        Raises:
            MonitorError: a value is out of its range.
        """
        if not self.bind.strip():
            raise MonitorError("monitor: --bind is empty; give an address such as 127.0.0.1 or 0.0.0.0")
        if not 0 <= self.port <= 65535:
            raise MonitorError(f"monitor: --port {self.port}: must be from 0 to 65535")
        if self.password is not None and len(self.password) < SHORTEST_PASSWORD:
            raise MonitorError(
                f"monitor: FRAMERUNNER_JUDGE_PASSWORD has {len(self.password)} characters; "
                f"use at least {SHORTEST_PASSWORD}, or unset it for one-time links"
            )
