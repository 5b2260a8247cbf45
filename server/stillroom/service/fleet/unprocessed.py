"""Missions that could not be processed: processing raised, or ended its worker again and again. They can be run again."""

from stillroom.documents.api import Page
from stillroom.documents.fleet import UnprocessedMission
from stillroom.errors import NotUnprocessed
from stillroom.service.missions import find_mission
from stillroom.service.paging import page_of
from stillroom.store import fleet, lanes, missions
from stillroom.store.database import Database
from stillroom.store.missions import FailedRow


def list_unprocessed(database: Database, cursor: int | None, limit: int) -> Page[UnprocessedMission]:
    """The newest arrivals first."""
    with database.read() as tx:
        rows, following = page_of(missions.unprocessed(tx, cursor, limit + 1), limit, lambda row: str(row.id))
    return Page(items=[_document(row) for row in rows], next=following)


def run_again(database: Database, robot_id: str, map_name: str, key: str) -> None:
    """As if it had just arrived; where newer missions were processed since, it is late. Raises NotFound, NotUnprocessed."""
    with database.write() as tx:
        of, row = find_mission(tx, robot_id, map_name, key)
        lanes.lock(tx, of.id)
        if missions.get(tx, row.id).status != "done" or missions.traceback(tx, row.id) is None:
            raise NotUnprocessed(f"Mission {key} was processed; what came of it stays as it is.")
        fleet.hold(tx)
        fleet.uncount(tx, row.id)
        missions.queue_again(tx, row.id)
        lanes.wake(tx, of.id)


def _document(row: FailedRow) -> UnprocessedMission:
    return UnprocessedMission(
        robot=row.robot_id,
        map=row.map_name,
        mission=row.key,
        received_at=row.received_at,
        finished_at=row.finished_at,
        attempts=row.attempts,
        algorithm=row.algorithm or "",
        error=row.traceback,
        url=f"/api/v1/fleet/robots/{row.robot_id}/maps/{row.map_name}/missions/{row.key}",
    )
