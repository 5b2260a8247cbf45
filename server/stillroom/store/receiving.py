"""What an upload asks the database, in as few statements as it takes: each costs as much as checking the grid."""

from dataclasses import fields
from typing import Any

import sqlalchemy as sa
from sqlalchemy.dialects import postgresql, sqlite

from stillroom.store import clock, erasing
from stillroom.store.database import Transaction, tell
from stillroom.store.hints import Hint
from stillroom.store.missions import QUEUED, NewMission
from stillroom.store.tables import lane, map_, mission, robot

_named = sa.select(map_.c.id).where(
    map_.c.robot_id == sa.bindparam("robot_id"), map_.c.name == sa.bindparam("map_name")
)
_AWAKE = (
    sa.update(lane)
    .where(lane.c.map_id == _named.scalar_subquery())
    .values(ready_at=sa.func.coalesce(lane.c.ready_at, clock.SECONDS))
)
_OPEN = {
    "postgresql": _AWAKE.returning(lane.c.map_id, erasing.BESIDE_OTHERS),
    "sqlite": _AWAKE.returning(lane.c.map_id),
}


def open_lane(tx: Transaction, robot_id: str, map_name: str) -> int | None:
    """Locks and wakes the lane of the map of that name, and holds grids beside others (`erasing.hold_grids`): who deletes grids waits
    for no lane, so that their order does not matter. The map's number; None where there is no such map."""
    names = {"robot_id": robot_id, "map_name": map_name}
    map_id: int | None = tx.execute(_OPEN[tx.dialect.name], names).scalar()
    if map_id is not None:
        tell(tx, Hint("work", map_id))
    return map_id


def _adding(insert: Any) -> sa.Executable:
    names = [field.name for field in fields(NewMission)]
    values = [sa.bindparam(f"new_{name}", type_=mission.c[name].type) for name in names]
    first = [sa.literal(value, mission.c[name].type) for name, value in QUEUED.items()]
    if_still_theirs = (
        sa.select(*values, *first, clock.MOMENT)
        .join_from(map_, robot, robot.c.id == map_.c.robot_id)
        .where(map_.c.id == sa.bindparam("new_map_id"), robot.c.id == sa.bindparam("sender"))
        .where(robot.c.released_at.is_(None))
    )
    into = insert(mission).from_select([*names, *QUEUED, "received_at"], if_still_theirs)
    added: sa.Executable = into.on_conflict_do_nothing().returning(mission.c.id, erasing.SWEEPS)
    return added


_ADD = {"postgresql": _adding(postgresql.insert), "sqlite": _adding(sqlite.insert)}


def add_mission(tx: Transaction, new: NewMission, robot_id: str) -> tuple[int, int | None] | None:
    """Its number, received now, and `erasing.SWEEPS`; None where the map has one of that id, or is not this robot's any more, which
    waits for the lane."""
    values = {f"new_{name}": value for name, value in vars(new).items()} | {"sender": robot_id}
    made = tx.execute(_ADD[tx.dialect.name], values).first()
    return None if made is None else (made[0], made[1])
