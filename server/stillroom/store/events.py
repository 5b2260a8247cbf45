"""What happened, in order; people's browsers follow it."""

from collections.abc import Sequence
from datetime import datetime

import sqlalchemy as sa

from stillroom.store import deliveries, robots
from stillroom.store.changes import Change, apply, given, named
from stillroom.store.database import Transaction, tell
from stillroom.store.hints import Hint
from stillroom.store.robots import Selection
from stillroom.store.rows import EventRow, Json, MapRow, as_row, columns
from stillroom.store.tables import event, map_, robot

_LOCK = 0x57111
"""Keeps these locks apart from others of the same database."""


NEWS = ("conflict", "mission", "version")
"""What people and their programs may want to be sent a message about."""
Happened = tuple[str, Json]
"""What kind of thing happened, and what is to be told of it."""


def _is_news(kind: sa.ColumnElement[str]) -> sa.ColumnElement[bool]:
    return sa.or_(*(kind == one for one in NEWS))  # IN would be written out anew for every statement


def _at_once(of_map: sa.CTE) -> sa.Insert:
    """For PostgreSQL. All locks are taken before the first event gets its number, as they are counted first."""
    held = sa.func.pg_advisory_xact_lock(
        sa.func.hashtextextended(robots.followers().c.name, sa.literal_column(str(_LOCK)))
    )
    locks = sa.select(sa.func.count(held)).cte("locks")
    all_of_it = sa.func.json_array_elements(sa.bindparam("happened", type_=sa.JSON))
    told = all_of_it.table_valued(sa.column("what", sa.JSON), with_ordinality="place").render_derived()
    happened = (
        sa.select(of_map.c.robot_id, of_map.c.id, told.c.what["kind"].as_string(), told.c.what["data"])
        .add_columns(sa.bindparam("now", type_=event.c.created_at.type))
        .select_from(locks.join(of_map, sa.true()).join(told, sa.true()))
        .order_by(told.c.place)
    )
    into = sa.insert(event).from_select(["robot_id", "map_id", "kind", "data", "created_at"], happened)
    added = into.returning(event.c.id, event.c.kind).cte("added")
    return deliveries.posting(sa.select(added.c.id).where(_is_news(added.c.kind)))


_OF = sa.select(map_.c.id, map_.c.robot_id).where(map_.c.id == sa.bindparam("of"))
# the map stays whose it is: its owner may keep it just now, when the robot is given up
_AT_ONCE = _at_once(_OF.with_for_update(read=True, key_share=True).cte("of_map"))
_IS_LOCKED = sa.select(
    sa.bindparam("of", type_=map_.c.id.type).label("id"),
    sa.bindparam("of_robot", type_=map_.c.robot_id.type).label("robot_id"),
)
_AT_ONCE_BESIDE = _at_once(_IS_LOCKED.cte("of_map"))
_ADD = (
    sa.insert(event)
    .values(given(event, "new", "map_id", "kind", "data", "created_at"))
    .values(robot_id=sa.select(map_.c.robot_id).where(map_.c.id == sa.bindparam("new_map_id")).scalar_subquery())
    .returning(event.c.id)
)
_POST = deliveries.posting(sa.select(sa.bindparam("event_id", type_=event.c.id.type)))


def add(
    tx: Transaction, of: MapRow, happened: Sequence[Happened], now: datetime, beside: Sequence[Change] = ()
) -> None:
    """Tells of all that happened to a map, in this order, and has messages sent about it.

    The last thing that a transaction does: until it ends, no other adds an event that the same people see.

    So their events are committed in the order of their ids, and who has seen one has missed none before it.

    `beside`: changes that are made with it, of other tables than these; the map must be locked then, and `of` be as it is since.
    """
    news = [kind for kind, _ in happened if kind in NEWS]
    if tx.dialect.name == "postgresql":
        all_of_it = [{"kind": kind, "data": data} for kind, data in happened]
        told = _AT_ONCE_BESIDE if beside else _AT_ONCE
        apply(tx, *beside, Change(told, {"of_robot": of.robot_id, "of": of.id, "happened": all_of_it, "now": now}))
    else:  # on SQLite there is one writer at a time
        apply(tx, *beside)
        for kind, data in happened:
            one = {"map_id": of.id, "kind": kind, "data": data, "created_at": now}
            number = tx.execute(_ADD, named("new", one)).scalar_one()
            if kind in NEWS:
                tx.execute(_POST, {"event_id": number})
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
