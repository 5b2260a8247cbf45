"""The semantic map (paper, Table I): rooms, dividers, walls and clutter over an occupancy map. Coordinates are metres in the map frame."""

from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
import shapely
from shapely import Polygon

from stillroom.maps.geometry import Line, Point, Points, as_points, distinct
from stillroom.maps.grid import GridFrame
from stillroom.maps.meta import MapMeta

MadeBy = Literal["algorithm", "user"]
DividerKind = Literal["open", "door"]
Shut = Literal["never", "once", "asked"]
WallKind = Literal["wall", "open", "unseen"]
RestrictionKind = Literal["no_go", "no_mop", "virtual_wall"]
RoomKind = Literal[
    "kitchen", "dining_room", "living_room", "bedroom", "children_room", "bathroom", "toilet", "hall", "office",
    "utility_room", "storage", "garage", "balcony", "other",
]  # fmt: skip


@dataclass(frozen=True)
class Ids:
    """Numbers for new ids of one map: never reused, so that an id names one thing for ever.

    `prefix` keeps the maps of one robot apart ("" for its first map, "2-" for its second). `used` counts what was given out by kind.
    """

    prefix: str = ""
    used: tuple[tuple[str, int], ...] = ()

    def take(self, kind: str, count: int = 1) -> "tuple[tuple[str, ...], Ids]":
        """`count` new ids of one kind ("r" rooms, "d" dividers, ...) and what remains."""
        counts = dict(self.used)
        first = counts.get(kind, 0) + 1
        counts[kind] = first + count - 1
        return tuple(f"{kind}{self.prefix}{n}" for n in range(first, first + count)), replace(
            self, used=tuple(sorted(counts.items()))
        )


@dataclass(frozen=True)
class Room:
    """A space enclosed by wall sections and dividers. One polygon; its vertex order never changes within a version."""

    id: str
    name: str
    segment_id: int
    polygon: Polygon
    made_by: MadeBy = "algorithm"
    named_by: MadeBy = "algorithm"
    derived_from: str | None = None
    last_visited: str | None = None
    """Id of the newest mission that saw it."""
    pinned: bool = False
    anchor: Polygon | None = None
    """Its shape when a person last confirmed it, or when it was found, in the map's frame: it moves only with the whole map, rigidly."""
    kind: RoomKind | None = None
    """What it is used for, where a person said so."""


@dataclass(frozen=True)
class Divider:
    """A straight boundary between rooms; each end lies on a wall or on another divider. The user has the last word on it."""

    id: str
    line: Line
    kind: DividerKind = "open"
    made_by: MadeBy = "algorithm"
    rooms: tuple[str, ...] = ()
    shut: Shut = "never"
    """Whether obstacles closed it in some mission, and whether a person was asked since if it is a door."""


@dataclass(frozen=True)
class Wall:
    """A polyline of the outline: `wall` lies within the wall distance of occupied pixels, `open` borders unexplored space.

    `unseen` was wall when the robot was last there, and the mission under this map did not look.
    """

    id: str
    line: tuple[Point, ...]
    kind: WallKind = "wall"


@dataclass(frozen=True)
class Clutter:
    """A movable object: a region of occupancy pixels inside a room."""

    id: str
    polygon: Polygon


@dataclass(frozen=True)
class Restriction:
    """Where the robot must not go or mop. `virtual_wall` is a line of two points, the others are rings (first point not repeated)."""

    id: str
    kind: RestrictionKind
    shape: tuple[Point, ...]
    placed: bool = True


@dataclass(frozen=True)
class Phantom:
    """Space that is not a real place, as a person said: a mirror's image, what lies behind a window, the outside.

    `shape` is a ring of three or more points, first point not repeated. It is no floor in this or any later mission.
    """

    id: str
    shape: tuple[Point, ...]


@dataclass(frozen=True)
class SemanticMap:
    frame: GridFrame
    rooms: tuple[Room, ...] = ()
    dividers: tuple[Divider, ...] = ()
    walls: tuple[Wall, ...] = ()
    clutter: tuple[Clutter, ...] = ()
    restrictions: tuple[Restriction, ...] = ()
    meta: MapMeta = field(default=MapMeta.EMPTY)
    phantoms: tuple[Phantom, ...] = ()
    ids: Ids = Ids()

    def room(self, room_id: str) -> Room | None:
        return next((room for room in self.rooms if room.id == room_id), None)

    def divider(self, divider_id: str) -> Divider | None:
        return next((divider for divider in self.dividers if divider.id == divider_id), None)

    def vertices(self) -> Points:
        """Every vertex of the map's semantics and the corners of its grid, shape (n, 2)."""
        frame = self.frame
        corners = as_points([(0, 0), (frame.width, 0), (frame.width, frame.height), (0, frame.height)])
        lines = [as_points(divider.line) for divider in self.dividers] + [as_points(wall.line) for wall in self.walls]
        rings = [shapely.get_coordinates(room.polygon) for room in self.rooms]
        shapes = [as_points(shape) for shape in self._drawn_shapes()]
        return distinct(np.concatenate([frame.to_map(corners), *rings, *lines, *shapes]))[0]

    def _drawn_shapes(self) -> list[tuple[Point, ...]]:
        return [r.shape for r in self.restrictions] + [p.shape for p in self.phantoms]
