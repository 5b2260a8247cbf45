"""Grids that no home looks like: what must not break anything all the same."""

from math import pi

import numpy as np
from hypothesis import strategies as st

from stillroom.maps.geometry import Pose
from stillroom.maps.grid import Cell, GridFrame, OccupancyGrid


@st.composite
def any_grid(draw: st.DrawFn, largest: int = 80) -> OccupancyGrid:
    """Up to `largest` x `largest` cells in blocks of any size and any mixture, in any frame."""
    width, height = draw(st.integers(1, largest)), draw(st.integers(1, largest))
    block = draw(st.sampled_from([1, 1, 2, 4, 10, 20]))
    unexplored, occupied = draw(st.floats(0, 1)), draw(st.floats(0, 1))
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    shape = (-(-height // block), -(-width // block))
    kinds = np.full(shape, Cell.FREE, np.uint8)
    kinds[rng.random(shape) < occupied * draw(st.sampled_from([0.1, 0.5, 1.0]))] = Cell.OCCUPIED
    kinds[rng.random(shape) < unexplored * draw(st.sampled_from([0.0, 0.2, 1.0]))] = Cell.UNEXPLORED
    cells = np.kron(kinds, np.ones((block, block), np.uint8))[:height, :width].copy()
    speckles = rng.random(cells.shape) < draw(st.sampled_from([0.0, 0.0, 0.02, 0.2]))
    cells[speckles] = rng.integers(0, 3, int(speckles.sum()), dtype=np.uint8)
    origin = Pose(draw(st.floats(-30, 30)), draw(st.floats(-30, 30)), draw(st.sampled_from([0.0, 0.3, -2.0, pi])))
    return OccupancyGrid(GridFrame(draw(st.sampled_from([0.02, 0.05, 0.1, 0.25])), width, height, origin), cells)
