"""The outline of the floor: on the walls' faces, with few vertices, at any resolution and angle."""

from math import radians

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from shapely import MultiPolygon, Polygon

from stillroom.maps.geometry import Pose
from stillroom.maps.grid import Cell, GridFrame, OccupancyGrid
from stillroom.maps.semantics import Wall
from stillroom.pipeline.params import PARAMS
from stillroom.pipeline.walls import outline, seal_diagonals, separate_clutter, wall_features
from tests.drawing import draw, rectangle


def painted(frame: GridFrame, *shapes: Polygon) -> OccupancyGrid:
    """Shapes of the map frame painted one over the other: the first free, the next occupied and so on."""
    columns, rows = np.meshgrid(np.arange(frame.width) + 0.5, np.arange(frame.height) + 0.5)
    centres = frame.to_map(np.stack([columns.ravel(), rows.ravel()], 1))
    cells = np.full(frame.width * frame.height, Cell.UNEXPLORED, np.uint8)
    for i, shape in enumerate(shapes):
        cells[shapely.contains_xy(shape, centres)] = (Cell.OCCUPIED, Cell.FREE)[i % 2]
    return OccupancyGrid(frame, cells.reshape(frame.height, frame.width))


def floor_of(grid: OccupancyGrid) -> MultiPolygon:
    return outline(separate_clutter(grid, PARAMS).floor, grid.frame, PARAMS, smallest_m2=PARAMS.pocket_area_m2)


def vertices(polygon: Polygon) -> int:
    return len(polygon.exterior.coords) - 1


def turned(polygon: Polygon, degrees: float) -> Polygon:
    return shapely.transform(polygon, Pose(yaw=radians(degrees)).apply)


@pytest.mark.parametrize("resolution", [0.02, 0.04, 0.05, 0.1])
def test_a_room_of_four_by_four_metres_is_four_corners_on_the_walls_faces(resolution: float) -> None:
    frame = GridFrame(resolution, round(5 / resolution), round(5 / resolution))
    grid = painted(frame, rectangle(0.3, 0.3, 4.7, 4.7), rectangle(0.5, 0.5, 4.5, 4.5))
    (room,) = floor_of(grid).geoms
    assert vertices(room) == 4
    assert shapely.hausdorff_distance(room, rectangle(0.5, 0.5, 4.5, 4.5)) < resolution


@given(st.integers(0, 2**32))
def test_a_room_with_ragged_walls_has_few_vertices_on_the_walls_faces(seed: int) -> None:
    frame = GridFrame(0.05, 100, 100)
    cells = painted(frame, rectangle(0.2, 0.2, 4.8, 4.8), rectangle(0.5, 0.5, 4.5, 4.5)).cells.copy()
    rng = np.random.default_rng(seed)
    for face in (10, 89):
        bumps = rng.random(80) < 0.3
        cells[face, 10:90][bumps] = Cell.OCCUPIED
        bumps = rng.random(80) < 0.3
        cells[10:90, face][bumps] = Cell.OCCUPIED
    (room,) = floor_of(OccupancyGrid(frame, cells)).geoms
    assert 4 <= vertices(room) <= 12
    assert shapely.hausdorff_distance(room.exterior, rectangle(0.5, 0.5, 4.5, 4.5).exterior) < 0.12
    assert room.area == pytest.approx(16, rel=0.03)


@pytest.mark.parametrize("degrees", [3, 10, 30, 45, 72])
def test_a_building_at_any_angle_has_the_same_area_on_straight_walls(degrees: float) -> None:
    frame = GridFrame(0.05, 200, 160, Pose(-4.5, -1.5))
    truth = turned(rectangle(0.5, 0.5, 4.5, 3.5), degrees)
    grid = painted(frame, shapely.buffer(truth, 0.2, join_style="mitre"), truth)
    (room,) = floor_of(grid).geoms
    assert room.area == pytest.approx(12, rel=0.03)
    assert vertices(room) <= 8
    assert shapely.hausdorff_distance(room.exterior, truth.exterior) < 0.15


@pytest.mark.parametrize("yaw", [0.0, 0.3, 1.0, 2.5, -3.0])
def test_a_grid_whose_origin_is_turned_gives_the_same_floor_turned(yaw: float) -> None:
    text = """
        ##########
        #........#
        #........#
        #....#####
        #....#
        ######
    """
    straight, askew = draw(text, cells=8), draw(text, cells=8, origin=Pose(1.5, -2.0, yaw))
    expected = shapely.transform(floor_of(straight.grid), Pose(1.5, -2.0, yaw).apply)
    found = floor_of(askew.grid)
    assert shapely.hausdorff_distance(found, expected) < 0.005
    assert found.area == pytest.approx(expected.area, rel=0.001)


def test_the_floor_is_on_the_left_of_every_ring() -> None:
    drawing = draw("""
        ##############
        #............#
        #............#
        #....##......#
        #....##......#
        #....##......#
        #....##......#
        #....##......#
        #....##......#
        #............#
        #............#
        ##############
    """)
    (room,) = floor_of(drawing.grid).geoms
    assert room.exterior.is_ccw
    assert len(room.interiors) == 1
    assert not room.interiors[0].is_ccw


def test_a_long_pillar_is_a_hole_of_its_own_size() -> None:
    frame = GridFrame(0.05, 120, 120)
    hall, pillar = rectangle(0.5, 0.5, 5.5, 5.5), rectangle(2.0, 2.8, 4.0, 3.0)
    grid = painted(frame, rectangle(0.3, 0.3, 5.7, 5.7), hall, pillar)
    (room,) = floor_of(grid).geoms
    assert len(room.interiors) == 1
    assert shapely.hausdorff_distance(Polygon(room.interiors[0]), pillar) <= 0.05


def test_a_table_in_the_middle_of_a_room_is_clutter_and_its_place_is_floor() -> None:
    frame = GridFrame(0.05, 120, 120)
    hall, table = rectangle(0.5, 0.5, 5.5, 5.5), rectangle(2.0, 2.5, 3.5, 3.5)
    grid = painted(frame, rectangle(0.3, 0.3, 5.7, 5.7), hall, table)
    obstacles = separate_clutter(grid, PARAMS)
    assert (obstacles.clutter.sum() * 0.05**2) == pytest.approx(1.5)
    assert not (obstacles.clutter & obstacles.wall).any()
    (room,) = floor_of(grid).geoms
    assert room.area == pytest.approx(25, rel=0.01)


@pytest.mark.parametrize("thickness", [1, 2, 3])
def test_a_thin_wall_between_two_rooms_survives(thickness: int) -> None:
    cells = np.full((60, 100), Cell.FREE, np.uint8)
    cells[[0, -1]] = cells[:, [0, -1]] = Cell.OCCUPIED
    cells[:, 40 : 40 + thickness] = Cell.OCCUPIED
    floor = floor_of(OccupancyGrid(GridFrame(0.05, 100, 60), cells))
    assert len(floor.geoms) == 2
    gap = shapely.distance(*floor.geoms)
    assert gap == pytest.approx(thickness * 0.05, abs=0.03)


def test_a_diagonal_wall_of_one_cell_parts_two_rooms() -> None:
    cells = np.full((80, 80), Cell.FREE, np.uint8)
    cells[[0, -1]] = cells[:, [0, -1]] = Cell.OCCUPIED
    cells[np.arange(80), np.arange(80)] = Cell.OCCUPIED
    for mirrored in (cells, cells[:, ::-1].copy()):
        floor = floor_of(OccupancyGrid(GridFrame(0.05, 80, 80), mirrored.copy()))
        assert len(floor.geoms) == 2
        assert shapely.intersection(*floor.geoms).area < 0.01


def test_specks_are_no_floor() -> None:
    cells = np.full((60, 60), Cell.UNEXPLORED, np.uint8)
    cells[10:15, 10:15] = cells[40, 40] = Cell.FREE
    assert floor_of(OccupancyGrid(GridFrame(0.05, 60, 60), cells)).is_empty


@given(st.integers(0, 2**32), st.integers(1, 40), st.integers(1, 40), st.floats(0.2, 0.95))
def test_the_outline_of_any_floor_is_valid(seed: int, width: int, height: int, share: float) -> None:
    floor = seal_diagonals(np.random.default_rng(seed).random((height, width)) < share)
    found = outline(floor, GridFrame(0.05, width, height), PARAMS)
    assert found.is_valid


# -- walls ---------------------------------------------------------------------------------------------------------


def walls_of(grid: OccupancyGrid) -> tuple[MultiPolygon, tuple[Wall, ...]]:
    floor = floor_of(grid)
    return floor, wall_features(floor, grid.near_occupied(PARAMS.wall_reach_m), grid.frame, "1")


def test_walls_run_around_the_whole_floor_with_the_floor_on_their_left() -> None:
    floor, walls = walls_of(draw("########\n#......#\n#......#\n#......#\n########", cells=10).grid)
    assert {wall.kind for wall in walls} == {"wall"}
    lines = shapely.union_all([shapely.LineString(wall.line) for wall in walls])
    assert shapely.symmetric_difference(lines, floor.boundary).length < 0.01
    for wall in walls:
        (x0, y0), (x1, y1) = wall.line[:2]
        left = np.array([-(y1 - y0), x1 - x0]) / np.hypot(x1 - x0, y1 - y0) * 0.05
        assert shapely.contains_xy(floor, *((x0 + x1) / 2 + left[0], (y0 + y1) / 2 + left[1]))


def test_a_border_to_unexplored_space_is_open_and_the_rest_is_wall() -> None:
    floor, walls = walls_of(draw("#######\n#..... \n#..... \n#..... \n#######", cells=10).grid)
    open_, solid = ([w for w in walls if w.kind == kind] for kind in ("open", "wall"))
    assert len(open_) == 1
    assert len(solid) == 1
    (x0, _), *_, (x1, _) = open_[0].line
    assert_allclose([x0, x1], 3.0, atol=0.05)
    assert shapely.LineString(open_[0].line).length == pytest.approx(1.5 - 2 * PARAMS.wall_reach_m, abs=0.11)
    lines = shapely.union_all([shapely.LineString(wall.line) for wall in walls])
    assert shapely.hausdorff_distance(lines, floor.boundary) < 0.01


def test_ids_of_walls_are_unique_and_name_the_version() -> None:
    _, walls = walls_of(draw("#######\n#..... \n#..... \n#..... \n#######", cells=10).grid)
    assert [wall.id for wall in walls] == [f"w1-{i}" for i in range(1, len(walls) + 1)]


@given(st.integers(0, 2**32))
def test_sealing_leaves_no_connection_over_a_corner_alone_and_adds_no_floor(seed: int) -> None:
    floor = np.random.default_rng(seed).random((12, 12)) < 0.6
    sealed = seal_diagonals(floor)
    assert not (sealed & ~floor).any()
    a, b, c, d = sealed[:-1, :-1], sealed[:-1, 1:], sealed[1:, :-1], sealed[1:, 1:]
    assert not ((a & d & ~b & ~c) | (b & c & ~a & ~d)).any()
