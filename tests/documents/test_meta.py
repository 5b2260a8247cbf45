"""What robots say about missions: no number that is none gets through, however it is written."""

import json
import math
from typing import Any

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from stillroom.documents.missions import parse_meta, stored_meta
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


ROOMS = {"r1": [[0.0, 1.0]], "r2": [[2.5, 3.0]]}
META: dict[str, Any] = {"sequence": 1, "resolution": 1.0, "mine": {"b": 1.0, "a": [2]}, "tracking": {"rooms": ROOMS}}


@pytest.mark.parametrize(
    "same",
    [
        dict(reversed(META.items())),
        META | {"tracking": {"rooms": dict(reversed(ROOMS.items()))}},
        META | {"resolution": 1, "mine": {"a": [2.0], "b": 1}},
        META | {"tracking": {"rooms": {"r1": [[0, 1]], "r2": [[2.5, 3]]}}},
        META | {"epoch": 0, "started_at": None},
    ],
)
def test_the_same_meta_has_the_same_digest_however_it_is_written_down(same: dict[str, Any]) -> None:
    assert digest_of(same) == digest_of(META)
    assert stored_meta(same).digest() == digest_of(META)


@pytest.mark.parametrize(
    "other",
    [
        META | {"sequence": 2},
        META | {"mine": {"b": 1.0, "a": [3]}},
        META | {"tracking": {"dividers": ROOMS}},
        META | {"tracking": {"rooms": {"r1": [[2.5, 3.0]], "r2": [[0.0, 1.0]]}}},
        META | {"ours": None},
    ],
)
def test_another_meta_has_another_digest(other: dict[str, Any]) -> None:
    assert digest_of(other) != digest_of(META)


def digest_of(meta: dict[str, Any]) -> str:
    return parse_meta(json.dumps(meta).encode())[0].digest()
