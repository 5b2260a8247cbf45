"""What happened to the maps that somebody may see."""

from stillroom.documents import api
from stillroom.service.access import Principal, visible_to
from stillroom.store import events, robots
from stillroom.store.database import Database

BATCH = 500


def newest_event(database: Database, caller: Principal) -> int:
    """Id of the newest event that the caller may see."""
    with database.read() as tx:
        return events.newest(tx, visible_to(caller))


def events_after(
    database: Database, caller: Principal, last: int, robot_id: str | None, map_name: str | None
) -> list[tuple[int, api.Event]]:
    """Up to 500 events after the one with the id `last`, with their ids, oldest first."""
    visible = visible_to(caller)
    if robot_id is not None:
        visible = visible & robots.is_robot(robot_id)
    with database.read() as tx:
        rows = events.after(tx, last, visible, map_name, BATCH)
    return [
        (
            row.id,
            api.Event.model_validate(
                {"kind": row.kind, "robot": row.robot_id, "map": row.map_name, "at": row.created_at, **row.data}
            ),
        )
        for row in rows
    ]
