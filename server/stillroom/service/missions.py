"""What became of missions."""

from collections.abc import Sequence

from stillroom.documents import api
from stillroom.documents.grids import as_png, cells_as_png
from stillroom.documents.missions import MissionTimes, stored_meta
from stillroom.errors import NotFound
from stillroom.service.maps import find_map, map_url
from stillroom.service.paging import page_of
from stillroom.store import conflicts, maps, missions
from stillroom.store.database import Database, Transaction
from stillroom.store.grids import GridStore
from stillroom.store.rows import ConflictRow, MapName, MapRow, MissionRow, ShownMission


def mission_by_id(database: Database, mission_id: int) -> api.MissionDocument:
    with database.look() as tx:
        shown, of_name, met_any = missions.shown(tx, mission_id)
        if not met_any and shown.outcome != "parked":
            return mission_document(of_name, shown)
        row, of = missions.with_map(tx, mission_id)
        return _documents(tx, of, [row])[0]


def mission_by_key(database: Database, robot_id: str, map_name: str, key: str) -> api.MissionDocument:
    """Raises NotFound."""
    with database.read() as tx:
        of, row = find_mission(tx, robot_id, map_name, key)
        return _documents(tx, of, [row])[0]


def mission_grid(database: Database, grids: GridStore, robot_id: str, map_name: str, key: str) -> bytes:
    """The raw grid as PNG. Raises NotFound."""
    with database.read() as tx:
        _, row = find_mission(tx, robot_id, map_name, key)
    return as_png(grids.get(row.grid), stored_meta(row.meta).reading())


def mission_cells(database: Database, grids: GridStore, robot_id: str, map_name: str, key: str) -> bytes:
    """What the cells of its grid mean, as PNG. Raises NotFound."""
    with database.read() as tx:
        _, row = find_mission(tx, robot_id, map_name, key)
    return cells_as_png(grids.get(row.grid), stored_meta(row.meta).reading())


def list_missions(
    database: Database, robot_id: str, map_name: str, outcome: str | None, cursor: int | None, limit: int
) -> api.Page[api.MissionDocument]:
    """The newest arrivals first. Raises NotFound."""
    with database.read() as tx:
        of = find_map(tx, robot_id, map_name)
        rows = missions.page(tx, of.id, outcome, cursor, limit + 1)
        items, following = page_of(rows, limit, lambda row: str(row.id))
        return api.Page(items=_documents(tx, of, items), next=following)


def find_mission(tx: Transaction, robot_id: str, map_name: str, key: str) -> tuple[MapRow, MissionRow]:
    """Raises NotFound."""
    of = maps.by_name(tx, robot_id, map_name)
    row = None if of is None else missions.by_key(tx, of.id, key)
    if of is None or row is None:
        raise NotFound(f"{robot_id} has no mission {key} of a map {map_name}.")
    return of, row


def mission_document(of: MapName, row: ShownMission) -> api.MissionDocument:
    """Without what became of it since."""
    return _document(of, row, [], None)


def _documents(tx: Transaction, of: MapRow, rows: Sequence[MissionRow]) -> list[api.MissionDocument]:
    parked = [row.id for row in rows if row.outcome == "parked"]
    placed = missions.placements(tx, parked) if parked else {}
    floors = {row.id: row.name for row in maps.of_robots(tx, [of.robot_id])} if placed else {}
    met = conflicts.of_missions(tx, [row.id for row in rows if row.status == "done"])
    decided = conflicts.decided(tx, [mission_id for mission_id, keys in met.items() if keys])
    documents = []
    for row in rows:
        decision = None
        if row.id in placed:
            decision = _placement(placed[row.id], floors)
        elif row.id in decided:
            decision = _decision(of, row, decided[row.id])
        documents.append(_document(of, row, met.get(row.id, ()), decision))
    return documents


def _decision(of: MapRow, row: MissionRow, decided: ConflictRow) -> api.DecisionDocument:
    """The last answer to a conflict that the mission met."""
    return api.DecisionDocument.model_validate(
        {
            "response": decided.response,
            "conflict": decided.key,
            "proposal": decided.proposal,
            "map": of.name,
            "mission": row.key,
            "decided_by": decided.decided_by,
            "decided_at": decided.decided_at,
            "status": "done",
            "outcome": None,
            "version": decided.version,
            "reason": decided.note or "",
        }
    )


def _placement(placed: MissionRow, floors: dict[int, str]) -> api.DecisionDocument:
    assert placed.placed_by is not None
    return api.DecisionDocument.model_validate(
        {
            "response": "place",
            "conflict": None,
            "proposal": None,
            "map": floors[placed.map_id],
            "mission": placed.key,
            "decided_by": placed.placed_by,
            "decided_at": placed.received_at,
            "status": placed.status,
            "outcome": placed.outcome,
            "version": placed.version,
            "reason": (placed.result or {}).get("reason", ""),
        }
    )


def _document(
    of: MapName, row: ShownMission, met: Sequence[str], decision: api.DecisionDocument | None
) -> api.MissionDocument:
    said, found = MissionTimes.model_validate(row.meta), row.result or {}
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
            "left_with": said.base_version,
            "version": row.version,
            "algorithm": row.algorithm,
            "rooms": found.get("rooms", []),
            "conflicts": met,
            "discovered_rooms": found.get("discovered", []),
            "warnings": found.get("warnings", []),
            "reason": found.get("reason", ""),
            "candidates": found.get("candidates", []),
            "decision": decision,
            "timings_ms": found.get("timings_ms", {}),
            "started_at": said.started_at,
            "ended_at": said.ended_at,
            "received_at": row.received_at,
            "grid": f"{map_url(of)}/missions/{row.key}/grid.png",
        }
    )
