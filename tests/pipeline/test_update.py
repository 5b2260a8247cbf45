"""What a mission did not see is no evidence, even where its grid ends before the home does."""

import numpy as np

from stillroom.maps.geometry import Pose
from stillroom.maps.grid import GridFrame, OccupancyGrid
from stillroom.maps.mission import Mission
from stillroom.maps.motion import IDENTITY
from stillroom.maps.semantics import Ids
from stillroom.pipeline.creation import create_map
from stillroom.pipeline.update import update_map
from tests.drawing import iou
from tests.golden.homes import CORRIDOR


def test_rooms_beyond_the_new_grid_keep_their_shape() -> None:
    home = create_map(CORRIDOR.grid, "0", Ids())
    frame = CORRIDOR.grid.frame
    half = GridFrame(frame.resolution, frame.width // 2, frame.height, frame.origin)
    update = update_map(home, Mission("1", OccupancyGrid(half, CORRIDOR.grid.cells[:, : half.width].copy()), IDENTITY))
    assert update.outcome == "updated"
    assert update.map.frame == half
    assert [room.id for room in update.map.rooms] == [room.id for room in home.rooms]
    for before, after in zip(home.rooms, update.map.rooms, strict=True):
        assert iou(before.polygon, after.polygon) > 0.97
    assert any(not room.visited for room in update.rooms)


def test_a_grid_is_extended_by_unexplored_cells_alone() -> None:
    grid = CORRIDOR.grid
    points = grid.frame.to_map(np.array([[-3.5, -1.2], [grid.frame.width + 2.1, 4.0]]))
    covering = grid.covering(points)
    assert (covering.frame.width, covering.frame.height) == (grid.frame.width + 7, grid.frame.height + 2)
    assert (covering.cells[2:, 4:-3] == grid.cells).all()
    assert covering.unexplored.sum() == grid.unexplored.sum() + covering.cells.size - grid.cells.size
    again = grid.covering(grid.frame.to_map(np.array([[1.0, 1.0]])))
    assert again is grid
    assert grid.covering(np.array([[1e9, 0.0]])) is grid


def test_a_turned_grid_is_extended_along_its_own_axes() -> None:
    frame = GridFrame(0.05, 10, 20, Pose(1.0, 2.0, 0.7))
    grid = OccupancyGrid(frame, np.ones((20, 10), np.uint8))
    corner = frame.to_map(np.array([[-1.5, 0.0]]))
    covering = grid.covering(corner)
    assert covering.frame.width == 12
    assert np.allclose(covering.frame.to_cells(corner), [[0.5, 0.0]], atol=1e-6)
