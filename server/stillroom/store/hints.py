"""Hints to those who wait: a commit changed something, or there is something to do. The truth is read from the database every time."""

from typing import Literal, NamedTuple

CHANNEL = "stillroom"
"""PostgreSQL's name for where they pass."""


class Hint(NamedTuple):
    """`work`: a lane of a map has something to do; `changed`: a map, or one of its missions, did."""

    kind: Literal["work", "changed"]
    map_id: int


def encode(hint: Hint) -> str:
    """One line without its end."""
    return f"{hint.kind} {hint.map_id}"


def decode(line: str) -> Hint | None:
    """None for what this program does not know: a newer one may share the database."""
    kind, _, map_id = line.partition(" ")
    if kind in ("work", "changed") and map_id.isdecimal():
        return Hint("work" if kind == "work" else "changed", int(map_id))
    return None
