"""JSON that every reader takes: numbers that it cannot hold (NaN and infinities) are null."""

from __future__ import annotations

import json
from collections.abc import Mapping
from math import isfinite
from typing import Any

_CONTAINERS = (dict, list, tuple, Mapping)


def finite(value: Any, decimals: int | None = None) -> Any:  # noqa: ANN401 - whatever JSON can hold
    """A copy with None for numbers that are not finite, lists for tuples and text for keys.

    Args:
        value: anything that JSON can hold; what else is there stays as it is.
        decimals: to which numbers are rounded; None: all digits are kept.
    """
    if isinstance(value, float):
        kept = value if isfinite(value) else None
        return kept if kept is None or decimals is None else round(kept, decimals)
    if isinstance(value, str) or not isinstance(value, _CONTAINERS):
        return value
    if isinstance(value, (list, tuple)):
        return [finite(item, decimals) for item in value]
    return {str(key): finite(item, decimals) for key, item in value.items()}


def encode(value: Any, decimals: int | None = None) -> str:  # noqa: ANN401 - as above
    """Write compact JSON of what `finite` returns.

    Raises:
        TypeError: there is something in it that JSON does not know.
    """
    return json.dumps(finite(value, decimals), separators=(",", ":"), allow_nan=False)
