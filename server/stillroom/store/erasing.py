"""Everything of a robot, or of a person, is deleted from whatever table it is in: tables are found by what they refer to."""

from collections.abc import Iterable, Sequence
from datetime import datetime

import sqlalchemy as sa

from stillroom.store.database import Transaction, insert_unless_there
from stillroom.store.fleet_tables import replay
from stillroom.store.privacy_tables import discarded_grid, grid_sweep, retention
from stillroom.store.receivers import remove as remove_receiver
from stillroom.store.tables import (
    account,
    api_token,
    delivery,
    language,
    link,
    map_,
    membership,
    metadata,
    mission,
    preference,
    receiver,
    robot,
    session,
    version,
)

SIGNATURE = 400
"""Length of all columns that say who did something."""


def of_robot(table: sa.Table, robot_id: str) -> sa.ColumnElement[bool] | None:
    """Which rows of a table belong to a robot, by its first reference that leads there; None where none does."""
    if table is robot:
        return robot.c.id == robot_id
    for column in table.columns:
        for key in column.foreign_keys if not column.nullable else ():
            above = None if key.column.table is table else of_robot(key.column.table, robot_id)
            if above is not None:
                return column.in_(sa.select(key.column).where(above))
    return None


def grids_of(tx: Transaction, robot_id: str) -> Sequence[str]:
    """The keys of all grids that a robot's missions and versions refer to."""
    of = sa.select(map_.c.id).where(map_.c.robot_id == robot_id)
    found = sa.union(*(sa.select(table.c.grid).where(table.c.map_id.in_(of)) for table in (mission, version)))
    return [key for key in tx.execute(found).scalars() if key]


def count_missions(tx: Transaction, robot_id: str) -> int:
    query = sa.select(sa.func.count()).select_from(mission).join(map_, map_.c.id == mission.c.map_id)
    return tx.execute(query.where(map_.c.robot_id == robot_id)).scalar_one()


def erase_robot(tx: Transaction, robot_id: str, now: datetime) -> None:
    """All but the row of the robot itself. Its lanes must be locked, counting held and done."""
    discard(tx, grids_of(tx, robot_id), now)
    for table in reversed(metadata.sorted_tables):
        which = None if table is robot else of_robot(table, robot_id)
        if which is not None:
            tx.execute(sa.delete(table).where(which))
    tx.execute(
        sa.delete(delivery).where(sa.cast(delivery.c.content, sa.Text).contains(f'"{robot_id}"', autoescape=True))
    )
    for row in tx.execute(sa.select(replay.c.id, replay.c.selection)).all():
        if robot_id in str(row.selection):
            tx.execute(
                sa.update(replay).where(replay.c.id == row.id).values(selection=_without(row.selection, robot_id))
            )


def _without(selection: object, robot_id: str) -> object:
    if isinstance(selection, dict):
        return {name: _without(value, robot_id) for name, value in selection.items() if value != robot_id}
    if isinstance(selection, list):
        return [_without(value, robot_id) for value in selection if value != robot_id]
    return selection


def erase_person(tx: Transaction, email: str, signature: str, nobody: str) -> None:
    """What belongs to a person, whose robots are erased already. What the person did in homes of others stays, by `nobody`."""
    for row in tx.execute(sa.select(receiver.c.id).where(receiver.c.person == signature)).all():
        remove_receiver(tx, row.id)
    for table in (preference, language):
        tx.execute(sa.delete(table).where(table.c.person == signature))
    tx.execute(sa.delete(membership).where(sa.or_(membership.c.home == email, membership.c.email == email)))
    tx.execute(sa.delete(link).where(sa.or_(link.c.home == email, link.c.email == email)))
    for table in (session, api_token, account):
        tx.execute(sa.delete(table).where(table.c.email == email))
    tx.execute(sa.delete(retention).where(retention.c.home == email))
    for table in metadata.sorted_tables:
        for column in table.columns:
            if isinstance(column.type, sa.String) and column.type.length == SIGNATURE:
                tx.execute(sa.update(table).where(column == signature).values({column.name: nobody}))


# -- grids ---------------------------------------------------------------------------------------------------------


def discard(tx: Transaction, keys: Iterable[str], now: datetime) -> None:
    """They are deleted soon, those that nothing refers to any more."""
    for key in sorted(set(keys)):  # in one order, so that two never wait for each other
        insert_unless_there(tx, discarded_grid, {"key": key, "at": now})


def discarded(tx: Transaction, most: int) -> Sequence[str]:
    query = sa.select(discarded_grid.c.key).order_by(discarded_grid.c.at, discarded_grid.c.key).limit(most)
    return tx.execute(query).scalars().all()


def unreferred(tx: Transaction, keys: Sequence[str]) -> set[str]:
    """Those that nothing refers to."""
    used: set[str] = set()
    for table in (mission, version):
        used.update(tx.execute(sa.select(table.c.grid).where(table.c.grid.in_(keys))).scalars())
    return set(keys) - used


def gone(tx: Transaction, keys: Sequence[str]) -> None:
    """One more sweep is done."""
    tx.execute(sa.delete(discarded_grid).where(discarded_grid.c.key.in_(keys)))
    insert_unless_there(tx, grid_sweep, {"id": _ONLY, "times": 0})
    tx.execute(sa.update(grid_sweep).values(times=grid_sweep.c.times + 1))


_ONLY = 1
_times = sa.func.coalesce(sa.select(grid_sweep.c.times).where(grid_sweep.c.id == _ONLY).scalar_subquery(), 0)
SWEEPS = sa.select(_times).where(~sa.exists(sa.select(discarded_grid.c.key))).scalar_subquery()
"""How many sweeps there were, inside of another query; null where some may have begun without an end. While grids are held, the same
number as some time before says that none was deleted in between."""


_LOCK = 0x57113


BESIDE_OTHERS = sa.func.pg_advisory_xact_lock_shared(_LOCK)
"""`hold_grids` inside of another query of PostgreSQL's."""
_BESIDE_OTHERS, _ALONE = sa.select(BESIDE_OTHERS), sa.select(sa.func.pg_advisory_xact_lock(_LOCK))


def hold_grids(tx: Transaction, alone: bool) -> None:
    """Who deletes grids holds them alone; who refers to one holds them beside others. On SQLite there is one writer anyway."""
    if tx.dialect.name == "postgresql":
        tx.execute(_ALONE if alone else _BESIDE_OTHERS)
