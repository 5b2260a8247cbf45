"""How long homes keep what their robots sensed."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime

import sqlalchemy as sa

from stillroom.store.database import Transaction, upsert
from stillroom.store.privacy_tables import retention
from stillroom.store.rows import as_row, as_row_or_none, columns
from stillroom.store.tables import conflict, ending, map_, mission, robot, sighting, version

NEWEST = 10
"""Versions of a map that always keep their grids."""


@dataclass(frozen=True)
class RetentionRow:
    home: str
    days: int
    changed_by: str
    changed_at: datetime


@dataclass(frozen=True)
class Old:
    """A mission whose grid is not to be kept any longer."""

    id: int
    map_id: int
    key: str
    grid: str


_RETENTION = sa.select(*columns(retention, RetentionRow))


def of_home(tx: Transaction, home: str) -> RetentionRow | None:
    return as_row_or_none(RetentionRow, tx.execute(_RETENTION.where(retention.c.home == home)).first())


def every(tx: Transaction) -> Sequence[RetentionRow]:
    return [as_row(RetentionRow, row) for row in tx.execute(_RETENTION.order_by(retention.c.home))]


def choose(tx: Transaction, row: RetentionRow) -> None:
    upsert(tx, retention, [vars(row)])


def choose_nothing(tx: Transaction, home: str) -> None:
    tx.execute(sa.delete(retention).where(retention.c.home == home))


def _old(home: str, before: datetime) -> sa.ColumnElement[bool]:
    """Missions of a home that are done, older than that, and whose grid nothing needs: no version that is in force, pinned, named or
    among the newest, no question that waits, no mission that nobody has said the floor of."""
    of_home = sa.select(map_.c.id).join(robot, robot.c.id == map_.c.robot_id).where(robot.c.owner == home)
    needed = (
        sa.select(version.c.number)
        .join(map_, map_.c.id == version.c.map_id)
        .where(
            version.c.map_id == mission.c.map_id,
            version.c.mission == mission.c.key,
            sa.or_(
                version.c.number == map_.c.pinned, version.c.name.is_not(None), version.c.number > map_.c.head - NEWEST
            ),
        )
    )
    asks = (
        sa.select(sighting.c.id)
        .join(conflict, conflict.c.id == sighting.c.conflict_id)
        .outerjoin(ending, ending.c.conflict_id == conflict.c.id)
        .where(sighting.c.mission_id == mission.c.id, conflict.c.waits, ending.c.conflict_id.is_(None))
    )
    placed = mission.alias("placed")
    unplaced = sa.and_(
        mission.c.outcome == "parked",
        ~sa.exists(sa.select(placed.c.id).where(placed.c.placed_from == mission.c.id)),
    )
    return sa.and_(
        mission.c.map_id.in_(of_home),
        mission.c.status == "done",
        mission.c.received_at < before,
        mission.c.grid != "",
        ~sa.exists(needed),
        ~sa.exists(asks),
        ~unplaced,
    )


def count_old(tx: Transaction, home: str, before: datetime) -> int:
    return tx.execute(sa.select(sa.func.count()).select_from(mission).where(_old(home, before))).scalar_one()


def old(tx: Transaction, home: str, before: datetime, most: int) -> Sequence[Old]:
    query = sa.select(*columns(mission, Old)).where(_old(home, before)).order_by(mission.c.id).limit(most)
    return [as_row(Old, row) for row in tx.execute(query)]


def forget_grid(tx: Transaction, of: Old) -> None:
    """Of the mission, and of all versions that lie on it; the lane must be locked."""
    tx.execute(sa.update(mission).where(mission.c.id == of.id).values(grid=""))
    same = version.c.map_id == of.map_id, version.c.mission == of.key
    tx.execute(sa.update(version).where(*same).values(grid=""))
