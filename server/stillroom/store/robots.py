"""Robots, and the sessions and sign-in links of people."""

from collections.abc import Sequence
from datetime import datetime

import sqlalchemy as sa

from stillroom.store.database import Transaction, insert_unless_there
from stillroom.store.rows import RobotRow, as_row, as_row_or_none, columns
from stillroom.store.tables import login_link, robot, session

Selection = sa.ColumnElement[bool]
"""A condition that selects robots."""

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
            "claim_code_hash": claim_code_hash,
        },
    )


def get(tx: Transaction, robot_id: str) -> RobotRow | None:
    return as_row_or_none(RobotRow, tx.execute(_ROBOT.where(robot.c.id == robot_id)).first())


def by_token(tx: Transaction, token_hash: str) -> RobotRow | None:
    return as_row_or_none(RobotRow, tx.execute(_ROBOT.where(robot.c.token_hash == token_hash)).first())


def page(tx: Transaction, visible: Selection, after: str, limit: int) -> Sequence[RobotRow]:
    """Robots in order of their ids."""
    query = _ROBOT.where(visible, robot.c.id > after).order_by(robot.c.id).limit(limit)
    return [as_row(RobotRow, row) for row in tx.execute(query)]


def owned_by(owner: str | None) -> Selection:
    """Which robots belong to a person; None: those that belong to nobody yet."""
    return robot.c.owner.is_(None) if owner is None else robot.c.owner == owner


def everything() -> Selection:
    return sa.true()


def is_robot(robot_id: str) -> Selection:
    return robot.c.id == robot_id


def add_login_link(tx: Transaction, link_hash: str, owner: str | None, expires_at: datetime) -> None:
    tx.execute(sa.insert(login_link).values(hash=link_hash, owner=owner, expires_at=expires_at))


def use_login_link(tx: Transaction, link_hash: str, now: datetime) -> tuple[str | None] | None:
    """The link's owner in a tuple, once; None where it was used, has expired or never was."""
    used = (
        sa.update(login_link)
        .where(login_link.c.hash == link_hash, login_link.c.used_at.is_(None), login_link.c.expires_at > now)
        .values(used_at=now)
        .returning(login_link.c.owner)
    )
    row = tx.execute(used).first()
    return None if row is None else (row.owner,)


def add_session(tx: Transaction, session_hash: str, owner: str | None, now: datetime, expires_at: datetime) -> None:
    tx.execute(sa.insert(session).values(hash=session_hash, owner=owner, created_at=now, expires_at=expires_at))


def session_owner(tx: Transaction, session_hash: str, now: datetime) -> tuple[str | None] | None:
    query = sa.select(session.c.owner).where(session.c.hash == session_hash, session.c.expires_at > now)
    row = tx.execute(query).first()
    return None if row is None else (row.owner,)


def end_session(tx: Transaction, session_hash: str) -> None:
    tx.execute(sa.delete(session).where(session.c.hash == session_hash))
