"""Options that name several numbers, such as `--response lag=0.6,dead-time=0.15`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import pi
from typing import TYPE_CHECKING

from framerunner.commands import check_range
from framerunner.errors import SettingError

if TYPE_CHECKING:
    from framerunner.flying.response import ResponseDelay
    from framerunner.geometry.vectors import Vec3
    from offboard.limits import CommandLimits


@dataclass(frozen=True, slots=True)
class NumberRange:
    """A number's range, and its value where it is not given; without one it must be given."""

    low: float
    high: float
    default: float | None = None


_RESPONSE = {
    "lag": NumberRange(0.0, 2.0, 0.0),
    "dead-time": NumberRange(0.0, 1.0, 0.0),
    "height-wander": NumberRange(0.0, 0.5, 0.0),
}
_LIMITS = {
    **{name: NumberRange(0.1, 20.0) for name in ("forward", "left", "up")},
    "yaw-rate": NumberRange(0.1, 2 * pi),
    "down": NumberRange(0.1, 20.0, 0.0),
}
_PLACE = {
    "forward": NumberRange(-1.0, 1.0),
    "left": NumberRange(-1.0, 1.0, 0.0),
    "up": NumberRange(-1.0, 1.0, 0.0),
}


def place_of_lens(text: str) -> Vec3:
    """The value of `--position`, metres forward, left, up. Raises `SettingError` with one line."""
    given = _named_numbers("--position", text, _PLACE)
    return (given["forward"], given["left"], given["up"])


def response_of(text: str) -> ResponseDelay:
    """The value of `--response`. Raises `SettingError` with one line."""
    from framerunner.flying.response import ResponseDelay

    given = _named_numbers("--response", text, _RESPONSE)
    return ResponseDelay(given["lag"], given["dead-time"], given["height-wander"])


def limits_of(text: str) -> CommandLimits:
    """The value of `--drone-limits`; down is as up where not given. Raises `SettingError` with a line."""
    from offboard.limits import CommandLimits

    given = _named_numbers("--drone-limits", text, _LIMITS)
    up_m_s = given["up"]
    return CommandLimits(given["forward"], given["left"], up_m_s, given["down"] or up_m_s, given["yaw-rate"])


def _named_numbers(option: str, text: str, known: Mapping[str, NumberRange]) -> dict[str, float]:
    """Read `name=number,name=number`.

    Raises:
        SettingError: a name is unknown, twice or missing, or its value is no number or out of range.
    """
    from offboard.chart.problems import cut, did_you_mean

    found: dict[str, float] = {}
    for part in text.split(","):
        name, separator, number = (each.strip() for each in part.partition("="))
        if name not in known:
            advice = did_you_mean(name, known, f"it has {', '.join(known)}")
            raise SettingError(f"{option} {cut(part, 40)}: unknown name; {advice}")
        if name in found:
            raise SettingError(f"{option}: {name} is given twice; give it once")
        try:
            found[name] = float(number)
        except ValueError:
            shown = cut(number, 40) if separator else ""
            raise SettingError(f"{option} {name}={shown}: write a number, such as {name}=0.5") from None
        check_range(f"{option} {name}", found[name], known[name].low, known[name].high)
    for name, span in known.items():
        if name not in found:
            if span.default is None:
                raise SettingError(f"{option}: {name} is missing; add {name}=NUMBER after a comma")
            found[name] = span.default
    return found
