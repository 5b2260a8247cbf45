"""JSON from strangers."""

import pytest

from stillroom.documents.json_text import MAX_DEPTH, MAX_PARTS, load_json
from stillroom.errors import InvalidInput


def test_json_is_read_in_any_of_its_encodings() -> None:
    for encoding in ("utf-8", "utf-8-sig", "utf-16", "utf-32"):
        assert load_json('{"Küche": [1, 2.5, null]}'.encode(encoding), "") == {"Küche": [1, 2.5, None]}


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"{",
        b"\xff\xfe\xfd",
        b"[1,]",
        b"[" * 10_000_000,
        b'{"a":' * 5_000_000,
        b"[" * (MAX_DEPTH + 2) + b"]" * (MAX_DEPTH + 2),
        b"[" + b"[]," * MAX_PARTS + b"0]",
        b"1" * 10_000,
    ],
)
def test_what_is_no_json_or_out_of_bounds_is_refused_with_a_pointer(content: bytes) -> None:
    with pytest.raises(InvalidInput) as refused:
        load_json(content, "/here")
    assert [fault.pointer for fault in refused.value.faults] == ["/here"]


def test_what_is_deep_but_not_too_deep_is_read() -> None:
    assert load_json(b"[" * MAX_DEPTH + b"]" * MAX_DEPTH, "")
