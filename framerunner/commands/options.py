"""Kinds of option that several commands share."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any

from cyclopts import Parameter, Token


def _whole(_type: Any, tokens: Sequence[Token]) -> int:  # noqa: ANN401 - the library's signature
    """Take whole numbers only: the library's own conversion takes 1.5 for 2.

    Raises:
        ValueError: it is none.
    """
    text = tokens[0].value
    try:
        return int(text)
    except ValueError:
        raise ValueError(f'"{text}" is not a whole number.') from None


WholeNumber = Annotated[int, Parameter(converter=_whole)]
