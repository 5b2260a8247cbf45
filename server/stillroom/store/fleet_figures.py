"""What dashboards ask of the tallies: all of it from sums by day, so that it takes as long for a busy day as for a quiet one."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import date, datetime
from typing import Any, Literal

import sqlalchemy as sa

from stillroom.store.database import Transaction
from stillroom.store.fleet import MEASURES
from stillroom.store.fleet_tables import counted, fleet_cause, fleet_day, fleet_failure_day, fleet_robot, uncounted
from stillroom.store.rows import as_row, as_row_or_none, columns
from stillroom.store.tables import map_, mission, robot
from stillroom.store.tallies import WIDTH

Dimension = Literal["day", "firmware", "model", "algorithm", "size"]
DIMENSIONS: tuple[Dimension, ...] = ("firmware", "model", "algorithm", "size")
TALLIES = ("missions", *MEASURES)


@dataclass(frozen=True)
class Selection:
    """Missions that were processed on the days from `first` to `last`; of each dimension one of the values, where any are given."""

    first: date
    last: date
    firmware: tuple[str, ...] = ()
    model: tuple[str, ...] = ()
    algorithm: tuple[str, ...] = ()
    size: tuple[str, ...] = ()


@dataclass(frozen=True)
class Group:
    key: str
    tallies: Mapping[str, str]
    """By measure, and `missions`."""


@dataclass(frozen=True)
class CauseRow:
    id: int
    key: str
    kind: str
    cause: str
    stage: str
    algorithm: str
    first_seen: datetime
    last_seen: datetime
    returned_at: datetime | None
    muted_at: datetime | None
    muted_until: datetime | None
    muted_by: str | None
    mute_note: str | None


@dataclass(frozen=True)
class Failures:
    """Missions that failed by one cause."""

    cause_id: int
    outcome: str
    robots: str
    """A tally."""


@dataclass(frozen=True)
class CauseDay:
    """Missions of one day that failed by one cause."""

    day: date
    firmware: str
    model: str
    size: str
    outcome: str
    robots: str
    """A tally."""


@dataclass(frozen=True)
class FailedMission:
    id: int
    robot_id: str
    map_name: str
    key: str
    outcome: str
    finished_at: datetime
    firmware: str
    model: str
    algorithm: str
    escaped_at: datetime | None
    cause: str | None


def tallies(tx: Transaction, of: Selection, by: Dimension | None) -> list[Group]:
    """One group for each value, or one of all; in order of their keys."""
    sums = [sa.func.aggregate_strings(fleet_day.c[name], "").label(name) for name in TALLIES]
    if by is None:
        row = tx.execute(sa.select(*sums).where(*_within(fleet_day, of))).one()
        return [Group("all", {name: row._mapping[name] or "" for name in TALLIES})]
    key = fleet_day.c[by]
    query = sa.select(key.label("key"), *sums).where(*_within(fleet_day, of)).group_by(key).order_by(key)
    return [Group(str(row.key), {name: row._mapping[name] or "" for name in TALLIES}) for row in tx.execute(query)]


def totals(tx: Transaction) -> Mapping[str, int]:
    """How many missions each tally has, of all days."""
    sums = (sa.func.sum(sa.func.length(fleet_day.c[name])).label(name) for name in TALLIES)
    row = tx.execute(sa.select(*sums)).one()._mapping
    return {name: int(row[name] or 0) // WIDTH for name in TALLIES}


def known(tx: Transaction) -> Mapping[str, list[str]]:
    """The values that there are of each dimension, of all days."""
    return {
        name: list(tx.execute(sa.select(fleet_day.c[name]).distinct().order_by(fleet_day.c[name])).scalars())
        for name in DIMENSIONS
    }


def first_day(tx: Transaction) -> date | None:
    found: date | None = tx.execute(sa.select(sa.func.min(fleet_day.c.day))).scalar()
    return found


def failures(tx: Transaction, of: Selection) -> list[Failures]:
    """By cause and outcome."""
    table = fleet_failure_day
    query = (
        sa.select(table.c.cause_id, table.c.outcome, sa.func.aggregate_strings(table.c.robots, "").label("robots"))
        .where(*_failed_within(of))
        .group_by(table.c.cause_id, table.c.outcome)
        .order_by(table.c.cause_id, table.c.outcome)
    )
    return [as_row(Failures, row) for row in tx.execute(query) if row.robots]


def trends(tx: Transaction, of: Selection) -> Mapping[int, list[tuple[date, int]]]:
    """How many missions failed by each cause on each day that had any."""
    table = fleet_failure_day
    query = (
        sa.select(table.c.cause_id, table.c.day, sa.func.sum(sa.func.length(table.c.robots)))
        .where(*_failed_within(of))
        .group_by(table.c.cause_id, table.c.day)
        .order_by(table.c.cause_id, table.c.day)
    )
    found: dict[int, list[tuple[date, int]]] = {}
    for cause, day, length in tx.execute(query).all():
        if length:
            found.setdefault(cause, []).append((day, int(length) // WIDTH))
    return found


def failed(tx: Transaction, of: Selection) -> int:
    """How many missions failed, by whatever cause."""
    length = tx.execute(
        sa.select(sa.func.sum(sa.func.length(fleet_failure_day.c.robots))).where(*_failed_within(of))
    ).scalar()
    return int(length or 0) // WIDTH


def of_cause(tx: Transaction, of: Selection, cause_id: int) -> list[CauseDay]:
    """What failed by one cause, in order of days."""
    # An index by cause would be quick here, and make the questions about all causes jump about in the table.
    table = fleet_failure_day
    query = sa.select(*columns(table, CauseDay)).where(*_failed_within(of), table.c.cause_id == cause_id)
    return [as_row(CauseDay, row) for row in tx.execute(query.order_by(table.c.day)) if row.robots]


def escapes_by_cause(tx: Transaction, of: Selection) -> list[tuple[int, int]]:
    """(Cause, number of the robot) of each escape that had needed the meta layer."""
    query = sa.select(counted.c.cause_id, counted.c.robot).where(
        counted.c.escaped_at.is_not(None), *_within(counted, of)
    )
    # chosen here and not in the query, where it would have SQLite look through all that failed instead of what escaped
    return [(row.cause_id, row.robot) for row in tx.execute(query) if row.cause_id is not None]


def causes(tx: Transaction) -> Sequence[CauseRow]:
    query = sa.select(*columns(fleet_cause, CauseRow)).order_by(fleet_cause.c.id)
    return [as_row(CauseRow, row) for row in tx.execute(query)]


def cause(tx: Transaction, key: str) -> CauseRow | None:
    query = sa.select(*columns(fleet_cause, CauseRow)).where(fleet_cause.c.key == key)
    return as_row_or_none(CauseRow, tx.execute(query).first())


def mute(tx: Transaction, cause_id: int, values: Mapping[str, Any]) -> None:
    """`muted_at`, `muted_until`, `muted_by` and `mute_note`."""
    tx.execute(sa.update(fleet_cause).where(fleet_cause.c.id == cause_id).values(**values))


def missions(
    tx: Transaction, of: Selection, cause_id: int | None, escaped: bool, before: int | None, limit: int
) -> Sequence[FailedMission]:
    """Missions that failed, of all causes or one, or that escaped; the newest arrivals first."""
    query = (
        sa.select(
            mission.c.id,
            map_.c.robot_id,
            map_.c.name.label("map_name"),
            mission.c.key,
            mission.c.finished_at,
            *(counted.c[name] for name in ("outcome", "firmware", "model", "algorithm", "escaped_at")),
            fleet_cause.c.key.label("cause"),
        )
        .select_from(counted)
        .join(mission, mission.c.id == counted.c.mission_id)
        .join(map_, map_.c.id == mission.c.map_id)
        .outerjoin(fleet_cause, fleet_cause.c.id == counted.c.cause_id)
        .where(*_within(counted, of))
        .order_by(counted.c.mission_id.desc())
        .limit(limit)
    )
    if cause_id is not None:
        query = query.where(counted.c.cause_id == cause_id)
    elif escaped:
        query = query.where(counted.c.escaped_at.is_not(None))
    else:
        query = query.where(counted.c.cause_id.is_not(None))
    if before is not None:
        query = query.where(counted.c.mission_id < before)
    return [as_row(FailedMission, row) for row in tx.execute(query)]


def fact(tx: Transaction, mission_id: int) -> tuple[datetime | None, str | None] | None:
    """When a mission was corrected, and the id of what it failed by; None where it is not counted."""
    query = (
        sa.select(counted.c.escaped_at, fleet_cause.c.key)
        .outerjoin(fleet_cause, fleet_cause.c.id == counted.c.cause_id)
        .where(counted.c.mission_id == mission_id)
    )
    row = tx.execute(query).first()
    return None if row is None else (row.escaped_at, row.key)


def robots_of(tx: Transaction, numbers: Sequence[int]) -> Mapping[int, tuple[str, str]]:
    """Id and name by number, of those that are still there."""
    query = (
        sa.select(fleet_robot.c.number, robot.c.id, robot.c.name)
        .join(robot, robot.c.id == fleet_robot.c.robot_id)
        .where(fleet_robot.c.number.in_(numbers))
    )
    return {row.number: (row.id, row.name) for row in tx.execute(query)}


def waiting(tx: Transaction) -> int:
    """Missions that were processed and are not in the tallies yet."""
    found: int = tx.execute(sa.select(sa.func.count()).select_from(uncounted)).scalar_one()
    return found


def _failed_within(of: Selection) -> list[sa.ColumnElement[bool]]:
    where = _within(fleet_failure_day, of, without="algorithm")
    if of.algorithm:
        same = sa.select(fleet_cause.c.id).where(fleet_cause.c.algorithm.in_(of.algorithm))
        where.append(fleet_failure_day.c.cause_id.in_(same))
    return where


def _within(table: sa.Table, of: Selection, without: str = "") -> list[sa.ColumnElement[bool]]:
    days = [table.c.day >= of.first, table.c.day <= of.last]
    named = (name for name in DIMENSIONS if name != without and getattr(of, name))
    return days + [table.c[name].in_(getattr(of, name)) for name in named]
