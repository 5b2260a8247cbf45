"""Steps 2 to 4 of the transfer (paper, Algorithm 1): which obstacles of a new grid are wall and which are clutter, and where walls have gaps."""

from collections.abc import Sequence

import cv2
import numpy as np
import numpy.typing as npt
import shapely
from shapely import Polygon

from stillroom.maps.geometry import GRID_M, Line, Points, as_points, polygons_in
from stillroom.maps.grid import Cell, GridFrame, Mask, OccupancyGrid, look_up
from stillroom.maps.meta import MetaOccupancy
from stillroom.maps.semantics import SemanticMap
from stillroom.pipeline.cells import cells_in, nearest_cells, short_pieces
from stillroom.pipeline.gaps import Gap, WallSearch
from stillroom.pipeline.params import Params
from stillroom.pipeline.walls import Obstacles, seal_diagonals, separate_clutter

SUBPIXEL = 4
"""Binary digits that OpenCV keeps of a coordinate when it draws."""


def corrected(grid: OccupancyGrid, occupancy: Sequence[MetaOccupancy]) -> OccupancyGrid:
    """A copy of the grid with the meta-occupancy on it; the grid itself is never altered."""
    if not occupancy:
        return grid
    cells = grid.cells.copy()
    for cell, value in (("free", Cell.FREE), ("occupied", Cell.OCCUPIED)):
        cells[cells_in([o.polygon for o in occupancy if o.cell == cell], grid.frame)] = value
    return OccupancyGrid(grid.frame, cells)


def classify_obstacles(
    tracked: SemanticMap,
    inside: Mask,
    grid: OccupancyGrid,
    shut: Sequence[str],
    params: Params,
    meta_walls: Sequence[Polygon] = (),
) -> Obstacles:
    """Obstacles near a tracked room boundary are wall, those inside tracked rooms are clutter; the others are judged by their shape.

    What the robot did not see inside a tracked room still is floor; a shut door is an obstacle that moves, not a wall.
    `inside`: the cells of the tracked rooms. `meta_walls` are wall whatever was sensed there.
    """
    frame, cell = grid.frame, grid.frame.resolution
    # where a meta-divider stood and the robot senses something now, the wall is back
    boundary = [as_points(w.line) for w in tracked.walls] + [as_points(d.line) for d in tracked.meta.dividers]
    reaches = params.wall_classification_m, params.wall_offset_m, params.outline_margin_m
    near, along, margin = bands(boundary, reaches, frame)
    doors = filled([_doorway(d.line, params.door_thickness_m) for d in tracked.dividers if d.id in shut], frame)
    wall = grid.occupied & (near | ~inside) & ~doors
    furniture = wall & _furniture(grid.occupied & inside, near, along, params, cell)
    wall &= ~furniture
    # but what stands against a wall does not open it
    search = WallSearch.along(boundary, frame, params)
    behind = [gap.path for gap in search.gaps(wall)]
    wall |= furniture & band(behind, params.wall_offset_m, frame)
    floor = grid.free.copy()
    if np.count_nonzero(floor & ~inside & ~near) * cell**2 > params.floor_speck_m2:
        beyond = separate_clutter(grid, params).floor & ~inside & ~near
        floor |= beyond
        wall &= ~beyond
    wall |= _bridged(search.gaps(wall), frame, params)
    # edges of cupboards that touch a wall are no walls
    wall &= ~(short_pieces(wall, params.wall_spur_m / cell) & (near | inside))
    wall |= cells_in(meta_walls, frame)
    floor &= ~wall
    unseen = grid.unexplored & inside & ~wall
    unseen = _spread(unseen & ~margin, unseen, 2 * round(params.outline_margin_m / cell) + 2)
    floor |= (grid.occupied & ~wall & (inside | near)) | unseen
    return Obstacles(wall, grid.occupied & ~wall & inside, seal_diagonals(floor))


def _spread(mask: Mask, over: Mask, steps: int) -> Mask:
    """`mask` grown by so many cells at the most, from cell to cell with a common edge, within `over`."""
    cross = cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))
    for _ in range(steps):
        grown = np.asarray(cv2.dilate(mask.view(np.uint8), cross)).view(np.bool_) & over
        if np.array_equal(grown, mask):
            break
        mask = grown
    return mask


def filled(polygons: Sequence[Polygon], frame: GridFrame) -> Mask:
    """Cells whose centre lies in one of the polygons."""
    mask = np.zeros((frame.height, frame.width), np.uint8)
    if not polygons:
        return mask.view(np.bool_)
    # OpenCV fills every cell that the edge touches: half a cell less keeps shapes from growing mission by mission
    for polygon in polygons_in(shapely.buffer(list(polygons), -frame.resolution / 2, join_style="mitre")):
        rings = [drawn(shapely.get_coordinates(ring), frame) for ring in (polygon.exterior, *polygon.interiors)]
        hollow = np.zeros_like(mask) if len(rings) > 1 else mask
        cv2.fillPoly(hollow, rings, 1, shift=SUBPIXEL)
        mask |= hollow
    return mask.view(np.bool_)


def room_cells(semantic_map: SemanticMap, frame: GridFrame) -> Mask:
    """Cells of the rooms."""
    return filled([room.polygon for room in semantic_map.rooms], frame)


def band(lines: Sequence[Points], reach_m: float, frame: GridFrame) -> Mask:
    """Cells within `reach_m` of one of the lines."""
    return bands(lines, [reach_m], frame)[0]


def bands(lines: Sequence[Points], reaches_m: Sequence[float], frame: GridFrame) -> list[Mask]:
    """The same for each of the distances."""
    points = drawn(np.concatenate([np.zeros((0, 2)), *lines]), frame)
    ends = np.cumsum([len(line) for line in lines], dtype=np.int64).tolist()
    pieces = [points[end - len(line) : end] for line, end in zip(lines, ends, strict=True)]
    found = []
    for reach_m in reaches_m:
        mask = np.zeros((frame.height, frame.width), np.uint8)
        thickness = max(1, 2 * round(reach_m / frame.resolution) + 1)
        cv2.polylines(mask, pieces, False, 1, thickness, shift=SUBPIXEL)
        found.append(mask.view(np.bool_))
    return found


def drawn(points: Points, frame: GridFrame) -> npt.NDArray[np.int32]:
    """Map coordinates as OpenCV draws them: fixed point, cell centres at whole numbers."""
    return np.round((frame.to_cells(points) - 0.5) * (1 << SUBPIXEL)).astype(np.int32)


def _furniture(obstacles: Mask, near: Mask, along: Mask, params: Params, cell: float) -> Mask:
    """Of the obstacles inside rooms those that are no wall: what stands off the walls and is short, or reaches on into the room.

    `along` is the band of cells in which walls are expected. What touches furniture there belongs to it, or else the slice of a cupboard
    that is next to the wall would become wall, and with the next mission the next slice.
    """
    off_walls = obstacles & ~along
    count, found = cv2.connectedComponents(off_walls.view(np.uint8), connectivity=8)
    labels = np.asarray(found, np.int32)
    is_large = np.zeros(count, bool)
    is_large[labels[off_walls & ~near]] = True
    large = is_large.take(labels)
    reach = 2 * (round(params.wall_offset_m / cell) + 1) + 1
    grown = cv2.dilate(large.view(np.uint8), np.ones((reach, reach), np.uint8)) > 0
    return np.asarray((short_pieces(off_walls, params.wall_spur_m / cell) & ~large) | (grown & obstacles))


def _bridged(gaps: Sequence[Gap], frame: GridFrame, params: Params) -> Mask:
    """Gaps in walls that were whole, closed where every point still lies within the wall distance of an obstacle (paper, Table I)."""
    bridges = np.zeros((frame.height, frame.width), np.uint8)
    ends = np.array([gap.path[[0, -1]] for gap in gaps if gap.bounded]).reshape(-1, 2, 2)
    longest = 2 * params.wall_reach_m + frame.resolution
    short = np.hypot(*(ends[:, 1] - ends[:, 0]).T) <= longest + GRID_M
    for begin, end in nearest_cells(ends[short].reshape(-1, 2), frame).reshape(-1, 2, 2).tolist():
        cv2.line(bridges, begin, end, 1, 1)
    return bridges > 0


# -- doors ---------------------------------------------------------------------------------------------------------


def _doorway(line: Line, reach_m: float) -> Polygon:
    """The rectangle `reach_m` to both sides of a divider, no longer than it."""
    return shapely.buffer(shapely.LineString(line), reach_m, cap_style="flat")


def are_shut(lines: Sequence[Line], grid: OccupancyGrid, params: Params) -> Mask:
    """Which dividers obstacles cover for the most part, (n,)."""
    return covered(lines, grid, params) > params.door_cover


def covered(lines: Sequence[Line], grid: OccupancyGrid, params: Params) -> npt.NDArray[np.float64]:
    """Share of each divider on which obstacles lie, ends apart, (n,)."""
    cell = grid.frame.resolution
    ends = np.array(lines, dtype=np.float64).reshape(-1, 2, 2)
    along = ends[:, 1] - ends[:, 0]
    length = np.hypot(*along.T)
    normal = np.stack([-along[:, 1], along[:, 0]], 1) / np.maximum(length, 1e-9)[:, None]
    count = np.maximum(3, np.round(length / cell)).astype(np.int64)
    line = np.repeat(np.arange(len(lines)), count)
    number = np.arange(len(line)) - np.repeat(np.cumsum(count) - count, count)
    share = number * (0.8 / (count - 1))[line] + 0.1
    share[np.cumsum(count) - 1] = 0.9
    stations = ends[line, 0] + share[:, None] * along[line]
    depth = np.arange(-params.door_thickness_m, params.door_thickness_m + cell / 2, cell)
    at = stations[:, None] + depth[None, :, None] * normal[line][:, None]
    occupied = look_up(grid.occupied, grid.frame.to_cells(at.reshape(-1, 2)).reshape(at.shape), False)
    found = np.bincount(line, occupied.any(1), minlength=len(lines)) / count
    return np.asarray(np.where(length < cell, 0.0, found))
