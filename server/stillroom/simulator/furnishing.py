"""Furniture: what stands in which rooms, and where it can stand without blocking the way."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from math import atan2

import numpy as np
import shapely
from numpy.random import Generator
from shapely import MultiPoint, Point, Polygon

from stillroom.maps.geometry import Point as Position
from stillroom.maps.geometry import Points, Pose, as_points, polygons_in
from stillroom.simulator.homes import Door, Furniture, Home, RoomUse, TrueRoom, as_multipolygon, box
from stillroom.simulator.plans import thick_line

ATTEMPTS = 12
PASSAGE_M = 0.25
"""Half of the width that furniture leaves free everywhere between a room's doors: a robot gets through."""
_SWING_M = 0.75
"""Nothing stands this near to a doorway."""
_DOCK_CLEAR_M = 0.45
_OPEN_SHARE = 0.25
"""Of a room's floor stays within the robot's reach."""
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
    "dining": (
        Piece("dining table", 1.6, 0.9, against_wall=False, legs=True),
        *(Piece(f"chair {i}", 0.42, 0.42, against_wall=False, legs=True) for i in range(1, 5)),
        Piece("cabinet", 1.2, 0.45),
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


@dataclass(frozen=True)
class Site:
    """A room to be furnished: its doors, and the robot's `dock` where it stands there."""

    room: TrueRoom
    doors: tuple[Door, ...]
    dock: Position | None


def site(name: str, rooms: Iterable[TrueRoom], doors: Iterable[Door], dock: Position) -> Site:
    room = next(room for room in rooms if room.name == name)
    inside = shapely.contains_xy(room.polygon, *dock)
    return Site(room, tuple(door for door in doors if name in door.rooms), dock if inside else None)


def furnish(
    rng: Generator, rooms: tuple[TrueRoom, ...], doors: tuple[Door, ...], dock: Position
) -> tuple[Furniture, ...]:
    """What fits of each room's furniture, one piece after the other."""
    standing: list[Furniture] = []
    for room in rooms:
        here: list[Furniture] = []
        for piece in _BY_USE[room.use]:
            found = find_place(rng, f"{room.name}/{piece.name}", piece, site(room.name, rooms, doors, dock), here)
            here += [found] if found else []
        standing += here
    return tuple(standing)


def piece_of(furniture: Furniture) -> Piece:
    """What kind of furniture this is."""
    corners = shapely.get_coordinates(furniture.footprint)
    width, depth = np.linalg.norm(np.diff(corners[:3], axis=0), axis=1).tolist()
    name, legs = furniture.id.rpartition("/")[2], len(furniture.solid.geoms) > 1
    return Piece(name, width, depth, furniture.against_wall, legs, furniture.movable)


def moved_elsewhere(home: Home, piece: Furniture, rng: Generator) -> Home:
    """The home with one piece elsewhere in its room; as it was where no other place is free."""
    where = site(piece.room, home.rooms, home.doors, home.dock)
    others = [other for other in home.furniture if other.room == piece.room and other.id != piece.id]
    found = find_place(rng, piece.id, piece_of(piece), where, others)
    return replace(home, furniture=tuple((found or f) if f.id == piece.id else f for f in home.furniture))


def find_place(rng: Generator, key: str, piece: Piece, at: Site, others: Iterable[Furniture]) -> Furniture | None:
    """The piece at a place where it blocks nothing; None where none was found."""
    others = tuple(others)
    for _ in range(ATTEMPTS):
        pose = _beside_wall(rng, piece, at.room.polygon) if piece.against_wall else _amid(rng, at.room.polygon)
        if pose is not None:
            placed = place(key, piece, at.room, pose)
            if may_stand(placed, at, others):
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


def may_stand(piece: Furniture, at: Site, others: tuple[Furniture, ...]) -> bool:
    """Within its room, on nothing else, and in nobody's way."""
    room = shapely.buffer(at.room.polygon, 1e-6, join_style="mitre")
    near = shapely.buffer(piece.footprint, 0.03)
    return (
        shapely.contains(room, piece.footprint)
        and not any(shapely.intersects(near, other.footprint) for other in others)
        and not any(shapely.intersects(place, piece.footprint) for place in _kept_clear(at))
        and _passable(at, [piece.solid, *(other.solid for other in others)])
    )


def _kept_clear(at: Site) -> list[shapely.Geometry]:
    """Around the dock, and before the doors."""
    places = [shapely.intersection(_way(door), at.room.polygon) for door in at.doors]
    return places if at.dock is None else [*places, shapely.buffer(Point(at.dock), _DOCK_CLEAR_M)]


def _passable(at: Site, solids: list[shapely.Geometry]) -> bool:
    """Whether the robot gets from each of the doors and the dock to all the others, and to much of the room."""
    ways = [_way(door) for door in at.doors]
    floor = shapely.difference(shapely.union_all([at.room.polygon, *ways]), shapely.union_all(solids))
    stops = [shapely.centroid(door.polygon) for door in at.doors] + ([] if at.dock is None else [Point(at.dock)])
    pieces = polygons_in(shapely.buffer(floor, -PASSAGE_M))
    return any(
        shapely.contains(part, MultiPoint(stops)) and part.area > _OPEN_SHARE * at.room.polygon.area for part in pieces
    )


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
