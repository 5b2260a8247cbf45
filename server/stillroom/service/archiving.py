"""Everything of a robot's maps, or of a home, as one archive, written while it is sent: nothing of it is held but one file at a time."""

import json
from collections.abc import Iterator, Mapping
from dataclasses import replace
from datetime import datetime
from typing import Any

import structlog

from stillroom import __version__
from stillroom.documents.archive_writer import ArchiveWriter
from stillroom.documents.archives import (
    ArchivedMap,
    ArchivedMission,
    ArchivedRobot,
    ArchivedRoom,
    ArchivedVersion,
)
from stillroom.documents.exports import export
from stillroom.documents.grids import read_grid
from stillroom.documents.images import IMAGE_TYPES, PGM_TYPE, PNG_TYPE
from stillroom.documents.nav2 import write_nav2
from stillroom.documents.stored import decode_map
from stillroom.errors import NotFound, StillroomError
from stillroom.service.maps import as_document, reading_of
from stillroom.store import archives, clock, households, maps, robots
from stillroom.store.database import Database
from stillroom.store.grids import GridStore
from stillroom.store.rows import MapRow, MissionRow, RobotRow, VersionRow

README = """What this archive holds
=======================

It is brought in again by the page of one's home, by POST to the address that it came from, or by `stillroom import`:
maps, rooms, dividers, zones, every version and mission, and what the robots sensed.

For reading only, and not brought in:
  home.json                      whose home it is, its people, how long what was sensed is kept, what the owner is told
  log.jsonl                      who looked at maps, and who changed something
  grants.jsonl                   who asked to see a floor plan, and what the owner said
  maps/*/decisions.jsonl         questions, and how they were answered
  maps/*/events.jsonl            what happened
  maps/*/current/                the map in force, for other programs

No passwords, tokens or secrets of webhooks are in it. manifest.json names each file with its SHA-256.
"""


def archive(database: Database, grids: GridStore, robot_id: str) -> Iterator[bytes]:
    """A robot's archive in pieces. What is added meanwhile may be in it or not. Raises NotFound before the first piece."""
    with database.read() as tx:
        robot, now = robots.get(tx, robot_id), clock.now(tx)
    if robot is None:
        raise NotFound(f"There is no robot {robot_id}.")
    return _of_robot(database, grids, robot, now)


def archive_home(database: Database, grids: GridStore, owner: str) -> Iterator[bytes]:
    """That of all robots of a person, with what is kept of the home beside them, in pieces."""
    with database.read() as tx:
        found, now = robots.page(tx, robots.owned_by(owner), "", robots.ALL), clock.now(tx)
        home = households.everything(tx, owner, now)
    writer, seen = ArchiveWriter(_SERVICE, None, now), set[str]()
    yield writer.add("README.txt", README.encode())
    yield writer.add("home.json", json.dumps(home, default=_as_text, ensure_ascii=False, indent=1).encode())
    for number, robot in enumerate(found, 1):
        yield from _written(writer, database, grids, robot, f"robots/{number}/", seen)
    yield writer.end()


log = structlog.get_logger()
_SERVICE = f"stillroom {__version__}"


def _of_robot(database: Database, grids: GridStore, robot: RobotRow, now: datetime) -> Iterator[bytes]:
    writer = ArchiveWriter(_SERVICE, robot.id, now)
    yield writer.add("README.txt", README.encode())
    yield from _written(writer, database, grids, robot, "", set())
    yield writer.end()


def _written(
    writer: ArchiveWriter, database: Database, grids: GridStore, robot: RobotRow, top: str, seen: set[str]
) -> Iterator[bytes]:
    """`seen`: the grids that are in it already, which grows."""
    with database.read() as tx:
        now = robots.get(tx, robot.id)
        if now is None or now.owner != robot.owner:
            return  # it was given up since: what is known of it now is another home's
        of_robot = maps.of_robots(tx, [robot.id])
        looks = writer.lines(f"{top}log.jsonl", map(_line, archives.looks(tx, robot.id)))
        grants = writer.lines(f"{top}grants.jsonl", map(_line, archives.grants(tx, robot.id)))
    said = ArchivedRobot(id=robot.id, name=robot.name, created_at=robot.created_at)
    yield looks
    yield grants
    yield writer.add(f"{top}robot.json", said.model_dump_json().encode())
    for of in of_robot:
        yield from _floor(writer, database, grids, of, f"{top}maps/{of.ordinal}", seen)


def _floor(
    writer: ArchiveWriter, database: Database, grids: GridStore, of: MapRow, folder: str, seen: set[str]
) -> Iterator[bytes]:
    with database.read() as tx:
        rooms = [ArchivedRoom(**vars(row)) for row in archives.rooms(tx, of.id)]
    yield writer.add(f"{folder}/map.json", _map(of, rooms).model_dump_json().encode())
    for version in _versions(database, of):
        piece, key = _grid(writer, grids, version.grid, seen)
        version = replace(version, grid=key)
        said = _version(version).model_dump_json().encode()
        yield piece
        yield writer.add(f"{folder}/versions/{version.number:06d}.json", said)
        if version.number == of.head:
            yield from _current(writer, database, grids, of, version, folder)
    for mission in _missions(database, of):
        piece, key = _grid(writer, grids, mission.grid, seen)
        said = _mission(database, replace(mission, grid=key)).model_dump_json().encode()
        yield piece
        yield writer.add(f"{folder}/missions/{mission.id:09d}.json", said)
    with database.read() as tx:
        decisions = writer.lines(f"{folder}/decisions.jsonl", map(_line, archives.decisions(tx, of.id)))
        happened = writer.lines(f"{folder}/events.jsonl", map(_line, archives.events(tx, of.id)))
    yield decisions
    yield happened


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


def _grid(writer: ArchiveWriter, grids: GridStore, key: str, seen: set[str]) -> tuple[bytes, str]:
    """What is to be sent of a grid, as the robot sent it, each once; and its key, "" where it was deleted meanwhile, or damaged."""
    if key in seen or not key:
        return b"", key
    try:
        content = grids.get(key)
    except (NotFound, FileNotFoundError, ValueError) as error:
        log.warning("a grid is missing in an archive", grid=key, reason=str(error))
        return b"", ""
    seen.add(key)
    return writer.add(f"grids/{key}.{suffix_of(content)}", content), key


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
