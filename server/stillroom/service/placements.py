"""A person says which floor a parked mission belongs to.

It then becomes a mission of that floor as if the robot had sent it there, except that the floor is not in doubt. The parked
mission stays as it is: what was decided is read from the one that it became.
"""

from dataclasses import dataclass
from datetime import datetime

from stillroom.errors import AlreadyDecided, NotParked
from stillroom.service.access import Principal, signature
from stillroom.service.missions import find_mission
from stillroom.store import clock, conflicts, events, lanes, maps, missions
from stillroom.store.conflicts import Ending
from stillroom.store.database import Database, Transaction
from stillroom.store.rows import MapRow, MissionRow

WITHOUT_EFFECT = ("reverted", "superseded")
"""After these the map is as it was, and the mission may be put elsewhere."""


@dataclass(frozen=True)
class Placement:
    parked_id: int
    placed_id: int
    map_id: int
    """The map that it was placed on."""


def place(database: Database, caller: Principal, robot_id: str, map_name: str, key: str, floor: str) -> Placement:
    """Durable and queued when this returns. The same again is the same placement.

    `floor`: the robot's name of a floor; a new name makes a new map. Raises NotFound, NotParked, and AlreadyDecided where it was
    placed elsewhere.
    """
    with database.write() as tx:
        of, found = find_mission(tx, robot_id, map_name, key)
        into = maps.get_or_add(tx, robot_id, floor)
        for map_id in sorted({of.id, into.id}):
            lanes.lock(tx, map_id)
        parked = missions.get(tx, found.id)
        if parked.outcome != "parked":
            raise NotParked(f"Mission {key} is {parked.outcome or parked.status}; only parked missions are placed.")
        earlier = missions.placements(tx, [parked.id]).get(parked.id)
        if earlier is not None:
            if earlier.map_id == into.id:
                return Placement(parked.id, earlier.id, into.id)
            _check_open(parked, earlier, maps.get(tx, earlier.map_id))
        new = missions.NewMission(
            map_id=into.id,
            key=missions.placed_key(key, of.name),
            epoch=parked.epoch,
            sequence=parked.sequence,
            grid=parked.grid,
            meta=parked.meta,
            meta_digest=parked.meta_digest,
            placed_from=parked.id,
            placed_by=signature(caller),
        )
        now = clock.now(tx)
        placed_id = missions.add(tx, new, now)
        lanes.wake(tx, into.id)
        answered = _answer(tx, of, parked, into, signature(caller), now)
        events.add(tx, of, [("decision", {"mission": key}), *answered], now)
    return Placement(parked.id, placed_id, into.id)


def _answer(
    tx: Transaction, of: MapRow, parked: MissionRow, into: MapRow, made_by: str, now: datetime
) -> list[events.Happened]:
    """The question which floor the mission belongs to is answered by this."""
    happened: list[events.Happened] = []
    for row in conflicts.standing(tx, of.id):
        if row.kind == "wrong_map" and row.mission_id == parked.id:
            note = f"Mission {parked.key} was placed on {into.name}."
            conflicts.end(tx, row.id, Ending("accepted", made_by, of.head, "accept", note=note), now)
            data = {"conflict": row.key, "state": "accepted", "mission": parked.key, "version": of.head}
            happened.append(("conflict", data))
    return happened


def _check_open(parked: MissionRow, earlier: MissionRow, floor: MapRow) -> None:
    if earlier.outcome not in WITHOUT_EFFECT:
        assert earlier.placed_by is not None
        raise AlreadyDecided(
            f"Mission {parked.key} was placed on {floor.name} by {earlier.placed_by}.",
            decided_by=earlier.placed_by,
            decided_at=earlier.received_at,
            map=floor.name,
        )
