"""Rooms of real plans and homes: as many as people drew, and the same however the map lies or is sampled."""

import numpy as np
import pytest
import shapely
from shapely import Polygon

from stillroom.documents.files import open_map
from stillroom.maps.grid import Cell, GridFrame, OccupancyGrid
from stillroom.maps.semantics import Ids
from stillroom.pipeline.creation import create_map
from tests.drawing import iou
from tests.real.bench_segmentation import HOMES, PLANS, found_rooms, plan, plan_names
from tests.real.room_scores import matched, mean, score
from tests.real.shared import DATA, EVERYTHING

SMALL_PLANS = ("Freiburg52_scan", "Freiburg79_scan", "lab_a_scan", "lab_c_scan", "office_a")
SOME_HOMES = ("homeA/d9_1093_multi_map", "homeA/z10_1056_virtual_restrictions", "single/S5_FW2008_with_segments")
PLANNED = plan_names() if EVERYTHING else SMALL_PLANS

pytestmark = pytest.mark.skipif(not (PLANS.is_dir() and HOMES.is_dir()), reason=f"there are no real maps in {DATA}")


@pytest.mark.parametrize(
    ("variant", "recall", "precision", "iou_", "f1"), [("", 98, 96, 88, 88), ("_furnitures", 91.5, 96, 84, 88)]
)
def test_rooms_of_plans_are_those_that_people_drew(
    variant: str, recall: float, precision: float, iou_: float, f1: float
) -> None:
    plans = [plan(name, variant) for name in PLANNED]
    scores = mean([score(found_rooms(grid, repeats=1)[0], drawn) for grid, drawn in plans])
    assert scores.recall >= recall
    assert scores.precision >= precision
    assert scores.iou >= iou_
    assert scores.f1 >= f1


def test_most_rooms_of_robot_and_owner_are_found() -> None:
    good, rooms = 0, 0
    for name in (
        "d9_1093_huge",
        "sca075_test",
        "S5_FW2020_with_segments",
        "S6_FW2652_with_active_segment_and_no_mop_zone",
    ):
        grid, semantics = open_map(HOMES / "single" / f"{name}.json").read({})
        assert semantics is not None
        drawn = np.where(grid.free, semantics.labels, 0).astype(np.int64)
        found, of = matched(found_rooms(grid, repeats=1)[0], drawn)
        good, rooms = good + found, rooms + of
    assert good >= 0.8 * rooms


def cells_of(home: str) -> tuple[OccupancyGrid, list[Polygon]]:
    grid, _ = open_map(HOMES / f"{home}.json").read({})
    return grid, rooms_of(grid)


def rooms_of(grid: OccupancyGrid) -> list[Polygon]:
    return [room.polygon for room in create_map(grid, "1", Ids()).rooms]


def assert_same(found: list[Polygon], expected: list[Polygon]) -> None:
    assert len(found) == len(expected)
    assert all(max(iou(polygon, other) for other in found) > 0.98 for polygon in expected)


@pytest.mark.parametrize("home", SOME_HOMES)
def test_unexplored_cells_around_a_home_change_nothing(home: str) -> None:
    grid, expected = cells_of(home)
    frame = GridFrame(grid.frame.resolution, grid.frame.width + 50, grid.frame.height + 41, grid.frame.origin)
    cells = np.pad(grid.cells, ((0, 41), (0, 50)), constant_values=Cell.UNEXPLORED)
    assert_same(rooms_of(OccupancyGrid(frame, cells)), expected)


@pytest.mark.parametrize("quarters", [0, 1, 2, 3])
@pytest.mark.parametrize("name", ["lab_a_scan", "Freiburg79_scan"])
def test_a_plan_has_the_same_rooms_mirrored_and_turned(name: str, quarters: int) -> None:
    grid, _ = plan(name, "_furnitures")
    cells = np.rot90(grid.cells[:, ::-1], quarters)
    frame = GridFrame(grid.frame.resolution, cells.shape[1], cells.shape[0])
    found, expected = rooms_of(OccupancyGrid(frame, np.ascontiguousarray(cells))), rooms_of(grid)
    areas = [sorted(polygon.area for polygon in rooms) for rooms in (found, expected)]
    assert areas[0] == pytest.approx(areas[1], rel=0.02)


@pytest.mark.parametrize("home", SOME_HOMES)
def test_cells_of_half_the_size_change_nothing(home: str) -> None:
    grid, expected = cells_of(home)
    frame = GridFrame(grid.frame.resolution / 2, grid.frame.width * 2, grid.frame.height * 2, grid.frame.origin)
    assert_same(rooms_of(OccupancyGrid(frame, np.kron(grid.cells, np.ones((2, 2), np.uint8)))), expected)


@pytest.mark.parametrize("home", SOME_HOMES)
def test_rooms_lie_on_what_is_free_and_hold_nearly_all_of_it(home: str) -> None:
    grid, rooms = cells_of(home)
    floor = shapely.union_all(rooms)
    assert float(grid.free.sum()) * grid.frame.resolution**2 == pytest.approx(floor.area, rel=0.1)
