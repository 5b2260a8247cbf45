"""Hints to those who wait: a commit changed something, or there is something to do. The truth is read from the database every time."""

from collections.abc import Mapping
from typing import Literal, NamedTuple, get_args

CHANNEL = "stillroom"
"""PostgreSQL's name for where they pass."""


HintKind = Literal["work", "changed", "message"]
_KINDS: Mapping[str, HintKind] = {kind: kind for kind in get_args(HintKind)}


class Hint(NamedTuple):
    """`work`: a lane of a map has something to do; `changed`: a map, or one of its missions, did; `message`: somebody is to be told."""

    kind: HintKind
    map_id: int


def encode(hint: Hint) -> str:
    """One line without its end."""
    return f"{hint.kind} {hint.map_id}"


def decode(line: str) -> Hint | None:
    """None for what this program does not know: a newer one may share the database."""
    kind, _, map_id = line.partition(" ")
    return Hint(_KINDS[kind], int(map_id)) if kind in _KINDS and map_id.isdecimal() else None
