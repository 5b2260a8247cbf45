"""Conflicts: what missions found, and how each ended. Whether one is open is derived: nothing has ended it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from typing import Any

import sqlalchemy as sa

from stillroom.store.database import Transaction, insert_unless_there
from stillroom.store.robots import Selection
from stillroom.store.rows import ConflictRow, Json, ProposalRow, as_row, as_row_or_none, columns
from stillroom.store.tables import conflict, ending, map_, mission, proposal, robot, sighting

_ended = ending.c.conflict_id.is_not(None)
_again = sighting.alias("again")
_later = mission.alias("later")
_newest = sa.select(sa.func.max(_again.c.id)).where(_again.c.conflict_id == conflict.c.id)
_found = sa.select(sa.func.count()).select_from(_again).where(_again.c.conflict_id == conflict.c.id)
_state = sa.case((_ended, ending.c.state), (conflict.c.resolved, "resolved_automatically"), else_="open")
_ELSEWHERE: Mapping[str, sa.ColumnElement[Any]] = {
    "robot_id": map_.c.robot_id,
    "map_name": map_.c.name,
    "state": _state,
    "fold_count": _found.scalar_subquery() - 1,
    "sighting_id": sighting.c.id,
    "mission": mission.c.key,
    "drawn": ending.c.dividers,
    "superseded_by": _later.c.key,
    **{name: sighting.c[name] for name in ("mission_id", "cause", "summary", "rooms", "dividers", "restrictions")},
    **{name: sighting.c[name] for name in ("base_version", "motion")},
    **{name: ending.c[name] for name in ("response", "proposal", "note", "decided_by", "decided_at", "version")},
}
_CONFLICT = (
    sa.select(
        *columns(conflict, ConflictRow, *_ELSEWHERE), *(column.label(name) for name, column in _ELSEWHERE.items())
    )
    .select_from(conflict)
    .join(sighting, sighting.c.id == _newest.scalar_subquery())
    .join(mission, mission.c.id == sighting.c.mission_id)
    .join(map_, map_.c.id == conflict.c.map_id)
    .outerjoin(ending, ending.c.conflict_id == conflict.c.id)
    .outerjoin(_later, _later.c.id == ending.c.mission_id)
)
# made once: making a statement takes as long as running it
_STANDING = _CONFLICT.where(conflict.c.map_id == sa.bindparam("map_id"), ~_ended).order_by(conflict.c.id)
IS_ANY_STANDING = sa.exists().where(
    conflict.c.map_id == map_.c.id, ~sa.exists().where(ending.c.conflict_id == conflict.c.id)
)
"""Whether there is one that nothing has ended; inside of another query about `map_`."""
_PROPOSAL = sa.select(*columns(proposal, ProposalRow))


@dataclass(frozen=True)
class NewConflict:
    map_id: int
    key: str
    kind: str
    place: str
    """Equal for a repeat of the same conflict."""
    resolved: bool
    opened_at: datetime
    due_at: datetime | None
    """When the default answer takes effect; None: nobody is asked."""
    quiet: bool
    """Nobody is sent a message."""


@dataclass(frozen=True)
class NewSighting:
    conflict_id: int
    mission_id: int
    cause: str
    summary: str
    rooms: Sequence[Json]
    dividers: Sequence[str]
    restrictions: Sequence[str]
    base_version: int
    motion: Json | None


@dataclass(frozen=True)
class NewProposal:
    name: str
    action: str
    recommended: bool
    changes: Json
    document: Json
    used_ids: Json


@dataclass(frozen=True)
class Ending:
    """How a conflict ended. Only an answer has a `response`."""

    state: str
    decided_by: str
    version: int | None
    response: str | None = None
    proposal: str | None = None
    dividers: Sequence[Any] | None = None
    note: str | None = None
    mission_id: int | None = None
    """The later one that superseded it."""


def add(tx: Transaction, new: NewConflict) -> int | None:
    """Its number; None where the map has one of that name. The lane must be locked, as for all that follows."""
    if not insert_unless_there(tx, conflict, vars(new) | {"waits": new.due_at is not None}):
        return None
    query = sa.select(conflict.c.id).where(conflict.c.map_id == new.map_id, conflict.c.key == new.key)
    made: int = tx.execute(query).scalar_one()
    return made


def add_sighting(tx: Transaction, new: NewSighting, proposals: Sequence[NewProposal]) -> None:
    """The proposals of earlier ones can't be accepted any more and go."""
    earlier = sa.select(sighting.c.id).where(sighting.c.conflict_id == new.conflict_id)
    tx.execute(sa.delete(proposal).where(proposal.c.sighting_id.in_(earlier)))
    made = tx.execute(sa.insert(sighting).values(vars(new)).returning(sighting.c.id)).scalar_one()
    if proposals:
        tx.execute(sa.insert(proposal), [vars(row) | {"sighting_id": made} for row in proposals])


def end(tx: Transaction, conflict_id: int, how: Ending, now: datetime) -> bool:
    """Whether this ended it; False where it had ended before."""
    tx.execute(sa.update(conflict).where(conflict.c.id == conflict_id).values(waits=False))
    return insert_unless_there(tx, ending, vars(how) | {"conflict_id": conflict_id, "decided_at": now})


def get(tx: Transaction, conflict_id: int) -> ConflictRow:
    return as_row(ConflictRow, tx.execute(_CONFLICT.where(conflict.c.id == conflict_id)).one())


def by_key(tx: Transaction, map_id: int, key: str) -> ConflictRow | None:
    query = _CONFLICT.where(conflict.c.map_id == map_id, conflict.c.key == key)
    return as_row_or_none(ConflictRow, tx.execute(query).first())


def standing(tx: Transaction, map_id: int) -> Sequence[ConflictRow]:
    """Those of a map that nothing has ended, the oldest first."""
    return [as_row(ConflictRow, row) for row in tx.execute(_STANDING, {"map_id": map_id})]


def last_told(tx: Transaction, map_id: int, place: str, resolved: bool) -> ConflictRow | None:
    """The newest that ended, of those about the same that people were told of; its rooms as they were when it ended."""
    same = conflict.c.map_id == map_id, conflict.c.place == place, conflict.c.resolved == resolved
    query = _CONFLICT.where(*same, ~conflict.c.quiet, _ended).order_by(conflict.c.id.desc()).limit(1)
    told = as_row_or_none(ConflictRow, tx.execute(query).first())
    if told is None:
        return None
    known = (
        sa.select(sighting.c.rooms)
        .join(mission, mission.c.id == sighting.c.mission_id)
        .where(sighting.c.conflict_id == told.id, mission.c.finished_at <= told.decided_at)
        .order_by(sighting.c.id.desc())
        .limit(1)
    )
    return replace(told, rooms=tx.execute(known).scalar() or told.rooms)


def put_off(tx: Transaction, map_id: int, since: datetime) -> Sequence[ConflictRow]:
    """Those of a map that somebody called temporary since then."""
    temporary = ending.c.response == "temporary", ending.c.decided_at > since
    return _rows(tx, _CONFLICT.where(conflict.c.map_id == map_id, *temporary).order_by(conflict.c.id))


def page(tx: Transaction, of: Selection, state: str | None, before: int | None, limit: int) -> Sequence[ConflictRow]:
    """The newest first. `of`: a condition on robots or maps."""
    query = _CONFLICT.join(robot, robot.c.id == map_.c.robot_id).where(of)
    if state is not None:
        query = query.where(_state == state)
    if state == "open":
        query = query.where(conflict.c.waits)
    if before is not None:
        query = query.where(conflict.c.id < before)
    return _rows(tx, query.order_by(conflict.c.id.desc()).limit(limit))


def is_of_map(map_id: int) -> Selection:
    return conflict.c.map_id == map_id


def due(tx: Transaction, now: datetime, limit: int) -> Sequence[ConflictRow]:
    """Those whose default answer takes effect now, the longest overdue first."""
    return _rows(
        tx, _CONFLICT.where(conflict.c.waits, conflict.c.due_at <= now).order_by(conflict.c.due_at).limit(limit)
    )


def of_missions(tx: Transaction, mission_ids: Sequence[int]) -> Mapping[int, Sequence[str]]:
    """What the conflicts that each mission met are called."""
    query = (
        sa.select(sighting.c.mission_id, conflict.c.key)
        .join(conflict, conflict.c.id == sighting.c.conflict_id)
        .where(sighting.c.mission_id.in_(mission_ids))
        .order_by(sighting.c.id)
    )
    named: dict[int, list[str]] = {mission_id: [] for mission_id in mission_ids}
    for mission_id, key in tx.execute(query) if mission_ids else ():
        named[mission_id].append(key)
    return named


def decided(tx: Transaction, mission_ids: Sequence[int]) -> Mapping[int, ConflictRow]:
    """The conflict that a person answered last of those that each mission met."""
    met = sa.select(sighting.c.mission_id, sighting.c.conflict_id).where(sighting.c.mission_id.in_(mission_ids))
    pairs = tx.execute(met).all() if mission_ids else []
    query = _CONFLICT.where(conflict.c.id.in_({pair.conflict_id for pair in pairs}), ending.c.response.is_not(None))
    rows = {row.id: row for row in _rows(tx, query.order_by(ending.c.decided_at, conflict.c.id))} if pairs else {}
    order = {conflict_id: place for place, conflict_id in enumerate(rows)}
    answered = sorted((pair for pair in pairs if pair.conflict_id in rows), key=lambda pair: order[pair.conflict_id])
    return {pair.mission_id: rows[pair.conflict_id] for pair in answered}


def settled_automatically(tx: Transaction, map_id: int, version: int) -> bool:
    """Whether the answer that made a version was to a conflict that the meta layer had settled."""
    query = (
        sa.select(conflict.c.id)
        .join(ending, ending.c.conflict_id == conflict.c.id)
        .where(conflict.c.map_id == map_id, conflict.c.resolved, ending.c.response.is_not(None))
        .where(ending.c.version == version)
    )
    return tx.execute(query.limit(1)).first() is not None


def proposals(tx: Transaction, sighting_ids: Sequence[int]) -> Mapping[int, Sequence[ProposalRow]]:
    """By sighting, in their order."""
    query = _PROPOSAL.where(proposal.c.sighting_id.in_(sighting_ids)).order_by(proposal.c.sighting_id, proposal.c.name)
    found: dict[int, list[ProposalRow]] = {sighting_id: [] for sighting_id in sighting_ids}
    for row in tx.execute(query):
        made = as_row(ProposalRow, row)
        found[made.sighting_id].append(made)
    return found


def proposed_map(tx: Transaction, sighting_id: int, name: str) -> tuple[Json, Json]:
    """The map's document, and how many ids would be used."""
    query = sa.select(proposal.c.document, proposal.c.used_ids)
    row = tx.execute(query.where(proposal.c.sighting_id == sighting_id, proposal.c.name == name)).one()
    return row.document, row.used_ids


def _rows(tx: Transaction, query: sa.Select[Any]) -> Sequence[ConflictRow]:
    return [as_row(ConflictRow, row) for row in tx.execute(query)]
