"""The occupancy map as the robot sensed it: cells and the frame they lie in. Nothing here ever alters a cell."""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
import numpy.typing as npt

from stillroom.maps.geometry import Points, Pose

Cells = npt.NDArray[np.uint8]
"""Shape (height, width), values of `Cell`; row 0 is the lowest y."""
Mask = npt.NDArray[np.bool_]
"""Shape (height, width); row 0 is the lowest y."""


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
        return self.origin.inverse().apply(points) / self.resolution

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

    @property
    def free(self) -> Mask:
        return np.equal(self.cells, Cell.FREE)

    @property
    def occupied(self) -> Mask:
        return np.equal(self.cells, Cell.OCCUPIED)

    @property
    def unexplored(self) -> Mask:
        return np.equal(self.cells, Cell.UNEXPLORED)
