"""What a grid shows otherwise than an earlier one."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stillroom.maps.geometry import Pose
from stillroom.maps.grid import Cell, GridFrame, OccupancyGrid
from stillroom.pipeline.differences import differences
from tests.drawing import draw

HOME = """
    ############
    #....#.....#
    #....#.....#
    #..........#
    #....#.....#
    ############
"""


def grid(text: str, origin: Pose = Pose()) -> OccupancyGrid:
    return draw(text, cells=8, origin=origin, margin=2).grid


def told(now: str, before: str = HOME) -> list[tuple[str, float]]:
    return [(found.change, round(found.polygon.area, 2)) for found in differences(grid(before), Pose(), grid(now))]


@pytest.mark.parametrize(
    ("now", "expected"),
    [
        (HOME, []),
        (HOME.replace("#..........#", "#....#.....#"), [("blocked", 0.04)]),
        (HOME.replace("#....#.....#", "#..........#"), [("opened", 0.26), ("opened", 0.1)]),
    ],
)
def test_places_are_told_by_what_became_of_them(now: str, expected: list[tuple[str, float]]) -> None:
    assert told(now) == expected


def test_a_part_that_the_robot_did_not_see_is_told_and_one_that_it_found() -> None:
    part = "\n".join(f"{line[:10]}       " for line in HOME.strip("\n").split("\n"))
    ((change, area),) = told(part)
    assert change == "unseen"
    assert area == pytest.approx(5 * 4 * 0.16, abs=0.5)
    ((change, again),) = told(HOME, part)
    assert (change, again) == ("found", area)


def test_a_wall_that_is_gone_is_told_where_it_was() -> None:
    found = differences(grid(HOME), Pose(), grid(HOME.replace("#....#.....#", "#..........#")))
    assert [(place.change, round(place.polygon.centroid.x, 2)) for place in found] == [("opened", 2.2)] * 2


@given(
    st.floats(-3, 3),
    st.floats(-3, 3),
    st.floats(-3, 3),
    st.sampled_from([HOME, HOME.replace("#....#.....#", "#..........#")]),
)
def test_a_grid_differs_from_itself_by_nothing_wherever_it_lies(x: float, y: float, yaw: float, text: str) -> None:
    pose = Pose(x, y, yaw)
    assert differences(grid(text), pose, grid(text, pose)) == ()


def test_grids_of_other_sizes_are_compared() -> None:
    small = OccupancyGrid(GridFrame(0.05, 4, 4), np.full((4, 4), Cell.FREE, np.uint8))
    large = OccupancyGrid(GridFrame(0.05, 40, 40), np.full((40, 40), Cell.FREE, np.uint8))
    assert [found.change for found in differences(small, Pose(), large)] == ["found"]
    assert [found.change for found in differences(large, Pose(), small)] == ["unseen"]
