"""What people did to a map between two of its versions: what a three-way merge has to know."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial

from stillroom.documents.stored import decode_map, decode_motion
from stillroom.maps.motion import Motion
from stillroom.pipeline.edits.rebase import Touch, touched
from stillroom.service.frames import Step, motion_between
from stillroom.store import maps
from stillroom.store.database import Transaction
from stillroom.store.rows import VersionHead

BY_PEOPLE = ("edit", "restore", "decision", "import")
FARTHEST = 1000
"""A map that has changed more often since is not merged with."""
MOST_DOCUMENTS = 60
"""Nor one that people have changed more often: each change has two documents to be compared."""


@dataclass(frozen=True)
class Since:
    """`motion` takes the old version's frame to the new one's; `touched`: what people changed in between."""

    motion: Motion
    touched: frozenset[Touch]


def since(tx: Transaction, map_id: int, old: int, new: int) -> Since | None:
    """From version `old` to `new`; None where the two have no frame in common or lie too far apart."""
    heads = maps.versions_after(tx, map_id, old, FARTHEST + 1)
    by_people = [head for head in heads if head.cause in BY_PEOPLE and head.number <= new]
    if len(heads) > FARTHEST or len(by_people) > MOST_DOCUMENTS:
        return None
    motion = motion_between(partial(frame_step, tx, map_id), old, new)
    if motion is None:
        return None
    return Since(motion, frozenset(touch for head in by_people for touch in _touched(tx, head)))


def frame_step(tx: Transaction, map_id: int, number: int) -> Step | None:
    head = maps.version_head(tx, map_id, number)
    return None if head is None else (head.frame_from, decode_motion(head.motion))


def _touched(tx: Transaction, head: VersionHead) -> Iterator[Touch]:
    after = maps.version_at(tx, head.map_id, head.number)
    before = None if head.parent is None else maps.version_at(tx, head.map_id, head.parent)
    if after is not None and before is not None:
        yield from touched(decode_map(before.document), decode_map(after.document), before.grid == after.grid)
