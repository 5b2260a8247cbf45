"""Maps of robots that sense nothing but what they touch."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
import shapely

from stillroom.maps.geometry import as_points
from stillroom.maps.grid import Mask, OccupancyGrid
from stillroom.simulator.building import draw_home
from stillroom.simulator.changes import World
from stillroom.simulator.distortion import distortion_at
from stillroom.simulator.effects import Effects, Streams
from stillroom.simulator.homes import Home
from stillroom.simulator.mapping import Sensed, sense
from stillroom.simulator.sensing import ROBOT_RADIUS_M, rasterise, reach
from stillroom.simulator.touching import go_over

BUMPS = replace(Effects.NONE, bumpers=1.0)
CELL = 0.05


@pytest.fixture(scope="module")
def home() -> Home:
    return draw_home(np.random.default_rng(11), 7)


def sensed(home: Home, effects: Effects = BUMPS) -> Sensed:
    return sense(World(home), distortion_at(home, 3, effects, Streams(3)), 3, CELL, effects, Streams(3))


def distances(grid: OccupancyGrid, mask: Mask, to: shapely.Geometry) -> np.ndarray:
    centres = grid.frame.to_map(as_points(np.argwhere(mask)[:, ::-1]) + 0.5)
    return np.asarray(shapely.distance(to, shapely.points(centres)))


def test_floor_is_where_the_robots_body_was_and_walls_are_what_it_touched(home: Home) -> None:
    of = sensed(home)
    floor = shapely.union_all([room.polygon for room in home.rooms] + [door.polygon for door in home.doors])
    things = shapely.union_all([home.walls, *(piece.solid for piece in home.furniture)])
    assert of.happened == {"bumpers"}
    assert distances(of.grid, of.grid.free, floor).max() < 2 * CELL
    assert np.quantile(distances(of.grid, of.grid.occupied, things), 0.99) < 1.5 * CELL


def test_walls_are_dotted(home: Home) -> None:
    of = sensed(home)
    known = cv2.dilate(of.grid.free.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
    rim = known & ~of.grid.free
    assert 0.5 < of.grid.occupied[rim].mean() < 0.98


def test_what_lies_behind_a_gap_too_narrow_for_the_robot_stays_unknown(home: Home) -> None:
    scanned, touched = sensed(home, Effects.NONE), sensed(home)
    assert touched.seen.sum() < scanned.seen.sum()
    assert not (touched.seen & touched.floor.solid).any()


def test_spots_that_it_missed_are_unknown(home: Home) -> None:
    floor = rasterise(World(home))
    reached = reach(World(home), floor).cells
    radius = round(ROBOT_RADIUS_M / 0.025)
    body = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * radius + 1, 2 * radius + 1))
    all_of_it = (cv2.dilate(reached.astype(np.uint8), body) > 0) & ~floor.solid
    swept = [go_over(floor, reached, np.random.default_rng(seed)).swept for seed in range(5)]
    assert all((mask <= all_of_it).all() for mask in swept)
    assert 0.9 < np.mean([mask.sum() / all_of_it.sum() for mask in swept]) < 1.0


def test_the_map_is_bent_and_wrecked_like_any_other(home: Home) -> None:
    plain = sensed(home)
    bent = sensed(home, replace(BUMPS, jitter_m=0.05, jitter_deg=1.0))
    wrecked = sensed(home, replace(BUMPS, slam_failures=1.0))
    assert np.array_equal(plain.seen, bent.seen)
    assert not np.array_equal(plain.grid.cells, bent.grid.cells)
    assert "slam_failures" in wrecked.happened
    assert wrecked.grid.cells.size > plain.grid.cells.size


def test_a_grid_may_lie_at_an_angle_in_its_frame(home: Home) -> None:
    floor = shapely.union_all([room.polygon for room in home.rooms] + [door.polygon for door in home.doors])
    for effects in (Effects.NONE, BUMPS):
        straight, turned = sensed(home, effects), sensed(home, replace(effects, turned_grids=1.0))
        assert straight.grid.frame.origin.yaw == 0.0
        assert turned.grid.frame.origin.yaw != 0.0
        assert distances(turned.grid, turned.grid.free, floor).max() < 2 * CELL
        assert turned.grid.free.sum() == pytest.approx(straight.grid.free.sum(), rel=0.02)
