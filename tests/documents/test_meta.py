"""What robots say about missions: no number that is none gets through, however it is written."""

import json
import math

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from stillroom.documents.missions import parse_meta
from stillroom.errors import InvalidInput

numbers = st.from_regex(
    r"-?(0|[1-9][0-9]{0,20}|[1-9][0-9]{190,330})(\.[0-9]{1,9})?([eE][+-]?[0-9]{1,5})?", fullmatch=True
)


@given(numbers)
@example("1e999")
@example("-Infinity")
@example("NaN")
@example("1E+0000309")
@example("9" * 199 + "e99")
@example("9" * 400 + ".0")
def test_numbers_that_are_not_finite_are_named_however_they_are_written(number: str) -> None:
    document = f'{{"sequence": 1, "mine": {{"x": [0, {number}]}}}}'.encode()
    meant = json.loads(number)
    if isinstance(meant, int) or math.isfinite(meant):
        assert parse_meta(document)[1]["mine"]["x"][1] == meant
        return
    with pytest.raises(InvalidInput) as refused:
        parse_meta(document)
    assert [fault.pointer for fault in refused.value.faults] == ["/meta/mine/x/1"]
