"""Semantic map creation (paper, section II-A): walls, clutter, dividers and rooms of a map without history, by algorithm."""

from collections.abc import Sequence

import cv2
import numpy as np
import numpy.typing as npt

from stillroom.maps.geometry import Line, Pose, as_points
from stillroom.maps.grid import Cell, GridFrame, OccupancyGrid
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


def create_map(grid: OccupancyGrid, mission_id: str, ids: Ids, params: Params = PARAMS) -> SemanticMap:
    """Rooms, dividers, walls and clutter of `grid`; new ids are taken from `ids`."""
    seen = _explored_part(grid, params)
    obstacles = separate_clutter(seen, params)
    floor = outline(obstacles.floor, seen.frame, params, smallest_m2=params.pocket_area_m2)
    lines = propose_dividers(floor, obstacles.floor, seen.frame, params)
    polygons = partition(floor, lines, params.face_area_m2)
    rooms, ids = new_rooms(polygons, mission_id, ids)
    dividers, ids = new_dividers(lines, rooms, ids)
    dividers = tuple(divider for divider in dividers if len(divider.rooms) > 1)
    (version,), ids = ids.take("v")
    return SemanticMap(
        frame=grid.frame,
        rooms=rooms,
        dividers=dividers,
        walls=wall_features(floor, _occupied_distance(seen), seen.frame, version[1:], params),
        clutter=clutter_features(obstacles.clutter, seen.frame, version[1:], params),
        ids=ids,
    )


def _occupied_distance(grid: OccupancyGrid) -> npt.NDArray[np.float32]:
    """`grid.occupied_distance` to a hundredth, in a third of the time: a map has it looked up along walls once."""
    if not grid.occupied.any():
        return np.full(grid.cells.shape, np.inf, np.float32)
    distance = cv2.distanceTransform((~grid.occupied).view(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_5)
    return np.asarray(distance, np.float32) * np.float32(grid.frame.resolution)


def _explored_part(grid: OccupancyGrid, params: Params) -> OccupancyGrid:
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
