"""Escapes: missions that were taken by themselves, and that the owner then undid or corrected.

One correction holds against one mission: of those that it takes back or changes, done within the last seven days, the first,
because that is where the error came in. What people add to a map, or call it, corrects nothing.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime, timedelta
from functools import partial

from stillroom.documents.stored import decode_map
from stillroom.maps.motion import IDENTITY
from stillroom.pipeline.comparison import compare
from stillroom.service.frames import motion_between
from stillroom.service.steps import frame_step
from stillroom.store import conflicts, fleet, maps
from stillroom.store.database import Transaction
from stillroom.store.rows import VersionHead

WITHIN = timedelta(days=7)
MOST_STEPS = 200
"""So many versions are looked back at most."""
LAYOUT = ("room-added", "room-ended", "room-grew", "room-shrank", "room-reshaped")
TAKEN = ("updated", "resolved")


@dataclass(frozen=True)
class _Taken:
    id: int
    version: VersionHead


def blamed(tx: Transaction, map_id: int, number: int) -> tuple[int, datetime] | None:
    """The mission that version `number`, which a person made, holds against, and when; None where it corrects none."""
    made = maps.version_head(tx, map_id, number)
    if made is None or made.parent is None:
        return None
    taken = list(_taken_before(tx, made))
    match made.cause:
        case "restore":
            undone = [one for one in taken if made.frame_from is not None and one.version.number > made.frame_from]
        case "decision" if not conflicts.settled_automatically(tx, map_id, number):
            undone = []  # it brought into force what had not been taken
        case _:
            changed = _layout(tx, made)
            undone = [one for one in taken if changed & _layout(tx, one.version)] if changed else []
    return (undone[-1].id, made.created_at) if undone else None


def _taken_before(tx: Transaction, made: VersionHead) -> Iterator[_Taken]:
    """Missions of the last days that were taken by themselves and that the map before `made` still had in it, the newest first."""
    number = made.parent
    for _ in range(MOST_STEPS):
        head = None if number is None else maps.version_head(tx, made.map_id, number)
        if head is None or head.created_at < made.created_at - WITHIN:
            return
        if head.cause == "mission":
            found = fleet.mission_of(tx, made.map_id, head.number)
            if found is not None and found[1] in TAKEN:
                yield _Taken(found[0], head)
        # what was in force between a version and its restoring is not in the map any more
        number = head.frame_from if head.cause in ("restore", "rollback") else head.parent


def _layout(tx: Transaction, head: VersionHead) -> frozenset[str]:
    """The rooms whose shape the version changed."""
    assert head.parent is not None
    before, after = (maps.version_at(tx, head.map_id, number) for number in (head.parent, head.number))
    assert before is not None
    assert after is not None
    motion = motion_between(partial(frame_step, tx, head.map_id), head.parent, head.number)
    changes = compare(decode_map(before.document), decode_map(after.document), motion or IDENTITY)
    return frozenset(change.feature for change in changes if change.code in LAYOUT)
