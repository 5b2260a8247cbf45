"""Which cells of a grid lie in polygons, and which in short pieces of a mask."""

import cv2
import numpy as np
import shapely
from hypothesis import given
from hypothesis import strategies as st

from stillroom.maps.geometry import Points, Pose, as_points
from stillroom.maps.grid import GridFrame
from stillroom.pipeline.cells import cells_in, short_pieces


def _centres(frame: GridFrame) -> Points:
    columns, rows = np.meshgrid(np.arange(frame.width) + 0.5, np.arange(frame.height) + 0.5)
    return frame.to_map(as_points(np.stack([columns.ravel(), rows.ravel()], 1)))


@given(st.integers(0, 2**32), st.sampled_from([0.0, 0.7]))
def test_the_cells_in_a_polygon_are_those_whose_centre_is(seed: int, yaw: float) -> None:
    rng = np.random.default_rng(seed)
    frame = GridFrame(0.05, 40, 30, Pose(1.0, -2.0, yaw))
    corners = frame.to_map(rng.uniform(-25, 60, (5, 2)))
    polygon = shapely.convex_hull(shapely.multipoints(corners))
    expected = shapely.contains_xy(polygon, _centres(frame)).reshape(30, 40)
    assert np.array_equal(cells_in([polygon], frame), expected)


def test_cells_in_several_polygons_count_though_these_overlap() -> None:
    frame = GridFrame(0.05, 40, 30)
    some = [shapely.box(0.2, 0.2, 1.0, 1.0), shapely.box(0.6, 0.6, 1.4, 1.4), shapely.box(1.2, -9.0, 1.6, 9.0)]
    expected = np.any([shapely.contains_xy(polygon, _centres(frame)) for polygon in some], axis=0)
    assert np.array_equal(cells_in(some, frame), expected.reshape(30, 40))


@given(st.floats(-1.0, 2.5), st.floats(-1.0, 2.0))
def test_cells_in_a_hole_do_not_count_wherever_on_the_grid_it_lies(x: float, y: float) -> None:
    frame = GridFrame(0.05, 40, 30)
    hollow = shapely.difference(shapely.box(x, y, x + 1.0, y + 0.8), shapely.box(x + 0.3, y + 0.2, x + 0.6, y + 0.5))
    expected = shapely.contains_xy(hollow, _centres(frame)).reshape(30, 40)
    assert np.array_equal(cells_in([hollow], frame), expected)


def test_no_polygon_and_one_beyond_the_grid_hold_no_cell() -> None:
    frame = GridFrame(0.05, 10, 10)
    assert not cells_in([], frame).any()
    assert not cells_in([shapely.box(5, 5, 6, 6)], frame).any()
    assert cells_in([shapely.box(-5, -5, 6, 6)], frame).all()


@given(st.integers(0, 2**32), st.floats(0.05, 0.95), st.integers(1, 12))
def test_a_piece_is_short_where_its_box_is_in_both_directions(seed: int, filled: float, cells: int) -> None:
    mask = np.random.default_rng(seed).random((20, 30)) < filled
    _, labels, stats, _ = cv2.connectedComponentsWithStats(mask.view(np.uint8), connectivity=8)
    short = stats[:, [cv2.CC_STAT_WIDTH, cv2.CC_STAT_HEIGHT]].max(1) < cells
    assert np.array_equal(short_pieces(mask, cells), mask & short[labels])
