"""A robot uploads a mission: checked, stored durably, queued. Processing is elsewhere."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from stillroom.documents.grids import check_type, read_grid
from stillroom.documents.missions import parse_meta, stored_meta
from stillroom.errors import Forbidden, MissionConflict, NotFound
from stillroom.store import maps, missions, receiving
from stillroom.store.database import Database, Transaction
from stillroom.store.grids import GridStore
from stillroom.store.rows import MissionRow


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
    soon: Callable[[int], None] = lambda _map_id: None,
) -> Received:
    """Durable when this returns: the grid is synced, the mission and the wake-up of its lane are one commit.

    `grid` is (media type, bytes); `soon` is told the map's number before anybody else can know of the mission. Raises InvalidInput,
    InvalidGrid, UnsupportedFormat, TooLarge, and MissionConflict where the id is taken by another upload. Nothing is left behind by
    an upload that is refused, except perhaps the grid's bytes.
    """
    media_type, content = grid
    check_type(media_type, content)
    said, document = parse_meta(meta)
    read_grid(content, said.reading())
    known, stored, digest = grids.sweeps, grids.put(content), said.digest()
    with database.write() as tx:
        map_id = _open_lane(tx, robot_id, map_name)
        soon(map_id)
        new = missions.NewMission(map_id, key, said.epoch, said.sequence, stored.key, document, digest)
        added = receiving.add_mission(tx, new, robot_id)
        if added is None:
            return _received_before(tx, new, robot_id)
    mission_id, sweeps = added
    grids.sweeps = sweeps
    if not stored.made or sweeps is None or sweeps != known:  # the grid may have been deleted since it was stored
        grids.keep(stored.key, content)
    return Received(map_id, mission_id, made=True)


def _open_lane(tx: Transaction, robot_id: str, map_name: str) -> int:
    """That of a new map, where there was none of the name."""
    there = receiving.open_lane(tx, robot_id, map_name)
    if there is not None:
        return there
    maps.get_or_add(tx, robot_id, map_name)
    made = receiving.open_lane(tx, robot_id, map_name)
    if made is None:
        raise NotFound("It was deleted meanwhile.")
    return made


def _received_before(tx: Transaction, new: missions.NewMission, robot_id: str) -> Received:
    there = missions.by_key(tx, new.map_id, new.key)
    if there is None:
        raise Forbidden(f"{robot_id} was given up meanwhile.")
    if (there.grid or new.grid) != new.grid or new.meta_digest not in _digests(there):
        raise MissionConflict(f"Mission {new.key} was uploaded before with another grid or other meta.")
    return Received(new.map_id, there.id, made=False)


def _digests(of: MissionRow) -> Iterator[str]:
    """As it was stored, perhaps by a program from before this one, and as it is made now."""
    yield of.meta_digest
    yield stored_meta(of.meta).digest()
