"""Maps drawn in text, top row first: `#` occupied, `.` free, a space unexplored; a letter is free and names the room around it."""

from collections.abc import Mapping
from dataclasses import dataclass
from textwrap import dedent

import numpy as np
import shapely
from shapely import Polygon

from stillroom.maps.geometry import Points, Pose, as_points
from stillroom.maps.grid import Cell, GridFrame, OccupancyGrid
from stillroom.maps.semantics import Divider, Room, SemanticMap


@dataclass(frozen=True, eq=False)
class Drawing:
    """`letters`: the points (n, 2) of the map frame at which each letter stands; `size_m` is the side of one character."""

    grid: OccupancyGrid
    letters: Mapping[str, Points]
    size_m: float

    def room(self, semantic_map: SemanticMap, letter: str) -> Room:
        """The one room in which every `letter` stands."""
        found = [room for room in semantic_map.rooms if _holds(room.polygon, self.letters[letter])]
        assert len(found) == 1, f"{len(found)} rooms hold every {letter}"
        return found[0]

    def rooms(self, semantic_map: SemanticMap) -> dict[str, Room]:
        """The room of each letter; every room has a letter and no two letters share a room."""
        rooms = {letter: self.room(semantic_map, letter) for letter in self.letters}
        ids = sorted(room.id for room in rooms.values())
        assert ids == sorted(room.id for room in semantic_map.rooms), "the map's rooms are not those that were drawn"
        return rooms

    def divider(self, semantic_map: SemanticMap, first: str, second: str) -> Divider:
        """The one divider between two letters' rooms."""
        sides = {self.room(semantic_map, first).id, self.room(semantic_map, second).id}
        found = [divider for divider in semantic_map.dividers if sides == set(divider.rooms)]
        assert len(found) == 1, f"{len(found)} dividers between {first} and {second}"
        return found[0]


def draw(text: str, cells: int = 4, resolution: float = 0.05, origin: Pose = Pose(), margin: int = 0) -> Drawing:
    """`text` as a grid; each character is a square of `cells` x `cells` cells of `resolution` metres.

    `origin` is the pose of the drawing's lower left corner; `margin` characters of unexplored space are put around it.
    Indentation and empty lines at both ends don't count.
    """
    rows = dedent(text).strip("\n").split("\n")
    width = max(map(len, rows))
    signs = np.array([list(row.ljust(width)) for row in reversed(rows)])
    signs = np.pad(signs, margin, constant_values=" ")
    values = np.full(signs.shape, Cell.FREE, np.uint8)
    values[signs == "#"] = Cell.OCCUPIED
    values[signs == " "] = Cell.UNEXPLORED
    x, y = origin.apply(as_points([(-margin * cells * resolution,) * 2]))[0].tolist()
    frame = GridFrame(resolution, signs.shape[1] * cells, signs.shape[0] * cells, Pose(x, y, origin.yaw))
    grid = OccupancyGrid(frame, np.kron(values, np.ones((cells, cells), np.uint8)))
    places = {
        str(sign): frame.to_map(as_points(np.argwhere(signs == sign)[:, ::-1] + 0.5) * cells)
        for sign in np.unique(signs)
        if sign.isalpha()
    }
    return Drawing(grid, places, cells * resolution)


def paint(grid: OccupancyGrid, cell: Cell, *shapes: Polygon) -> OccupancyGrid:
    """`grid` with every cell whose centre lies in one of `shapes` set to `cell`."""
    frame = grid.frame
    columns, rows = np.meshgrid(np.arange(frame.width) + 0.5, np.arange(frame.height) + 0.5)
    centres = frame.to_map(as_points(np.stack([columns.ravel(), rows.ravel()], 1)))
    inside = shapely.contains_xy(shapely.union_all(list(shapes)), centres).reshape(grid.cells.shape)
    return OccupancyGrid(frame, np.where(inside, np.uint8(cell), grid.cells))


def rectangle(x0: float, y0: float, x1: float, y1: float) -> Polygon:
    return Polygon([(x0, y0), (x1, y0), (x1, y1), (x0, y1)])


def iou(first: Polygon, second: Polygon) -> float:
    """Common area as a share of the area of both together."""
    return float(shapely.intersection(first, second).area / shapely.union(first, second).area)


def _holds(polygon: Polygon, points: Points) -> bool:
    return bool(shapely.contains_xy(polygon, points).all())
