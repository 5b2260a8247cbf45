"""One mission, looked at closely: its numbers, and with the owner's leave the figures that the paper shows of missions."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from stillroom import __version__
from stillroom.documents.api import AblationDocument, Page
from stillroom.documents.features import features, frame
from stillroom.documents.grids import cells_as_png, read_grid
from stillroom.documents.inspection import (
    InspectedMission,
    MetConflict,
    MissionStep,
    PlanFigure,
    RoomScoreDocument,
)
from stillroom.documents.missions import stored_meta
from stillroom.errors import NotFound
from stillroom.maps.grid import OccupancyGrid
from stillroom.maps.semantics import SemanticMap
from stillroom.pipeline.transfer import track
from stillroom.pipeline.update import MapUpdate
from stillroom.service.access import Principal, signature
from stillroom.service.fleet import grants
from stillroom.service.gathering import Gathered, Timings, gather_as_then
from stillroom.service.maps import find_map, reading_of
from stillroom.service.missions import find_mission
from stillroom.service.paging import page_of
from stillroom.service.planning import Means
from stillroom.service.sensed import difference_documents, pose_numbers, rigid
from stillroom.store import clock, conflicts, fleet_figures, missions, robots
from stillroom.store.database import Database
from stillroom.store.rows import ConflictRow, MissionRow


def numbers(database: Database, caller: Principal, robot_id: str, map_name: str, key: str) -> InspectedMission:
    """Raises NotFound."""
    with database.read() as tx:
        of, row = find_mission(tx, robot_id, map_name, key)
        met = [conflicts.by_key(tx, of.id, name) for name in conflicts.of_missions(tx, [row.id])[row.id]]
        before, after = missions.neighbours(tx, row)
        fact = fleet_figures.fact(tx, row.id)
        error = missions.traceback(tx, row.id)
        robot, now = robots.get(tx, robot_id), clock.now(tx)
        assert robot is not None
        plan, grant = grants.access(tx, robot, signature(caller), now)
    said, found = stored_meta(row.meta), row.result or {}
    tracking = said.tracking.as_tracking()
    return InspectedMission(
        robot=robot_id,
        map=map_name,
        mission=row.key,
        sequence=row.sequence,
        epoch=row.epoch,
        status=row.status,
        outcome=row.outcome,  # type: ignore[arg-type]  # one of them
        succeeded_at=row.succeeded_at,
        ablation=_ablation(row),
        base_version=row.base_version,
        version=row.version,
        left_with=said.base_version,
        algorithm=row.algorithm,
        firmware=said.firmware,
        model=said.model,
        tracked=[name for name in ("rooms", "dividers", "submaps", "transform") if getattr(tracking, name)],
        received_at=row.received_at,
        finished_at=row.finished_at,
        attempts=row.attempts,
        rooms=_scores(found.get("rooms", [])),
        discovered_rooms=len(found.get("discovered", [])),
        warnings=len(found.get("warnings", [])),
        conflicts=[_met(conflict) for conflict in met if conflict is not None],
        timings_ms=found.get("timings_ms", {}),
        error=error,
        escaped_at=None if fact is None else fact[0],
        cause=None if fact is None else fact[1],
        previous=before,
        next=after,
        plan=plan,
        plan_until=None if grant is None or plan != "granted" else grant.expires_at,
    )


def steps(database: Database, robot_id: str, map_name: str, cursor: int | None, limit: int) -> Page[MissionStep]:
    """The history of a map, mission by mission, the newest arrivals first. Raises NotFound."""
    with database.read() as tx:
        of = find_map(tx, robot_id, map_name)
        rows, following = page_of(missions.page(tx, of.id, None, cursor, limit + 1), limit, lambda row: str(row.id))
    items = [
        MissionStep(
            mission=row.key,
            outcome=row.outcome,  # type: ignore[arg-type]  # one of them
            finished_at=row.finished_at,
            base_version=row.base_version,
            version=row.version,
            failed=[row.ablation_transfer, row.ablation_meta_occupancy, row.ablation_meta_dividers].count(False),
        )
        for row in rows
    ]
    return Page(items=items, next=following)


def figure(means: Means, caller: Principal, robot_id: str, map_name: str, key: str) -> PlanFigure:
    """The mission run again from the version that it was carried over from. Raises NotFound, GrantRequired."""
    with means.database.read() as tx:
        _, row = find_mission(tx, robot_id, map_name, key)
    grants.look(means.database, caller, robot_id, map_name, key, "figure")
    if row.status != "done":
        raise NotFound(f"Mission {key} has not been processed yet.")
    pixels = _pixels(means, row)
    gathered, timings = gather_as_then(means.database, row.id), Timings()
    with timings("total"):
        update = means.carry_over(gathered, gathered.previous, timings)
    grid = read_grid(pixels, gathered.meta.reading())
    tracked = _tracked(gathered, update, grid)
    moved = None
    if gathered.current is not None and update.motion is not None:
        moved = rigid(gathered.current, update.motion)
    differences = []
    if moved is not None and gathered.current is not None:
        known = read_grid(
            means.grids.get(gathered.current.grid), reading_of(means.database, gathered.of, gathered.current)
        )
        differences = difference_documents(known, moved, grid)
    ablation = update.ablation
    candidate = update.candidate
    return PlanFigure(
        robot=robot_id,
        map=map_name,
        mission=key,
        algorithm=__version__,
        outcome=update.outcome,
        taken=update.taken,
        reason=_unnamed(update, gathered.previous),
        frame=frame(grid.frame),
        cells=f"/api/v1/fleet/robots/{robot_id}/maps/{map_name}/missions/{key}/cells.png",
        tracked=[] if tracked is None else features(_anonymous(tracked)),
        candidate=[] if candidate is None else features(_anonymous(candidate)),
        differences=differences,
        moved=None if moved is None else pose_numbers(moved),
        rooms=_scores([vars(score) for score in update.rooms]),
        ablation=None if ablation is None else AblationDocument(**vars(ablation)),
        timings_ms=timings.ms,
    )


def cells(means: Means, caller: Principal, robot_id: str, map_name: str, key: str) -> bytes:
    """What the robot sensed. Raises NotFound, GrantRequired."""
    with means.database.read() as tx:
        _, row = find_mission(tx, robot_id, map_name, key)
    grants.look(means.database, caller, robot_id, map_name, key, "cells")
    return cells_as_png(_pixels(means, row), stored_meta(row.meta).reading())


def _pixels(means: Means, row: MissionRow) -> bytes:
    """What the robot sent. Missions that were made up have none. Raises NotFound."""
    try:
        if row.grid:
            return means.grids.get(row.grid)
    except FileNotFoundError:
        pass
    raise NotFound(f"There is no grid of mission {row.key} any more.")


def _tracked(gathered: Gathered, update: MapUpdate, grid: OccupancyGrid) -> SemanticMap | None:
    previous = gathered.previous
    return None if previous is None or update.motion is None else track(previous, update.motion, grid.frame)


def _anonymous(m: SemanticMap) -> SemanticMap:
    """People name rooms; what is looked at by others has their ids."""
    return replace(m, rooms=tuple(replace(room, name=room.id) for room in m.rooms))


def _unnamed(update: MapUpdate, previous: SemanticMap | None) -> str:
    reason = update.reason
    rooms = [*(previous.rooms if previous is not None else ()), *update.map.rooms]
    for room in sorted(rooms, key=lambda room: -len(room.name)):
        reason = reason.replace(room.name, room.id) if room.name else reason
    return reason


def _scores(rooms: Sequence[Mapping[str, Any]]) -> list[RoomScoreDocument]:
    names = ("id", "precision", "recall", "passed")
    return [
        RoomScoreDocument.model_validate({name: room[name] for name in names} | {"visited": room.get("visited", True)})
        for room in rooms
    ]


def _met(row: ConflictRow) -> MetConflict:
    return MetConflict(
        id=row.key,
        kind=row.kind,
        cause=row.cause,
        state=row.state,  # type: ignore[arg-type]  # one of them
        rooms=_scores(row.rooms),
        response=row.response,
        decided_at=row.decided_at,
    )


def _ablation(row: MissionRow) -> AblationDocument | None:
    if row.ablation_transfer is None:
        return None
    return AblationDocument(
        transfer=row.ablation_transfer,
        meta_occupancy=bool(row.ablation_meta_occupancy),
        meta_dividers=bool(row.ablation_meta_dividers),
    )
