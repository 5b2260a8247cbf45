"""The schema: the migrations make what the tables say, and travel with the package."""

import tomllib
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import pytest
import sqlalchemy as sa
from alembic import command
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext
from alembic.script import ScriptDirectory

from stillroom.store import maps, migrate, missions, robots
from stillroom.store.database import Database
from stillroom.store.rows import RobotRow
from stillroom.store.tables import metadata, version
from tests import postgresql

DOCUMENT = {"format": 1, "rooms": [{"id": "r1", "name": "Küche"}]}
TOP = Path(__file__).parents[1]


@pytest.fixture
def new_url(engine: str, tmp_path: Path, request: pytest.FixtureRequest, worker_id: str) -> Iterator[str]:
    """Of a database without any table."""
    if engine == "sqlite":
        yield f"sqlite:///{tmp_path / 'new.sqlite'}"
        return
    server: postgresql.Server = request.getfixturevalue("postgresql_server")
    name = f"new_of_{worker_id}"
    server.execute(f"CREATE DATABASE {name}")
    yield server.url(name)
    server.execute(f"DROP DATABASE {name} WITH (FORCE)")


@pytest.fixture
def empty(new_url: str) -> Iterator[Database]:
    database = Database(new_url)
    yield database
    database.dispose()


def test_the_migrations_make_the_tables_that_the_program_knows(empty: Database) -> None:
    with empty.read() as tx:
        assert not migrate.is_current(tx)
    migrate.migrate(empty)
    with empty.read() as tx:
        assert migrate.is_current(tx)
        context = MigrationContext.configure(tx, opts={"compare_type": True})
        assert compare_metadata(context, metadata) == []


def test_every_migration_can_be_undone_and_done_again(empty: Database) -> None:
    steps = [step.revision for step in ScriptDirectory.from_config(migrate.config()).walk_revisions()]
    for revision in reversed(steps):
        migrate.migrate(empty, revision)
    with empty.write() as tx:
        command.downgrade(migrate.config(tx), "base")
        assert set(sa.inspect(tx).get_table_names()) <= {"alembic_version", "sqlite_sequence"}
    migrate.migrate(empty)


def test_what_is_stored_survives_a_migration_down_and_up_again(empty: Database) -> None:
    now = datetime(2026, 11, 22, 8, tzinfo=UTC)
    migrate.migrate(empty)
    with empty.write() as tx:
        robots.add(tx, RobotRow("RB-1", "Hall", None, now), "hash", "")
        of = maps.get_or_add(tx, "RB-1", "ground")
        parked = missions.add(tx, missions.NewMission(of.id, "1", 0, 1, "0" * 64, {}, "1" * 64), now)
        placed = missions.NewMission(of.id, "1~ground", 0, 1, "0" * 64, {}, "1" * 64, parked, "operator")
        missions.add(tx, placed, now)
        before = tx.execute(sa.text("SELECT id, map_id, key, meta_digest FROM mission ORDER BY id")).all()
        maps.add_version(tx, of, new_version(), now)
    with empty.write() as tx:
        command.downgrade(migrate.config(tx), "0001")
    migrate.migrate(empty)
    with empty.read() as tx:
        assert tx.execute(sa.text("SELECT id, map_id, key, meta_digest FROM mission ORDER BY id")).all() == before
        assert maps.by_name(tx, "RB-1", "ground") == replace(of, head=1)
        kept = maps.version_at(tx, of.id, 1)
        assert kept is not None
        assert kept.document == DOCUMENT
        with_keys = sa.inspect(tx).get_unique_constraints("mission")
    assert [unique["column_names"] for unique in with_keys] == [["map_id", "key"]]


def test_versions_that_an_older_program_wrote_are_read_beside_newer_ones(database: Database) -> None:
    now = datetime(2026, 11, 22, 8, tzinfo=UTC)
    with database.write() as tx:
        robots.add(tx, RobotRow("RB-1", "Hall", None, now), "hash", "")
        of = maps.get_or_add(tx, "RB-1", "ground")
        for number in (1, 2):
            assert maps.add_version(tx, replace(of, head=number - 1), new_version(), now) == number
        older = sa.update(version).where(version.c.number == 1)
        tx.execute(older.values(document=DOCUMENT, packed=None))
        for number in (1, 2):
            kept = maps.version_at(tx, of.id, number)
            assert kept is not None
            assert kept.document == DOCUMENT


def new_version() -> maps.NewVersion:
    return maps.NewVersion(None, "created", "1", "robot:RB-1", "0.1.0", "0" * 64, None, None, DOCUMENT, [], {}, {})


def test_servers_that_start_at_once_migrate_once(new_url: str) -> None:
    servers = [Database(new_url) for _ in range(4)]
    with ThreadPoolExecutor(4) as pool:
        list(pool.map(migrate.migrate, servers))
    for server in servers:
        with server.read() as tx:
            assert migrate.is_current(tx)
        server.dispose()


def test_there_is_one_newest_schema() -> None:
    assert len(ScriptDirectory.from_config(migrate.config()).get_heads()) == 1


def test_a_checkout_and_an_installed_package_both_find_the_migrations(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert migrate.folder() == TOP / "migrations"
    (tmp_path / "stillroom" / "migrations").mkdir(parents=True)
    monkeypatch.setattr(migrate, "_PACKAGE", tmp_path / "stillroom")
    assert migrate.folder() == tmp_path / "stillroom" / "migrations"


def test_a_wheel_holds_every_package_and_the_migrations() -> None:
    listed = set(tomllib.loads((TOP / "pyproject.toml").read_text())["tool"]["setuptools"]["packages"])
    server = TOP / "server"
    packages = {".".join(file.parent.relative_to(server).parts) for file in server.glob("stillroom/**/__init__.py")}
    assert listed == packages | {"stillroom.migrations", "stillroom.migrations.versions"}
