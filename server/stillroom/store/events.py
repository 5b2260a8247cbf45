"""What happened, in order; people's browsers follow it."""

from collections.abc import Sequence
from datetime import datetime

import sqlalchemy as sa

from stillroom.store import deliveries, robots
from stillroom.store.database import Transaction, tell
from stillroom.store.hints import Hint
from stillroom.store.robots import Selection
from stillroom.store.rows import EventRow, Json, MapRow, as_row, columns
from stillroom.store.tables import event, map_, robot

_LOCK = 0x57111
"""Keeps these locks apart from others of the same database."""


_HOLD = sa.select(
    sa.func.pg_advisory_xact_lock(sa.func.hashtextextended(robots.followers().c.name, sa.literal_column(str(_LOCK))))
)
NEWS = ("conflict", "mission", "version")
"""What people and their programs may want to be sent a message about."""
Happened = tuple[str, Json]
"""What kind of thing happened, and what is to be told of it."""


def add(tx: Transaction, of: MapRow, happened: Sequence[Happened], now: datetime) -> None:
    """Tells of all that happened to a map, in this order, and has messages sent about it.

    The last thing that a transaction does: until it ends, no other adds an event that the same people see.

    So their events are committed in the order of their ids, and who has seen one has missed none before it.
    """
    if tx.dialect.name == "postgresql":  # on SQLite there is one writer at a time
        tx.execute(_HOLD, {"robot_id": of.robot_id})
    # Not as it was read before: the map's owner may have kept it when the robot was given up.
    robot_id = sa.select(map_.c.robot_id).where(map_.c.id == of.id).scalar_subquery()
    made = sa.insert(event).values(robot_id=robot_id).returning(event.c.id, sort_by_parameter_order=True)
    same = {"map_id": of.id, "created_at": now}
    rows = [same | {"kind": kind, "data": data} for kind, data in happened]
    numbers = tx.execute(made, rows).scalars().all()
    news = [number for number, (kind, _) in zip(numbers, happened, strict=True) if kind in NEWS]
    deliveries.post(tx, news)
    tell(tx, Hint("changed", of.id))
    if news:
        tell(tx, Hint("message", of.id))


def newest(tx: Transaction, visible: Selection) -> int:
    """Id of the newest event of the robots that `visible` selects, 0 where there is none."""
    query = sa.select(sa.func.max(event.c.id)).join(robot, robot.c.id == event.c.robot_id).where(visible)
    return tx.execute(query).scalar() or 0


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
