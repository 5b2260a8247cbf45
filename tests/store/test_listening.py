"""Hints between processes that share a PostgreSQL."""

import threading
from collections.abc import Iterator
from queue import Queue

import pytest
import sqlalchemy as sa

from stillroom.store import listening
from stillroom.store.database import Database, tell
from stillroom.store.hints import Hint, decode, encode
from tests import postgresql

PATIENCE_S = 30.0


class Ear:
    """Remembers what it was told."""

    def __init__(self) -> None:
        self.hints: Queue[Hint] = Queue()
        self.caught_up = threading.Semaphore(0)

    def next(self) -> Hint:
        return self.hints.get(timeout=PATIENCE_S)


@pytest.fixture
def shared(postgresql_url: str) -> Iterator[Database]:
    database = Database(postgresql_url)
    yield database
    database.dispose()


@pytest.fixture
def ear(shared: Database, monkeypatch: pytest.MonkeyPatch) -> Iterator[Ear]:
    """Listens."""
    monkeypatch.setattr(listening, "RETRY_S", 0.05)
    listens = Ear()
    with shared.listening(listens.hints.put, listens.caught_up.release):
        assert listens.caught_up.acquire(timeout=PATIENCE_S)
        yield listens


def test_what_a_process_commits_is_heard_by_the_others(shared: Database, ear: Ear) -> None:
    with shared.write() as tx:
        tell(tx, Hint("work", 7))
        tell(tx, Hint("changed", 8))
    assert [ear.next(), ear.next()] == [Hint("work", 7), Hint("changed", 8)]


def test_what_was_undone_is_not_told(shared: Database, ear: Ear) -> None:
    def fail() -> None:
        with shared.write() as tx:
            tell(tx, Hint("changed", 1))
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    with shared.write() as tx:
        tell(tx, Hint("changed", 2))
    assert ear.next() == Hint("changed", 2)


def test_hints_of_another_program_are_passed_over(shared: Database, ear: Ear) -> None:
    with shared.write() as tx:
        for payload in ("", "changed", "changed x", "rollout 3"):
            tx.execute(sa.select(sa.func.pg_notify("stillroom", payload)))
        tell(tx, Hint("changed", 3))
    assert ear.next() == Hint("changed", 3)


def test_a_listener_that_lost_its_connection_connects_again_and_catches_up(shared: Database, ear: Ear) -> None:
    listeners = "FROM pg_stat_activity WHERE datname = current_database() AND query = 'LISTEN stillroom'"
    with shared.write() as tx:
        assert tx.execute(sa.text(f"SELECT pg_terminate_backend(pid) {listeners}")).scalars().all() == [True]
    assert ear.caught_up.acquire(timeout=PATIENCE_S)
    with shared.write() as tx:
        tell(tx, Hint("work", 4))
    assert ear.next() == Hint("work", 4)


def test_a_database_that_is_not_there_yet_is_waited_for(
    postgresql_server: postgresql.Server, monkeypatch: pytest.MonkeyPatch, worker_id: str
) -> None:
    monkeypatch.setattr(listening, "RETRY_S", 0.05)
    name, listens = f"later_of_{worker_id}", Ear()
    database = Database(postgresql_server.url(name))
    with database.listening(listens.hints.put, listens.caught_up.release):
        postgresql_server.execute(f"CREATE DATABASE {name}")
        assert listens.caught_up.acquire(timeout=PATIENCE_S)
    postgresql_server.execute(f"DROP DATABASE {name} WITH (FORCE)")


@pytest.mark.parametrize("engine", ["sqlite"])
def test_on_sqlite_a_process_hears_its_own_commits(database_url: str) -> None:
    listens = Ear()
    database = Database(database_url, listens.hints.put)
    with database.listening(listens.hints.put, listens.caught_up.release):
        for durable in (True, False):
            with database.write(durable=durable) as tx:
                tell(tx, Hint("changed", 5))
                assert listens.hints.empty()
            assert listens.hints.get_nowait() == Hint("changed", 5)
    database.dispose()


@pytest.mark.parametrize("hint", [Hint("work", 1), Hint("changed", 2**40)])
def test_a_hint_is_one_line(hint: Hint) -> None:
    assert decode(encode(hint)) == hint
    assert "\n" not in encode(hint)
