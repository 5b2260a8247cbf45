"""Connections: one engine that reads and one that writes, with the same code on SQLite and PostgreSQL."""

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from sqlite3 import Connection as SqliteConnection
from time import monotonic
from typing import Any

import sqlalchemy as sa
from pydantic_core import from_json, to_json
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.engine.interfaces import IsolationLevel
from sqlalchemy.exc import DisconnectionError, InterfaceError, NoResultFound, OperationalError
from sqlalchemy.exc import TimeoutError as PoolTimeout

from stillroom.errors import NotFound, Unavailable
from stillroom.store.hints import CHANNEL, Hint, encode

Transaction = sa.Connection
"""One transaction; all queries of the store take one."""

PATIENCE_MS = 30_000
"""How long a transaction waits for another's lock."""
_CONNECT_S = 10
_RESTED_S = 5.0
"""A connection that was not used for so long may have been cut."""


class Database:
    """`read()` and `write()` open a transaction each. Never open one inside the other: on SQLite only one may write at a time.

    `hear` is told what each commit of this process changed. On PostgreSQL nobody is told directly: the database itself
    carries hints to all processes that listen (`store.listening`).
    """

    def __init__(self, url: str, hear: Callable[[Hint], None] = lambda _hint: None) -> None:
        self.url = _with_driver(sa.make_url(url))
        self.is_postgresql = self.url.get_backend_name() == "postgresql"
        if self.is_postgresql:
            # All statements of a reader see one moment; writers lock first and then look, so each statement sees the newest.
            self._writer: sa.Engine = _postgresql_engine(self.url)
            self._relaxed_writer: sa.Engine = self._writer
            self._reader: sa.Engine = self._writer.execution_options(
                isolation_level="REPEATABLE READ", postgresql_readonly=True
            )
            # Connections of its own: to change one's isolation and change it back takes as long as a statement.
            self._looker: sa.Engine = _postgresql_engine(self.url, "AUTOCOMMIT", kept=10)
        else:
            if self.url.database:
                Path(self.url.database).parent.mkdir(parents=True, exist_ok=True)
            self._reader = _sqlite_engine(self.url, "BEGIN", "query_only=ON")
            self._writer = _sqlite_engine(self.url, "BEGIN IMMEDIATE", "synchronous=FULL")
            self._relaxed_writer = _sqlite_engine(self.url, "BEGIN IMMEDIATE", "synchronous=NORMAL")
            self._looker = self._reader
        self._hear = hear

    @contextmanager
    def read(self) -> Iterator[Transaction]:
        """All statements see the same moment."""
        with _unavailable_when_busy(), self._reader.connect() as connection:
            yield connection

    @contextmanager
    def look(self) -> Iterator[Transaction]:
        """To read with one statement, or with some of which each may see another moment: a third of the way to the database and back."""
        with _unavailable_when_busy(), self._looker.connect() as connection:
            yield connection

    @contextmanager
    def write(self, durable: bool = True) -> Iterator[Transaction]:
        """Committed at the end; rolled back where an error passes through.

        `durable`: a commit has reached the disk when this returns. Without, a power loss may undo it, though never a part of it
        and never one that was seen by a durable one.
        """
        engine = self._writer if durable else self._relaxed_writer
        with _unavailable_when_busy(), engine.begin() as connection:
            hints: dict[Hint, None] = {}
            connection.info[_HINTS] = hints
            if self.is_postgresql and not durable:
                connection.execute(sa.text("SET LOCAL synchronous_commit TO off"))
            yield connection
        self._tell(list(hints))

    def _tell(self, hints: Sequence[Hint]) -> None:
        if not self.is_postgresql:
            for hint in hints:
                self._hear(hint)
        elif hints:
            # Not inside of the transaction that it tells of: commits that notify wait for each other's disk, one after the other.
            with suppress(OperationalError, PoolTimeout), self._looker.connect() as connection:
                connection.execute(_NOTIFY, {"channel": CHANNEL, "hints": [encode(hint) for hint in hints]})

    @contextmanager
    def listening(self, hear: Callable[[Hint], None], caught_up: Callable[[], None]) -> Iterator[None]:
        """Within the block, what other processes commit is heard; `caught_up` is called whenever some may have been missed.

        On SQLite all processes of the service descend from one and tell each other.
        """
        if not self.is_postgresql:
            yield
            return
        from stillroom.store.listening import Listener  # needs PostgreSQL's driver

        listener = Listener(self.url, hear, caught_up)
        try:
            yield
        finally:
            listener.stop()

    def dispose(self) -> None:
        for engine in {self._reader, self._writer, self._relaxed_writer, self._looker}:
            engine.dispose()


_HINTS = "stillroom_hints"
_NOTIFY = sa.text(
    "SELECT set_config('synchronous_commit', 'off', true), pg_notify(:channel, hint) FROM unnest(CAST(:hints AS text[])) AS hint"
)


def tell(tx: Transaction, hint: Hint) -> None:
    """Tells those who wait, once `tx` is committed."""
    hints: dict[Hint, None] = tx.info[_HINTS]
    hints[hint] = None


def _with_driver(url: sa.URL) -> sa.URL:
    """PostgreSQL's URLs name no driver (postgres://…, postgresql://…); this program has one."""
    return url.set(drivername="postgresql+psycopg") if url.drivername in ("postgres", "postgresql") else url


def _dump(value: Any) -> str:
    """Several times as fast as `json`, which alone knows halves of characters: robots may send those."""
    try:
        return to_json(value).decode()
    except ValueError:
        return json.dumps(value)


def _load(text: str | bytes) -> Any:
    try:
        return from_json(text)
    except ValueError:
        return json.loads(text)


_JSON: Mapping[str, Any] = {"json_serializer": _dump, "json_deserializer": _load}


def _sqlite_engine(url: sa.URL, begin: str, pragma: str) -> sa.Engine:
    # As many connections as handler threads ask for: SQLite's own lock is the queue.
    engine = sa.create_engine(url, pool_size=5, max_overflow=-1, **_JSON)

    def prepare(connection: SqliteConnection, _record: object) -> None:
        connection.isolation_level = None  # the "begin" event decides, not the driver
        for setting in ("journal_mode=WAL", f"busy_timeout={PATIENCE_MS}", "foreign_keys=ON", pragma):
            connection.execute(f"PRAGMA {setting}").close()

    sa.event.listen(engine, "connect", prepare)
    sa.event.listen(engine, "begin", lambda connection: connection.exec_driver_sql(begin))
    return engine


def _postgresql_engine(url: sa.URL, isolation: IsolationLevel = "READ COMMITTED", kept: int = 20) -> sa.Engine:
    """`kept`: connections that stay; in a rush there are twice as many."""
    connect = {} if "connect_timeout" in url.query else {"connect_timeout": _CONNECT_S}
    engine = sa.create_engine(
        url,
        pool_size=kept,
        max_overflow=kept,
        pool_use_lifo=True,  # the one that was used last knows its statements best
        connect_args=connect,
        isolation_level=isolation,
        skip_autocommit_rollback=True,
        **_JSON,
    )

    def prepare(connection: Any, _record: object) -> None:
        connection.execute(f"SET lock_timeout = {PATIENCE_MS}")
        connection.commit()

    def rest(_connection: Any, record: Any) -> None:
        record.info["rests_since"] = monotonic()

    def look(connection: Any, record: Any, _proxy: object) -> None:
        # Every time would cost each transaction one more round trip.
        if monotonic() - record.info.get("rests_since", monotonic()) > _RESTED_S:
            try:
                engine.dialect.do_ping(connection)
            except engine.dialect.loaded_dbapi.Error as error:
                raise DisconnectionError from error

    for name, listener in (("connect", prepare), ("checkin", rest), ("checkout", look)):
        sa.event.listen(engine, name, listener)
    return engine


@contextmanager
def _unavailable_when_busy() -> Iterator[None]:
    try:
        yield
    except NoResultFound as error:
        raise NotFound("It was deleted meanwhile.") from error
    except (OperationalError, InterfaceError, PoolTimeout) as error:
        raise Unavailable("The database does not answer at the moment.") from error


def insert_unless_there(tx: Transaction, table: sa.Table, values: Mapping[str, Any]) -> bool:
    """Inserts; a row whose key exists already is left as it is. Whether it was inserted."""
    insert = (postgresql if tx.dialect.name == "postgresql" else sqlite).insert(table)
    added = insert.on_conflict_do_nothing().returning(*table.primary_key.columns)
    return tx.execute(added, values).first() is not None


def upsert(tx: Transaction, table: sa.Table, rows: Sequence[Mapping[str, Any]]) -> None:
    """Inserts; a row whose primary key exists already takes the new values."""
    if not rows:
        return
    insert = (postgresql if tx.dialect.name == "postgresql" else sqlite).insert(table)
    keys = [column.name for column in table.primary_key]
    changed = {name: insert.excluded[name] for name in rows[0] if name not in keys}
    tx.execute(insert.on_conflict_do_update(index_elements=keys, set_=changed), rows)
