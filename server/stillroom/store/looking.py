"""Who looked at a robot's maps, and who changed something."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any

import sqlalchemy as sa
from sqlalchemy.dialects import postgresql, sqlite

from stillroom.store.database import Transaction
from stillroom.store.fleet_tables import plan_view
from stillroom.store.privacy_tables import access_log
from stillroom.store.rows import as_row


@dataclass(frozen=True)
class Access:
    robot_id: str
    hour: int
    who: str
    did: str
    what: str
    source: str


@dataclass(frozen=True)
class Entry:
    last_at: datetime
    who: str
    did: str
    what: str
    source: str | None
    times: int


def note(tx: Transaction, access: Access, times: int, now: datetime) -> None:
    """So often since it was noted last; the same within an hour is one row."""
    insert = (postgresql if tx.dialect.name == "postgresql" else sqlite).insert(access_log)
    key = list(vars(access))
    again = {"times": access_log.c.times + insert.excluded.times, "last_at": insert.excluded.last_at}
    tx.execute(
        insert.on_conflict_do_update(index_elements=key, set_=again), vars(access) | {"times": times, "last_at": now}
    )


def entries(tx: Transaction, robot_id: str, before: datetime | None, limit: int) -> Sequence[Entry]:
    """The newest first, looks at floor plans by those who run the service among them."""
    log = sa.select(*(access_log.c[name] for name in ("last_at", "who", "did", "what", "source", "times"))).where(
        access_log.c.robot_id == robot_id
    )
    plans = sa.select(
        plan_view.c.at.label("last_at"),
        plan_view.c.viewer.label("who"),
        sa.literal("plan").label("did"),
        (plan_view.c.map_name + ": " + plan_view.c.what).label("what"),
        sa.null().label("source"),
        sa.literal(1).label("times"),
    ).where(plan_view.c.robot_id == robot_id)
    if before is not None:
        log, plans = log.where(access_log.c.last_at < before), plans.where(plan_view.c.at < before)
    found: list[Any] = []
    for query, at in ((log, access_log.c.last_at), (plans, plan_view.c.at)):
        found += tx.execute(query.order_by(at.desc()).limit(limit)).all()
    newest = sorted(found, key=lambda row: row.last_at, reverse=True)
    return [as_row(Entry, row) for row in newest[:limit]]


def forget(tx: Transaction, before: datetime, limit: int) -> int:
    """What was noted before then; how many rows."""
    old = sa.select(access_log.c.id).where(access_log.c.last_at < before).limit(limit)
    gone: int = tx.execute(sa.delete(access_log).where(access_log.c.id.in_(old))).rowcount
    return gone
