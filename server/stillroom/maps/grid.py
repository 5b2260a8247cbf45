"""The occupancy map as the robot sensed it: cells and the frame they lie in. Nothing here ever alters a cell."""

from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property
from typing import TypeVar

import cv2
import numpy as np
import numpy.typing as npt

from stillroom.maps.geometry import Points, Pose

Cells = npt.NDArray[np.uint8]
"""Shape (height, width), values of `Cell`; row 0 is the lowest y."""
Mask = npt.NDArray[np.bool_]
"""Shape (height, width); row 0 is the lowest y."""


FEW = 8
"""Cells."""
LARGEST = 20_000_000
"""Cells of a grid, at the most."""


class Cell(IntEnum):
    UNEXPLORED = 0
    FREE = 1
    OCCUPIED = 2


@dataclass(frozen=True)
class GridFrame:
    """Where a grid lies: `origin` is the pose of the outer corner of its lower-left cell in the map frame; `resolution` in metres a cell.

    Cell coordinates are continuous (column, row): cell (c, r) covers [c, c + 1) x [r, r + 1).
    """

    resolution: float
    width: int
    height: int
    origin: Pose = Pose()

    def to_cells(self, points: Points) -> Points:
        """Map frame (metres) to continuous cell coordinates, both of shape (n, 2)."""
        return self._from_map.apply(points) / self.resolution

    @cached_property
    def _from_map(self) -> Pose:
        return self.origin.inverse()

    def to_cells_inside(self, points: Points) -> Points:
        """The same, but places up to half a cell off the grid are on it: outlines end on its very edge."""
        cells = self.to_cells(points)
        inside = np.clip(cells, 0.0, (self.width - 0.5, self.height - 0.5))
        return np.where(np.abs(cells - inside) <= 1.0, inside, cells)

    def to_map(self, coordinates: Points) -> Points:
        """Continuous cell coordinates to the map frame (metres), both of shape (n, 2)."""
        return self.origin.apply(coordinates * self.resolution)


@dataclass(frozen=True, eq=False)
class OccupancyGrid:
    """Occupancy pixels with their frame. The array is made read-only."""

    frame: GridFrame
    cells: Cells

    def __post_init__(self) -> None:
        if self.cells.shape != (self.frame.height, self.frame.width) or self.cells.dtype != np.uint8:
            raise ValueError(f"cells of shape {self.cells.shape} and type {self.cells.dtype} don't fit the frame")
        self.cells.setflags(write=False)

    @cached_property
    def free(self) -> Mask:
        return np.equal(self.cells, Cell.FREE)

    @cached_property
    def occupied(self) -> Mask:
        return np.equal(self.cells, Cell.OCCUPIED)

    @cached_property
    def unexplored(self) -> Mask:
        return np.equal(self.cells, Cell.UNEXPLORED)

    @cached_property
    def occupied_distance(self) -> npt.NDArray[np.float32]:
        """Metres from each cell's centre to the nearest occupied cell's; infinite where there is none."""
        return distance_to(self.occupied, self.frame.resolution)

    def near_occupied(self, reach_m: float) -> Mask:
        """Cells whose centre is within `reach_m` of an occupied cell's. Where that is a few cells, much sooner than by `occupied_distance`."""
        steps = int(reach_m / self.frame.resolution + 1e-6)
        if steps > FEW:
            return self.occupied_distance <= reach_m + 1e-6
        across = np.arange(-steps, steps + 1) * self.frame.resolution
        disc = (np.hypot(across[:, None], across) <= reach_m + 1e-9).view(np.uint8)
        near = cv2.dilate(self.occupied.view(np.uint8), disc, borderType=cv2.BORDER_CONSTANT, borderValue=0)
        return np.asarray(near, np.uint8).view(np.bool_)

    def covering(self, points: Points) -> "OccupancyGrid":
        """The grid with as much unexplored space around it as it takes to hold `points` (n, 2) of the map frame.

        As it is where that would take more than `LARGEST` cells: points that far off are a mistake.
        """
        if not len(points):
            return self
        cells = self.frame.to_cells(points)
        west, south = np.maximum(np.ceil(-cells.min(0)), 0).astype(int).tolist()
        size = (self.frame.width, self.frame.height)
        east, north = np.maximum(np.ceil(cells.max(0)) - size, 0).astype(int).tolist()
        cells_then = (self.frame.width + west + east) * (self.frame.height + south + north)
        if cells_then == self.cells.size or cells_then > max(LARGEST, self.cells.size):
            return self
        corner = self.frame.to_map(np.array([[-west, -south]], dtype=np.float64))[0].tolist()
        frame = GridFrame(
            self.frame.resolution,
            self.frame.width + west + east,
            self.frame.height + south + north,
            Pose(corner[0], corner[1], self.frame.origin.yaw),
        )
        return OccupancyGrid(frame, np.pad(self.cells, ((south, north), (west, east))))


def distance_to(mask: Mask, resolution: float) -> npt.NDArray[np.float32]:
    """Metres from each cell's centre to the centre of the nearest cell of `mask`; infinite where there is none."""
    if not mask.any():
        return np.full(mask.shape, np.inf, np.float32)
    return cv2.distanceTransform((~mask).view(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE) * np.float32(resolution)


Value = TypeVar("Value", bound=np.generic)


def look_up(values: npt.NDArray[Value], coordinates: Points, outside: float) -> npt.NDArray[Value]:
    """`values` at continuous cell coordinates of shape (..., 2); `outside` beyond the grid."""
    height, width = values.shape
    column, row = (np.floor(coordinates[..., k]).astype(np.int64) for k in (0, 1))
    inside = (column >= 0) & (row >= 0) & (column < width) & (row < height)
    found = values.ravel().take(row * width + column, mode="clip")
    return np.where(inside, found, values.dtype.type(outside))
