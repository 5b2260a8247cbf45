"""Who may look at floor plans that are not theirs, and each time that somebody did."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any

import sqlalchemy as sa

from stillroom.store.database import Transaction, insert_unless_there
from stillroom.store.fleet_tables import plan_grant, plan_view, test_robot
from stillroom.store.robots import Selection
from stillroom.store.rows import as_row, as_row_or_none, columns
from stillroom.store.tables import robot


@dataclass(frozen=True)
class NewGrant:
    key: str
    robot_id: str
    asked_by: str
    reason: str
    hours: int
    asked_at: datetime
    expires_at: datetime


@dataclass(frozen=True)
class GrantRow:
    id: int
    key: str
    robot_id: str
    asked_by: str
    reason: str
    hours: int
    asked_at: datetime
    answered_at: datetime | None
    answered_by: str | None
    expires_at: datetime
    """Until then it can be answered; once it is granted, until then it holds."""
    granted: bool | None
    ended_at: datetime | None
    ended_by: str | None

    def is_open(self, now: datetime) -> bool:
        return self.granted is None and self.ended_at is None and self.expires_at > now

    def holds(self, now: datetime) -> bool:
        return self.granted is True and self.ended_at is None and self.expires_at > now


@dataclass(frozen=True)
class NewView:
    robot_id: str
    map_name: str
    mission: str
    viewer: str
    what: str
    why: str
    grant_id: int | None
    at: datetime


@dataclass(frozen=True)
class ViewRow:
    id: int
    robot_id: str
    map_name: str
    mission: str
    viewer: str
    what: str
    why: str
    at: datetime
    grant: str | None


_GRANT = sa.select(*columns(plan_grant, GrantRow))


def add(tx: Transaction, new: NewGrant) -> None:
    tx.execute(sa.insert(plan_grant).values(vars(new)))


def by_key(tx: Transaction, key: str) -> GrantRow | None:
    return as_row_or_none(GrantRow, tx.execute(_GRANT.where(plan_grant.c.key == key)).first())


def lock(tx: Transaction, key: str) -> GrantRow | None:
    """Until the end of the transaction nobody else answers it."""
    return as_row_or_none(GrantRow, tx.execute(_GRANT.where(plan_grant.c.key == key).with_for_update()).first())


def change(tx: Transaction, grant_id: int, values: Mapping[str, Any]) -> None:
    tx.execute(sa.update(plan_grant).where(plan_grant.c.id == grant_id).values(**values))


def of_robot(tx: Transaction, robot_id: str, now: datetime) -> Sequence[GrantRow]:
    """Those that are open or hold, the newest first."""
    mine = plan_grant.c.robot_id == robot_id, plan_grant.c.ended_at.is_(None), plan_grant.c.expires_at > now
    return [as_row(GrantRow, row) for row in tx.execute(_GRANT.where(*mine).order_by(plan_grant.c.id.desc()))]


def page(tx: Transaction, of: Selection, before: int | None, limit: int) -> Sequence[GrantRow]:
    """The newest first; `of`: a condition on robots."""
    query = _GRANT.join(robot, robot.c.id == plan_grant.c.robot_id).where(of)
    if before is not None:
        query = query.where(plan_grant.c.id < before)
    return [as_row(GrantRow, row) for row in tx.execute(query.order_by(plan_grant.c.id.desc()).limit(limit))]


def log(tx: Transaction, view: NewView) -> None:
    tx.execute(sa.insert(plan_view).values(vars(view)))


def views(tx: Transaction, robot_id: str, before: int | None, limit: int) -> Sequence[ViewRow]:
    """The newest first."""
    query = (
        sa.select(*columns(plan_view, ViewRow, "grant"), plan_grant.c.key.label("grant"))
        .outerjoin(plan_grant, plan_grant.c.id == plan_view.c.grant_id)
        .where(plan_view.c.robot_id == robot_id)
        .order_by(plan_view.c.id.desc())
        .limit(limit)
    )
    if before is not None:
        query = query.where(plan_view.c.id < before)
    return [as_row(ViewRow, row) for row in tx.execute(query)]


def is_test(tx: Transaction, robot_id: str) -> bool:
    return tx.execute(sa.select(test_robot.c.robot_id).where(test_robot.c.robot_id == robot_id)).first() is not None


def mark_test(tx: Transaction, robot_id: str, marked_by: str, now: datetime) -> None:
    insert_unless_there(tx, test_robot, {"robot_id": robot_id, "marked_by": marked_by, "marked_at": now})


def unmark_test(tx: Transaction, robot_id: str) -> None:
    tx.execute(sa.delete(test_robot).where(test_robot.c.robot_id == robot_id))
