"""The schema: the migrations make what the tables say, and travel with the package."""

import tomllib
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
import sqlalchemy as sa
from alembic import command
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext
from alembic.script import ScriptDirectory

from stillroom.store import migrate
from stillroom.store.database import Database
from stillroom.store.tables import metadata
from tests import postgresql

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
