"""What there is, for who checks all of it: read in batches, in one transaction."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any

import sqlalchemy as sa

from stillroom.store.database import Transaction
from stillroom.store.fleet import Counted
from stillroom.store.fleet_tables import counted, fleet_day, fleet_failure_day, fleet_robot, uncounted
from stillroom.store.privacy_tables import discarded_grid
from stillroom.store.rows import RowT, as_row, columns
from stillroom.store.tables import event, lane, map_, metadata, mission, room, version

COUNTED = ("updated", "resolved", "needs_review", "reverted", "parked")
"""Outcomes that the fleet's figures know."""

_BATCH = 500
_STREAM = 2000


@dataclass(frozen=True)
class AuditedMission:
    id: int
    map_id: int
    key: str
    epoch: int
    sequence: int
    status: str
    grid: str
    received_at: datetime
    finished_at: datetime | None
    outcome: str | None
    base_version: int | None
    version: int | None
    placed_from: int | None


@dataclass(frozen=True)
class AuditedVersion:
    map_id: int
    number: int
    parent: int | None
    cause: str
    mission: str | None
    grid: str
    rooms: int


@dataclass(frozen=True)
class Told:
    """How often it was told that a mission came to an outcome."""

    mission: str
    outcome: str
    times: int


@dataclass(frozen=True, eq=False)
class MapFacts:
    """One map and all that belongs to it."""

    id: int
    robot_id: str
    name: str
    head: int | None
    epoch: int | None
    sequence: int | None
    ready_at: float | None
    """When its lane is ready, in seconds since 1970; None: it rests."""
    living_rooms: int
    missions: Sequence[AuditedMission]
    versions: Sequence[AuditedVersion]
    """In the order of their numbers."""
    told: Sequence[Told]

    @property
    def path(self) -> str:
        return f"/api/v1/robots/{self.robot_id}/maps/{self.name}"


def map_facts(tx: Transaction) -> Iterator[MapFacts]:
    """Every map, in the order of their ids."""
    last = 0
    while rows := tx.execute(_maps_after(last)).all():
        ids = [row.id for row in rows]
        last = ids[-1]
        missions = _by_map(tx, _of_maps(mission, AuditedMission, ids).order_by(mission.c.id), AuditedMission)
        versions = _by_map(tx, _of_maps(version, AuditedVersion, ids).order_by(version.c.number), AuditedVersion)
        rooms: dict[int, int] = {row.map_id: row.rooms for row in tx.execute(_living_rooms(ids))}
        told: dict[int, list[Told]] = {}
        for row in tx.execute(_told([row.robot_id for row in rows], ids)):
            told.setdefault(row.map_id, []).append(Told(row.mission, row.outcome, row.times))
        for row in rows:
            yield MapFacts(
                **row._mapping,
                living_rooms=rooms.get(row.id, 0),
                missions=missions.get(row.id, []),
                versions=versions.get(row.id, []),
                told=told.get(row.id, []),
            )


def grids(tx: Transaction) -> Iterator[str]:
    """The keys of all grids that are referred to, each once."""
    query = sa.union(sa.select(mission.c.grid), sa.select(version.c.grid)).execution_options(yield_per=_STREAM)
    yield from tx.execute(query).scalars()


def miscounted(tx: Transaction) -> Iterator[tuple[int, str]]:
    """Missions that the fleet's figures should have and have not, or the other way round, or otherwise than they are."""
    should = sa.and_(
        mission.c.status == "done",
        mission.c.base_version.is_not(None),
        mission.c.placed_from.is_(None),
        mission.c.outcome.in_(COUNTED),
        mission.c.attempts > 0,  # else it was processed elsewhere, and came in an archive
    )
    waits = sa.exists().where(uncounted.c.mission_id == mission.c.id)
    is_there = sa.exists().where(counted.c.mission_id == mission.c.id)
    for row in tx.execute(sa.select(mission.c.id).where(should, ~waits, ~is_there)):
        yield row.id, "is not counted"
    differs = sa.or_(~should, counted.c.outcome != mission.c.outcome, counted.c.algorithm != mission.c.algorithm)
    joined = sa.select(mission.c.id).join(counted, counted.c.mission_id == mission.c.id)
    for row in tx.execute(joined.where(differs, ~waits)):
        yield row.id, "is counted as what it is not"


def facts(tx: Transaction) -> Iterator[Counted]:
    """Every mission that is counted."""
    rows = tx.execute(sa.select(*columns(counted, Counted)).execution_options(yield_per=_STREAM))
    yield from (as_row(Counted, row) for row in rows)


def discarded_grids(tx: Transaction) -> set[str]:
    """That are deleted soon, if nothing refers to them."""
    return set(tx.execute(sa.select(discarded_grid.c.key)).scalars())


def robot_numbers(tx: Transaction) -> set[int]:
    """By which tallies know robots."""
    return set(tx.execute(sa.select(fleet_robot.c.number)).scalars())


def tally_rows(tx: Transaction) -> Iterator[tuple[tuple[object, ...], str, str]]:
    """What each tally is of, its name, and the tally."""
    for table in (fleet_day, fleet_failure_day):
        keys = table.primary_key.columns.keys()
        for row in tx.execute(sa.select(table)):
            values = dict(row._mapping)
            key = (table.name, *(values.pop(name) for name in keys))
            yield from ((key, name, tally) for name, tally in values.items())


def failure_key(fact: Counted) -> tuple[object, ...]:
    names = fleet_failure_day.primary_key.columns.keys()
    return fleet_failure_day.name, *(getattr(fact, name) for name in names)


def day_key(fact: Counted) -> tuple[object, ...]:
    return fleet_day.name, *(getattr(fact, name) for name in fleet_day.primary_key.columns.keys())  # noqa: SIM118  # a collection of columns


def count(tx: Transaction, table: str) -> int:
    return tx.execute(sa.select(sa.func.count()).select_from(metadata.tables[table])).scalar_one()


def _by_map(tx: Transaction, query: sa.Select[Any], kind: type[RowT]) -> dict[int, list[RowT]]:
    found: dict[int, list[RowT]] = {}
    for row in tx.execute(query):
        found.setdefault(row.map_id, []).append(as_row(kind, row))
    return found


def _of_maps(table: sa.Table, kind: type[Any], ids: Sequence[int]) -> sa.Select[Any]:
    return sa.select(*columns(table, kind)).where(table.c.map_id.in_(ids))


def _living_rooms(ids: Sequence[int]) -> sa.Select[Any]:
    living = sa.select(room.c.map_id, sa.func.count().label("rooms")).where(
        room.c.map_id.in_(ids), room.c.retired.is_(False)
    )
    return living.group_by(room.c.map_id)


def _told(robot_ids: Sequence[str], ids: Sequence[int]) -> sa.Select[Any]:
    of, outcome = event.c.data["mission"].as_string(), event.c.data["outcome"].as_string()
    about = event.c.robot_id.in_(set(robot_ids)), event.c.map_id.in_(ids), event.c.kind == "mission"
    told = sa.select(event.c.map_id, of.label("mission"), outcome.label("outcome"), sa.func.count().label("times"))
    return told.where(*about).group_by(event.c.map_id, of, outcome)


def _maps_after(last: int) -> sa.Select[Any]:
    own = (map_.c.id, map_.c.robot_id, map_.c.name, map_.c.head, map_.c.epoch, map_.c.sequence)
    return (
        sa.select(*own, lane.c.ready_at)
        .join(lane, lane.c.map_id == map_.c.id)
        .where(map_.c.id > last)
        .order_by(map_.c.id)
        .limit(_BATCH)
    )
