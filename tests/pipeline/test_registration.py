"""Untracked grids: the frame is found again at any angle, or the mission is parked; never a wrong guess."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from stillroom.maps.geometry import Points, Pose, as_points, as_tuples
from stillroom.maps.grid import Cell, GridFrame, OccupancyGrid
from stillroom.maps.mission import Mission
from stillroom.maps.semantics import Ids, Restriction, SemanticMap
from stillroom.pipeline.creation import create_map
from stillroom.pipeline.params import PARAMS
from stillroom.pipeline.registration import register
from stillroom.pipeline.update import update_map
from stillroom.simulator.building import draw_home
from stillroom.simulator.effects import Effects, Streams
from stillroom.simulator.fleet import SimulatedRobot
from tests.drawing import draw, iou, paint, rectangle

HOME = draw(
    """
    ######################
    #.......#......#.....#
    #.......#......#.....#
    #.......#......#.....#
    #..............#.....#
    #..............#.....#
    #.......####..###..###
    #.......#............#
    #####.###............#
    #.......#............#
    #.......#######..#####
    #.......#........#####
    #.......#........#####
    ##################
    """,
    margin=4,
)
MIRRORED = draw(
    """
    #####################
    #.........#.........#
    #.........#.........#
    #.........#.........#
    #...................#
    #...................#
    #.........#.........#
    #.........#.........#
    #.........#.........#
    #####################
    """,
    margin=4,
)


def turned(grid: OccupancyGrid, pose: Pose) -> OccupancyGrid:
    """The same home as a robot draws it whose frame lies otherwise: `pose` takes the old frame to the new one; cells are resampled."""
    frame = grid.frame
    corners = frame.to_map(np.array([(0, 0), (frame.width, 0), (frame.width, frame.height), (0, frame.height)], float))
    low, high = pose.apply(corners).min(0), pose.apply(corners).max(0)
    width, height = np.ceil((high - low) / frame.resolution).astype(int).tolist()
    new = GridFrame(frame.resolution, width, height, Pose(float(low[0]), float(low[1])))
    columns, rows = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    points = new.to_map(np.stack([columns.ravel(), rows.ravel()], 1))
    old = np.floor(frame.to_cells(pose.inverse().apply(points))).astype(int)
    inside = ((old >= 0) & (old < (frame.width, frame.height))).all(1)
    cells = np.full(len(points), Cell.UNEXPLORED, np.uint8)
    cells[inside] = grid.cells[old[inside, 1], old[inside, 0]]
    return OccupancyGrid(new, cells.reshape(height, width))


@pytest.fixture(scope="module")
def home() -> SemanticMap:
    return create_map(HOME.grid, "0", Ids())


UPSTAIRS = draw(
    """
    ######################
    #......#.............#
    #......#.............#
    #......#.............#
    #......#.............#
    #......###..##########
    #..............#######
    #..............#
    ####..######...#######
    #.........#..........#
    #.........#......#####
    #.........#......#####
    #.........#......#####
    ##################
    """,
    margin=4,
)
"""Within the outer walls of HOME."""


STILL = replace(Effects.DEMO, furniture_moves=0.0, rooms_skipped=0.0, jitter_m=0.0, jitter_deg=0.0)
"""Nothing but noise changes."""


@dataclass(frozen=True)
class Simulated:
    """A home, the map that its robot made first, and a later mission's grid in a frame that lies elsewhere by `pose`."""

    first: SemanticMap
    grid: OccupancyGrid
    pose: Pose


def simulated(seed: int, pose: Pose, effects: Effects = Effects.DEMO) -> Simulated:
    home = draw_home(Streams(seed).of("home"))
    first = SimulatedRobot(home, Streams(seed), effects).sortie(0)
    later = SimulatedRobot(home.moved(pose), Streams(seed + 1000), effects).sortie(2)
    return Simulated(create_map(first.sensed.grid, "0", Ids()), later.sensed.grid, pose)


def corners_of(home: SemanticMap) -> Points:
    return as_points(shapely.get_coordinates([room.polygon for room in home.rooms]))


def error_m(found: Points, true: Points) -> float:
    return float(np.linalg.norm(found - true, axis=1).max())


@settings(max_examples=12)
@given(st.floats(-np.pi, np.pi), st.floats(-4, 4), st.floats(-4, 4))
def test_any_turn_and_metres_of_shift_are_found(yaw: float, x: float, y: float) -> None:
    home = create_map(HOME.grid, "0", Ids())
    pose = Pose(x, y, yaw)
    found = register(home, turned(HOME.grid, pose), PARAMS)
    assert found.found(PARAMS)
    corners = corners_of(home)
    assert error_m(found.motion.apply(corners), pose.apply(corners)) < 0.15


def test_an_untracked_mission_keeps_rooms_and_ids_in_a_turned_frame(home: SemanticMap) -> None:
    pose = Pose(2.0, -1.0, np.pi / 2)
    update = update_map(home, Mission("1", turned(HOME.grid, pose), None))
    assert update.outcome == "updated"
    assert [room.id for room in update.map.rooms] == [room.id for room in home.rooms]
    assert all(room.precision > 0.9 and room.recall > 0.9 for room in update.rooms)


def test_a_home_that_is_its_own_image_turned_is_parked_and_not_guessed() -> None:
    home = create_map(MIRRORED.grid, "0", Ids())
    update = update_map(home, Mission("1", turned(MIRRORED.grid, Pose(3.0, 1.0, 0.6)), None))
    assert update.outcome == "parked"
    assert not update.taken
    assert update.map is home


def test_a_closet_is_not_enough_to_tell_the_two_ends_of_a_home_apart() -> None:
    frame = MIRRORED.grid.frame
    x, y = frame.to_map(np.array([[20.0, 20.0]]))[0].tolist()
    nearly = paint(MIRRORED.grid, Cell.OCCUPIED, rectangle(x, y, x + 0.6, y + 0.5))
    found = register(create_map(nearly, "0", Ids()), turned(nearly, Pose(3.0, 1.0, 0.6)), PARAMS)
    assert found.ambiguous(PARAMS)
    assert not found.found(PARAMS)


def test_where_somebody_knows_that_it_is_this_floor_the_likeliest_pose_counts() -> None:
    home = create_map(MIRRORED.grid, "0", Ids())
    mission = Mission("1", turned(MIRRORED.grid, Pose(3.0, 1.0, np.pi / 2)), None)
    update = update_map(home, mission, trust_registration=True)
    assert update.outcome == "updated"
    assert [room.id for room in update.map.rooms] == [room.id for room in home.rooms]
    assert all(room.precision > 0.9 and room.recall > 0.9 for room in update.rooms)


def test_another_home_is_parked(home: SemanticMap) -> None:
    update = update_map(home, Mission("1", MIRRORED.grid, None))
    assert update.outcome == "parked"
    assert update.map is home


def test_a_frame_that_stayed_is_found_without_a_search_although_little_was_seen(home: SemanticMap) -> None:
    cells = HOME.grid.cells.copy()
    cells[:, cells.shape[1] // 2 :] = Cell.UNEXPLORED
    found = register(home, OccupancyGrid(HOME.grid.frame, cells), PARAMS)
    assert found.found(PARAMS)
    corners = corners_of(home)
    assert error_m(found.motion.apply(corners), corners) < 0.05


@pytest.mark.parametrize("quarters", [1, 2, 3])
@pytest.mark.parametrize("seed", [1, 2])
def test_a_home_turned_by_quarters_is_found_though_its_walls_run_along_the_same_lines(seed: int, quarters: int) -> None:
    case = simulated(seed, Pose(3.0, -2.0, quarters * np.pi / 2))
    found = register(case.first, case.grid, PARAMS)
    assert found.found(PARAMS)
    assert found.rival < 0.5 * found.fit
    corners = corners_of(case.first)
    assert np.median(np.linalg.norm(found.motion.apply(corners) - case.pose.apply(corners), axis=1)) < 0.1


def test_a_turned_mission_carries_rooms_and_restrictions_through_one_motion() -> None:
    case = simulated(3, Pose(-4.0, 1.0, np.pi / 2), STILL)
    middle = case.first.rooms[0].polygon.representative_point()
    zone = shapely.box(middle.x - 0.3, middle.y - 0.2, middle.x + 0.3, middle.y + 0.2)
    ring = as_tuples(shapely.get_coordinates(zone.exterior)[:-1])
    previous = replace(case.first, restrictions=(Restriction("z1", "no_go", ring),))
    update = update_map(previous, Mission("1", case.grid, None))
    assert update.taken
    now = {room.id: room.polygon for room in update.map.rooms}
    for room in previous.rooms:
        assert iou(shapely.transform(room.polygon, case.pose.apply), now[room.id]) >= 0.9
    (carried,) = update.map.restrictions
    assert carried.placed
    assert iou(shapely.transform(zone, case.pose.apply), shapely.Polygon(carried.shape)) >= 0.8


@pytest.mark.parametrize("seed", [4, 5])
def test_a_mission_that_ended_early_in_a_turned_frame_is_found_or_parked_but_never_misplaced(seed: int) -> None:
    case = simulated(seed, Pose(1.0, 5.0, 2.0), replace(Effects.DEMO, battery_ends=1.0))
    found = register(case.first, case.grid, PARAMS)
    corners = corners_of(case.first)
    misplaced = np.median(np.linalg.norm(found.motion.apply(corners) - case.pose.apply(corners), axis=1)) > 0.3
    assert not (found.found(PARAMS) and misplaced)


@pytest.mark.parametrize("yaw", [0.0, 0.7, np.pi])
def test_another_floor_within_the_same_outer_walls_is_parked(home: SemanticMap, yaw: float) -> None:
    update = update_map(home, Mission("1", turned(UPSTAIRS.grid, Pose(1.0, 2.0, yaw)), None))
    assert update.outcome == "parked"
    assert update.map is home


def test_homes_of_the_same_kind_are_not_taken_for_each_other() -> None:
    homes = [simulated(seed, Pose()) for seed in range(6, 10)]
    for mine in homes:
        for other in homes:
            assert register(mine.first, other.grid, PARAMS).found(PARAMS) == (mine is other)


def test_a_robot_that_senses_no_walls_is_found_by_where_its_floor_ends() -> None:
    def without_walls(grid: OccupancyGrid) -> OccupancyGrid:
        return OccupancyGrid(grid.frame, np.where(grid.occupied, np.uint8(Cell.UNEXPLORED), grid.cells))

    bare = create_map(without_walls(HOME.grid), "0", Ids())
    pose = Pose(2.0, 1.0, 1.2)
    found = register(bare, without_walls(turned(HOME.grid, pose)), PARAMS)
    assert found.found(PARAMS)
    assert error_m(found.motion.apply(corners_of(bare)), pose.apply(corners_of(bare))) < 0.2


def test_nothing_is_found_in_an_empty_grid_or_from_an_empty_map(home: SemanticMap) -> None:
    empty = OccupancyGrid(GridFrame(0.05, 40, 30), np.full((30, 40), Cell.UNEXPLORED, np.uint8))
    assert not register(home, empty, PARAMS).found(PARAMS)
    assert not register(SemanticMap(empty.frame), HOME.grid, PARAMS).found(PARAMS)
    assert not register(SemanticMap(empty.frame), empty, PARAMS).found(PARAMS)
