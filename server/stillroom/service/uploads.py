"""A robot uploads a mission: checked, stored durably, queued. Processing is elsewhere."""

from dataclasses import dataclass

from stillroom.documents.grids import check_type, read_grid
from stillroom.documents.missions import parse_meta
from stillroom.errors import Forbidden, MissionConflict
from stillroom.store import erasing, lanes, maps, missions, robots
from stillroom.store.database import Database, Transaction
from stillroom.store.grids import GridStore


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
        erasing.hold_grids(tx, alone=False)
        row = maps.get_or_add(tx, robot_id, map_name)
        new = missions.NewMission(row.id, key, said.epoch, said.sequence, grid_key, document, digest)
        lanes.lock(tx, row.id)
        sender = robots.get(tx, robot_id)  # looked up under the locks, which giving it up waits for, too
        if sender is None or sender.released_at is not None:
            raise Forbidden(f"{robot_id} was given up meanwhile.")
        mission_id = missions.add_unless_there(tx, new)
        if mission_id is None:
            return _received_before(tx, new)
        lanes.wake(tx, row.id)
    grids.keep(grid_key, content)
    return Received(row.id, mission_id, made=True)


def _received_before(tx: Transaction, new: missions.NewMission) -> Received:
    there = missions.by_key(tx, new.map_id, new.key)
    assert there is not None  # the lane is locked
    if (there.grid or new.grid, there.meta_digest) != (new.grid, new.meta_digest):
        raise MissionConflict(f"Mission {new.key} was uploaded before with another grid or other meta.")
    return Received(new.map_id, there.id, made=False)
