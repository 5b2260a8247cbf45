"""What happened, in order; people's browsers follow it."""

from collections.abc import Sequence
from datetime import datetime

import sqlalchemy as sa

from stillroom.store.database import Transaction
from stillroom.store.robots import Selection
from stillroom.store.rows import EventRow, Json, MapRow, as_row, columns
from stillroom.store.tables import event, map_, robot


def add(tx: Transaction, of: MapRow, kind: str, data: Json, now: datetime) -> None:
    values = {"robot_id": of.robot_id, "map_id": of.id, "kind": kind, "data": data, "created_at": now}
    tx.execute(sa.insert(event).values(values))


def newest(tx: Transaction) -> int:
    """Id of the newest event, 0 where there is none."""
    return tx.execute(sa.select(sa.func.max(event.c.id))).scalar() or 0


def after(tx: Transaction, last: int, visible: Selection, map_name: str | None, limit: int) -> Sequence[EventRow]:
    """Events after the one with the id `last`, of the robots that `visible` selects (a condition on `robot`)."""
    query = (
        sa.select(*columns(event, EventRow, "map_name"), map_.c.name.label("map_name"))
        .join(robot, robot.c.id == event.c.robot_id)
        .join(map_, map_.c.id == event.c.map_id)
        .where(event.c.id > last, visible)
        .order_by(event.c.id)
        .limit(limit)
    )
    if map_name is not None:
        query = query.where(map_.c.name == map_name)
    return [as_row(EventRow, row) for row in tx.execute(query)]
