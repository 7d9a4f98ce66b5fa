"""JSON without NaN and infinities, which it cannot represent."""

from __future__ import annotations

from collections.abc import Mapping
from math import isfinite
from typing import Any


def finite(value: Any) -> Any:  # noqa: ANN401 - anything that JSON can represent
    """A copy with None for numbers that are not finite, lists for tuples and text for keys."""
    if isinstance(value, float):
        return value if isfinite(value) else None
    if isinstance(value, (list, tuple)):
        return [finite(item) for item in value]
    if isinstance(value, Mapping):
        return {str(key): finite(item) for key, item in value.items()}
    return value
