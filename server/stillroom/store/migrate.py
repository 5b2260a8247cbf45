"""Brings a database to the newest schema. The steps lie in `migrations/` beside `server/`, and inside an installed package."""

from functools import cache
from pathlib import Path

import sqlalchemy as sa
from alembic import command
from alembic.config import Config
from alembic.runtime.migration import MigrationContext
from alembic.script import ScriptDirectory

from stillroom.store.database import Database, Transaction

_PACKAGE = Path(__file__).parents[1]
_LOCK = 0x57114
"""On PostgreSQL, whoever migrates holds it."""


def folder() -> Path:
    """A wheel carries the steps as `stillroom/migrations`; a checkout (editable install) has them at its top."""
    inside = _PACKAGE / "migrations"
    return inside if inside.is_dir() else _PACKAGE.parents[1] / "migrations"


def config(connection: sa.Connection | None = None) -> Config:
    settings = Config()
    settings.set_main_option("script_location", str(folder()))
    settings.attributes["connection"] = connection
    return settings


def migrate(database: Database, revision: str = "head") -> None:
    """All steps in one transaction, so that two servers that start at once don't both make tables."""
    with database.write() as tx:
        if database.is_postgresql:
            tx.execute(sa.select(sa.func.pg_advisory_xact_lock(_LOCK)))
        if not _is_newer(MigrationContext.configure(tx).get_current_revision()):
            command.upgrade(config(tx), revision)


def is_current(tx: Transaction) -> bool:
    """Whether the database is at the newest schema that this program knows, or at a newer one.

    A newer one has what this program needs: what is taken away is taken away a version later (docs/operations.md).
    """
    found = MigrationContext.configure(tx).get_current_revision()
    return found == _known()[0] or _is_newer(found)


def _is_newer(revision: str | None) -> bool:
    return revision is not None and revision not in _known()


@cache
def _known() -> tuple[str, ...]:
    """All steps, the newest first."""
    return tuple(step.revision for step in ScriptDirectory.from_config(config()).walk_revisions())
