"""What a rollout's candidate made of maps is taken back, map by map; what people did since stays.

The last version before the candidate's first comes into force again, with every edit that was made since done to it once more. Where
somebody has agreed to what the candidate made, it is the owner's by now and stays.
"""

from dataclasses import dataclass
from functools import partial

from stillroom.documents.api import Page
from stillroom.documents.rollouts import ChangedMap, MapState, NotReverted, Reverted, RevertedMaps
from stillroom.documents.stored import decode_map
from stillroom.errors import InvalidEdit
from stillroom.maps.semantics import SemanticMap
from stillroom.pipeline.edits.undo import undo
from stillroom.service.access import Principal, signature
from stillroom.service.edits import ended_by_restore
from stillroom.service.frames import motion_between
from stillroom.service.paging import page_of
from stillroom.service.steps import frame_step
from stillroom.service.versions import ids_of, new_version
from stillroom.store import clock, events, lanes, maps, rollouts
from stillroom.store.database import Database, Transaction
from stillroom.store.rollouts import RolloutRow
from stillroom.store.rows import MapRow, VersionHead

FARTHEST = 1000
"""So many versions are looked back at most."""
AT_ONCE = 50
"""Maps of one call."""


@dataclass(frozen=True)
class _Change:
    """What of the candidate is in the map in force."""

    state: MapState
    back_to: int | None = None
    edits: tuple[VersionHead, ...] = ()
    """Of people, made since, the oldest first."""


def changed_maps(tx: Transaction, row: RolloutRow, cursor: int | None, limit: int) -> Page[ChangedMap]:
    """In order of the maps."""
    found, following = page_of(
        rollouts.changed_maps(tx, row.id, cursor or 0, limit + 1), limit, lambda one: str(one.map_id)
    )
    return Page(items=[_document(tx, row, one) for one in found], next=following)


def _document(tx: Transaction, row: RolloutRow, one: rollouts.ChangedMap) -> ChangedMap:
    of = maps.get(tx, one.map_id)
    change = _change(tx, row, of)
    return ChangedMap(
        robot=of.robot_id,
        map=of.name,
        version=of.head or 0,
        first=one.first,
        back_to=change.back_to,
        state=change.state,
    )


def revert(
    database: Database,
    caller: Principal,
    row: RolloutRow,
    robot_id: str | None,
    map_name: str | None,
    cursor: int | None,
) -> RevertedMaps:
    """All maps that the candidate changed, or those of one robot, or one of them; some at a time."""
    with database.read() as tx:
        changed = rollouts.changed_maps(tx, row.id, cursor or 0, AT_ONCE + 1, robot_id)
        found, following = page_of(changed, AT_ONCE, lambda one: str(one.map_id))
        wanted = [of for of in (maps.get(tx, one.map_id) for one in found) if map_name in (None, of.name)]
        left = [of for of in wanted if _change(tx, row, of).state == "to_revert"]
    outcomes = [_revert(database, caller, row, of) for of in left]
    return RevertedMaps(
        reverted=[one for one in outcomes if isinstance(one, Reverted)],
        kept=[one for one in outcomes if isinstance(one, NotReverted)],
        next=following,
    )


def _revert(database: Database, caller: Principal, row: RolloutRow, of: MapRow) -> Reverted | NotReverted:
    def stays(reason: str) -> NotReverted:
        return NotReverted(robot=of.robot_id, map=of.name, reason=reason)

    with database.write() as tx:
        lanes.lock(tx, of.id)
        of = maps.get(tx, of.id)
        change = _change(tx, row, of)
        if change.state != "to_revert" or of.head is None:
            return stays("Nothing of it is left to take back.")
        before = None if change.back_to is None else maps.version_at(tx, of.id, change.back_to)
        current = maps.version_at(tx, of.id, of.head)
        if before is None or current is None:
            return stays("The candidate made the first version of this map: there is none to go back to.")
        try:
            restored = _with_edits(tx, of, decode_map(before.document, ids_of(of)), before.number, change.edits)
        except InvalidEdit as refused:
            return stays(f"An edit that was made since does not fit the version before: {refused.detail}")
        new = new_version(
            restored,
            retired=ended_by_restore(decode_map(current.document), restored),
            parent=of.head,
            cause="rollback",
            mission=before.mission,
            made_by=signature(caller),
            grid=before.grid,
            frame_from=before.number,
            motion=None,
        )
        now = clock.now(tx)
        number = maps.add_version(tx, of, new, now)
        events.add(tx, of, [("version", {"version": number, "cause": "rollback"})], now)
    return Reverted(robot=of.robot_id, map=of.name, version=number, back_to=before.number, kept=len(change.edits))


def _change(tx: Transaction, row: RolloutRow, of: MapRow) -> _Change:
    """By way of the versions that the one in force comes from: what was undone meanwhile is none of them."""
    keys = rollouts.by_candidate(tx, row.id, of.id)
    number, edits = of.head, list[VersionHead]()
    back_to, kept, found = None, list[VersionHead](), False
    for _ in range(FARTHEST):
        head = None if number is None else maps.version_head(tx, of.id, number)
        if head is None:
            break
        if head.cause in ("mission", "created") and head.mission in keys:
            back_to, kept, found = head.parent, list(edits), True
        elif head.cause == "decision":
            if not found and head.mission in keys:
                return _Change("decided")
            edits.append(head)
        elif head.cause == "edit":
            edits.append(head)
        number = head.frame_from if head.cause in ("restore", "rollback") else head.parent
    return _Change("to_revert", back_to, tuple(reversed(kept))) if found else _Change("undone")


def _with_edits(
    tx: Transaction, of: MapRow, restored: SemanticMap, number: int, edits: tuple[VersionHead, ...]
) -> SemanticMap:
    """Each edit done again. Raises InvalidEdit."""
    for head in edits:
        after = maps.version_at(tx, of.id, head.number)
        before = None if head.parent is None else maps.version_at(tx, of.id, head.parent)
        motion = motion_between(partial(frame_step, tx, of.id), head.number, number)
        if after is None or before is None or motion is None:
            raise InvalidEdit(f"Version {head.number} has no frame in common with it.")
        # an edit done again is its undoing taken back
        restored = undo(decode_map(after.document), decode_map(before.document), restored, motion, ()).map
    return restored
