"""JSON that every reader takes: numbers that it cannot hold (NaN and infinities) are null."""

from __future__ import annotations

import json
from collections.abc import Mapping
from math import isfinite
from typing import Any

_UNLIMITED = 1 << 30
_CONTAINERS = (dict, list, tuple, Mapping)


def finite(value: Any, *, longest: int | None = None, depth: int = _UNLIMITED) -> Any:  # noqa: ANN401
    """A copy with None for numbers that are not finite, lists for tuples and text for keys.

    Args:
        value: anything that JSON can hold; what else is there stays as it is.
        longest: characters of texts and items of lists that are kept; None: all.
        depth: of nested containers; one that lies deeper is None.
    """
    return _finite(value, None, longest, depth)


def encode(value: Any, *, decimals: int | None = None) -> str:  # noqa: ANN401 - whatever JSON can hold
    """Write compact JSON.

    Args:
        value: anything that JSON can hold.
        decimals: to which numbers are rounded; None: all digits are kept.

    Raises:
        TypeError: there is something in it that JSON does not know.
    """
    text = _finite(value, decimals, None, _UNLIMITED)
    return json.dumps(text, separators=(",", ":"), allow_nan=False)


def _finite(value: Any, decimals: int | None, longest: int | None, depth: int) -> Any:  # noqa: ANN401
    if isinstance(value, float):
        kept = value if isfinite(value) else None
        return kept if kept is None or decimals is None else round(kept, decimals)
    if isinstance(value, str):
        return value[:longest]
    if not isinstance(value, _CONTAINERS):
        return value
    if depth <= 0:
        return None
    if isinstance(value, (list, tuple)):
        return [_finite(item, decimals, longest, depth - 1) for item in value[:longest]]
    return {str(key)[:longest]: _finite(item, decimals, longest, depth - 1) for key, item in value.items()}
