import json
from math import isfinite

import pytest
from hypothesis import given
from hypothesis import strategies as st

from wire.finite_json import finite

values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda part: st.lists(part, max_size=4) | st.dictionaries(st.text(max_size=4), part, max_size=4),
    max_leaves=12,
)


@given(values)
def test_whatever_is_written_can_be_read_and_is_finite(value):
    again = json.loads(
        json.dumps(finite(value), allow_nan=False), parse_constant=lambda _: pytest.fail("no JSON")
    )
    assert again == finite(value)


@given(st.floats())
def test_a_number_is_kept_or_null(value):
    assert finite({"a": (value,)}) == {"a": [value if isfinite(value) else None]}
