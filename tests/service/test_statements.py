"""What one mission asks the database: each statement costs as much as a tenth of a registration."""

from collections.abc import Iterator
from contextlib import contextmanager

import sqlalchemy as sa

from stillroom.service.processing import process_next
from tests.conftest import RobotCaller, Service
from tests.homes import home

RECEIVED = 5 + 2
"""Statements of an upload that is answered at once, its token and its document included; two are about the queue, which is looked at
once a second.
"""
PROCESSED = {"postgresql": 5, "sqlite": 15}
"""Of processing it: SQLite changes one table after the other."""


@contextmanager
def asked() -> Iterator[list[str]]:
    """The statements of the block, but for those that begin and end transactions."""
    statements: list[str] = []

    def note(_connection: object, _cursor: object, statement: str, *_rest: object) -> None:
        if statement.startswith(("SELECT", "INSERT", "UPDATE", "DELETE", "WITH")):
            statements.append(statement)

    sa.event.listen(sa.Engine, "before_cursor_execute", note)
    try:
        yield statements
    finally:
        sa.event.remove(sa.Engine, "before_cursor_execute", note)


def test_a_mission_asks_the_database_no_more_than_it_must(service: Service, mapped: RobotCaller) -> None:
    mapped.upload("1", home(shift=(1, 0)), base_version=1)
    service.worker.paused = True
    with asked() as received:
        mapped.upload("2", home(shift=(1, 0)), base_version=2, wait=None)
    assert len(received) <= RECEIVED, "\n".join(received)
    with asked() as processed:
        assert process_next(service.database, service.grids) == 1
    most = PROCESSED[service.database.url.get_backend_name()]
    assert len(processed) <= most, "\n".join(processed)
    assert mapped.get(f"{mapped.path()}/missions/2").json()["outcome"] == "updated"
    assert not [statement for statement in processed if statement.startswith(("INSERT INTO room", "UPDATE room"))]
