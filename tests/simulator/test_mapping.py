"""Sensed grids against the truth."""

from collections.abc import Iterable
from dataclasses import replace

import cv2
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from stillroom.maps.geometry import Points, as_points
from stillroom.maps.grid import Cell, Mask, OccupancyGrid
from stillroom.simulator.building import draw_home, home_of
from stillroom.simulator.changes import World
from stillroom.simulator.distortion import Distortion, distortion_at
from stillroom.simulator.effects import Effects, Streams
from stillroom.simulator.homes import Home
from stillroom.simulator.mapping import Sensed, sense
from stillroom.simulator.sensing import rasterise, reach, route

RESOLUTION = 0.05
NOISY = replace(Effects.NONE, range_noise_m=0.01, scan_noise_m=0.008, scan_noise_deg=0.15)


def straight(home: Home) -> Distortion:
    return distortion_at(home, 0, Effects.NONE, Streams(0))


def sensed(home: Home, effects: Effects = Effects.NONE, mission: int = 0, shut: frozenset[str] = frozenset()) -> Sensed:
    return sense(World(home, shut), straight(home), mission, RESOLUTION, effects, Streams(3))


def centres(grid: OccupancyGrid, mask: Mask) -> Points:
    return grid.frame.to_map(as_points(np.argwhere(mask)[:, ::-1]) + 0.5)


def distances(points: Points, to: Iterable[shapely.Geometry]) -> np.ndarray:
    return np.asarray(shapely.distance(shapely.union_all(list(to)), shapely.points(points)))


@pytest.fixture(scope="module")
def home() -> Home:
    return draw_home(np.random.default_rng(11), 7)


@settings(max_examples=5)
@given(st.integers(0, 2**32 - 1))
def test_free_cells_lie_in_rooms_and_doorways_and_occupied_ones_on_what_stands_there(seed: int) -> None:
    home = draw_home(np.random.default_rng(seed))
    grid = sensed(home).grid
    floor = [room.polygon for room in home.rooms] + [door.polygon for door in home.doors]
    assert distances(centres(grid, grid.free), floor).max() < 2 * RESOLUTION
    things = [home.walls, *(piece.solid for piece in home.furniture)]
    assert distances(centres(grid, grid.occupied), things).max() < 1.5 * RESOLUTION


@settings(max_examples=5)
@given(st.integers(0, 2**32 - 1))
def test_the_robot_gets_to_every_room_and_maps_much_of_its_floor(seed: int) -> None:
    home = draw_home(np.random.default_rng(seed))
    grid = sensed(home, NOISY).grid
    free = shapely.points(centres(grid, grid.free))
    for room in home.rooms:
        clear = room.polygon.area - sum(f.footprint.area for f in home.furniture if f.room == room.name)
        mapped = shapely.contains(room.polygon, free).sum() * RESOLUTION**2
        assert mapped > 0.3 * clear, room.name


def test_walls_come_out_one_to_three_cells_thick_with_nothing_known_behind(home: Home) -> None:
    grid = sensed(home, NOISY).grid
    thick = cv2.morphologyEx(grid.occupied.astype(np.uint8), cv2.MORPH_OPEN, np.ones((4, 4), np.uint8))
    assert thick.sum() < 0.1 * grid.occupied.sum(), "but where both faces of a thin wall meet"
    outside = shapely.buffer(shapely.union_all([home.walls, *(room.polygon for room in home.rooms)]), 2 * RESOLUTION)
    known = shapely.points(centres(grid, ~grid.unexplored))
    assert shapely.contains(outside, known).all()


def test_what_lies_under_furniture_stays_unexplored(home: Home) -> None:
    grid = sensed(home).grid
    bed = next(piece for piece in home.furniture if piece.id == "Bedroom/bed")
    unseen = shapely.points(centres(grid, grid.unexplored))
    inside = shapely.buffer(bed.footprint, -3 * RESOLUTION)
    assert shapely.contains(inside, unseen).sum() * RESOLUTION**2 == pytest.approx(inside.area, rel=0.1)


def test_the_robot_passes_under_tables_and_sees_their_legs(home: Home) -> None:
    grid = sensed(home).grid
    table = next(piece for piece in home.furniture if piece.id == "Living room/dining table")
    inside = shapely.buffer(table.footprint, -4 * RESOLUTION)
    assert shapely.contains(inside, shapely.points(centres(grid, grid.free))).sum() * RESOLUTION**2 > 0.8 * inside.area
    hits = shapely.points(centres(grid, grid.occupied))
    assert all((shapely.distance(leg, hits) < RESOLUTION).any() for leg in table.solid.geoms)


def free_area(of: Sensed, home: Home, room: str) -> float:
    polygon = home.room(room).polygon
    return float(shapely.contains(polygon, shapely.points(centres(of.grid, of.grid.free))).sum() * RESOLUTION**2)


def test_a_room_behind_a_shut_door_is_not_seen_at_all(home: Home) -> None:
    (door,) = home.doors_of("Bathroom")
    assert free_area(sensed(home), home, "Bathroom") > 1.0
    assert free_area(sensed(home, shut=frozenset({door.id})), home, "Bathroom") < 0.05


@pytest.mark.parametrize("robot", range(6))
def test_no_ray_slips_through_thin_walls_or_shut_doors_at_any_angle(robot: int) -> None:
    streams = Streams(2, robot)
    home = home_of(streams, replace(Effects.NONE, thin_walls=1.0, turned=True))
    behind = home.room("Bathroom").polygon
    shut = frozenset(door.id for door in home.doors_of("Bathroom"))
    of = sensed(home, shut=shut)
    assert shapely.contains(behind, shapely.points(of.floor.centres(np.argwhere(of.seen)))).sum() == 0


def test_the_robot_does_not_enter_a_room_that_it_leaves_out(home: Home) -> None:
    bedroom = home.room("Bedroom").polygon
    for skipped in (frozenset[str](), frozenset({"Bedroom"})):
        world = World(home, skipped=skipped)
        places = route(rasterise(world), reach(world, rasterise(world)), np.random.default_rng(1))
        assert bool(shapely.contains(bedroom, shapely.points(places)).any()) == (not skipped)


def test_noise_moves_walls_by_little_and_only_here_and_there_by_more(home: Home) -> None:
    grid = sensed(home, NOISY).grid
    things = [home.walls, *(piece.solid for piece in home.furniture)]
    assert np.quantile(distances(centres(grid, grid.occupied), things), 0.98) < RESOLUTION


def test_the_map_is_bent_and_what_was_seen_is_not(home: Home) -> None:
    bent = distortion_at(home, 0, replace(Effects.NONE, jitter_m=0.05, jitter_deg=0.3), Streams(9))
    crooked = sense(World(home), bent, 0, RESOLUTION, Effects.NONE, Streams(3))
    plain = sensed(home)
    assert np.array_equal(crooked.seen, plain.seen)
    wall = shapely.union_all([home.walls, *(piece.solid for piece in home.furniture)])
    there = centres(crooked.grid, crooked.grid.occupied)
    assert distances(there, [wall]).max() > 1.5 * RESOLUTION
    assert distances(bent.undo(there), [wall]).max() < 1.5 * RESOLUTION


def test_without_effects_two_missions_differ_only_in_the_robots_way(home: Home) -> None:
    first, again, later = sensed(home), sensed(home), sensed(home, mission=1)
    assert np.array_equal(first.grid.cells, again.grid.cells)
    both = first.seen & later.seen
    assert both.sum() > 0.97 * (first.seen | later.seen).sum()


@pytest.mark.parametrize(
    "effect", [{"gaps_per_10m": 3.0}, {"specks": 3.0}, {"range_noise_m": 0.02}, {"scan_noise_m": 0.02}]
)
def test_each_error_changes_the_grid_and_nothing_when_it_is_switched_off(home: Home, effect: dict[str, float]) -> None:
    effects = replace(Effects.NONE, **effect)  # type: ignore[arg-type]
    clean, wrong = sensed(home), sensed(home, effects)
    assert clean.grid.cells.shape != wrong.grid.cells.shape or not np.array_equal(clean.grid.cells, wrong.grid.cells)
    assert np.array_equal(clean.seen, wrong.seen)
    off = sensed(home, replace(effects, **dict.fromkeys(effect, 0.0)))  # type: ignore[arg-type]
    assert np.array_equal(clean.grid.cells, off.grid.cells)


def test_gaps_take_walls_away_and_specks_add_obstacles_to_the_floor(home: Home) -> None:
    clean = sensed(home).grid.cells
    gaps = sensed(home, replace(Effects.NONE, gaps_per_10m=3.0)).grid.cells
    specks = sensed(home, replace(Effects.NONE, specks=3.0)).grid.cells
    assert (clean[gaps != clean] != Cell.FREE).all()
    assert (gaps != Cell.OCCUPIED)[gaps != clean].all()
    assert (clean[specks != clean] == Cell.FREE).all()
    assert (specks[specks != clean] == Cell.OCCUPIED).all()


def test_gaps_lie_where_they_lie_whether_or_not_there_are_specks(home: Home) -> None:
    clean = sensed(home).grid.cells
    gaps = sensed(home, replace(Effects.NONE, gaps_per_10m=3.0)).grid.cells
    both = sensed(home, replace(Effects.NONE, gaps_per_10m=3.0, specks=3.0)).grid.cells
    assert (both == gaps)[clean != Cell.FREE].mean() > 0.999
