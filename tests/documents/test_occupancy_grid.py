"""nav_msgs/OccupancyGrid as JSON."""

import json
from math import cos, pi, sin
from typing import Any

import numpy as np
import pytest
from hypothesis import given

from stillroom.documents.images import Reading
from stillroom.documents.occupancy_grid import read_occupancy_grid, write_occupancy_grid
from stillroom.errors import InvalidGrid, TooLarge
from stillroom.maps.geometry import Pose
from stillroom.maps.grid import Cell, OccupancyGrid
from tests.grids import any_grid

UNEXPLORED, FREE, OCCUPIED = Cell.UNEXPLORED, Cell.FREE, Cell.OCCUPIED


def message(data: list[Any], width: int, height: int, **origin: Any) -> dict[str, Any]:
    return {"info": {"resolution": 0.05, "width": width, "height": height, "origin": origin}, "data": data}


@given(any_grid(largest=20))
def test_a_grid_comes_back_as_it_was(grid: OccupancyGrid) -> None:
    back = read_occupancy_grid(json.loads(write_occupancy_grid(grid)), Reading())
    assert np.array_equal(back.cells, grid.cells)
    assert (back.frame.resolution, back.frame.width) == (grid.frame.resolution, grid.frame.width)
    assert (back.frame.origin.x, back.frame.origin.y) == (grid.frame.origin.x, grid.frame.origin.y)
    assert back.frame.origin.yaw == pytest.approx(grid.frame.origin.yaw)


def test_the_first_row_is_the_lowest() -> None:
    grid = read_occupancy_grid(message([0, 0, 100, -1], 2, 2), Reading())
    assert grid.cells.tolist() == [[FREE, FREE], [OCCUPIED, UNEXPLORED]]


def test_probabilities_are_divided_by_the_thresholds_and_beyond_100_nothing_is_known() -> None:
    data = [-128, -1, 0, 19, 20, 65, 66, 100, 101, 255]
    grid = read_occupancy_grid(message(data, 10, 1), Reading())
    none, free, full = UNEXPLORED, FREE, OCCUPIED
    assert grid.cells[0].tolist() == [none, none, free, free, none, none, full, full, none, none]
    other = read_occupancy_grid(message(data, 10, 1), Reading(occupied_thresh=0.1, free_thresh=0.1))
    assert other.cells[0].tolist() == [none, none, free, full, full, full, full, full, none, none]


def test_the_origin_is_a_pose_with_a_quaternion() -> None:
    turned = {"x": 0, "y": 0, "z": sin(pi / 8), "w": cos(pi / 8)}
    origin = read_occupancy_grid(
        message([0], 1, 1, position={"x": 1, "y": -2.5, "z": 0}, orientation=turned), Reading()
    ).frame.origin
    assert (origin.x, origin.y) == (1, -2.5)
    assert origin.yaw == pytest.approx(pi / 4)
    assert read_occupancy_grid(message([0], 1, 1), Reading()).frame.origin == Pose()


@pytest.mark.parametrize(
    ("changed", "pointer"),
    [
        ({"data": [0, 0, 0]}, "/grid/data"),
        ({"data": [0, 0, 0, 0.5]}, "/grid/data"),
        ({"data": [0, 0, 0, "0"]}, "/grid/data"),
        ({"data": [0, 0, 0, None]}, "/grid/data"),
        ({"data": [0, 0, 0, [0]]}, "/grid/data"),
        ({"data": [0, 0, 0, 256]}, "/grid/data"),
        ({"data": [0, 0, 0, 10**400]}, "/grid/data"),
        ({"data": {}}, "/grid/data"),
        ({"info": {"width": 2, "height": 2}}, "/grid/info/resolution"),
        ({"info": {"width": 2, "height": 2, "resolution": 0}}, "/grid/info/resolution"),
        ({"info": {"width": 2, "height": 2, "resolution": -0.05}}, "/grid/info/resolution"),
        ({"info": {"width": 2, "height": 2, "resolution": float("nan")}}, "/grid/info/resolution"),
        ({"info": {"width": 2.5, "height": 2, "resolution": 0.05}}, "/grid/info/width"),
        ({"info": {"width": -2, "height": -2, "resolution": 0.05}}, "/grid/info/width"),
        ({"info": {"width": 0, "height": 0, "resolution": 0.05}, "data": []}, "/grid"),
        ({"info": None}, "/grid/info"),
    ],
)
def test_a_message_that_contradicts_itself_is_refused(changed: dict[str, Any], pointer: str) -> None:
    with pytest.raises(InvalidGrid) as refused:
        read_occupancy_grid(message([0, 0, 0, 0], 2, 2) | changed, Reading())
    assert pointer in [fault.pointer for fault in refused.value.faults]


@pytest.mark.parametrize("q", [(0, 0, 0, 0), (0.7, 0, 0, 0.7), (0, 0, 2, 0), (0, 0, float("nan"), 1)])
def test_a_grid_that_does_not_lie_flat_is_refused(q: tuple[float, float, float, float]) -> None:
    with pytest.raises(InvalidGrid):
        read_occupancy_grid(message([0], 1, 1, orientation=dict(zip("xyzw", q, strict=True))), Reading())


def test_too_many_cells_are_refused_before_they_are_looked_at() -> None:
    with pytest.raises(TooLarge):
        read_occupancy_grid(message([], 100_000, 100_000), Reading())
