"""Phantoms: space that is not a real place, as a person said. It is cut out of the floor, and out of every later mission's grid."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from shapely import Polygon

from stillroom.maps.geometry import as_points, as_tuples, fit_pose
from stillroom.maps.grid import Cell, OccupancyGrid
from stillroom.maps.motion import Motion
from stillroom.maps.semantics import Phantom
from stillroom.pipeline.cells import cells_in


def without_phantoms(grid: OccupancyGrid, phantoms: Sequence[Phantom]) -> OccupancyGrid:
    """A copy of the grid in which nothing was explored where phantoms are; the grid itself is never altered."""
    if not phantoms:
        return grid
    cells = grid.cells.copy()
    cells[cells_in([Polygon(phantom.shape) for phantom in phantoms], grid.frame)] = Cell.UNEXPLORED
    return OccupancyGrid(grid.frame, cells)


def carry_phantoms(phantoms: Sequence[Phantom], motion: Motion) -> tuple[Phantom, ...]:
    """Each moved as one rigid shape with the ground around it."""
    return tuple(_carry(phantom, motion) for phantom in phantoms)


def _carry(phantom: Phantom, motion: Motion) -> Phantom:
    shape = as_points(phantom.shape)
    moved = fit_pose(shape, motion.apply(shape)).apply(shape)
    return replace(phantom, shape=as_tuples(np.round(moved, 4)))
