"""Windows, and ways through walls that were not there before."""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from stillroom.maps.geometry import as_points
from stillroom.simulator.building import draw_home
from stillroom.simulator.changes import World
from stillroom.simulator.distortion import distortion_at
from stillroom.simulator.effects import Effects, Streams
from stillroom.simulator.homes import Home
from stillroom.simulator.mapping import Sensed, sense
from stillroom.simulator.openings import draw_windows, with_passage
from stillroom.simulator.sensing import rasterise, reach, route

SEEDS = st.integers(0, 2**32 - 1)
some_homes = settings(max_examples=8)


@pytest.fixture(scope="module")
def home() -> Home:
    return draw_home(np.random.default_rng(5), 8)


def sensed(world: World) -> Sensed:
    straight = distortion_at(world.home, 0, Effects.NONE, Streams(0))
    return sense(world, straight, 0, 0.05, Effects.NONE, Streams(3))


@some_homes
@given(SEEDS)
def test_a_passage_joins_two_rooms_that_no_doorway_joined(seed: int) -> None:
    rng = np.random.default_rng(seed)
    before = draw_home(rng)
    after = with_passage(before, rng)
    assert after.rooms == before.rooms
    (passage,) = after.doors[len(before.doors) :]
    assert frozenset(passage.rooms) not in {frozenset(door.rooms) for door in before.doors}
    assert passage.kind == "opening"
    assert 0.8 <= shapely.LineString(passage.line).length <= 2.0
    for name in passage.rooms:
        room = after.room(name).polygon
        assert shapely.distance(room, passage.polygon) < 1e-6
        assert shapely.intersection(room, passage.polygon).area < 1e-6


def test_the_robot_sees_through_a_passage_and_goes_through_it(home: Home) -> None:
    opened = next(with_passage(home, np.random.default_rng(seed)) for seed in range(20))
    passage = opened.doors[-1]
    others = frozenset(door.id for door in opened.doors if set(passage.rooms) & set(door.rooms)) - {passage.id}
    a, b = (opened.room(name).polygon for name in passage.rooms)
    world = World(opened, others)
    places = shapely.points(route(rasterise(world), reach(world, rasterise(world)), np.random.default_rng(1)))
    inside = [bool(shapely.contains(room, places).any()) for room in (a, b)]
    assert inside[0] == inside[1], "with all other doors shut, both are reached or neither is"


def test_furniture_is_moved_out_of_the_way_and_none_is_lost(home: Home) -> None:
    opened = with_passage(home, np.random.default_rng(3))
    assert [piece.id for piece in opened.furniture] == [piece.id for piece in home.furniture]
    moved = [piece for piece, old in zip(opened.furniture, home.furniture, strict=True) if piece != old]
    way = shapely.buffer(opened.doors[-1].polygon, 0.3)
    assert not any(shapely.intersects(piece.footprint, way) for piece in moved)


@some_homes
@given(SEEDS)
def test_windows_are_cut_into_outer_walls_and_show_what_is_outside(seed: int) -> None:
    rng = np.random.default_rng(seed)
    plain = draw_home(rng)
    home = draw_windows(plain, 1.0, rng)
    floor = shapely.union_all([room.polygon for room in home.rooms])
    assert home.windows
    for window in home.windows:
        assert shapely.intersection(window.view, floor).area < 1e-3
        assert min(shapely.distance(pane, floor) for pane in window.panes.geoms) < 1e-6
        assert shapely.distance(window.panes, window.view) < 0.05
    assert draw_windows(plain, 0.0, rng).windows == ()


def test_rays_pass_a_clear_window_and_the_robot_does_not() -> None:
    home = draw_windows(draw_home(np.random.default_rng(5), 8), 1.0, np.random.default_rng(1))
    clear = World(home, clear=frozenset(window.id for window in home.windows))
    floor = shapely.union_all([room.polygon for room in home.rooms] + [home.walls])
    places = route(rasterise(clear), reach(clear, rasterise(clear)), np.random.default_rng(1))
    assert shapely.contains(shapely.convex_hull(floor), shapely.points(places)).all()

    def free_outside(world: World) -> float:
        grid = sensed(world).grid
        centres = shapely.points(grid.frame.to_map(as_points(np.argwhere(grid.free)[:, ::-1]) + 0.5))
        return float((~shapely.contains(shapely.buffer(floor, 0.3), centres)).sum() * 0.05**2)

    assert free_outside(World(home)) == 0.0
    assert free_outside(clear) > 1.0


def test_the_raster_of_the_floor_is_the_same_size_whichever_windows_are_clear() -> None:
    home = draw_windows(draw_home(np.random.default_rng(5), 8), 1.0, np.random.default_rng(1))
    shut, clear = World(home), World(home, clear=frozenset(window.id for window in home.windows))
    assert rasterise(shut).frame == rasterise(clear).frame
    assert not rasterise(shut).glass.any()
