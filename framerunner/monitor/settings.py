"""Settings of the monitor, and the error for those that cannot be used."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from framerunner.errors import UserError
from framerunner.monitor.addresses import is_address_or_network

SHORTEST_PASSWORD = 8
SHORTEST_CODE = 6
BACKLOG = 100  # connections accepted at the same time; must be well below the limit of open files


class MonitorError(UserError):
    """The monitor cannot be started; the message is one line for people."""


@dataclass(frozen=True, slots=True)
class ConnectionLimits:
    """Limits of the server's clients."""

    head_s: float = 10.0  # from the connection, or the first byte of a later request, to the end of its head
    keep_alive_s: int = 30  # from the end of a request to the end of the next one's head
    body_s: float = 20.0  # from the head to the end of the body
    stalled_s: float = 30.0  # how long a client may leave data unread
    close_s: float = 5.0  # from closing a connection to its end
    head_bytes: int = 65_536
    body_bytes: int = 65_536
    total: int = 1000  # connections
    per_address: int = 250  # connections from an address; simultaneous requests from one behind a proxy


@dataclass(frozen=True, slots=True)
class MonitorSettings:
    """Where the monitor listens, where it stores, and with what people log in.

    Attributes:
        bind: address or name of the interface to listen on.
        port: TCP port; 0 lets the system choose one.
        database: SQLAlchemy URL of the competition's tables.
        organiser_password: with which organisers log in; None: they get one-time links.
        judge_password: likewise of judges.
        class_code: code word with which pupils join; None: they cannot.
        class_file: where the pupils are kept; None: nobody can join.
        trusted_proxies: addresses or networks whose X-Forwarded-For and X-Forwarded-Proto are used.
        limits: of connections.
        qr_codes: print addresses as QR codes too.
        operator_socket: local socket at which flights with an operator connect; None: none does.
        certificate: PEM file with which pages are served over TLS; None: over plain HTTP.
        key: PEM file of its private key; None: it is in the certificate's file.
    """

    bind: str = "127.0.0.1"
    port: int = 8080
    database: str = "sqlite:///framerunner.db"
    organiser_password: str | None = field(default=None, repr=False)
    trusted_proxies: tuple[str, ...] = ()
    limits: ConnectionLimits = ConnectionLimits()
    qr_codes: bool = False
    operator_socket: Path | None = None
    certificate: Path | None = None
    key: Path | None = None
    judge_password: str | None = field(default=None, repr=False)
    class_code: str | None = field(default=None, repr=False)
    class_file: Path | None = None

    @property
    def scheme(self) -> str:
        """Of its URLs."""
        return "http" if self.certificate is None else "https"

    def check(self) -> None:
        """Raise `MonitorError` if a value is out of its range."""
        if not self.bind.strip():
            raise MonitorError("monitor: --bind is empty; give an address such as 127.0.0.1 or 0.0.0.0")
        if not 0 <= self.port <= 65535:
            raise MonitorError(f"monitor: --port {self.port}: must be from 0 to 65535")
        self._check_secrets()
        if self.key is not None and self.certificate is None:
            raise MonitorError(f"monitor: --key {self.key}: give its certificate too, by --certificate")
        for proxy in self.trusted_proxies:
            if not is_address_or_network(proxy):
                raise MonitorError(
                    f"monitor: --trusted-proxy '{proxy[:60]}': must be an address or a network in numbers, "
                    "such as 127.0.0.1 or 10.0.0.0/24"
                )

    def _check_secrets(self) -> None:
        given = {
            "FRAMERUNNER_ORGANISER_PASSWORD": (self.organiser_password, SHORTEST_PASSWORD, "one-time links"),
            "FRAMERUNNER_JUDGE_PASSWORD": (self.judge_password, SHORTEST_PASSWORD, "one-time links"),
            "FRAMERUNNER_CLASS_CODE": (self.class_code, SHORTEST_CODE, "a monitor without pupils"),
        }
        users: dict[str, str] = {}
        for variable, (secret, shortest, otherwise) in given.items():
            if secret is None:
                continue
            if len(secret) < shortest:
                raise MonitorError(
                    f"monitor: {variable} has {len(secret)} characters; "
                    f"use at least {shortest}, or unset it for {otherwise}"
                )
            other = users.setdefault(secret.strip().casefold(), variable)
            if other != variable:
                raise MonitorError(f"monitor: {variable} is the same as {other}; give each role its own")
