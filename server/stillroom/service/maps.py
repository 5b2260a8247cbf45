"""People look at maps, edit them and bring old versions back."""

from typing import TypeVar

from stillroom.documents import api
from stillroom.documents.features import features, frame, segments, stored_map
from stillroom.documents.geojson import RoomFeature
from stillroom.documents.grids import as_png, cells_as_png
from stillroom.documents.images import Reading
from stillroom.documents.missions import stored_meta
from stillroom.documents.stored import decode_map
from stillroom.errors import NotFound
from stillroom.maps.semantics import SemanticMap
from stillroom.service.access import Principal, rights_towards, visible_to
from stillroom.service.paging import page_of
from stillroom.store import maps, missions, robots
from stillroom.store.database import Database, Transaction
from stillroom.store.grids import GridStore
from stillroom.store.rows import MapName, MapRow, VersionHead, VersionRow, VersionSummary

T = TypeVar("T")


def list_robots(database: Database, caller: Principal, after: str, limit: int) -> api.Page[api.RobotSummary]:
    """Those that the caller may see, with their maps."""
    with database.read() as tx:
        rows, following = page_of(robots.page(tx, visible_to(caller), after, limit + 1), limit, lambda row: row.id)
        of_robots = maps.of_robots(tx, [row.id for row in rows])
        heads = maps.heads(tx, of_robots)
        rights = rights_towards(tx, caller, rows)
    summaries: dict[str, list[api.MapSummary]] = {row.id: [] for row in rows}
    for of in of_robots:
        summaries[of.robot_id].append(map_summary(of, heads.get(of.id)))
    items = [
        api.RobotSummary(id=r.id, name=r.name, owner=r.owner, maps=summaries[r.id], may=rights[r.id]) for r in rows
    ]
    return api.Page(items=items, next=following)


def map_summary(of: MapRow, head: VersionHead | None) -> api.MapSummary:
    return api.MapSummary.model_validate(
        {
            "map": of.name,
            "name": of.title,
            "review": of.review,
            "version": of.head,
            "pinned": of.pinned,
            "rooms": 0 if head is None else head.rooms,
            "updated_at": None if head is None else head.created_at,
            "url": map_url(of),
        }
    )


def map_url(of: MapName) -> str:
    return f"/api/v1/robots/{of.robot_id}/maps/{of.name}"


def version_in_force(database: Database, robot_id: str, map_name: str) -> tuple[MapRow, int]:
    """Raises NotFound where there is no such map, or none that has a version yet."""
    with database.read() as tx:
        return find_in_force(tx, robot_id, map_name)


def show_map(database: Database, robot_id: str, map_name: str, number: int | None = None) -> dict[str, object]:
    """The version in force, or a given one, as `api.MapDocument` has it. Raises NotFound."""
    with database.look() as tx:
        found = maps.shown(tx, robot_id, map_name, number)
    head, row = _there(found, robot_id, map_name)
    if head is None:
        raise _not_yet(robot_id, map_name)
    if row is None:
        raise _no_version(robot_id, map_name, number)
    of = MapName(robot_id, map_name)
    seen = _summary(of, row) | {"type": "FeatureCollection"} | _pictures(of, row)
    return seen | stored_map(row.document)


def map_segments(database: Database, robot_id: str, map_name: str) -> list[api.Segment]:
    of, row = find_version(database, robot_id, map_name)
    return segments(decode_map(row.document), of.name)


def version_grid(database: Database, grids: GridStore, robot_id: str, map_name: str, number: int) -> bytes:
    """The occupancy pixels under a version, as PNG. Raises NotFound."""
    of, row = find_version(database, robot_id, map_name, number)
    return as_png(grids.get(row.grid), reading_of(database, of, row))


def version_cells(database: Database, grids: GridStore, robot_id: str, map_name: str, number: int) -> bytes:
    """What the pixels under a version mean, as PNG. Raises NotFound."""
    of, row = find_version(database, robot_id, map_name, number)
    return cells_as_png(grids.get(row.grid), reading_of(database, of, row))


def reading_of(database: Database, of: MapRow, row: VersionHead) -> Reading:
    """How the mission that brought a version's grid said it is to be read."""
    with database.read() as tx:
        mission = None if row.mission is None else missions.by_key(tx, of.id, row.mission)
    return Reading() if mission is None else stored_meta(mission.meta).reading()


def list_versions(
    database: Database, robot_id: str, map_name: str, cursor: int | None, limit: int
) -> api.Page[api.VersionListItem]:
    """The newest first. Raises NotFound."""
    with database.read() as tx:
        of = find_map(tx, robot_id, map_name)
        rows, following = page_of(maps.versions_page(tx, of.id, cursor, limit + 1), limit, lambda row: str(row.number))
    items = [api.VersionListItem.model_validate(version_item(of, row)) for row in rows]
    return api.Page(items=items, next=following)


def version_item(of: MapRow, row: VersionHead) -> dict[str, object]:
    return _summary(of, row) | {
        "rooms": row.rooms,
        "name": row.name,
        "url": f"{map_url(of)}/versions/{row.number}",
    }


def find_room(database: Database, robot_id: str, map_name: str, room_id: str) -> RoomFeature | api.RetiredRoom:
    """The room, or where its space went, for any id that ever was. Raises NotFound."""
    with database.read() as tx:
        of, number = find_in_force(tx, robot_id, map_name)
        known = maps.room_row(tx, of.id, room_id)
        if known is None:
            raise NotFound(f"The map {map_name} of {robot_id} never had a room {room_id}.")
        if known.retired:
            return api.RetiredRoom(
                id=known.id, survivor=_survivor(tx, of.id, room_id), name=known.name, segment_id=known.segment_id
            )
        row = maps.version_at(tx, of.id, number)
    assert row is not None
    found = next(one for one in stored_map(row.document)["features"] if one["id"] == room_id)
    return RoomFeature.model_validate(found)


def find_map(tx: Transaction, robot_id: str, map_name: str) -> MapRow:
    return _there(maps.by_name(tx, robot_id, map_name), robot_id, map_name)


def find_in_force(tx: Transaction, robot_id: str, map_name: str) -> tuple[MapRow, int]:
    of = find_map(tx, robot_id, map_name)
    return of, _head(of)


def _there(of: T | None, robot_id: str, map_name: str) -> T:
    if of is None:
        raise NotFound(f"{robot_id} has no map {map_name}.")
    return of


def _head(of: MapRow) -> int:
    if of.head is None:
        raise _not_yet(of.robot_id, of.name)
    return of.head


def _not_yet(robot_id: str, map_name: str) -> NotFound:
    return NotFound(f"The map {map_name} of {robot_id} has no version yet: its first mission is not done.")


def _no_version(robot_id: str, map_name: str, number: int | None) -> NotFound:
    return NotFound(f"The map {map_name} of {robot_id} has no version {number}.")


def find_version(
    database: Database, robot_id: str, map_name: str, number: int | None = None
) -> tuple[MapRow, VersionRow]:
    with database.look() as tx:
        found, row = maps.in_force(tx, robot_id, map_name) or (None, None)
        of = _there(found, robot_id, map_name)
        head = _head(of)
        if number is not None and number != head:
            row = maps.version_at(tx, of.id, number)
    if row is None:
        raise _no_version(robot_id, map_name, number)
    return of, row


def _survivor(tx: Transaction, map_id: int, room_id: str) -> str | None:
    """The living room that has its space; survivors may have ended since."""
    seen = {room_id}
    row = maps.room_row(tx, map_id, room_id)
    while row is not None and row.retired and row.survivor is not None and row.survivor not in seen:
        seen.add(row.survivor)
        row = maps.room_row(tx, map_id, row.survivor)
    return None if row is None or row.retired else row.id


def _summary(of: MapName, row: VersionSummary) -> dict[str, object]:
    return {
        "robot": of.robot_id,
        "map": of.name,
        "version": row.number,
        "parent": row.parent,
        "cause": row.cause,
        "mission": row.mission,
        "made_by": row.made_by,
        "created_at": row.created_at,
    }


def _pictures(of: MapName, row: VersionSummary) -> dict[str, object]:
    of_version = f"{map_url(of)}/versions/{row.number}"
    return {"grid": f"{of_version}/grid.png", "cells": f"{of_version}/cells.png"}


def document_fields(of: MapRow, row: VersionHead, semantic_map: SemanticMap) -> dict[str, object]:
    shapes = {"frame": frame(semantic_map.frame), "features": features(semantic_map)}
    return _summary(of, row) | _pictures(of, row) | shapes


def as_document(of: MapRow, row: VersionHead, semantic_map: SemanticMap) -> api.MapDocument:
    return api.MapDocument.model_validate(document_fields(of, row, semantic_map))
