"""What time it is: by the database's clock where several machines share it, else by this machine's."""

import time
from datetime import UTC, datetime

import sqlalchemy as sa

from stillroom.store.database import Transaction
from stillroom.store.tables import UtcDateTime


def now(tx: Transaction) -> datetime:
    if tx.dialect.name != "postgresql":
        return datetime.now(UTC)
    moment: datetime = tx.execute(sa.select(sa.func.clock_timestamp())).scalar_one()
    return moment.astimezone(UTC)


def moment(tx: Transaction) -> sa.ColumnElement[datetime]:
    """`now` inside of another query."""
    if tx.dialect.name != "postgresql":
        return sa.literal(datetime.now(UTC), UtcDateTime)
    return sa.func.clock_timestamp(type_=UtcDateTime)


def seconds(tx: Transaction) -> sa.ColumnElement[float]:
    """Since 1970, for use inside a query."""
    if tx.dialect.name != "postgresql":
        return sa.literal(time.time(), sa.Double)
    # Of the statement and not of the moment, so that an index can be searched by it.
    return sa.cast(sa.extract("epoch", sa.func.statement_timestamp()), sa.Double)
