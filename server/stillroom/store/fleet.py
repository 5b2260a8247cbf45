"""Missions are counted once each into the tallies of their day, and corrections that people make are held against them."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import date, datetime, timedelta
from typing import Any

import sqlalchemy as sa
from sqlalchemy.dialects import postgresql, sqlite

from stillroom.store import tallies
from stillroom.store.database import Transaction, insert_unless_there
from stillroom.store.fleet_tables import (
    counted,
    fleet_cause,
    fleet_day,
    fleet_failure_day,
    fleet_robot,
    uncounted,
    unjudged,
)
from stillroom.store.rows import as_row, as_row_or_none, columns
from stillroom.store.tables import conflict, map_, mission, sighting, version

GONE_AFTER = timedelta(days=14)
"""What was not seen for so long and is seen again has come back."""
MEASURES = ("transfer", "meta_occupancy", "meta_dividers", "reverted", "needs_review", "parked", "escapes")
"""What may be counted of a mission; each has a tally."""
_LOCK = 0x57112
_WHERE = ("day", "firmware", "model", "algorithm", "size")


@dataclass(frozen=True)
class Processed:
    """What counting has to know of a mission."""

    id: int
    robot_id: str
    outcome: str
    placed: bool
    """A person put it where it is; it was counted where the robot sent it."""
    base_version: int | None
    finished_at: datetime
    algorithm: str
    firmware: str | None
    model: str | None
    rooms: int | None
    """Of the map that was carried over."""
    transfer: bool | None
    meta_occupancy: bool | None
    meta_dividers: bool | None
    traceback: str | None


@dataclass(frozen=True)
class Met:
    """A conflict that a mission met."""

    mission_id: int
    kind: str
    cause: str
    resolved: bool


@dataclass(frozen=True)
class Fingerprint:
    key: str
    kind: str
    cause: str
    stage: str
    algorithm: str


@dataclass(frozen=True)
class Counted:
    mission_id: int
    robot: int
    day: date
    firmware: str
    model: str
    algorithm: str
    size: str
    outcome: str
    failed: int
    """How many rows of the results table failed: the first ones."""
    cause_id: int | None
    escaped_at: datetime | None = None

    @property
    def measures(self) -> list[str]:
        """The tallies that it belongs to, beside `missions`."""
        if self.outcome == "parked":
            return ["parked"]
        own = [self.outcome] if self.outcome in MEASURES else []
        return [*MEASURES[: self.failed], *own, *(["escapes"] if self.escaped_at is not None else [])]


def hold(tx: Transaction) -> None:
    """Until the end of the transaction no other counts. On SQLite there is one writer at a time anyway."""
    if tx.dialect.name == "postgresql":
        tx.execute(sa.select(sa.func.pg_advisory_xact_lock(_LOCK)))


def backlog(tx: Transaction) -> tuple[int, int]:
    """How many missions are not counted, and how many versions not judged."""
    waiting = (sa.select(sa.func.count()).select_from(table).scalar_subquery() for table in (uncounted, unjudged))
    row = tx.execute(sa.select(*waiting)).one()
    return row[0], row[1]


def to_count(tx: Transaction, most: int) -> Sequence[Processed]:
    """In the order of their ids."""
    query = (
        sa.select(
            mission.c.id,
            map_.c.robot_id,
            mission.c.outcome,
            mission.c.placed_from.is_not(None).label("placed"),
            *(mission.c[name] for name in ("base_version", "finished_at", "algorithm", "traceback")),
            *(mission.c.meta[name].as_string().label(name) for name in ("firmware", "model")),
            version.c.rooms,
            *(mission.c[f"ablation_{row}"].label(row) for row in MEASURES[:3]),
        )
        .select_from(uncounted)
        .join(mission, mission.c.id == uncounted.c.mission_id)
        .join(map_, map_.c.id == mission.c.map_id)
        .outerjoin(version, sa.and_(version.c.map_id == mission.c.map_id, version.c.number == mission.c.base_version))
        .order_by(uncounted.c.mission_id)
        .limit(most)
    )
    return [as_row(Processed, row) for row in tx.execute(query)]


def met(tx: Transaction, mission_ids: Sequence[int]) -> Mapping[int, Met]:
    """Of the conflicts that each mission met, the one that says most: what was not settled first, then in their order."""
    query = (
        sa.select(sighting.c.mission_id, conflict.c.kind, sighting.c.cause, conflict.c.resolved)
        .join(conflict, conflict.c.id == sighting.c.conflict_id)
        .where(sighting.c.mission_id.in_(mission_ids))
        .order_by(conflict.c.resolved, sighting.c.id)
    )
    found: dict[int, Met] = {}
    for row in tx.execute(query):
        found.setdefault(row.mission_id, as_row(Met, row))
    return found


def robot_numbers(tx: Transaction, robot_ids: Iterable[str]) -> Mapping[str, int]:
    wanted = set(robot_ids)
    query = sa.select(fleet_robot.c.robot_id, fleet_robot.c.number).where(fleet_robot.c.robot_id.in_(wanted))
    known = {row.robot_id: row.number for row in tx.execute(query)}
    for robot_id in sorted(wanted - known.keys()):
        insert_unless_there(tx, fleet_robot, {"robot_id": robot_id})
    return known if wanted <= known.keys() else {row.robot_id: row.number for row in tx.execute(query)}


def see_cause(tx: Transaction, what: Fingerprint, at: datetime) -> int:
    """Its number; remembers when it was seen, and whether it has come back."""
    insert_unless_there(tx, fleet_cause, vars(what) | {"first_seen": at, "last_seen": at})
    names = ("id", "first_seen", "last_seen")
    row = tx.execute(sa.select(*(fleet_cause.c[name] for name in names)).where(fleet_cause.c.key == what.key)).one()
    seen: dict[str, datetime] = {}
    if at < row.first_seen:  # machines' clocks differ a little, and what is processed first need not be counted first
        seen["first_seen"] = at
    if at > row.last_seen:
        seen |= {"last_seen": at} | ({"returned_at": at} if at - row.last_seen > GONE_AFTER else {})
    if seen:
        tx.execute(sa.update(fleet_cause).where(fleet_cause.c.id == row.id).values(**seen))
    found: int = row.id
    return found


def count(tx: Transaction, looked_at: Sequence[int], facts: Sequence[Counted]) -> None:
    """Counts `facts`; all that was looked at does not wait any more, counted or not."""
    if facts:
        tx.execute(sa.insert(counted), [vars(fact) for fact in facts])
        _add(tx, facts)
    tx.execute(sa.delete(uncounted).where(uncounted.c.mission_id.in_(looked_at)))


def uncount(tx: Transaction, mission_id: int) -> None:
    """Takes a mission out of the tallies again: it is processed once more. Counting must be held."""
    tx.execute(sa.delete(uncounted).where(uncounted.c.mission_id == mission_id))
    fact = fact_of(tx, mission_id)
    if fact is None:
        return
    here = sa.and_(*(fleet_day.c[name] == getattr(fact, name) for name in _WHERE))
    names = fact.measures if fact.outcome == "parked" else ["missions", *fact.measures]
    row = tx.execute(sa.select(fleet_day).where(here)).one()._mapping
    less = {name: tallies.without(row[name], fact.robot) for name in names}
    tx.execute(sa.update(fleet_day).where(here).values(**less))
    if fact.cause_id is not None:
        table = fleet_failure_day
        same = (table.c[name] == getattr(fact, name) for name in table.primary_key.columns.keys())  # noqa: SIM118  # a collection of columns
        there = sa.and_(*same)
        robots = tx.execute(sa.select(table.c.robots).where(there)).scalar_one()
        tx.execute(sa.update(table).where(there).values(robots=tallies.without(robots, fact.robot)))
    tx.execute(sa.delete(counted).where(counted.c.mission_id == mission_id))


def fact_of(tx: Transaction, mission_id: int) -> Counted | None:
    query = sa.select(*columns(counted, Counted)).where(counted.c.mission_id == mission_id)
    return as_row_or_none(Counted, tx.execute(query).first())


def escape(tx: Transaction, mission_id: int, at: datetime) -> None:
    """A person has corrected what the mission did; counts once. Counting must be held."""
    fact = fact_of(tx, mission_id)
    if fact is None or fact.escaped_at is not None:
        return
    tx.execute(sa.update(counted).where(counted.c.mission_id == mission_id).values(escaped_at=at))
    where = {name: getattr(fact, name) for name in _WHERE}
    _append(tx, fleet_day, [where | _tallied("escapes", tallies.encode([fact.robot]))])


def to_judge(tx: Transaction, most: int) -> Sequence[tuple[int, int]]:
    """Versions that people made: (map, number)."""
    query = sa.select(unjudged.c.map_id, unjudged.c.number).order_by(unjudged.c.map_id, unjudged.c.number).limit(most)
    return [(row.map_id, row.number) for row in tx.execute(query)]


def judged(tx: Transaction, versions: Sequence[tuple[int, int]]) -> None:
    tx.execute(sa.delete(unjudged).where(sa.tuple_(unjudged.c.map_id, unjudged.c.number).in_(versions)))


def mission_of(tx: Transaction, map_id: int, number: int) -> tuple[int, str, datetime] | None:
    """The mission that the robot sent here and that made a version: its number, outcome and when it was done."""
    query = sa.select(mission.c.id, mission.c.outcome, mission.c.finished_at).where(
        mission.c.map_id == map_id,
        mission.c.version == number,
        mission.c.base_version < number,
        mission.c.placed_from.is_(None),
        mission.c.key == sa.select(version.c.mission).where(version.c.map_id == map_id, version.c.number == number)
        .scalar_subquery(),
    )  # fmt: skip
    row = tx.execute(query).first()
    return None if row is None else (row.id, row.outcome, row.finished_at)


def _add(tx: Transaction, facts: Sequence[Counted]) -> None:
    days: dict[tuple[Any, ...], dict[str, list[int]]] = {}
    failures: dict[tuple[Any, ...], list[int]] = {}
    reasons = fleet_failure_day.primary_key.columns.keys()
    for fact in facts:
        tally = days.setdefault(tuple(getattr(fact, name) for name in _WHERE), {})
        for name in fact.measures if fact.outcome == "parked" else ["missions", *fact.measures]:
            tally.setdefault(name, []).append(fact.robot)
        if fact.cause_id is not None:
            failures.setdefault(tuple(getattr(fact, name) for name in reasons), []).append(fact.robot)
    _append(
        tx,
        fleet_day,
        [
            dict(zip(_WHERE, key, strict=True))
            | {name: tallies.encode(tally.get(name, ())) for name in ("missions", *MEASURES)}
            for key, tally in sorted(days.items())
        ],
    )
    _append(
        tx,
        fleet_failure_day,
        [
            dict(zip(reasons, key, strict=True)) | {"robots": tallies.encode(robots)}
            for key, robots in sorted(failures.items())
        ],
    )


def _tallied(name: str, tally: str) -> dict[str, str]:
    return dict.fromkeys(("missions", *MEASURES), "") | {name: tally}


def _append(tx: Transaction, table: sa.Table, rows: Sequence[Mapping[str, Any]]) -> None:
    """Puts tallies behind those that are there."""
    if not rows:
        return
    insert = (postgresql if tx.dialect.name == "postgresql" else sqlite).insert(table)
    keys = table.primary_key.columns.keys()
    longer = {name: table.c[name].concat(insert.excluded[name]) for name in rows[0] if name not in keys}
    tx.execute(insert.on_conflict_do_update(index_elements=keys, set_=longer), rows)
