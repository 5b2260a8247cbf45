"""Everything of a robot's maps as one archive, written while it is sent: nothing of it is held but one file at a time."""

import json
from collections.abc import Iterator, Mapping, Sequence
from datetime import datetime
from typing import Any

from stillroom import __version__
from stillroom.documents.archives import (
    ArchivedMap,
    ArchivedMission,
    ArchivedRobot,
    ArchivedRoom,
    ArchivedVersion,
    ArchiveWriter,
)
from stillroom.documents.exports import export
from stillroom.documents.grids import read_grid
from stillroom.documents.images import IMAGE_TYPES, PGM_TYPE, PNG_TYPE
from stillroom.documents.nav2 import write_nav2
from stillroom.documents.stored import decode_map
from stillroom.errors import NotFound, StillroomError
from stillroom.service.maps import as_document, reading_of
from stillroom.store import archives, clock, maps, robots
from stillroom.store.database import Database
from stillroom.store.grids import GridStore
from stillroom.store.rows import MapRow, MissionRow, VersionRow


def archive(database: Database, grids: GridStore, robot_id: str) -> Iterator[bytes]:
    """The archive in pieces. What is added meanwhile may be in it or not. Raises NotFound before the first piece."""
    with database.read() as tx:
        robot, of_robot, now = robots.get(tx, robot_id), maps.of_robots(tx, [robot_id]), clock.now(tx)
    if robot is None:
        raise NotFound(f"There is no robot {robot_id}.")
    return _written(
        database, grids, ArchivedRobot(id=robot.id, name=robot.name, created_at=robot.created_at), of_robot, now
    )


def _written(
    database: Database, grids: GridStore, robot: ArchivedRobot, of_robot: Sequence[MapRow], now: datetime
) -> Iterator[bytes]:
    writer, seen = ArchiveWriter(f"stillroom {__version__}", robot.id, now), set[str]()
    yield writer.add("robot.json", robot.model_dump_json().encode())
    for of in of_robot:
        folder = f"maps/{of.ordinal}"
        with database.read() as tx:
            rooms = [ArchivedRoom(**vars(row)) for row in archives.rooms(tx, of.id)]
        yield writer.add(f"{folder}/map.json", _map(of, rooms).model_dump_json().encode())
        for version in _versions(database, of):
            yield writer.add(
                f"{folder}/versions/{version.number:06d}.json", _version(version).model_dump_json().encode()
            )
            yield _grid(writer, grids, version.grid, seen)
            if version.number == of.head:
                yield from _current(writer, database, grids, of, version, folder)
        for mission in _missions(database, of):
            said = _mission(database, mission).model_dump_json().encode()
            yield writer.add(f"{folder}/missions/{mission.id:09d}.json", said)
            yield _grid(writer, grids, mission.grid, seen)
        with database.read() as tx:
            yield writer.lines(f"{folder}/decisions.jsonl", map(_line, archives.decisions(tx, of.id)))
            yield writer.lines(f"{folder}/events.jsonl", map(_line, archives.events(tx, of.robot_id, of.id)))
    with database.read() as tx:
        yield writer.lines("log.jsonl", map(_line, archives.looks(tx, robot.id)))
    yield writer.end()


def _line(row: Mapping[str, Any]) -> bytes:
    return json.dumps(dict(row), default=_as_text, ensure_ascii=False).encode()


def _as_text(value: object) -> str:
    return value.isoformat() if isinstance(value, datetime) else str(value)


def _versions(database: Database, of: MapRow) -> Iterator[VersionRow]:
    """Up to the one that was in force when the archive was begun."""
    last = 0
    while last < (of.head or 0):
        with database.read() as tx:
            rows = archives.versions(tx, of.id, last)
        if not rows:
            return
        yield from (row for row in rows if row.number <= (of.head or 0))
        last = rows[-1].number


def _missions(database: Database, of: MapRow) -> Iterator[MissionRow]:
    last = 0
    while True:
        with database.read() as tx:
            rows = archives.missions(tx, of.id, last)
        if not rows:
            return
        yield from rows
        last = rows[-1].id


def _grid(writer: ArchiveWriter, grids: GridStore, key: str, seen: set[str]) -> bytes:
    """As the robot sent it; each once. What was deleted meanwhile is left out."""
    if key in seen or not key:
        return b""
    seen.add(key)
    content = grids.get(key)
    return writer.add(f"grids/{key}.{suffix_of(content)}", content)


def suffix_of(content: bytes) -> str:
    if content.startswith(IMAGE_TYPES[PNG_TYPE]):
        return "png"
    return "pgm" if content.startswith(IMAGE_TYPES[PGM_TYPE]) else "json"


def _current(
    writer: ArchiveWriter, database: Database, grids: GridStore, of: MapRow, version: VersionRow, folder: str
) -> Iterator[bytes]:
    """The version in force in the formats of others, for people."""
    semantic_map = decode_map(version.document)
    geojson = as_document(of, version, semantic_map).model_dump_json().encode()
    yield writer.add(f"{folder}/current/map.geojson", geojson)
    if not version.grid:
        return
    try:
        grid = read_grid(grids.get(version.grid), reading_of(database, of, version))
    except StillroomError:
        return  # kept as it was sent
    for name, content in write_nav2(grid, "map").items():
        yield writer.add(f"{folder}/current/{name}", content)
    yield writer.add(f"{folder}/current/map.json", export("valetudo", semantic_map, grid, geojson, "map").content)
    yield writer.add(f"{folder}/current/map.png", export("png", semantic_map, grid, geojson, "map").content)


def _map(of: MapRow, rooms: list[ArchivedRoom]) -> ArchivedMap:
    names = ("name", "title", "ordinal", "review", "head", "pinned", "epoch", "sequence", "used_ids", "created_at")
    return ArchivedMap.model_validate({name: getattr(of, name) for name in names} | {"rooms": rooms})


def _version(row: VersionRow) -> ArchivedVersion:
    return ArchivedVersion.model_validate({name: getattr(row, name) for name in ArchivedVersion.model_fields})


def _mission(database: Database, row: MissionRow) -> ArchivedMission:
    parked = None
    if row.placed_from is not None:
        with database.read() as tx:
            parked = archives.placed_from(tx, row.placed_from)
    rows = (row.ablation_transfer, row.ablation_meta_occupancy, row.ablation_meta_dividers)
    apart = {"placed_from": parked, "ablation": None if rows[0] is None else rows}
    same = ArchivedMission.model_fields.keys() - apart.keys()
    return ArchivedMission.model_validate({name: getattr(row, name) for name in same} | apart)
