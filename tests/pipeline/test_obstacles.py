"""Wall or clutter, gaps in walls, doors that are shut, and the grid with the meta-occupancy on it."""

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from shapely import Polygon

from stillroom.maps.geometry import Pose, as_points
from stillroom.maps.grid import Cell, GridFrame, OccupancyGrid
from stillroom.maps.meta import MetaOccupancy
from stillroom.maps.semantics import Ids
from stillroom.pipeline.creation import create_map
from stillroom.pipeline.obstacles import are_shut, band, classify_obstacles, corrected, covered, filled, room_cells
from stillroom.pipeline.params import PARAMS
from tests.drawing import paint, rectangle
from tests.golden.homes import FOUR_ROOMS

HOME = FOUR_ROOMS.grid
BASE = create_map(HOME, "0", Ids())
ROOMS = room_cells(BASE, HOME.frame)
FRAME = GridFrame(0.05, 100, 60)


def occupancy(polygon: Polygon, cell: str) -> MetaOccupancy:
    return MetaOccupancy("o1", polygon, "free" if cell == "free" else "occupied", "1")


# -- the corrected grid ----------------------------------------------------------------------------------------------


def test_without_corrections_the_grid_is_the_one_that_was_sensed() -> None:
    assert corrected(HOME, ()) is HOME


def test_corrections_change_a_copy_and_nothing_beside_them() -> None:
    before = HOME.cells.copy()
    gap, box = rectangle(3.0, 2.0, 3.5, 2.2), rectangle(1.0, 1.0, 1.5, 1.5)
    copy = corrected(HOME, [occupancy(gap, "free"), occupancy(box, "occupied")])
    assert (HOME.cells == before).all()
    expected = paint(paint(HOME, Cell.FREE, gap), Cell.OCCUPIED, box)
    assert (copy.cells == expected.cells).all()
    assert copy.frame == HOME.frame


def test_where_two_corrections_overlap_the_wall_wins() -> None:
    place = rectangle(1.0, 1.0, 1.5, 1.5)
    for order in (["free", "occupied"], ["occupied", "free"]):
        copy = corrected(HOME, [occupancy(place, cell) for cell in order])
        assert (copy.cells == paint(HOME, Cell.OCCUPIED, place).cells).all()


# -- drawing shapes on a grid ----------------------------------------------------------------------------------------


@given(st.floats(0.3, 1.5), st.floats(0.3, 1.0), st.floats(0.1, 1.0), st.floats(0.1, 1.0))
def test_a_filled_polygon_has_the_cells_whose_centres_it_holds(x: float, y: float, width: float, height: float) -> None:
    polygon = rectangle(x, y, x + width, y + height)
    area = filled([polygon], FRAME).sum() * FRAME.resolution**2
    slack = FRAME.resolution * polygon.length / 2 + FRAME.resolution**2
    assert abs(area - polygon.area) <= slack
    allowed = paint(_blank(), Cell.FREE, polygon.buffer(FRAME.resolution * 0.75)).free
    assert not (filled([polygon], FRAME) & ~allowed).any()


def test_a_hole_in_a_polygon_is_not_filled() -> None:
    ring = rectangle(0.5, 0.5, 2.5, 2.0) - rectangle(1.0, 1.0, 2.0, 1.5)
    mask = filled([ring], FRAME)
    assert mask[15, 15]
    assert not mask[25, 30]


def test_a_band_reaches_as_far_as_it_says_on_both_sides_to_a_cell() -> None:
    mask = band([as_points([(1.0, 1.525), (4.0, 1.525)])], 0.25, FRAME)
    (rows,) = np.nonzero(mask[:, 50])
    assert 24 <= rows.min() <= 25
    assert 35 <= rows.max() <= 36


def _blank() -> OccupancyGrid:
    return OccupancyGrid(FRAME, np.zeros((FRAME.height, FRAME.width), np.uint8))


# -- doors -----------------------------------------------------------------------------------------------------------

DOOR = ((1.2, 2.1), (2.0, 2.1))


@pytest.mark.parametrize(("share", "shut"), [(0.0, False), (0.3, False), (0.8, True), (1.0, True)])
def test_a_divider_is_shut_where_obstacles_cover_most_of_it(share: float, shut: bool) -> None:
    grid = paint(HOME, Cell.OCCUPIED, rectangle(1.2, 2.0, 1.2 + 0.8 * share, 2.2)) if share else HOME
    assert are_shut([DOOR], grid, PARAMS).tolist() == [shut]


def test_a_door_leaf_a_little_aside_of_the_divider_shuts_it_and_a_wall_farther_off_does_not() -> None:
    assert are_shut([DOOR], paint(HOME, Cell.OCCUPIED, rectangle(1.2, 2.2, 2.0, 2.25)), PARAMS)
    assert not are_shut([DOOR], paint(HOME, Cell.OCCUPIED, rectangle(1.2, 2.6, 2.0, 2.65)), PARAMS)


def test_unexplored_cells_shut_nothing() -> None:
    assert not are_shut([DOOR], paint(HOME, Cell.UNEXPLORED, rectangle(1.0, 1.8, 2.2, 2.4)), PARAMS)


def test_dividers_are_covered_together_as_each_is_alone() -> None:
    grid = paint(HOME, Cell.OCCUPIED, rectangle(1.2, 2.2, 2.0, 2.25))
    lines = [
        DOOR,
        ((0.5, 0.5), (0.5, 0.5)),
        ((1.0, 2.0), (1.9, 2.4)),
        ((1.6, 1.0), (1.6, 3.0)),
        ((-3.0, 0.0), (9.0, 0.0)),
    ]
    alone = [covered([line], grid, PARAMS)[0] for line in lines]
    assert covered(lines, grid, PARAMS).tolist() == alone
    assert alone[:2] == [1.0, 0.0]
    assert 0 < alone[3] < 1
    assert covered([], grid, PARAMS).tolist() == []


# -- wall or clutter -------------------------------------------------------------------------------------------------


def test_obstacles_near_tracked_walls_are_wall_and_those_inside_rooms_are_clutter() -> None:
    box = rectangle(2.0, 3.0, 2.6, 3.6)
    obstacles = classify_obstacles(BASE, ROOMS, paint(HOME, Cell.OCCUPIED, box), (), PARAMS)
    inside = paint(HOME, Cell.OCCUPIED, box).occupied & ~HOME.occupied
    assert obstacles.clutter[inside].all()
    assert not obstacles.wall[inside].any()
    near = band([as_points(w.line) for w in BASE.walls], 0.1, HOME.frame) & HOME.occupied
    assert obstacles.wall[near].mean() > 0.99
    assert not (obstacles.wall & obstacles.floor).any()


def test_meta_walls_are_wall_whatever_was_sensed_there() -> None:
    gap = rectangle(3.0, 2.0, 3.8, 2.2)
    obstacles = classify_obstacles(BASE, ROOMS, paint(HOME, Cell.FREE, gap), (), PARAMS, [gap])
    cells = paint(_zeros(), Cell.OCCUPIED, gap).occupied
    assert obstacles.wall[cells].all()
    assert not obstacles.floor[cells].any()


def _zeros() -> OccupancyGrid:
    return OccupancyGrid(HOME.frame, np.zeros_like(HOME.cells))


def test_a_shut_door_is_no_wall() -> None:
    (door,) = (d for d in BASE.dividers if shapely.LineString(d.line).intersects(rectangle(1.0, 1.9, 2.2, 2.3)))
    leaf = rectangle(1.2, 2.05, 2.0, 2.15)
    grid = paint(HOME, Cell.OCCUPIED, leaf)
    cells = paint(_zeros(), Cell.OCCUPIED, leaf).occupied
    assert not classify_obstacles(BASE, ROOMS, grid, (door.id,), PARAMS).wall[cells].any()
    assert classify_obstacles(BASE, ROOMS, grid, (), PARAMS).wall[cells].any()


@given(st.integers(0, 2**32))
def test_classification_alters_no_cell(seed: int) -> None:
    rng = np.random.default_rng(seed)
    cells = np.where(rng.random(HOME.cells.shape) < 0.05, rng.integers(0, 3, HOME.cells.shape), HOME.cells)
    grid = OccupancyGrid(HOME.frame, cells.astype(np.uint8))
    before = grid.cells.copy()
    obstacles = classify_obstacles(BASE, ROOMS, grid, (), PARAMS)
    assert (grid.cells == before).all()
    assert not (obstacles.wall & obstacles.floor).any()
    assert grid.frame.origin == Pose(*grid.frame.to_map(np.zeros((1, 2)))[0].tolist())
