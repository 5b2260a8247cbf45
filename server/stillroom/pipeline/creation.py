"""Semantic map creation (paper, section II-A): walls, clutter, dividers and rooms of a map without history, by algorithm."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np
import numpy.typing as npt
import shapely
from shapely import MultiPolygon, Polygon

from stillroom.maps.geometry import Line, Points, Pose, as_points, polygons_in
from stillroom.maps.grid import Cell, GridFrame, Mask, OccupancyGrid, look_up
from stillroom.maps.semantics import Divider, Ids, Room, SemanticMap
from stillroom.pipeline.cells import label_cells
from stillroom.pipeline.params import PARAMS, Params
from stillroom.pipeline.rooms import new_rooms, partition, rooms_beside
from stillroom.pipeline.segmentation import propose_dividers
from stillroom.pipeline.walls import (
    clutter_features,
    outline,
    separate_clutter,
    wall_features,
)

NARROW_M = 0.3
"""No robot fits into what is narrower on average."""
LEAST_COMPACT = 0.35
"""Area as a share of that of the circle with the same perimeter: rooms have 0.5 and more, beams of a sensor less than 0.2."""
MOSTLY_WALLED = 0.75
"""Where walls bound less than this share of all rooms, it says nothing of one that walls don't bound it."""


def create_map(grid: OccupancyGrid, mission_id: str, ids: Ids, params: Params = PARAMS) -> SemanticMap:
    """Rooms, dividers, walls and clutter of `grid`; new ids are taken from `ids`."""
    seen = explored_part(grid, params)
    obstacles = separate_clutter(without_specks(seen, params), params)
    mask = without_slots(obstacles.floor, seen.frame.resolution, params)
    floor = outline(mask, seen.frame, params, smallest_m2=params.pocket_area_m2)
    lines = propose_dividers(floor, mask, seen.frame, params)
    polygons = partition(floor, lines, params.face_area_m2)
    near_walls = seen.near_occupied(params.wall_reach_m)
    entered = _entered(polygons, lines, near_walls, seen.frame, params)
    if len(entered) < len(polygons):
        polygons, floor = entered, shapely.orient_polygons(MultiPolygon(polygons_in(shapely.union_all(entered))))
    rooms, ids = new_rooms(polygons, mission_id, ids)
    dividers, ids = new_dividers(lines, rooms, ids)
    dividers = tuple(divider for divider in dividers if len(divider.rooms) > 1)
    (version,), ids = ids.take("v")
    return SemanticMap(
        frame=grid.frame,
        rooms=_with_hallways(rooms, dividers, params),
        dividers=dividers,
        walls=wall_features(floor, near_walls, seen.frame, version[1:]),
        clutter=clutter_features(obstacles.clutter, seen.frame, version[1:], params),
        ids=ids,
    )


def without_slots(floor: Mask, cell: float, params: Params) -> Mask:
    """`floor` without gaps too narrow to lead anywhere: single cells of thin walls that were sensed as free. `cell`: metres."""
    across = max(int(params.slot_width_m / cell + 1e-6), 1) + 1
    obstacles = np.logical_not(floor).view(np.uint8)
    sealed = obstacles.copy()
    for line in (np.ones((1, across), np.uint8), np.ones((across, 1), np.uint8)):
        rows, columns = line.shape
        grown = cv2.dilate(obstacles, line, anchor=(columns // 2, rows // 2))
        shrunk = cv2.erode(grown, line, anchor=((columns - 1) // 2, (rows - 1) // 2))
        sealed |= np.asarray(shrunk, np.uint8)
    return np.asarray(sealed == 0)


def without_specks(grid: OccupancyGrid, params: Params) -> OccupancyGrid:
    """`grid` with free cells for what is no larger than a slot, or a single cell, and stands free or sticks out of the face of a wall.

    Walls as thin as that stay, and so do their ends.
    """
    size = max(int(params.slot_width_m / grid.frame.resolution + 1e-6), 1)
    alone = -np.ones((size + 2, size + 2), np.int8)
    alone[1:-1, 1:-1] = 0
    on_wall = alone.copy()
    on_wall[-1] = 1
    obstacles, block = np.where(grid.occupied, np.uint8(255), np.uint8(0)), np.ones((size, size), np.uint8)
    at = np.zeros_like(obstacles)
    for pattern in (alone, *(np.rot90(on_wall, turns) for turns in range(4))):
        # the block's first cell: where the pattern's own is, one row and column on
        at |= np.asarray(cv2.morphologyEx(obstacles, cv2.MORPH_HITMISS, np.ascontiguousarray(pattern), anchor=(1, 1)))
    specks = np.asarray(cv2.dilate(at, block, anchor=(size - 1, size - 1))) > 0
    return OccupancyGrid(grid.frame, np.where(specks & grid.occupied, np.uint8(Cell.FREE), grid.cells))


def _entered(
    polygons: Sequence[Polygon],
    lines: Sequence[Line],
    near_occupied: Mask,
    frame: GridFrame,
    params: Params,
) -> tuple[Polygon, ...]:
    """The rooms without what was only seen into, through a window or a pane: too narrow for a robot, or drawn out and hardly bound by walls.

    The largest room stays; walls say nothing where the robot saw few of them anywhere.
    """
    wide = [polygon for k, polygon in enumerate(polygons) if k == 0 or 2 * polygon.area >= NARROW_M * polygon.length]
    if len(wide) < 2:
        return tuple(wide)
    rings = shapely.segmentize([polygon.exterior for polygon in wide], 2 * frame.resolution)
    samples, room = shapely.get_coordinates(rings, return_index=True)
    walled = _beside_cells(near_occupied, frame.to_cells(samples))
    if walled.mean() < MOSTLY_WALLED:
        return tuple(wide)
    share = np.bincount(room, walled, len(wide)) / np.bincount(room, minlength=len(wide))
    divided = np.zeros(len(wide))
    for line, sides in zip(lines, rooms_beside(lines, wide), strict=True):
        divided[list(sides)] += np.hypot(line[1][0] - line[0][0], line[1][1] - line[0][1])
    perimeter = shapely.length(rings)
    enclosed = share * perimeter >= params.room_enclosure * (perimeter - divided)
    compact = 4 * np.pi * shapely.area(wide) >= LEAST_COMPACT * perimeter**2
    compact[0] = True
    return tuple(polygon for polygon, kept in zip(wide, (enclosed | compact).tolist(), strict=True) if kept)


def _beside_cells(mask: Mask, places: Points) -> Mask:
    """Which places (n, 2) in cells lie in cells of the mask: those on a border between cells lie in those of both sides."""
    corners = np.array([(-0.1, -0.1), (-0.1, 0.1), (0.1, -0.1), (0.1, 0.1)])
    return np.asarray(look_up(mask, places[:, None] + corners, False).any(1))


def _with_hallways(rooms: Sequence[Room], dividers: Sequence[Divider], params: Params) -> tuple[Room, ...]:
    """The rooms, and those called hallways that are narrow, long, and lead to several others."""
    doors = Counter(room_id for divider in dividers for room_id in divider.rooms)
    named, count = [], 0
    for room in rooms:
        if doors[room.id] >= params.hallway_doors and _is_narrow(room.polygon, params):
            count += 1
            named.append(replace(room, name="Hallway" if count == 1 else f"Hallway {count}"))
        else:
            named.append(room)
    return tuple(named)


def _is_narrow(polygon: Polygon, params: Params) -> bool:
    radius = shapely.maximum_inscribed_circle(polygon, tolerance=0.1).length
    return bool(2 * radius <= params.hallway_width_m and polygon.area >= params.hallway_stretch * (2 * radius) ** 2)


def explored_part(grid: OccupancyGrid, params: Params) -> OccupancyGrid:
    """What is free with as much around it as walls can reach: the map is the same, however much is unexplored around it."""
    left, bottom, width, height = cv2.boundingRect(grid.free.view(np.uint8))
    margin = int(np.ceil(params.wall_reach_m / grid.frame.resolution)) + 2
    west, south, east, north = left - margin, bottom - margin, left + width + margin, bottom + height + margin
    inside = grid.cells[max(south, 0) : north, max(west, 0) : east]
    missing = ((max(-south, 0), max(north - grid.frame.height, 0)), (max(-west, 0), max(east - grid.frame.width, 0)))
    x, y = grid.frame.to_map(as_points([(west, south)]))[0].tolist()
    frame = GridFrame(grid.frame.resolution, east - west, north - south, Pose(x, y, grid.frame.origin.yaw))
    return OccupancyGrid(frame, np.pad(inside, missing, constant_values=Cell.UNEXPLORED))


def room_cells(semantic_map: SemanticMap, grid: OccupancyGrid, params: Params = PARAMS) -> npt.NDArray[np.int32]:
    """Which room each free cell is in, (height, width): k + 1 for the map's room k, 0 for none.

    Rooms have straight edges where cells are ragged: free cells left out beside an edge belong to the room that they are connected to.
    """
    labels = np.where(grid.free, label_cells([room.polygon for room in semantic_map.rooms], grid.frame), 0)
    cross = cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))
    for _ in range(int(np.ceil(3 * params.outline_tolerance_m / grid.frame.resolution))):
        left_out = grid.free & (labels == 0)
        labels[left_out] = cv2.dilate(labels.astype(np.uint16), cross)[left_out]
    return labels.astype(np.int32)


def new_dividers(lines: Sequence[Line], rooms: Sequence[Room], ids: Ids) -> tuple[tuple[Divider, ...], Ids]:
    fresh, ids = ids.take("d", len(lines))
    beside = rooms_beside(lines, [room.polygon for room in rooms])
    dividers = tuple(
        Divider(divider_id, line, rooms=tuple(rooms[i].id for i in sides))
        for divider_id, line, sides in zip(fresh, lines, beside, strict=True)
    )
    return dividers, ids
