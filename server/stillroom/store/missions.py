"""Missions: the row is the job."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from functools import cache
from typing import Any

import sqlalchemy as sa
from sqlalchemy.dialects import postgresql, sqlite

from stillroom.store import clock, conflicts, maps, rollouts
from stillroom.store.changes import Change, given, named
from stillroom.store.database import Transaction
from stillroom.store.fleet_tables import uncounted
from stillroom.store.rows import (
    Json,
    MapName,
    MapRow,
    MissionRow,
    ShownMission,
    VersionRow,
    as_row,
    as_row_or_none,
    as_rows,
    columns,
)
from stillroom.store.tables import map_, mission, sighting, version

_MISSION = sa.select(*columns(mission, MissionRow))
# made once: making a statement takes as long as running it
_WITH_MAP = (
    _MISSION.add_columns(*columns(map_, MapRow))
    .join(map_, map_.c.id == mission.c.map_id)
    .where(mission.c.id == sa.bindparam("mission_id"))
)
_SHOWN = (
    sa.select(*columns(mission, ShownMission), *columns(map_, MapName))
    .add_columns(sa.exists().where(sighting.c.mission_id == mission.c.id))
    .join_from(mission, map_, map_.c.id == mission.c.map_id)
    .where(mission.c.id == sa.bindparam("mission_id"))
)
_TO_PROCESS = _WITH_MAP.add_columns(
    clock.MOMENT, conflicts.IS_ANY_STANDING, rollouts.IS_ANY_IN_PLAY, *maps.VERSION.selected_columns
).outerjoin(version, sa.and_(version.c.map_id == map_.c.id, version.c.number == map_.c.head))
_ABLATION = ("ablation_transfer", "ablation_meta_occupancy", "ablation_meta_dividers")
_FOUND = ("outcome", "succeeded_at", "base_version", "version", "algorithm", "traceback")
_FINISH = (
    sa.update(mission)
    .where(mission.c.id == sa.bindparam("done"))
    .values(given(mission, "found", "finished_at", "result", *_FOUND, *_ABLATION) | {"status": "done"})
)


@dataclass(frozen=True)
class NewMission:
    map_id: int
    key: str
    epoch: int
    sequence: int
    grid: str
    meta: Json
    meta_digest: str
    placed_from: int | None = None
    """The parked mission that a person said belongs to this map."""
    placed_by: str | None = None


QUEUED: dict[str, Any] = {"status": "queued", "attempts": 0}
"""How a mission begins."""


@dataclass(frozen=True)
class Finding:
    """What processing found; never changes afterwards."""

    outcome: str
    reason: str
    base_version: int | None
    version: int | None
    algorithm: str
    succeeded_at: str | None
    ablation: tuple[bool, bool, bool] | None
    result: Json
    traceback: str | None = None


def add(tx: Transaction, new: NewMission, now: datetime) -> int:
    made: int = tx.execute(sa.insert(mission).values(_values(new, now)).returning(mission.c.id)).scalar_one()
    return made


def _values(new: NewMission, received_at: datetime) -> dict[str, Any]:
    return vars(new) | QUEUED | {"received_at": received_at}


def get(tx: Transaction, mission_id: int) -> MissionRow:
    return as_row(MissionRow, tx.execute(_MISSION.where(mission.c.id == mission_id)).one())


@dataclass(frozen=True)
class ToProcess:
    mission: MissionRow
    of: MapRow
    current: VersionRow | None
    """The version in force; None where the map has none yet."""
    is_any_standing: bool
    """Whether anything about the map is not settled."""
    is_any_in_play: bool
    """Whether a rollout may say how it is processed."""
    now: datetime


def to_process(tx: Transaction, mission_id: int) -> ToProcess:
    found = tx.execute(_TO_PROCESS, {"mission_id": mission_id}).one()
    row, of, (now, is_any_standing, is_any_in_play, *in_force) = as_rows(found, MissionRow, MapRow)
    current = None if of.head is None else maps.version_row(in_force)
    return ToProcess(row, of, current, is_any_standing, is_any_in_play, now)


def shown(tx: Transaction, mission_id: int) -> tuple[ShownMission, MapName, bool]:
    """With the map that it is of, and whether it met any conflicts."""
    row, of, (met_any,) = as_rows(tx.execute(_SHOWN, {"mission_id": mission_id}).one(), ShownMission, MapName)
    return row, of, met_any


def with_map(tx: Transaction, mission_id: int) -> tuple[MissionRow, MapRow]:
    row, of, _ = as_rows(tx.execute(_WITH_MAP, {"mission_id": mission_id}).one(), MissionRow, MapRow)
    return row, of


def by_key(tx: Transaction, map_id: int, key: str) -> MissionRow | None:
    query = _MISSION.where(mission.c.map_id == map_id, mission.c.key == key)
    return as_row_or_none(MissionRow, tx.execute(query).first())


def placed_key(key: str, map_name: str) -> str:
    """What a mission of another map, or of the same map before it was placed, is called: no robot can choose such an id."""
    return f"{key}~{map_name}"


def placements(tx: Transaction, parked: Sequence[int]) -> Mapping[int, MissionRow]:
    """What became of parked missions that a person placed, by their ids; the last word where there were several."""
    query = _MISSION.where(mission.c.placed_from.in_(parked)).order_by(mission.c.id)
    rows = (as_row(MissionRow, row) for row in tx.execute(query))
    return {row.placed_from: row for row in rows if row.placed_from is not None}


def page(tx: Transaction, map_id: int, outcome: str | None, before: int | None, limit: int) -> Sequence[MissionRow]:
    """The newest arrivals first."""
    query = _MISSION.where(mission.c.map_id == map_id)
    if outcome is not None:
        query = query.where(mission.c.outcome == outcome)
    if before is not None:
        query = query.where(mission.c.id < before)
    return [as_row(MissionRow, row) for row in tx.execute(query.order_by(mission.c.id.desc()).limit(limit))]


def neighbours(tx: Transaction, of: MissionRow) -> tuple[str | None, str | None]:
    """What the missions of the same map that arrived before and after one are called."""
    same = mission.c.map_id == of.map_id
    before = sa.select(mission.c.key).where(same, mission.c.id < of.id).order_by(mission.c.id.desc()).limit(1)
    after = sa.select(mission.c.key).where(same, mission.c.id > of.id).order_by(mission.c.id).limit(1)
    return tx.execute(before).scalar(), tx.execute(after).scalar()


def traceback(tx: Transaction, mission_id: int) -> str | None:
    """Where processing failed, for those who run the service."""
    found: str | None = tx.execute(sa.select(mission.c.traceback).where(mission.c.id == mission_id)).scalar_one()
    return found


@dataclass(frozen=True)
class FailedRow:
    """A mission that could not be processed."""

    id: int
    robot_id: str
    map_name: str
    key: str
    received_at: datetime
    finished_at: datetime | None
    attempts: int
    algorithm: str | None
    traceback: str


def unprocessed(tx: Transaction, before: int | None, limit: int) -> Sequence[FailedRow]:
    """The newest arrivals first."""
    query = (
        sa.select(*columns(mission, FailedRow, "robot_id", "map_name"), map_.c.robot_id, map_.c.name.label("map_name"))
        .join(map_, map_.c.id == mission.c.map_id)
        .where(mission.c.traceback.is_not(None))
        .order_by(mission.c.id.desc())
        .limit(limit)
    )
    if before is not None:
        query = query.where(mission.c.id < before)
    return [as_row(FailedRow, row) for row in tx.execute(query)]


def queue_again(tx: Transaction, mission_id: int) -> None:
    """As if it had just arrived; its lane must be locked."""
    found = ("finished_at", "outcome", "succeeded_at", "base_version", "version", "algorithm", "result", "traceback")
    ablation = (f"ablation_{row}" for row in ("transfer", "meta_occupancy", "meta_dividers"))
    values = dict.fromkeys((*found, *ablation), sa.null()) | {"status": "queued", "attempts": 0}
    tx.execute(sa.update(mission).where(mission.c.id == mission_id).values(**values))


def finished(tx: Transaction, mission_id: int, found: Finding, now: datetime) -> tuple[Change, ...]:
    values = {name: getattr(found, name) for name in _FOUND}
    values |= zip(_ABLATION, found.ablation or (None, None, None), strict=True)
    values |= {"finished_at": now, "result": found.result | {"reason": found.reason}}
    return (
        Change(_FINISH, {"done": mission_id} | named("found", values)),
        Change(_to_count(tx.dialect.name), {"done": mission_id}),
    )


@cache
def _to_count(dialect: str) -> sa.Insert:
    insert = postgresql.insert if dialect == "postgresql" else sqlite.insert
    return insert(uncounted).values(mission_id=sa.bindparam("done")).on_conflict_do_nothing()


@dataclass(frozen=True)
class Tally:
    """Where the missions of the whole service stand."""

    by_outcome: Mapping[str, int]
    waiting: int
    oldest_waiting_since: datetime | None
    unprocessed: int


def tally(tx: Transaction) -> Tally:
    done = (
        sa.select(mission.c.outcome, sa.func.count()).where(mission.c.outcome.is_not(None)).group_by(mission.c.outcome)
    )
    waiting = sa.select(sa.func.count(), sa.func.min(mission.c.received_at)).where(mission.c.status != "done")
    count, since = tx.execute(waiting).one()
    failed = sa.select(sa.func.count()).where(mission.c.traceback.is_not(None))
    return Tally({row[0]: row[1] for row in tx.execute(done)}, count, since, tx.execute(failed).scalar_one())
