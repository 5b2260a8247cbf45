"""Homes as they are in truth: rooms, walls, doors and furniture. Coordinates are metres in the home's own frame (REP-103)."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
import shapely
from shapely import MultiPolygon, Point, Polygon

from stillroom.maps.geometry import Line, Points, Pose, as_line, as_points, polygons_in

Passage = Literal["door", "opening"]
RoomUse = Literal["hall", "living", "dining", "kitchen", "bath", "bed", "work", "store"]


@dataclass(frozen=True)
class TrueRoom:
    """`polygon` goes from wall face to wall face; doorways belong to no room."""

    name: str
    use: RoomUse
    polygon: Polygon


@dataclass(frozen=True)
class Door:
    """A way through a wall between two rooms. A `door` has a leaf and can be shut, an `opening` can't.

    `polygon` is the piece of floor within the wall, `line` runs along its middle from jamb to jamb.
    """

    id: str
    kind: Passage
    rooms: tuple[str, str]
    line: Line
    polygon: Polygon


@dataclass(frozen=True)
class Furniture:
    """`solid` is what stands on the floor (of a table, its legs), `footprint` the place that it takes up."""

    id: str
    room: str
    footprint: Polygon
    solid: MultiPolygon
    against_wall: bool
    movable: bool


@dataclass(frozen=True)
class Window:
    """A window down to the floor: `panes` lie in an outer wall, `view` is what can be seen through them of the outside."""

    id: str
    panes: MultiPolygon
    view: MultiPolygon


@dataclass(frozen=True)
class Home:
    rooms: tuple[TrueRoom, ...]
    walls: MultiPolygon
    doors: tuple[Door, ...]
    furniture: tuple[Furniture, ...]
    dock: tuple[float, float]
    """Where the robot starts from."""
    windows: tuple[Window, ...] = ()
    traits: frozenset[str] = frozenset()
    """What is particular about it, by the names of the simulator's effects."""

    def room(self, name: str) -> TrueRoom:
        return next(room for room in self.rooms if room.name == name)

    def doors_of(self, name: str) -> tuple[Door, ...]:
        return tuple(door for door in self.doors if name in door.rooms)

    def moved(self, pose: Pose) -> "Home":
        """The same home elsewhere."""
        return Home(
            tuple(TrueRoom(room.name, room.use, _moved(room.polygon, pose)) for room in self.rooms),
            as_multipolygon(_moved(self.walls, pose)),
            tuple(_moved_door(door, pose) for door in self.doors),
            tuple(_moved_furniture(piece, pose) for piece in self.furniture),
            as_point(pose.apply(as_points(self.dock))),
            tuple(_moved_window(window, pose) for window in self.windows),
            self.traits,
        )


def carried(polygon: Polygon, move: Callable[[Points], Points]) -> Polygon:
    """A polygon with each vertex moved. Closes its rings itself: `move` may round the same point differently in two rows."""
    shell, *holes = [move(shapely.get_coordinates(ring)[:-1]) for ring in (polygon.exterior, *polygon.interiors)]
    return Polygon(shell, holes)


def as_multipolygon(geometry: shapely.Geometry) -> MultiPolygon:
    return MultiPolygon(polygons_in(geometry))


def as_point(points: Points) -> tuple[float, float]:
    """The one point of an array of shape (1, 2)."""
    ((x, y),) = points.tolist()
    return x, y


def clear_of_furniture(home: Home, margin_m: float) -> shapely.Geometry:
    """The floor where a disc of radius `margin_m` can stand: rooms and doorways without what stands on them."""
    floor = shapely.union_all([room.polygon for room in home.rooms] + [_threshold(door) for door in home.doors])
    return shapely.buffer(shapely.difference(floor, shapely.union_all([f.solid for f in home.furniture])), -margin_m)


def _threshold(door: Door) -> Polygon:
    """A doorway with a hair of both rooms, so that they are one piece with it."""
    return shapely.buffer(door.polygon, 1e-4, join_style="mitre")


def unreachable_rooms(home: Home, radius_m: float) -> tuple[str, ...]:
    """Names of the rooms that a robot of `radius_m` can't enter from its dock when all doors are open."""
    pieces = polygons_in(clear_of_furniture(home, radius_m))
    here = min(pieces, key=lambda piece: shapely.distance(piece, Point(home.dock)))
    return tuple(room.name for room in home.rooms if shapely.intersection(here, room.polygon).area < 0.2)


def _moved(geometry: shapely.Geometry, pose: Pose) -> shapely.Geometry:
    return shapely.transform(geometry, pose.apply)


def _moved_door(door: Door, pose: Pose) -> Door:
    line = as_line(pose.apply(as_points(door.line)))
    return Door(door.id, door.kind, door.rooms, line, _moved(door.polygon, pose))


def _moved_furniture(piece: Furniture, pose: Pose) -> Furniture:
    return Furniture(
        piece.id,
        piece.room,
        _moved(piece.footprint, pose),
        as_multipolygon(_moved(piece.solid, pose)),
        piece.against_wall,
        piece.movable,
    )


def _moved_window(window: Window, pose: Pose) -> Window:
    return Window(window.id, as_multipolygon(_moved(window.panes, pose)), as_multipolygon(_moved(window.view, pose)))


def box(x0: float, y0: float, x1: float, y1: float) -> Polygon:
    return Polygon(np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)]))
