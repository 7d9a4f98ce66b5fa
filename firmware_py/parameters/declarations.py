"""What a parameter is, and all parameters there are: `declarations.yaml`, loaded and checked."""

from __future__ import annotations

from importlib import resources
from math import isfinite
from struct import pack
from typing import Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

from framerunner.errors import UserError
from framerunner.files.text_file import decode_text
from framerunner.files.yaml_text import read_yaml


class ParameterError(UserError):
    """A value that a parameter cannot have; the message is one line for people."""


class Parameter(BaseModel):
    """The declaration of one parameter; if minimum and maximum are equal, it cannot be changed."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: str = Field(pattern=r"^[A-Z][A-Z0-9_]{0,15}$", description="at most 16 characters: MAVLink's limit")
    kind: Literal["int32", "float"]
    default: float = Field(allow_inf_nan=False)
    minimum: float = Field(allow_inf_nan=False)
    maximum: float = Field(allow_inf_nan=False)
    unit: str = ""
    description: str = Field(min_length=1, description="one line")
    details: str = Field(default="", description="whole sentences")
    group: str = "Miscellaneous"
    category: Literal["Standard", "System", "Developer"] = "Standard"
    decimals: int | None = Field(default=None, ge=0, le=9, description="decimals to show")
    increment: float | None = Field(default=None, gt=0.0, description="a sensible step when adjusting")
    choices: dict[int, str] = Field(default={}, description="names of the valid values")
    bits: dict[int, str] = Field(default={}, description="names of a bit mask's bits")
    reboot_required: bool = False

    @model_validator(mode="after")
    def _makes_sense(self) -> Self:
        if not self.minimum <= self.default <= self.maximum:
            raise ValueError(
                f"{self.name}: default {self.default} is outside {self.minimum} to {self.maximum}"
            )
        if self.kind == "int32" and any(bound % 1 for bound in (self.minimum, self.default, self.maximum)):
            raise ValueError(f"{self.name}: an int32 has whole numbers only")
        if (self.choices or self.bits) and self.kind != "int32":
            raise ValueError(f"{self.name}: only an int32 has choices or bits")
        if self.choices and self.default not in self.choices:
            raise ValueError(f"{self.name}: default {self.default:g} is none of its choices")
        return self

    @property
    def constant(self) -> bool:
        """Whether it cannot be changed."""
        return self.minimum == self.maximum

    def checked(self, value: float) -> float:
        """The value as it is kept: an int for `int32`, else a float.

        Raises:
            ParameterError: it is not finite, not whole where it must be, out of range or none of the choices.
        """
        if not isfinite(value):
            raise ParameterError(f"{self.name}: {value} is not a finite number")
        if self.kind == "int32" and value % 1:
            raise ParameterError(f"{self.name}: {value:g} is not a whole number")
        if not self.minimum <= value <= self.maximum:
            if self.constant:
                raise ParameterError(f"{self.name}: is {self.default:.9g} and cannot be changed")
            unit = f" {self.unit}" if self.unit else ""
            raise ParameterError(
                f"{self.name}: {value:g} is outside {self.minimum:g} to {self.maximum:g}{unit}"
            )
        if self.choices and value not in self.choices:
            there_are = ", ".join(f"{choice} {text}" for choice, text in sorted(self.choices.items()))
            raise ParameterError(f"{self.name}: there is no choice {value:g}; there are {there_are}")
        return int(value) if self.kind == "int32" else float(value)

    def same(self, one: float, other: float) -> bool:
        """Whether two values are equal on MAVLink, which carries floats in four bytes."""
        return one == other or (self.kind == "float" and pack("<f", one) == pack("<f", other))

    def with_default(self, default: float) -> Parameter:
        """The same with another default; a constant changes its value.

        Raises:
            ParameterError: the value is not valid.
        """
        if self.constant and isfinite(default) and not (self.kind == "int32" and default % 1):
            return self.model_copy(update={"default": default, "minimum": default, "maximum": default})
        return self.model_copy(update={"default": self.checked(default)})


def _declare(name: str, group: str, fields: dict[str, Any]) -> Parameter:
    """One entry of the YAML file; its short forms are described there."""
    if "constant" in fields:
        value = fields.pop("constant")
        fields |= {"default": value, "range": (value, value), "category": "System"}
    kind = "float" if isinstance(fields["default"], float) else "int32"
    if kind == "float":
        fields.setdefault("decimals", 1)
    if "choices" in fields:
        numbers = sorted(map(int, fields["choices"]))
        span = (numbers[0], numbers[-1])
    elif "bits" in fields:
        span = (0, sum(1 << int(bit) for bit in fields["bits"]))
    else:
        span = fields.pop("range")
    return Parameter(name=name, group=group, kind=kind, minimum=span[0], maximum=span[1], **fields)


def _load() -> tuple[Parameter, ...]:
    text = decode_text(resources.files(__package__).joinpath("declarations.yaml").read_bytes())
    groups: Any = read_yaml(text)
    declared = [_declare(name, group, each) for group, rows in groups.items() for name, each in rows.items()]
    return tuple(sorted(declared, key=lambda each: each.name))


DECLARATIONS: tuple[Parameter, ...] = _load()
"""Sorted by name, as they are numbered on MAVLink."""
