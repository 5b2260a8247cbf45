"""Walls that were not sensed, false obstacles, and grids that a failed SLAM has wrecked."""

from dataclasses import replace
from math import radians

import numpy as np
import pytest
import shapely

from stillroom.maps.geometry import as_points
from stillroom.maps.grid import Cell, GridFrame, OccupancyGrid
from stillroom.simulator.building import draw_home
from stillroom.simulator.changes import World
from stillroom.simulator.distortion import Distortion, distortion_at
from stillroom.simulator.effects import Effects, Streams
from stillroom.simulator.faults import LONG_GAP_M, Gap, draw_gaps, draw_slam_failure, with_gaps
from stillroom.simulator.homes import Home, box
from stillroom.simulator.mapping import sense
from stillroom.simulator.sensing import TRUTH_RESOLUTION_M

STRAIGHT = Distortion(np.zeros((1, 2)), np.zeros((1, 2)), np.zeros(1))
MANY = replace(Effects.NONE, gaps_per_10m=5.0, gap_m=(0.1, 1.5))


@pytest.fixture(scope="module")
def home() -> Home:
    return draw_home(np.random.default_rng(5), 8)


def gaps(home: Home, mission: int = 3, seed: int = 1) -> tuple[Gap, ...]:
    return draw_gaps(home, mission, MANY, np.random.default_rng(seed))


def test_gaps_lie_along_walls_short_ones_more_often_than_long_ones(home: Home) -> None:
    found = [gap for seed in range(10) for gap in gaps(home, seed=seed)]
    faces = shapely.union_all([room.polygon.exterior for room in home.rooms])
    assert all(shapely.intersects(gap.strip, faces) for gap in found)
    lengths = np.array([gap.length_m for gap in found])
    assert lengths.min() >= 0.1
    assert 1.3 < lengths.max() <= 1.5
    assert (lengths < 0.5).mean() > 0.5
    assert 0.4 < np.mean([gap.leaks for gap in found]) < 0.6


def test_there_are_as_many_gaps_as_the_walls_are_long(home: Home) -> None:
    walls = sum(room.polygon.exterior.length for room in home.rooms)
    counts = [len(gaps(home, seed=seed)) for seed in range(20)]
    assert np.mean(counts) == pytest.approx(5.0 * walls / 10, rel=0.1)


def test_a_first_map_has_no_long_gaps_and_no_leaks(home: Home) -> None:
    first = gaps(home, mission=0)
    assert first
    assert all(gap.length_m <= LONG_GAP_M and not gap.leaks for gap in first)


def walled() -> OccupancyGrid:
    """Floor left of a wall of one cell at x = 2, nothing known behind it."""
    cells = np.full((40, 80), Cell.UNEXPLORED, np.uint8)
    cells[:, :40] = Cell.FREE
    cells[:, 40] = Cell.OCCUPIED
    return OccupancyGrid(GridFrame(0.05, 80, 40), cells)


def test_a_gap_that_leaks_is_floor_through_the_wall_and_another_one_is_unknown() -> None:
    strip = box(1.9, 0.5, 2.3, 1.0)
    leaking = with_gaps(walled(), (Gap(strip, 0.5, leaks=True),), STRAIGHT)
    assert (leaking[11:19, 40:45] == Cell.FREE).all()
    blind = with_gaps(walled(), (Gap(strip, 0.5, leaks=False),), STRAIGHT)
    assert (blind[11:19, 40] == Cell.UNEXPLORED).all()
    assert (blind[:, 41:] == Cell.UNEXPLORED).all()
    for cells in (leaking, blind):
        assert (cells[:, :40] == Cell.FREE).all()
        assert (cells[22:, 40] == Cell.OCCUPIED).all()


def test_nothing_leaks_where_the_wall_was_not_in_sight() -> None:
    grid = walled()
    cells = grid.cells.copy()
    cells[:, 30:] = Cell.UNEXPLORED
    hidden = OccupancyGrid(grid.frame, cells)
    gap = Gap(box(1.9, 0.5, 2.3, 1.0), 0.5, leaks=True)
    assert np.array_equal(with_gaps(hidden, (gap,), STRAIGHT), cells)


@pytest.mark.parametrize("seed", range(6))
def test_a_failed_slam_puts_a_part_of_the_scans_far_off_and_some_of_them_twice(seed: int) -> None:
    rng = np.random.default_rng(seed)
    places = rng.uniform(-5, 5, (40, 2))
    failure = draw_slam_failure(places, rng)
    lost = failure.scans[~failure.again]
    assert 0.25 * len(places) <= len(lost) <= 0.65 * len(places)
    assert len(set(failure.scans.tolist())) == len(failure.scans)
    assert failure.again.any()
    assert radians(3) <= abs(failure.off.yaw) <= radians(15)
    middle = places[lost].mean(0)
    assert 0.4 <= np.linalg.norm(failure.off.apply(as_points(middle))[0] - middle) <= 1.5


def test_walls_are_doubled_in_a_wrecked_grid_and_the_truth_is_as_it_was(home: Home) -> None:
    def sensed(effects: Effects, mission: int = 4) -> tuple[OccupancyGrid, np.ndarray, frozenset[str]]:
        bent = distortion_at(home, mission, effects, Streams(2))
        found = sense(World(home), bent, mission, 0.05, effects, Streams(2))
        return found.grid, found.seen, found.happened

    clean, seen, _ = sensed(Effects.NONE)
    wrecked, still_seen, happened = sensed(replace(Effects.NONE, slam_failures=1.0))
    assert happened == {"slam_failures"}
    assert np.array_equal(seen, still_seen)
    assert wrecked.occupied.sum() > 1.15 * clean.occupied.sum()
    assert sensed(replace(Effects.NONE, slam_failures=1.0), mission=0)[2] == frozenset(), "never the first map"
    assert TRUTH_RESOLUTION_M < 0.05
