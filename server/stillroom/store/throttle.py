"""What was tried how often, and when it may be tried again."""

from dataclasses import dataclass
from datetime import datetime

import sqlalchemy as sa

from stillroom.store.database import Transaction, insert_unless_there
from stillroom.store.rows import as_row, columns
from stillroom.store.tables import throttle


@dataclass(frozen=True)
class ThrottleRow:
    count: int
    open_at: datetime
    """Nothing is let through before."""


def lock(tx: Transaction, key: str, now: datetime) -> ThrottleRow:
    """Held until the transaction ends."""
    insert_unless_there(tx, throttle, {"key": key, "count": 0, "open_at": now, "forget_at": now})
    query = sa.select(*columns(throttle, ThrottleRow)).where(throttle.c.key == key).with_for_update()
    return as_row(ThrottleRow, tx.execute(query).one())


def put(tx: Transaction, key: str, count: int, open_at: datetime, forget_at: datetime) -> None:
    values = {"count": count, "open_at": open_at, "forget_at": forget_at}
    tx.execute(sa.update(throttle).where(throttle.c.key == key).values(values))


def take_back(tx: Transaction, key: str, now: datetime) -> None:
    fewer = {"count": sa.case((throttle.c.count > 0, throttle.c.count - 1), else_=0), "open_at": now}
    tx.execute(sa.update(throttle).where(throttle.c.key == key).values(fewer))


def drop(tx: Transaction, key: str) -> None:
    tx.execute(sa.delete(throttle).where(throttle.c.key == key))


def clean(tx: Transaction, now: datetime) -> None:
    """Forgets what is long ago."""
    old = sa.select(throttle.c.key).where(throttle.c.forget_at <= now).limit(100).with_for_update(skip_locked=True)
    tx.execute(sa.delete(throttle).where(throttle.c.key.in_(old)))
