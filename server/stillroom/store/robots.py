"""Robots: whose they are, and how they change hands."""

from collections.abc import Mapping, Sequence
from typing import Any

import sqlalchemy as sa

from stillroom.store.database import Transaction, insert_unless_there
from stillroom.store.rows import RobotRow, as_row, as_row_or_none, columns
from stillroom.store.tables import account, map_, membership, metadata, robot

Selection = sa.ColumnElement[bool]
"""A condition that selects robots."""

ALL = 2**31 - 1

_ROBOT = sa.select(*columns(robot, RobotRow))


def add(tx: Transaction, row: RobotRow, token_hash: str, claim_code_hash: str) -> bool:
    """Whether it was added; False where the id exists."""
    return insert_unless_there(
        tx,
        robot,
        {
            "id": row.id,
            "name": row.name,
            "owner": row.owner,
            "created_at": row.created_at,
            "token_hash": token_hash,
            "token_made_at": None if row.kept_from else row.created_at,
            "kept_from": row.kept_from,
            "claim_code_hash": claim_code_hash,
        },
    )


# Statements of every mission are made once: making one takes as long as running it.
_BY_ID = _ROBOT.where(robot.c.id == sa.bindparam("robot_id"))
_BY_TOKEN = sa.select(robot.c.id, robot.c.released_at.is_not(None)).where(
    robot.c.token_hash == sa.bindparam("token_hash")
)


def get(tx: Transaction, robot_id: str) -> RobotRow | None:
    return as_row_or_none(RobotRow, tx.execute(_BY_ID, {"robot_id": robot_id}).first())


def by_token(tx: Transaction, token_hash: str) -> tuple[str, bool] | None:
    """Its id, and whether its owner gave it up and nobody has claimed it since."""
    found = tx.execute(_BY_TOKEN, {"token_hash": token_hash}).first()
    return None if found is None else (found[0], bool(found[1]))


def of_map(tx: Transaction, map_id: int) -> RobotRow | None:
    query = _ROBOT.join(map_, map_.c.robot_id == robot.c.id).where(map_.c.id == map_id)
    return as_row_or_none(RobotRow, tx.execute(query).first())


def page(tx: Transaction, visible: Selection, after: str, limit: int) -> Sequence[RobotRow]:
    """Robots in order of their ids."""
    query = _ROBOT.where(visible, robot.c.id > after).order_by(robot.c.id).limit(limit)
    return [as_row(RobotRow, row) for row in tx.execute(query)]


def owned_by(owner: str | None) -> Selection:
    """Which robots belong to a person; None: those that belong to nobody yet."""
    return robot.c.owner.is_(None) if owner is None else robot.c.owner == owner


def in_homes_of(email: str) -> Selection:
    """Which robots belong to homes that a person is a member or a viewer of."""
    return robot.c.owner.in_(sa.select(membership.c.home).where(membership.c.email == email))


def registered() -> Selection:
    """Without what owners kept of robots that they gave up."""
    return robot.c.kept_from.is_(None)


def kept() -> Selection:
    """What owners kept of robots that they gave up."""
    return robot.c.kept_from.is_not(None)


def count(tx: Transaction, which: Selection) -> int:
    return tx.execute(sa.select(sa.func.count()).select_from(robot).where(which)).scalar_one()


def any_of(selections: Sequence[Selection]) -> Selection:
    return sa.or_(sa.false(), *selections)


def everything() -> Selection:
    return sa.true()


def is_robot(robot_id: str) -> Selection:
    return robot.c.id == robot_id


def by_claim_code(tx: Transaction, claim_code_hash: str) -> RobotRow | None:
    """One that nobody owns; held until the transaction ends."""
    theirs = robot.c.claim_code_hash == claim_code_hash, robot.c.owner.is_(None)
    return as_row_or_none(RobotRow, tx.execute(_ROBOT.where(*theirs).with_for_update()).first())


def lock(tx: Transaction, robot_id: str) -> RobotRow | None:
    """Held until the transaction ends."""
    return as_row_or_none(RobotRow, tx.execute(_ROBOT.where(robot.c.id == robot_id).with_for_update()).first())


def change(tx: Transaction, robot_id: str, values: Mapping[str, Any]) -> None:
    tx.execute(sa.update(robot).where(robot.c.id == robot_id).values(dict(values)))


def hand_over(tx: Transaction, robot_id: str, kept: str) -> None:
    """All that is known of a robot is from now on known of another one, whatever table it is in."""
    columns_of_robots = [
        column
        for table in metadata.sorted_tables
        for column in table.columns
        if any(key.column is robot.c.id for key in column.foreign_keys)
    ]
    for column in columns_of_robots:
        tx.execute(sa.update(column.table).where(column == robot_id).values({column.name: kept}))


def remove(tx: Transaction, robot_id: str) -> None:
    """One that nothing refers to."""
    tx.execute(sa.delete(robot).where(robot.c.id == robot_id))


def map_ids(tx: Transaction, robot_id: str) -> Sequence[int]:
    return tx.execute(sa.select(map_.c.id).where(map_.c.robot_id == robot_id).order_by(map_.c.id)).scalars().all()


def followers() -> sa.Subquery:
    """All whose streams of events show the robot `of_robot`, by `name`, in a fixed order; "" is whoever looks after what is nobody's."""
    this = robot.c.id == sa.bindparam("of_robot")
    owner = sa.select(sa.func.coalesce(robot.c.owner, "").label("name")).where(this)
    members = sa.select(membership.c.email).join(robot, robot.c.owner == membership.c.home).where(this)
    nobodys = sa.exists(sa.select(robot.c.id).where(this, robot.c.owner.is_(None)))
    operators = sa.select(account.c.email).where(account.c.duty == "operator", nobodys)
    return sa.union(owner, members, operators).order_by("name").subquery()
