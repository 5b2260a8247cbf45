from math import pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from stillroom.maps.geometry import Pose
from stillroom.maps.grid import Cell, GridFrame, OccupancyGrid, distance_to, look_up

lengths = st.floats(-50, 50)
poses = st.builds(Pose, lengths, lengths, st.floats(-pi, pi))
frames = st.builds(GridFrame, st.floats(0.01, 0.2), st.integers(1, 2000), st.integers(1, 2000), poses)
points = st.lists(st.tuples(lengths, lengths), min_size=1, max_size=5).map(np.array)


def test_the_origin_is_the_outer_corner_of_the_lower_left_cell() -> None:
    frame = GridFrame(0.05, 10, 20, Pose(-3.2, -1.0))
    assert_allclose(frame.to_map(np.array([[0.0, 0.0], [0.5, 0.5]])), [[-3.2, -1.0], [-3.175, -0.975]])
    assert_allclose(frame.to_cells(np.array([[-3.2, -1.0], [-3.15, -0.9]])), [[0, 0], [1, 2]], atol=1e-9)


def test_a_quarter_turn_of_the_origin_makes_columns_run_up_and_rows_run_left() -> None:
    frame = GridFrame(0.1, 10, 20, Pose(1.0, 2.0, pi / 2))
    assert_allclose(frame.to_map(np.array([[10.0, 0.0], [0.0, 20.0]])), [[1.0, 3.0], [-1.0, 2.0]], atol=1e-9)
    assert_allclose(frame.to_cells(np.array([[1.0, 3.0]])), [[10.0, 0.0]], atol=1e-9)


@given(frames, points)
def test_to_cells_and_to_map_undo_each_other(frame: GridFrame, places: np.ndarray) -> None:
    assert_allclose(frame.to_map(frame.to_cells(places)), places, atol=1e-8)
    assert_allclose(frame.to_cells(frame.to_map(places)), places, atol=1e-6)


@given(frames, points)
def test_one_cell_is_resolution_metres_long_in_any_direction(frame: GridFrame, cells: np.ndarray) -> None:
    steps = np.linalg.norm(frame.to_map(np.add(cells, (1, 0))) - frame.to_map(cells), axis=1)
    assert_allclose(steps, frame.resolution, atol=1e-9)


def test_cells_of_a_grid_can_not_be_written() -> None:
    cells = np.zeros((2, 3), np.uint8)
    grid = OccupancyGrid(GridFrame(0.05, 3, 2), cells)
    with pytest.raises(ValueError, match="read-only"):
        grid.cells[0, 0] = Cell.FREE
    with pytest.raises(ValueError, match="read-only"):
        cells[0, 0] = Cell.FREE


@pytest.mark.parametrize("cells", [np.zeros((3, 2), np.uint8), np.zeros((2, 3), np.int8), np.zeros(6, np.uint8)])
def test_cells_that_do_not_fit_the_frame_are_refused(cells: np.ndarray) -> None:
    with pytest.raises(ValueError, match="fit the frame"):
        OccupancyGrid(GridFrame(0.05, 3, 2), cells)


def test_free_occupied_and_unexplored_part_the_cells() -> None:
    grid = OccupancyGrid(GridFrame(0.05, 3, 1), np.array([[Cell.UNEXPLORED, Cell.FREE, Cell.OCCUPIED]], np.uint8))
    assert grid.unexplored.tolist() == [[True, False, False]]
    assert grid.free.tolist() == [[False, True, False]]
    assert grid.occupied.tolist() == [[False, False, True]]


def test_distance_is_in_metres_between_the_centres_of_cells() -> None:
    mask = np.zeros((5, 5), bool)
    mask[0, 0] = True
    distance = distance_to(mask, 0.05)
    assert distance[0, 0] == 0
    assert distance[0, 4] == pytest.approx(0.2)
    assert distance[4, 3] == pytest.approx(0.25)


@pytest.mark.parametrize("resolution", [0.01, 0.025, 0.04, 0.05])
def test_cells_near_occupied_ones_are_those_within_the_distance(resolution: float) -> None:
    cells = np.random.default_rng(1).choice([Cell.FREE, Cell.OCCUPIED], (40, 60), p=[0.99, 0.01]).astype(np.uint8)
    grid = OccupancyGrid(GridFrame(resolution, 60, 40), cells)
    for reach_m in (0.02, 0.1, 0.2, 0.3):
        assert np.array_equal(grid.near_occupied(reach_m), grid.occupied_distance <= reach_m + 1e-6)


def test_nothing_is_near_where_nothing_is_occupied() -> None:
    assert not OccupancyGrid(GridFrame(0.05, 20, 10), np.ones((10, 20), np.uint8)).near_occupied(0.2).any()


def test_distance_to_nothing_is_infinite() -> None:
    assert np.isinf(distance_to(np.zeros((3, 3), bool), 0.05)).all()


def test_values_are_looked_up_at_column_and_row_and_are_outside_beyond_the_grid() -> None:
    values = np.array([[1, 2], [3, 4]], np.uint8)
    places = np.array([[0.5, 0.5], [1.99, 0.0], [0.0, 1.99], [-0.01, 0.5], [2.0, 0.5], [0.5, 2.0]])
    assert look_up(values, places, 9).tolist() == [1, 2, 3, 9, 9, 9]
