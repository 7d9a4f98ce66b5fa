"""JSON without NaN and infinities, which it cannot represent: they become null."""

from __future__ import annotations

import json
from collections.abc import Mapping
from math import isfinite
from typing import Any


def finite(value: Any, decimals: int | None = None) -> Any:  # noqa: ANN401 - anything that JSON can represent
    """A copy with None for numbers that are not finite, lists for tuples and text for keys.

    Args:
        value: anything that JSON can represent; other objects are kept.
        decimals: to which numbers are rounded; None: they are not.
    """
    if isinstance(value, float):
        kept = value if isfinite(value) else None
        return kept if kept is None or decimals is None else round(kept, decimals)
    if value is None or isinstance(value, (str, int)):
        return value
    if isinstance(value, (list, tuple)):
        return [finite(item, decimals) for item in value]
    if isinstance(value, Mapping):
        return {str(key): finite(item, decimals) for key, item in value.items()}
    return value


def encode(value: Any, decimals: int | None = None) -> str:  # noqa: ANN401 - as above
    """Compact JSON of what `finite` returns.

    Raises:
        TypeError: it contains an object that JSON cannot represent.
    """
    return json.dumps(finite(value, decimals), separators=(",", ":"), allow_nan=False)
