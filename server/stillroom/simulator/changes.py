"""What happens in a home between missions: furniture moves, doors shut, rooms are left out or come later."""

from dataclasses import dataclass, replace

from numpy.random import Generator
from shapely import Point

from stillroom.simulator.effects import Effects, Streams
from stillroom.simulator.furnishing import find_place, piece_of, site
from stillroom.simulator.homes import Furniture, Home


@dataclass(frozen=True)
class World:
    """A home as it stands during one mission, and the rooms that the robot does not enter in it."""

    home: Home
    shut: frozenset[str] = frozenset()
    """Ids of doors."""
    skipped: frozenset[str] = frozenset()
    """Names of rooms."""


def world_during(home: Home, mission: int, effects: Effects, streams: Streams) -> World:
    """The world during a mission, with the furniture as it stands in `home`."""
    shut = shut_doors(home, effects.doors_shut, streams.of("doors", mission))
    if mission < effects.late_until:
        late = late_rooms(home, effects.rooms_late, streams.of("late"))
        shut |= {door.id for door in home.doors if late & set(door.rooms)}
    if mission == 0:
        return World(home, shut)
    return World(home, shut, skip_rooms(home, effects.rooms_skipped, streams.of("visits", mission)))


def move_furniture(home: Home, share: float, rng: Generator) -> Home:
    """Each movable piece stands elsewhere in its room with probability `share`; it stays where nowhere else is free."""
    standing = list(home.furniture)
    for i, moving in enumerate(rng.random(len(standing)) < share):
        if moving and standing[i].movable:
            standing[i] = _moved(rng, standing, i, home)
    return replace(home, furniture=tuple(standing))


def _moved(rng: Generator, standing: list[Furniture], index: int, home: Home) -> Furniture:
    piece = standing[index]
    others = [other for other in standing if other.room == piece.room and other is not piece]
    where = site(piece.room, home.rooms, home.doors, home.dock)
    return find_place(rng, piece.id, piece_of(piece), where, others) or piece


def shut_doors(home: Home, share: float, rng: Generator) -> frozenset[str]:
    """Doors that are shut; openings and the doors of the room that the robot starts in stay open."""
    draws = rng.random(len(home.doors))
    start = _start(home)
    return frozenset(
        door.id
        for door, draw in zip(home.doors, draws, strict=True)
        if draw < share and door.kind == "door" and start not in door.rooms
    )


def late_rooms(home: Home, count: int, rng: Generator) -> frozenset[str]:
    """`count` rooms behind a single door."""
    order = rng.permutation(len(home.rooms))
    alone = [home.rooms[i].name for i in order if [d.kind for d in home.doors_of(home.rooms[i].name)] == ["door"]]
    return frozenset(alone[:count])


def skip_rooms(home: Home, probability: float, rng: Generator) -> frozenset[str]:
    """Rooms that are not visited: dead ends only, so that the rest can be reached."""
    draws = rng.random(len(home.rooms))
    return frozenset(
        room.name
        for room, draw in zip(home.rooms, draws, strict=True)
        if draw < probability and len(home.doors_of(room.name)) == 1 and room.name != _start(home)
    )


def _start(home: Home) -> str:
    return min(home.rooms, key=lambda room: room.polygon.distance(Point(home.dock))).name
