"""Run by alembic. The connection comes from `stillroom.store.migrate`, or for `alembic revision` from the settings."""

from alembic import context

from stillroom.settings import Settings
from stillroom.store import fleet_tables, privacy_tables  # noqa: F401  # tables of their own, of the same metadata
from stillroom.store.database import Database
from stillroom.store.tables import metadata


def run() -> None:
    connection = context.config.attributes.get("connection")
    if connection is not None:
        context.configure(connection=connection, target_metadata=metadata, render_as_batch=True, compare_type=True)
        with context.begin_transaction():
            context.run_migrations()
        return
    with Database(Settings.from_environment().database_url).write() as tx:
        context.configure(connection=tx, target_metadata=metadata, render_as_batch=True, compare_type=True)
        context.run_migrations()


run()
