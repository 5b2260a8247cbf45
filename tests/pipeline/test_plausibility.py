"""Whether a grid shows the floor it is taken for, and only once: furniture, doors and unseen rooms say nothing against it."""

from dataclasses import replace

import numpy as np
import pytest
import shapely

from stillroom.maps.geometry import Pose, as_points
from stillroom.maps.grid import Cell, OccupancyGrid, look_up
from stillroom.maps.motion import Motion
from stillroom.maps.semantics import Ids, SemanticMap
from stillroom.pipeline.alignment import align
from stillroom.pipeline.creation import create_map
from stillroom.pipeline.params import PARAMS
from stillroom.pipeline.plausibility import Plausibility, plausibility
from stillroom.pipeline.transfer import track
from stillroom.simulator.building import draw_home
from stillroom.simulator.effects import Effects, Streams
from stillroom.simulator.fleet import SimulatedRobot
from tests.drawing import draw, paint, rectangle

GROUND = draw(
    """
    ########################################
    #...........#..........#...............#
    #...........#..........#...............#
    #...........#..........#...............#
    #...........#..........#...............#
    #......................#...............#
    #...........#..........#...............#
    #...........#..........#...............#
    #####..########..##########..###########
    #......................................#
    #......................................#
    ######..##############....##############
    #...............#......................#
    #...............#......................#
    #...............#......................#
    #...............#......................#
    #...............#......................#
    #...............#......................#
    ########################################
    """,
    cells=5,
    margin=4,
)
UPSTAIRS = draw(
    """
    ########################################
    #.................#....................#
    #.................#....................#
    #.................#....................#
    #.................#....................#
    #.................#....................#
    #.................########..############
    #......................................#
    #......................................#
    #.................#####..######..#######
    #..########..######........#...........#
    #.......#..........#.......#...........#
    #.......#..........#.......#...........#
    #.......#..........#.......#...........#
    #..................#.......#...........#
    #.......#..........#.......#...........#
    #.......#..........#.......#...........#
    #.......#..........#.......#...........#
    ########################################
    """,
    cells=5,
    margin=4,
)
"""The same outer walls as GROUND."""
UNSETTLED = replace(
    Effects.DEMO,
    furniture_moves=0.3,
    doors_shut=0.25,
    rooms_skipped=0.2,
    gaps_per_10m=1.0,
    gap_m=(0.2, 1.5),
    specks=1.5,
    jitter_m=0.10,
    jitter_deg=1.0,
)


@pytest.fixture(scope="module")
def ground() -> SemanticMap:
    return create_map(GROUND.grid, "0", Ids())


def judged(previous: SemanticMap, grid: OccupancyGrid, motion: Motion | None = None) -> Plausibility:
    motion = Motion.rigid(Pose()) if motion is None else motion
    aligned = align(previous, motion, grid, PARAMS.alignment_reach_m, PARAMS)
    return plausibility(track(previous, aligned.motion, grid.frame), grid, PARAMS)


def wrecked(grid: OccupancyGrid, pose: Pose, share: float) -> OccupancyGrid:
    """A grid with its western `share` drawn once more, moved by `pose`: its obstacles, and its floor where nothing was."""
    frame = grid.frame
    columns, rows = np.meshgrid(np.arange(frame.width), np.arange(frame.height))
    places = frame.to_map(as_points(np.stack([columns.ravel(), rows.ravel()], 1)) + 0.5)
    sources = frame.to_cells(pose.inverse().apply(places))
    copy = look_up(grid.cells, sources, Cell.UNEXPLORED).reshape(grid.cells.shape)
    copy[sources[:, 0].reshape(copy.shape) > share * frame.width] = Cell.UNEXPLORED
    cells = np.where(grid.unexplored, copy, grid.cells)
    return OccupancyGrid(frame, np.where(copy == Cell.OCCUPIED, copy, cells))


def about_the_middle(grid: OccupancyGrid, x: float, y: float, degrees: float) -> Pose:
    middle = Pose(*grid.frame.to_map(np.array([[grid.frame.width / 4, grid.frame.height / 2]]))[0].tolist())
    return middle.after(Pose(x, y, np.radians(degrees))).after(middle.inverse())


def test_the_same_grid_again_agrees_entirely(ground: SemanticMap) -> None:
    found = judged(ground, GROUND.grid)
    assert found.walls_found == 1
    assert found.walls_new == found.walls_twice == 0
    assert not found.other_floor(PARAMS)
    assert not found.wrecked(PARAMS)


@pytest.mark.parametrize(
    ("x", "y", "degrees"), [(0.4, 0.3, 0.0), (0.0, -1.5, 0.0), (0.9, 0.9, 2.0), (0.4, 0.4, 8.0), (-0.2, 0.6, -15.0)]
)
def test_walls_that_are_there_twice_are_a_wreck_and_not_another_floor(
    ground: SemanticMap, x: float, y: float, degrees: float
) -> None:
    found = judged(ground, wrecked(GROUND.grid, about_the_middle(GROUND.grid, x, y, degrees), 0.7))
    assert found.walls_found > 0.9
    assert found.wrecked(PARAMS)
    assert not found.other_floor(PARAMS)


def test_a_room_drawn_twice_does_not_wreck_the_home(ground: SemanticMap) -> None:
    found = judged(ground, wrecked(GROUND.grid, Pose(0.5, 0.5), 0.15))
    assert not found.wrecked(PARAMS)


def test_other_walls_inside_the_same_outer_walls_are_another_floor(ground: SemanticMap) -> None:
    found = judged(ground, UPSTAIRS.grid)
    assert found.walls_found > 0.4
    assert found.other_floor(PARAMS)
    assert not found.wrecked(PARAMS)


def test_furniture_along_every_wall_and_shut_doors_are_still_the_same_floor(ground: SemanticMap) -> None:
    x0, y0 = GROUND.grid.frame.to_map(np.array([[20.0, 20.0]]))[0]
    cupboards = [rectangle(x0 + x, y0 + y, x0 + x + 2.0, y0 + y + 0.6) for x in (0.5, 6.0) for y in (0.3, 1.1, 3.6)]
    doors = [shapely.LineString(divider.line).buffer(0.06) for divider in ground.dividers]
    found = judged(ground, paint(GROUND.grid, Cell.OCCUPIED, *cupboards, *doors))
    assert 0 < found.walls_new < 0.3
    assert not found.other_floor(PARAMS)
    assert not found.wrecked(PARAMS)


def test_what_was_not_explored_is_no_evidence(ground: SemanticMap) -> None:
    cells = GROUND.grid.cells.copy()
    cells[:, cells.shape[1] // 3 :] = Cell.UNEXPLORED
    found = judged(ground, OccupancyGrid(GROUND.grid.frame, cells))
    assert found.walls_found > 0.97
    assert found.in_sight_m < 0.5 * judged(ground, GROUND.grid).in_sight_m
    assert not found.other_floor(PARAMS)


def test_nothing_is_said_where_no_wall_is_in_sight(ground: SemanticMap) -> None:
    cells = np.full_like(GROUND.grid.cells, Cell.UNEXPLORED)
    middle = (slice(60, 70), slice(60, 70))
    cells[middle] = GROUND.grid.cells[middle]
    found = judged(ground, OccupancyGrid(GROUND.grid.frame, cells))
    assert found == Plausibility(1.0, 0.0, 0.0, 0.0, 0.0)
    assert not found.other_floor(PARAMS)
    assert not found.wrecked(PARAMS)


def test_a_floor_that_lies_beside_the_known_one_is_another(ground: SemanticMap) -> None:
    frame = replace(UPSTAIRS.grid.frame, origin=Pose(UPSTAIRS.grid.frame.origin.x + 12.0, 0.0))
    found = judged(ground, OccupancyGrid(frame, UPSTAIRS.grid.cells))
    assert found.in_sight_m < PARAMS.plausible_length_m
    assert found.other_floor(PARAMS)


@pytest.mark.parametrize("seed", [3, 8, 21])
def test_a_home_in_which_much_moved_sensed_badly_is_itself_and_not_its_neighbour(seed: int) -> None:
    home = draw_home(Streams(seed).of("home"), 6)
    robot = SimulatedRobot(home, Streams(seed), UNSETTLED)
    previous = create_map(robot.sortie(0).sensed.grid, "0", Ids())
    corners = as_points(shapely.get_coordinates([room.polygon for room in previous.rooms]))
    moved = robot.distortion(2).apply(robot.distortion(0).undo(corners))
    found = judged(previous, robot.sortie(2).sensed.grid, Motion.through(corners, moved))
    assert not found.other_floor(PARAMS)
    assert not found.wrecked(PARAMS)
    neighbour = SimulatedRobot(draw_home(Streams(seed + 100).of("home"), 6), Streams(seed), UNSETTLED)
    assert judged(previous, neighbour.sortie(1).sensed.grid).other_floor(PARAMS)
