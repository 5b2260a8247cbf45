"""Connections: one engine that reads and one that writes, with the same code on SQLite and PostgreSQL."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from sqlite3 import Connection as SqliteConnection
from typing import Any

import sqlalchemy as sa
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.exc import OperationalError
from sqlalchemy.exc import TimeoutError as PoolTimeout

from stillroom.errors import Unavailable

Transaction = sa.Connection
"""One transaction; all queries of the store take one."""

SQLITE_BUSY_MS = 30_000


class Database:
    """`read()` and `write()` open a transaction each. Never open one inside the other: on SQLite only one may write at a time."""

    def __init__(self, url: str) -> None:
        self.url = sa.make_url(url)
        self._is_sqlite = self.url.get_backend_name() == "sqlite"
        if self._is_sqlite and self.url.database:
            Path(self.url.database).parent.mkdir(parents=True, exist_ok=True)
        self._reader = self._engine("BEGIN")
        self._writer = self._engine("BEGIN IMMEDIATE") if self._is_sqlite else self._reader

    def _engine(self, begin: str) -> sa.Engine:
        if not self._is_sqlite:
            return sa.create_engine(self.url, pool_pre_ping=True, pool_size=20)
        # As many connections as handler threads ask for: SQLite's own lock is the queue.
        engine = sa.create_engine(self.url, pool_size=5, max_overflow=-1)
        sa.event.listen(engine, "connect", _prepare_sqlite)
        sa.event.listen(engine, "begin", lambda connection: connection.exec_driver_sql(begin))
        return engine

    @contextmanager
    def read(self) -> Iterator[Transaction]:
        with _unavailable_when_busy(), self._reader.connect() as connection:
            yield connection

    @contextmanager
    def write(self) -> Iterator[Transaction]:
        """Committed durably at the end; rolled back where an error passes through."""
        with _unavailable_when_busy(), self._writer.begin() as connection:
            yield connection

    def dispose(self) -> None:
        self._reader.dispose()
        self._writer.dispose()


def _prepare_sqlite(connection: SqliteConnection, _record: object) -> None:
    connection.isolation_level = None  # the "begin" event decides, not the driver
    for pragma in (
        "journal_mode=WAL",
        "synchronous=FULL",  # what was acknowledged survives power loss
        f"busy_timeout={SQLITE_BUSY_MS}",
        "foreign_keys=ON",
    ):
        connection.execute(f"PRAGMA {pragma}").close()


@contextmanager
def _unavailable_when_busy() -> Iterator[None]:
    try:
        yield
    except (OperationalError, PoolTimeout) as error:
        raise Unavailable("The database does not answer at the moment.") from error


def insert_unless_there(
    tx: Transaction, table: sa.Table, values: Mapping[str, Any] | Sequence[Mapping[str, Any]]
) -> bool:
    """Inserts; a row whose key exists already is left as it is. Whether anything was inserted."""
    insert = (postgresql if tx.dialect.name == "postgresql" else sqlite).insert(table)
    return tx.execute(insert.on_conflict_do_nothing(), values).rowcount > 0


def upsert(tx: Transaction, table: sa.Table, rows: Sequence[Mapping[str, Any]]) -> None:
    """Inserts; a row whose primary key exists already takes the new values."""
    if not rows:
        return
    insert = (postgresql if tx.dialect.name == "postgresql" else sqlite).insert(table)
    keys = [column.name for column in table.primary_key]
    changed = {name: insert.excluded[name] for name in rows[0] if name not in keys}
    tx.execute(insert.on_conflict_do_update(index_elements=keys, set_=changed), rows)
