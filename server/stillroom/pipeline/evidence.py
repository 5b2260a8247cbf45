"""What a grid says for and against walls that are known: which are found again, which are gone, and which obstacles are new."""

import cv2
import numpy as np
import numpy.typing as npt
import shapely

from stillroom.maps.geometry import line_strings
from stillroom.maps.grid import Cell, GridFrame, Mask, OccupancyGrid, look_up
from stillroom.maps.semantics import SemanticMap
from stillroom.pipeline.alignment import WallSamples
from stillroom.pipeline.cells import nearest_cells, short_pieces

FOUND_M = 0.15
"""A wall is found again where an obstacle lies within this distance, and the obstacle is not new."""
DOORWAY_M = 0.25
"""Obstacles this near to a divider are a door, or what stands in the doorway."""
PIECE_M = 0.50
"""An obstacle smaller than this is no wall, but the leg of a table."""


def look_for_walls(samples: WallSamples, near: Mask, grid: OccupancyGrid) -> tuple[Mask, Mask]:
    """Which wall samples are found again, and which are in sight: those, and the others where the grid is free right through the wall.

    `near`: the cells within `FOUND_M` of whatever counts as the wall.
    """

    def cell_at(beyond_m: float) -> npt.NDArray[np.uint8]:
        return look_up(grid.cells, grid.frame.to_cells(samples.points + beyond_m * samples.normals), Cell.UNEXPLORED)

    close = look_up(near, grid.frame.to_cells(samples.points), False)
    found = close & (cell_at(-FOUND_M) != Cell.UNEXPLORED)
    gone = ~close & (cell_at(0.0) == Cell.FREE) & (cell_at(FOUND_M) == Cell.FREE)
    return found, found | gone


def known_cells(semantic_map: SemanticMap, frame: GridFrame) -> Mask:
    """Cells in which obstacles are nothing new: near walls, doorways and clutter."""
    known = np.zeros((frame.height, frame.width), np.uint8)
    walls = _cells_of(line_strings([wall.line for wall in semantic_map.walls]), frame)
    cv2.polylines(known, walls, False, 1, 2 * in_cells(FOUND_M, frame) + 1)
    doorways = _cells_of(line_strings([divider.line for divider in semantic_map.dividers]), frame)
    cv2.polylines(known, doorways, False, 1, 2 * in_cells(DOORWAY_M, frame) + 1)
    rings = _cells_of(shapely.get_exterior_ring([clutter.polygon for clutter in semantic_map.clutter]), frame)
    for ring in rings:
        cv2.fillPoly(known, [ring], 1)
    cv2.polylines(known, rings, True, 1, 2 * in_cells(FOUND_M, frame) + 1)
    return known > 0


def floor_cells(semantic_map: SemanticMap, frame: GridFrame) -> Mask:
    """Cells of the rooms, to half a cell."""
    floor = np.zeros((frame.height, frame.width), np.uint8)
    for ring in _cells_of(shapely.get_exterior_ring([room.polygon for room in semantic_map.rooms]), frame):
        cv2.fillPoly(floor, [ring], 1)
    return floor > 0


def _cells_of(lines: npt.NDArray[np.object_], frame: GridFrame) -> list[npt.NDArray[np.int32]]:
    """The cells nearest to each line's points, (m, 2)."""
    points = nearest_cells(shapely.get_coordinates(lines), frame)
    return np.split(points, np.cumsum(shapely.get_num_coordinates(lines))[:-1]) if len(lines) else []


def faces_of_obstacles(grid: OccupancyGrid) -> Mask:
    """Obstacles where they can be touched: filled ones count as much as those of which only the face is seen."""
    cross = cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))
    return grid.occupied & (cv2.dilate(grid.free.view(np.uint8), cross) > 0)


def large_pieces(mask: Mask, frame: GridFrame) -> Mask:
    """`mask` without the pieces that are smaller than `PIECE_M`."""
    return mask & ~short_pieces(mask, PIECE_M / frame.resolution)


def count_in_large_pieces(mask: Mask, frame: GridFrame) -> int:
    """The cells of `large_pieces`."""
    return int(np.count_nonzero(large_pieces(mask, frame)))


def grown(mask: Mask, reach_m: float, frame: GridFrame) -> Mask:
    """The cells within `reach_m` of those of `mask`."""
    across = 2 * in_cells(reach_m, frame) + 1
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (across, across))
    return cv2.dilate(mask.view(np.uint8), disc) > 0


def in_cells(length_m: float, frame: GridFrame) -> int:
    return max(1, round(length_m / frame.resolution))
