"""JSON from strangers: read in bounded memory and with bounded nesting."""

import json
from typing import Any

from stillroom.errors import Fault, InvalidInput

MAX_PARTS = 1_000_000
"""Brackets and quotes in one document: what makes values large in memory and small on the wire."""
MAX_DEPTH = 64


def load_json(content: bytes, at: str) -> Any:
    """The document; NaN and infinities come through. Raises InvalidInput with the pointer `at` for what is no JSON or out of bounds."""
    if sum(map(content.count, (b"[", b"{", b'"'))) > MAX_PARTS:
        raise _refused(at, f"more than {MAX_PARTS} lists, objects and strings")
    try:
        document = json.loads(content)
    except RecursionError:
        raise _refused(at, "nested too deeply") from None
    except ValueError as error:
        raise _refused(at, str(error)) from None
    if _is_deeper(document, MAX_DEPTH):
        raise _refused(at, f"nested more than {MAX_DEPTH} deep")
    return document


def _is_deeper(document: Any, depth: int) -> bool:
    level = [document]
    for _ in range(depth):
        # Only containers go on: lists of millions of numbers are passed over at the speed of one comparison each.
        level = [
            inner
            for outer in level
            if type(outer) in _CONTAINERS
            for inner in (outer.values() if type(outer) is dict else outer)
            if type(inner) in _CONTAINERS
        ]
        if not level:
            return False
    return True


_CONTAINERS = (dict, list)


def _refused(at: str, why: str) -> InvalidInput:
    return InvalidInput("The JSON can't be used.", (Fault(at, why),))
