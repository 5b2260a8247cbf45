"""Maps out of an archive become maps of a robot: with all versions and missions, or not at all."""

import json
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from pydantic import ValidationError

from stillroom.documents.archives import Archive, ArchivedMap, ArchivedMission, ArchivedRobot, ArchivedVersion
from stillroom.documents.checking import check_map, check_motion, renamer, with_ids
from stillroom.documents.grids import read_grid
from stillroom.documents.missions import faults_of, parse_meta
from stillroom.documents.privacy import Imported, ImportedHome
from stillroom.documents.stored import upgrade
from stillroom.errors import AlreadyExists, Fault, Forbidden, InvalidInput, NotFound
from stillroom.service.archiving import suffix_of
from stillroom.service.missions import mission_document
from stillroom.service.robots import keep
from stillroom.store import archives, clock, erasing, events, lanes, maps, robots
from stillroom.store.database import Database, Transaction, tell
from stillroom.store.grids import GridStore
from stillroom.store.hints import Hint
from stillroom.store.rows import MapRow, MissionRow, RobotRow

_MAP = re.compile(r".*maps/[0-9]+/map\.json")
MOST_KEPT = 100
"""Robots without a robot, of one home."""
Json = dict[str, Any]


@dataclass(frozen=True)
class _Floor:
    """A map of the archive that was looked at."""

    folder: str
    said: ArchivedMap
    rooms: Sequence[int]
    """How many each version has."""
    missions: int


@dataclass(frozen=True)
class _Robot:
    said: ArchivedRobot
    floors: Sequence[_Floor]


def import_archive(database: Database, grids: GridStore, robot_id: str, archive: Archive) -> Imported:
    """All maps of a robot's archive as maps of the robot, with the ids that they had, where the robot has no other maps.

    Decisions, events and who looked are for people to read; they are not brought in. The fleet's figures count nothing of it.
    Raises InvalidInput, TooLarge; AlreadyExists where the robot has a map of the same name; Forbidden for one that was given up.
    """
    if archive.manifest.robot is None:
        raise _refused("robots", "the archive of a whole home, which is brought in by its owner")
    (only,) = _bring(
        database, grids, archive, lambda tx, found: [_brought_in(tx, robot_id, archive, one.floors) for one in found]
    )
    return only


def import_home(database: Database, grids: GridStore, owner: str, archive: Archive) -> ImportedHome:
    """All maps of an archive, of one robot or of a home: of a robot that is the person's, as its maps; else as maps that the person kept.

    Raises like `import_archive`.
    """

    def place(tx: Transaction, found: Sequence[_Robot]) -> list[Imported]:
        return [_brought_in(tx, _target(tx, owner, robot.said), archive, robot.floors) for robot in found]

    return ImportedHome(robots=_bring(database, grids, archive, place))


def _target(tx: Transaction, owner: str, said: ArchivedRobot) -> str:
    there = robots.get(tx, said.id)
    if there is not None and there.owner == owner:
        return there.id
    if robots.count(tx, robots.owned_by(owner) & robots.kept()) >= MOST_KEPT:
        raise InvalidInput(f"{MOST_KEPT} robots that are none any more are kept already: delete what you don't need.")
    return keep(tx, RobotRow(said.id, said.name, owner, clock.now(tx)))


def _bring(
    database: Database,
    grids: GridStore,
    archive: Archive,
    place: Callable[[Transaction, Sequence[_Robot]], list[Imported]],
) -> list[Imported]:
    archive.check()
    checked: dict[str, str] = {}
    found = [robot for robot in (_robot(archive, top, checked) for top in archive.robots()) if robot.floors]
    if not found:
        raise _refused("maps", "no map")
    if len({robot.said.id for robot in found}) != len(found):
        raise _refused("robots", "one is there twice")
    for key, path in checked.items():
        if grids.put(archive.read(path)).key != key:
            raise _refused(path, "not what it is called")
    try:
        with database.write() as tx:
            erasing.hold_grids(tx, alone=False)
            made = place(tx, found)
    except Exception:
        with database.write() as tx:
            erasing.discard(tx, checked, clock.now(tx))
        raise
    for key, path in checked.items():
        grids.keep(key, archive.read(path))
    return made


# -- looking at what is to come ------------------------------------------------------------------------------------


def _robot(archive: Archive, top: str, checked: dict[str, str]) -> _Robot:
    said = archive.load(ArchivedRobot, f"{top}robot.json")
    folders = [path.removesuffix("/map.json") for path in archive.below(f"{top}maps") if _MAP.fullmatch(path)]
    floors = [_look_at(archive, folder, checked) for folder in folders]
    if len({floor.said.name for floor in floors}) != len(floors):
        raise _refused(f"{top}maps", "two of one name")
    return _Robot(said, floors)


def _look_at(archive: Archive, folder: str, checked: dict[str, str]) -> _Floor:
    """Whether everything of a map can be used; `checked`: the paths of grids by their keys, which grows. Raises InvalidInput."""
    said = archive.load(ArchivedMap, f"{folder}/map.json")
    of = _row(said, 0, "robot", said.ordinal)
    keys: dict[str, str] = {}
    missions, rooms = 0, list[int]()
    for path, mission in _missions(archive, folder):
        missions += 1
        if mission.key in keys:
            raise _refused(path, "another mission is called so")
        keys[mission.key] = mission.grid
        _check_mission(archive, of, mission, path, checked)
    for path, version in _versions(archive, folder):
        last = len(rooms)
        if version.number != last + 1 or version.parent != (last or None) or not 0 <= (version.frame_from or 0) <= last:
            raise _refused(path, "versions follow each other without a gap")
        if version.mission is not None and keys.get(version.mission) != version.grid:
            raise _refused(path, "lies on no mission's grid")
        _, found = check_map(version.document, f"/{path}/document")
        check_motion(version.motion, f"/{path}/motion")
        rooms.append(len(found.rooms))
        if len(found.rooms) > 0 and len(rooms) == said.head:
            _check_rooms(said, {room.id: room.segment_id for room in found.rooms}, folder)
    if (said.head or 0) != len(rooms) or not 0 <= (said.pinned or 0) <= len(rooms):
        raise _refused(f"{folder}/map.json", "its newest version is not the last one")
    return _Floor(folder, said, rooms, missions)


def _check_rooms(said: ArchivedMap, living: Mapping[str, int], folder: str) -> None:
    known = {room.id: room.segment_id for room in said.rooms}
    twice = len(known) != len(said.rooms) or len(set(known.values())) != len(known)
    alive = {room.id for room in said.rooms if not room.retired}
    if twice or alive != living.keys() or any(known[room] != segment for room, segment in living.items()):
        raise _refused(f"{folder}/map.json", "its rooms are not those of its newest version")


def _check_mission(archive: Archive, of: MapRow, mission: ArchivedMission, path: str, checked: dict[str, str]) -> None:
    meta, _ = parse_meta(json.dumps(mission.meta).encode())
    if (meta.sequence, meta.epoch) != (mission.sequence, mission.epoch) and mission.placed_from is None:
        raise _refused(path, "another place in the order than its meta says")
    if (mission.status == "done") != (mission.outcome is not None and mission.finished_at is not None):
        raise _refused(path, "neither done nor to be done")
    try:
        mission_document(of, _mission_row(mission, 0, 0))
    except ValidationError as error:
        raise InvalidInput(f"{path} can't be used.", faults_of(error, f"/{path}")) from None
    if mission.grid and mission.grid not in checked:
        found = archive.grid(mission.grid)
        content = archive.read(found)
        if not found.endswith(suffix_of(content)):
            raise _refused(found, "another format than its name says")
        read_grid(content, meta.reading())
        checked[mission.grid] = found


def _versions(archive: Archive, folder: str) -> Iterator[tuple[str, ArchivedVersion]]:
    yield from ((path, archive.load(ArchivedVersion, path)) for path in archive.below(f"{folder}/versions"))


def _missions(archive: Archive, folder: str) -> Iterator[tuple[str, ArchivedMission]]:
    yield from ((path, archive.load(ArchivedMission, path)) for path in archive.below(f"{folder}/missions"))


# -- bringing it in ------------------------------------------------------------------------------------------------


def _brought_in(tx: Transaction, robot_id: str, archive: Archive, floors: Sequence[_Floor]) -> Imported:
    robot = robots.lock(tx, robot_id)
    if robot is None:
        raise NotFound(f"There is no robot {robot_id}.")
    if robot.released_at is not None:
        raise Forbidden(f"{robot_id} was given up.")
    there = archives.ordinals(tx, robot_id)
    clash = sorted(there.keys() & {floor.said.name for floor in floors})
    if clash:
        raise AlreadyExists(f"{robot_id} has a map {', '.join(clash)} already.", maps=clash)
    taken, ids, placed = set(there.values()), archives.room_ids(tx, robot_id), list[tuple[int, int, str]]()
    missions: dict[tuple[int, str], int] = {}
    made: list[MapRow] = []
    for floor in floors:
        ordinal = floor.said.ordinal if floor.said.ordinal not in taken else max(taken) + 1
        taken.add(ordinal)
        made.append(_bring_in(tx, robot_id, archive, floor, ordinal, ids, missions, placed))
    for mission_id, parked_ordinal, parked_key in placed:
        parked = missions.get((parked_ordinal, parked_key))
        if parked is not None:
            archives.link_placed(tx, mission_id, parked)
    now = clock.now(tx)
    for of in made:
        events.add(tx, of, [("settings", {})], now)
        tell(tx, Hint("work", of.id))
    return Imported(
        robot=robot_id,
        maps=[of.name for of in made],
        versions=sum(len(floor.rooms) for floor in floors),
        missions=sum(floor.missions for floor in floors),
    )


def _bring_in(
    tx: Transaction,
    robot_id: str,
    archive: Archive,
    floor: _Floor,
    ordinal: int,
    ids: set[str],
    missions: dict[tuple[int, str], int],
    placed: list[tuple[int, int, str]],
) -> MapRow:
    said = floor.said
    names = renamer(_prefix(said.ordinal), _prefix(ordinal))
    rooms = [
        room.model_dump() | {"id": names[room.id], "survivor": room.survivor and names[room.survivor]}
        for room in said.rooms
    ]
    clash = ids & {room["id"] for room in rooms}
    if clash:
        raise AlreadyExists(f"{robot_id} has rooms {', '.join(sorted(clash))} already.")
    ids.update(room["id"] for room in rooms)
    of = _row(said, 0, robot_id, ordinal)
    values = {name: value for name, value in vars(of).items() if name != "id"}
    waits = False
    map_id = archives.add_map(tx, values, None)
    archives.add_rooms(tx, [room | {"map_id": map_id} for room in rooms])
    for _, mission in _missions(archive, floor.folder):
        row = _mission_row(mission, 0, map_id)
        values = {name: value for name, value in vars(row).items() if name not in ("id", "placed_from")}
        mission_id = archives.add_mission(tx, values | {"result": with_ids(row.result, names)})
        missions[said.ordinal, mission.key] = mission_id
        waits |= mission.status != "done"
        if mission.placed_from is not None:
            placed.append((mission_id, *mission.placed_from))
    for rooms_then, (_, version) in zip(floor.rooms, _versions(archive, floor.folder), strict=True):
        document = with_ids(upgrade(version.document), names)
        archives.add_version(tx, version.model_dump() | {"map_id": map_id, "rooms": rooms_then, "document": document})
    if waits:
        lanes.lock(tx, map_id)
        lanes.wake(tx, map_id)
    return maps.get(tx, map_id)


def _prefix(ordinal: int) -> str:
    """Of ids: see service.versions.ids_of."""
    return "" if ordinal == 1 else f"{ordinal}-"


def _row(said: ArchivedMap, map_id: int, robot_id: str, ordinal: int) -> MapRow:
    same = said.model_dump(exclude={"rooms", "ordinal"})
    return MapRow(**same, id=map_id, robot_id=robot_id, ordinal=ordinal)


def _mission_row(said: ArchivedMission, mission_id: int, map_id: int) -> MissionRow:
    meta, _ = parse_meta(json.dumps(said.meta).encode())
    transfer, meta_occupancy, meta_dividers = said.ablation or (None, None, None)
    same = said.model_dump(exclude={"ablation", "placed_from", "status"})
    return MissionRow(
        **same,
        id=mission_id,
        map_id=map_id,
        status="done" if said.status == "done" else "queued",
        attempts=0,  # it was not processed here
        meta_digest=meta.digest(),
        ablation_transfer=transfer,
        ablation_meta_occupancy=meta_occupancy,
        ablation_meta_dividers=meta_dividers,
        placed_from=None,
    )


def _refused(path: str, why: str) -> InvalidInput:
    return InvalidInput("The archive can't be used.", (Fault(f"/{path}", why),))
