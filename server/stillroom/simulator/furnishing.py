"""Furniture: what stands in which rooms, and where it can stand without blocking the way."""

from collections.abc import Iterable
from dataclasses import dataclass
from math import atan2

import numpy as np
import shapely
from numpy.random import Generator
from shapely import Point, Polygon

from stillroom.maps.geometry import Points, Pose, as_points, polygons_in
from stillroom.simulator.homes import Door, Furniture, RoomUse, TrueRoom, as_multipolygon, box
from stillroom.simulator.plans import thick_line

ATTEMPTS = 12
PASSAGE_M = 0.25
"""Half of the width that furniture leaves free everywhere between a room's doors: a robot gets through."""
_SWING_M = 0.75
"""Nothing stands this near to a doorway."""
_LEG_M = 0.05


@dataclass(frozen=True)
class Piece:
    """A kind of furniture, width along the wall times depth, metres."""

    name: str
    width: float
    depth: float
    against_wall: bool = True
    legs: bool = False
    movable: bool = True


_BY_USE: dict[RoomUse, tuple[Piece, ...]] = {
    "hall": (Piece("dresser", 0.9, 0.3),),
    "living": (
        Piece("sofa", 2.1, 0.9),
        Piece("board", 1.7, 0.4),
        Piece("shelf", 1.0, 0.3),
        Piece("dining table", 1.6, 0.9, against_wall=False, legs=True),
        *(Piece(f"chair {i}", 0.42, 0.42, against_wall=False, legs=True) for i in range(1, 5)),
        Piece("armchair", 0.8, 0.8, against_wall=False),
        Piece("coffee table", 0.9, 0.55, against_wall=False, legs=True),
        Piece("plant", 0.35, 0.35, against_wall=False),
    ),
    "kitchen": (
        Piece("counter", 2.2, 0.6, movable=False),
        Piece("fridge", 0.65, 0.65, movable=False),
        Piece("table", 0.9, 0.7, legs=True),
        Piece("stool", 0.38, 0.38, against_wall=False, legs=True),
    ),
    "bath": (
        Piece("tub", 1.6, 0.75, movable=False),
        Piece("toilet", 0.4, 0.6, movable=False),
        Piece("basin", 0.6, 0.45, movable=False),
        Piece("hamper", 0.4, 0.35),
    ),
    "bed": (
        Piece("bed", 1.5, 2.0),
        Piece("wardrobe", 1.8, 0.6),
        Piece("night table", 0.45, 0.4),
        Piece("chair", 0.42, 0.42, against_wall=False, legs=True),
    ),
    "work": (
        Piece("desk", 1.5, 0.75, legs=True),
        Piece("bookcase", 1.2, 0.3),
        Piece("office chair", 0.5, 0.5, against_wall=False, legs=True),
        Piece("drawers", 0.45, 0.5),
    ),
    "store": (Piece("shelves", 1.1, 0.4), Piece("machine", 0.6, 0.6, movable=False)),
}


def furnish(rng: Generator, rooms: Iterable[TrueRoom], doors: tuple[Door, ...]) -> tuple[Furniture, ...]:
    """What fits of each room's furniture, one piece after the other."""
    standing: list[Furniture] = []
    for room in rooms:
        here: list[Furniture] = []
        for piece in _BY_USE[room.use]:
            found = find_place(rng, f"{room.name}/{piece.name}", piece, room, doors, here)
            here += [found] if found else []
        standing += here
    return tuple(standing)


def piece_of(furniture: Furniture) -> Piece:
    """What kind of furniture this is."""
    room_name, _, name = furniture.id.rpartition("/")
    del room_name
    return next(piece for pieces in _BY_USE.values() for piece in pieces if piece.name == name)


def find_place(
    rng: Generator, key: str, piece: Piece, room: TrueRoom, doors: tuple[Door, ...], others: Iterable[Furniture]
) -> Furniture | None:
    """The piece at a place where it blocks nothing; None where none was found."""
    others = tuple(others)
    own_doors = tuple(door for door in doors if room.name in door.rooms)
    for _ in range(ATTEMPTS):
        pose = _beside_wall(rng, piece, room.polygon) if piece.against_wall else _amid(rng, room.polygon)
        if pose is not None:
            placed = place(key, piece, room, pose)
            if may_stand(placed, room, own_doors, others):
                return placed
    return None


def place(key: str, piece: Piece, room: TrueRoom, pose: Pose) -> Furniture:
    """`pose` is of the middle of its back, looking along y."""
    w, d = piece.width, piece.depth
    parts = _legs(w, d) if piece.legs else [box(-w / 2, 0.0, w / 2, d)]
    moved = [shapely.transform(part, pose.apply) for part in parts]
    footprint = shapely.transform(box(-w / 2, 0.0, w / 2, d), pose.apply)
    return Furniture(
        key,
        room.name,
        footprint,
        as_multipolygon(moved[0] if len(moved) == 1 else shapely.union_all(moved)),
        piece.against_wall,
        piece.movable,
    )


def may_stand(piece: Furniture, room: TrueRoom, doors: tuple[Door, ...], others: tuple[Furniture, ...]) -> bool:
    """Within its room, on nothing else, clear of the doors, and the robot still gets from each door to every other and into the room."""
    if not shapely.contains(shapely.buffer(room.polygon, 1e-6, join_style="mitre"), piece.footprint):
        return False
    near = shapely.buffer(piece.footprint, 0.03)
    if any(shapely.intersects(near, other.footprint) for other in others):
        return False
    ways = [_way(door) for door in doors]
    if any(
        shapely.intersects(shapely.difference(way, door.polygon), piece.footprint)
        for way, door in zip(ways, doors, strict=True)
    ):
        return False
    solids = shapely.union_all([piece.solid, *(other.solid for other in others)])
    floor = shapely.buffer(shapely.difference(shapely.union_all([room.polygon, *ways]), solids), -PASSAGE_M)
    middles = shapely.MultiPoint([shapely.centroid(door.polygon) for door in doors])
    return any(shapely.contains(part, middles) and part.area > 0.25 * room.polygon.area for part in polygons_in(floor))


def _way(door: Door) -> Polygon:
    """The doorway with the floor on both sides that has to stay clear."""
    return thick_line(door.line, 2 * _SWING_M)


def _beside_wall(rng: Generator, piece: Piece, room: Polygon) -> Pose | None:
    """With its back along one of the room's walls, a finger's breadth off."""
    corners = shapely.get_coordinates(shapely.orient_polygons(room).exterior)
    runs = np.diff(corners, axis=0)
    lengths = np.linalg.norm(runs, axis=1)
    if not (long_enough := lengths >= piece.width + 0.02).any():
        return None
    wall = int(rng.choice(len(runs), p=lengths * long_enough / (lengths * long_enough).sum()))
    along = runs[wall] / lengths[wall]
    left = rng.uniform(piece.width / 2, lengths[wall] - piece.width / 2)
    off = np.array([-along[1], along[0]]) * rng.uniform(0.005, 0.03)
    x, y = corners[wall] + along * left + off
    return Pose(float(x), float(y), atan2(along[1], along[0]))


def _amid(rng: Generator, room: Polygon) -> Pose | None:
    """Anywhere in the room, along its walls or a little turned."""
    x0, y0, x1, y1 = room.bounds
    x, y = float(rng.uniform(x0, x1)), float(rng.uniform(y0, y1))
    corners = shapely.get_coordinates(room.exterior)
    run = corners[1] - corners[0]
    yaw = atan2(run[1], run[0]) + float(rng.choice([0.0, np.pi / 2, rng.uniform(-np.pi, np.pi)], p=[0.4, 0.4, 0.2]))
    return Pose(x, y, yaw) if shapely.contains(room, Point(x, y)) else None


def _legs(width: float, depth: float) -> list[Polygon]:
    across, along = width / 2 - _LEG_M, depth - 2 * _LEG_M
    feet: Points = as_points([(s * across, _LEG_M + t * along) for s in (-1, 1) for t in (0, 1)])
    half = _LEG_M / 2
    return [box(x - half, y - half, x + half, y + half) for x, y in feet.tolist()]
