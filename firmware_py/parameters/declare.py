"""Short ways to write declarations down, one for each sort of parameter."""

from __future__ import annotations

from collections.abc import Mapping

from firmware_py.parameters.model import Parameter

Span = tuple[float, float]
"""Least and greatest value."""


class Group:
    """Declares the parameters of one group, in the words that ground stations show as its heading."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.declarations: list[Parameter] = []

    def real(
        self,
        name: str,
        default: float,
        span: Span,
        unit: str,
        description: str,
        *,
        details: str = "",
        decimals: int = 1,
        increment: float | None = None,
        reboot: bool = False,
    ) -> None:
        """Declare a float."""
        self.declarations.append(
            Parameter(
                name=name,
                kind="float",
                default=default,
                minimum=span[0],
                maximum=span[1],
                unit=unit,
                description=description,
                details=details,
                group=self.name,
                decimals=decimals,
                increment=increment,
                reboot_required=reboot,
            )
        )

    def whole(
        self,
        name: str,
        default: int,
        span: Span,
        unit: str,
        description: str,
        *,
        details: str = "",
        increment: float | None = None,
        reboot: bool = False,
    ) -> None:
        """Declare an int32 that counts or measures something."""
        self.declarations.append(
            Parameter(
                name=name,
                kind="int32",
                default=default,
                minimum=span[0],
                maximum=span[1],
                unit=unit,
                description=description,
                details=details,
                group=self.name,
                increment=increment,
                reboot_required=reboot,
            )
        )

    def choice(
        self,
        name: str,
        default: int,
        choices: Mapping[int, str],
        description: str,
        details: str = "",
        *,
        unit: str = "",
    ) -> None:
        """Declare an int32 that is one of some named values."""
        self.declarations.append(
            Parameter(
                name=name,
                kind="int32",
                default=default,
                minimum=min(choices),
                maximum=max(choices),
                unit=unit,
                description=description,
                details=details,
                group=self.name,
                choices=dict(choices),
            )
        )

    def switch(self, name: str, default: int, description: str, details: str = "") -> None:
        """Declare an int32 that is off (0) or on (1)."""
        self.choice(name, default, {0: "Disabled", 1: "Enabled"}, description, details)

    def mask(
        self, name: str, default: int, bits: Mapping[int, str], description: str, details: str = ""
    ) -> None:
        """Declare an int32 of which each bit means something."""
        self.declarations.append(
            Parameter(
                name=name,
                kind="int32",
                default=default,
                minimum=0,
                maximum=sum(1 << place for place in bits),
                description=description,
                details=details,
                group=self.name,
                bits=dict(bits),
            )
        )

    def fact(self, name: str, value: int, description: str, details: str = "") -> None:
        """Declare an int32 that cannot be changed."""
        self.declarations.append(
            Parameter(
                name=name,
                kind="int32",
                default=value,
                minimum=value,
                maximum=value,
                description=description,
                details=details,
                group=self.name,
                category="System",
            )
        )
