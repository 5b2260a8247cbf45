"""Untracked grids: the frame is found again at any angle, or the mission is parked; never a wrong guess."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stillroom.maps.geometry import Points, Pose
from stillroom.maps.grid import Cell, GridFrame, OccupancyGrid
from stillroom.maps.mission import Mission
from stillroom.maps.semantics import Ids, SemanticMap
from stillroom.pipeline.creation import create_map
from stillroom.pipeline.params import PARAMS
from stillroom.pipeline.registration import register
from stillroom.pipeline.update import update_map
from tests.drawing import draw

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


def error_m(found: Points, true: Points) -> float:
    return float(np.linalg.norm(found - true, axis=1).max())


@settings(max_examples=12)
@given(st.floats(-np.pi, np.pi), st.floats(-4, 4), st.floats(-4, 4))
def test_any_turn_and_metres_of_shift_are_found(yaw: float, x: float, y: float) -> None:
    home = create_map(HOME.grid, "0", Ids())
    pose = Pose(x, y, yaw)
    found = register(home, turned(HOME.grid, pose), PARAMS)
    assert found.found(PARAMS)
    corners = np.concatenate([np.asarray(room.polygon.exterior.coords) for room in home.rooms])
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
    corners = np.concatenate([np.asarray(room.polygon.exterior.coords) for room in home.rooms])
    assert error_m(found.motion.apply(corners), corners) < 0.05
