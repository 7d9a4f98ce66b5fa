import json
from math import inf, isfinite, nan

import pytest
from hypothesis import given
from hypothesis import strategies as st

from framerunner.wire.finite_json import encode, finite

values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda part: st.lists(part, max_size=4) | st.dictionaries(st.text(max_size=4), part, max_size=4),
    max_leaves=12,
)


@given(values)
def test_encoded_values_can_be_read_and_are_finite(value):
    again = json.loads(encode(value), parse_constant=lambda _: pytest.fail("no JSON"))
    assert again == finite(value)


@given(st.floats())
def test_a_number_is_kept_or_null(value):
    assert finite({"a": (value,)}) == {"a": [value if isfinite(value) else None]}


def test_numbers_are_rounded_where_asked():
    value = {"t": 1.23456, "q": [0.00004, nan, -inf, 7]}
    assert encode(value, decimals=4) == '{"t":1.2346,"q":[0.0,null,null,7]}'
