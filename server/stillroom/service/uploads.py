"""A robot uploads a mission: checked, stored durably, queued. Processing is elsewhere."""

from dataclasses import dataclass

from stillroom.documents import api
from stillroom.documents.grids import as_png, check_type, read_grid
from stillroom.documents.missions import parse_meta, stored_meta
from stillroom.errors import MissionConflict, NotFound
from stillroom.service.paging import page_of
from stillroom.store import clock, lanes, maps, missions
from stillroom.store.database import Database
from stillroom.store.grids import GridStore
from stillroom.store.rows import MapRow, MissionRow


@dataclass(frozen=True)
class Received:
    map_id: int
    mission_id: int
    made: bool
    """False where the mission was there already."""


def receive(
    database: Database,
    grids: GridStore,
    robot_id: str,
    map_name: str,
    key: str,
    grid: tuple[str, bytes],
    meta: bytes,
) -> Received:
    """Durable when this returns: the grid is synced, the mission and the wake-up of its lane are one commit.

    `grid` is (media type, bytes). Raises InvalidInput, InvalidGrid, UnsupportedFormat, TooLarge, and MissionConflict where the
    id is taken by another upload. Nothing is left behind by an upload that is refused, except perhaps the grid's bytes.
    """
    media_type, content = grid
    check_type(media_type, content)
    said, document = parse_meta(meta)
    read_grid(content, said.reading())
    grid_key, digest = grids.put(content), said.digest()
    with database.write() as tx:
        row = maps.get_or_add(tx, robot_id, map_name)
        lanes.lock(tx, row.id)
        there = missions.by_key(tx, row.id, key)
        if there is not None:
            if (there.grid, there.meta_digest) != (grid_key, digest):
                raise MissionConflict(f"Mission {key} was uploaded before with another grid or other meta.")
            return Received(row.id, there.id, made=False)
        new = missions.NewMission(row.id, key, said.epoch, said.sequence, grid_key, document, digest)
        mission_id = missions.add(tx, new, clock.now(tx))
        lanes.wake(tx, row.id)
    return Received(row.id, mission_id, made=True)


def mission_by_id(database: Database, mission_id: int) -> api.MissionDocument:
    with database.read() as tx:
        row = missions.get(tx, mission_id)
        return mission_document(row, maps.get(tx, row.map_id))


def mission_by_key(database: Database, robot_id: str, map_name: str, key: str) -> api.MissionDocument:
    """Raises NotFound."""
    row, of = _find(database, robot_id, map_name, key)
    return mission_document(row, of)


def mission_grid(database: Database, grids: GridStore, robot_id: str, map_name: str, key: str) -> bytes:
    """The raw grid as PNG. Raises NotFound."""
    row, _ = _find(database, robot_id, map_name, key)
    return as_png(grids.get(row.grid), stored_meta(row.meta).reading())


def list_missions(
    database: Database, robot_id: str, map_name: str, outcome: str | None, cursor: int | None, limit: int
) -> api.Page[api.MissionDocument]:
    """The newest arrivals first. Raises NotFound."""
    with database.read() as tx:
        of = maps.by_name(tx, robot_id, map_name)
        if of is None:
            raise NotFound(f"{robot_id} has no map {map_name}.")
        rows = missions.page(tx, of.id, outcome, cursor, limit + 1)
    items, following = page_of(rows, limit, lambda row: str(row.id))
    return api.Page(items=[mission_document(row, of) for row in items], next=following)


def mission_document(row: MissionRow, of: MapRow) -> api.MissionDocument:
    said, found = stored_meta(row.meta), row.result or {}
    ablation = None
    if row.ablation_transfer is not None:
        ablation = api.AblationDocument(
            transfer=row.ablation_transfer,
            meta_occupancy=bool(row.ablation_meta_occupancy),
            meta_dividers=bool(row.ablation_meta_dividers),
        )
    return api.MissionDocument.model_validate(
        {
            "id": row.key,
            "robot": of.robot_id,
            "map": of.name,
            "sequence": row.sequence,
            "epoch": row.epoch,
            "status": row.status,
            "outcome": row.outcome,
            "succeeded_at": row.succeeded_at,
            "ablation": ablation,
            "base_version": row.base_version,
            "version": row.version,
            "algorithm": row.algorithm,
            "rooms": found.get("rooms", []),
            "conflicts": [],
            "discovered_rooms": found.get("discovered", []),
            "warnings": found.get("warnings", []),
            "reason": found.get("reason", ""),
            "timings_ms": found.get("timings_ms", {}),
            "started_at": said.started_at,
            "ended_at": said.ended_at,
            "received_at": row.received_at,
            "grid": f"/api/v1/robots/{of.robot_id}/maps/{of.name}/missions/{row.key}/grid.png",
        }
    )


def _find(database: Database, robot_id: str, map_name: str, key: str) -> tuple[MissionRow, MapRow]:
    with database.read() as tx:
        of = maps.by_name(tx, robot_id, map_name)
        row = None if of is None else missions.by_key(tx, of.id, key)
    if of is None or row is None:
        raise NotFound(f"{robot_id} has no mission {key} of a map {map_name}.")
    return row, of
