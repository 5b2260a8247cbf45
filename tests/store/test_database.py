"""Connections: durable, readers never in the way, and what one commits is told to those who wait."""

import threading
from datetime import UTC, datetime, timedelta, timezone
from pathlib import Path
from typing import Any

import pytest
import sqlalchemy as sa

from stillroom.errors import Unavailable
from stillroom.settings import Settings
from stillroom.store import database as database_module
from stillroom.store import robots
from stillroom.store.database import Database
from stillroom.store.rows import RobotRow


def row(robot_id: str, at: datetime | None = None) -> RobotRow:
    return RobotRow(robot_id, robot_id, None, at or datetime.now(UTC))


def add(database: Database, robot_id: str) -> bool:
    with database.write() as tx:
        return robots.add(tx, row(robot_id), f"token of {robot_id}", "")


@pytest.mark.parametrize("durable", [True, False])
def test_commits_are_durable_unless_asked_not_to_be(database: Database, durable: bool) -> None:
    with database.write(durable=durable) as tx:
        if database.is_postgresql:
            assert tx.execute(sa.text("SHOW synchronous_commit")).scalar() == ("on" if durable else "off")
        else:
            assert tx.execute(sa.text("PRAGMA synchronous")).scalar() == (2 if durable else 1)  # FULL, NORMAL
            assert tx.execute(sa.text("PRAGMA journal_mode")).scalar() == "wal"
            assert tx.execute(sa.text("PRAGMA foreign_keys")).scalar() == 1
    if database.is_postgresql:
        with database.write() as tx:  # the same connection again
            assert tx.execute(sa.text("SHOW synchronous_commit")).scalar() == "on"


def test_readers_do_not_wait_for_writers(database: Database) -> None:
    with database.write() as tx:
        robots.add(tx, row("RB-1"), "t", "")
        with database.read() as reader:
            assert robots.get(reader, "RB-1") is None
    with database.read() as reader:
        assert robots.get(reader, "RB-1") is not None


def test_an_error_undoes_the_whole_transaction(database: Database) -> None:
    def fail() -> None:
        with database.write() as tx:
            robots.add(tx, row("RB-1"), "t", "")
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    assert add(database, "RB-1")
    assert not add(database, "RB-1")


def test_all_that_a_reader_sees_is_of_one_moment(database: Database) -> None:
    with database.read() as reader:
        assert robots.get(reader, "RB-1") is None
        assert add(database, "RB-1")
        assert robots.get(reader, "RB-1") is None


def test_who_only_looks_sees_what_was_committed_meanwhile(database: Database) -> None:
    if not database.is_postgresql:
        pytest.skip("readers of SQLite cost nothing more")
    with database.look() as tx:
        assert robots.get(tx, "RB-1") is None
        assert add(database, "RB-1")
        assert robots.get(tx, "RB-1") is not None


def test_a_reader_cannot_write(database: Database) -> None:
    with pytest.raises((sa.exc.DBAPIError, Unavailable)), database.read() as tx:
        robots.add(tx, row("RB-1"), "t", "")


def test_a_writer_that_waits_too_long_is_told_that_the_database_is_busy(
    settings: Settings, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(database_module, "PATIENCE_MS", 50)
    patient, hasty = Database(settings.database_url), Database(settings.database_url)
    with patient.write() as tx:
        robots.add(tx, row("RB-1"), "t", "")
        with pytest.raises(Unavailable):
            add(hasty, "RB-1")
        tx.rollback()
    assert add(hasty, "RB-1")
    patient.dispose()
    hasty.dispose()


def test_many_writers_at_once_all_get_their_turn(database: Database) -> None:
    threads = [threading.Thread(target=add, args=(database, f"RB-{n}")) for n in range(20)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    with database.read() as tx:
        assert len(robots.page(tx, robots.owned_by(None), "", 100)) == 20


@pytest.mark.parametrize("zone", [UTC, timezone(timedelta(hours=5, minutes=30))])
def test_moments_come_back_in_utc(database: Database, zone: timezone) -> None:
    moment = datetime(2026, 11, 22, 8, 0, 0, 123456, tzinfo=zone)
    with database.write() as tx:
        robots.add(tx, row("RB-1", moment), "t", "")
        found = robots.get(tx, "RB-1")
    assert found is not None
    assert found.created_at == moment
    assert found.created_at.utcoffset() == timedelta(0)


def test_the_folder_of_a_new_database_is_made(tmp_path: Path) -> None:
    database = Database(f"sqlite:///{tmp_path / 'a' / 'b' / 'new.sqlite'}")
    with database.write() as tx:
        assert tx.execute(sa.text("SELECT 1")).scalar() == 1
    database.dispose()


def test_json_comes_out_as_it_went_in_whatever_robots_put_there(database: Database) -> None:
    said: dict[str, Any] = {
        "é": "\ud83d",
        "nul": "a\0b",
        "numbers": [1, 1.0, -0.0, 1e-7, 10**30],
        "deep": [[[[{}]]]],
        "nothing": None,
    }
    with database.write() as tx:
        found = tx.execute(sa.select(sa.type_coerce(sa.literal(said, sa.JSON), sa.JSON))).scalar_one()
        plain = tx.execute(sa.select(sa.literal({"word": "ß", "x": 0.1}, sa.JSON))).scalar_one()
    assert found == said
    assert list(map(type, found["numbers"])) == [int, float, float, float, int]
    assert plain == {"word": "ß", "x": 0.1}
