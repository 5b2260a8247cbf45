"""What happens in a home between missions: furniture moves, doors shut, things stand in the way, walls are opened."""

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from shapely import Point, Polygon

from stillroom.simulator.doorways import in_doorways
from stillroom.simulator.effects import Effects, Streams
from stillroom.simulator.furnishing import moved_elsewhere
from stillroom.simulator.homes import Home
from stillroom.simulator.openings import with_passage

_BATTERY = (0.3, 0.8)
"""Share of its way that a robot gets along when its battery ends too soon."""
_PASSAGES_FROM, _PASSAGES_TO = 5, 13
"""Missions before which ways through walls are opened."""
_CLEAR = 0.4
"""Probability that rays pass a window during a mission."""


@dataclass(frozen=True)
class World:
    """A home as it stands during one mission, and the rooms that the robot does not enter in it."""

    home: Home
    shut: frozenset[str] = frozenset()
    """Ids of doors."""
    skipped: frozenset[str] = frozenset()
    """Names of rooms."""
    in_doorways: tuple[Polygon, ...] = ()
    """What stands there and leaves a way past."""
    clear: frozenset[str] = frozenset()
    """Ids of the windows that rays pass."""
    battery: float = 1.0
    """Share of its way after which the robot turns back."""
    happened: frozenset[str] = frozenset()
    """The effects, by their names in EFFECTS, that made this world another."""


def world_during(home: Home, mission: int, effects: Effects, streams: Streams) -> World:
    """The world during a mission, with the furniture and the passages of `home`.

    The first mission finds the ways clear and goes everywhere.
    """
    shut = shut_doors(home, effects.doors_shut, streams.of("doors", mission))
    late = late_rooms(home, effects.rooms_late, streams.of("late"))
    behind = frozenset(door.id for door in home.doors if late & set(door.rooms))
    clear = clear_windows(home, streams.of("windows", mission + 1))
    blocked: dict[str, Polygon] = {}
    skipped, battery = frozenset[str](), 1.0
    if mission > 0:
        blocked = in_doorways(home, effects.doorways_blocked, streams.of("doorways", mission))
        skipped = skip_rooms(home, effects.rooms_skipped, streams.of("visits", mission))
        ends, share = streams.of("battery", mission).random(2).tolist()
        battery = _BATTERY[0] + share * (_BATTERY[1] - _BATTERY[0]) if ends < effects.battery_ends else 1.0
    happened = {
        "doors": bool(shut),
        "blocked_doorways": bool(blocked),
        "skipped_rooms": bool(skipped),
        "battery": battery < 1.0,
        "windows": bool(clear),
        "late_rooms": bool(behind) and mission == effects.late_until,
        "passages": any(door.id.startswith("passage") for door in home.doors),
    }
    return World(
        home,
        shut | behind if mission < effects.late_until else shut,
        skipped,
        tuple(thing for key, thing in blocked.items() if key not in shut),
        clear,
        battery,
        frozenset(name for name, has in happened.items() if has),
    )


def home_during(home: Home, mission: int, effects: Effects, streams: Streams) -> Home:
    """What a mission finds other than the mission before did: furniture that was moved, a way through a wall."""
    moved = move_furniture(home, effects.furniture_moves, streams.of("furniture", mission))
    has, when = streams.of("passages").random(2).tolist()
    opens = _PASSAGES_FROM + int(when * (_PASSAGES_TO - _PASSAGES_FROM))
    return (
        with_passage(moved, streams.of("passages", mission)) if has < effects.passages and mission == opens else moved
    )


def clear_windows(home: Home, rng: Generator) -> frozenset[str]:
    """Windows whose curtains are open."""
    draws = rng.random(len(home.windows)).tolist()
    return frozenset(window.id for window, draw in zip(home.windows, draws, strict=True) if draw < _CLEAR)


def move_furniture(home: Home, share: float, rng: Generator) -> Home:
    """Each movable piece stands elsewhere in its room with probability `share`; it stays where nowhere else is free.

    Each has a random stream of its own, so that none moves otherwise because of another.
    """
    draws, seeds = rng.random(len(home.furniture)).tolist(), rng.integers(2**63, size=len(home.furniture)).tolist()
    for piece, draw, seed in zip(home.furniture, draws, seeds, strict=True):
        if draw < share and piece.movable:
            home = moved_elsewhere(home, piece, np.random.default_rng(seed))
    return home


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
