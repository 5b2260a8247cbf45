"""Drawn homes: plausible by construction, whatever the seed."""

import numpy as np
import pytest
import shapely
from hypothesis import example, given, settings
from hypothesis import strategies as st
from shapely import Point

from stillroom.maps.geometry import Pose, as_points
from stillroom.simulator.building import draw_home
from stillroom.simulator.homes import Home, carried, unreachable_rooms
from stillroom.simulator.plans import ROOMS, thick_line

SEEDS = st.integers(0, 2**32 - 1)
some_homes = settings(max_examples=8)
ROBOT_M = 0.2


def home_of(seed: int, rooms: int | None = None) -> Home:
    return draw_home(np.random.default_rng(seed), rooms)


@some_homes
@given(SEEDS)
def test_the_same_seed_is_the_same_home(seed: int) -> None:
    assert home_of(seed) == home_of(seed)


def test_another_seed_is_another_home() -> None:
    assert len({home_of(seed, 7).rooms for seed in range(10)}) == 10


@some_homes
@given(SEEDS, st.integers(*ROOMS))
def test_a_home_has_the_rooms_that_were_asked_for_each_with_a_name_of_its_own(seed: int, rooms: int) -> None:
    home = home_of(seed, rooms)
    assert len(home.rooms) == len({room.name for room in home.rooms}) == rooms


@pytest.mark.parametrize("rooms", [ROOMS[0] - 1, ROOMS[1] + 1])
def test_a_plan_of_too_few_or_too_many_rooms_is_refused(rooms: int) -> None:
    with pytest.raises(ValueError, match=f"{rooms} rooms"):
        home_of(0, rooms)


@some_homes
@given(SEEDS)
def test_rooms_walls_and_doorways_share_the_building_without_overlap(seed: int) -> None:
    home = home_of(seed)
    parts = [*(room.polygon for room in home.rooms), *(door.polygon for door in home.doors), home.walls]
    whole = shapely.union_all(parts)
    assert sum(part.area for part in parts) == pytest.approx(whole.area, abs=1e-6)
    assert all(room.polygon.is_valid and not room.polygon.interiors for room in home.rooms)
    building = shapely.Polygon(max(shapely.get_parts(whole), key=lambda part: part.area).exterior)
    assert building.area == pytest.approx(whole.area, abs=1e-6), "nothing but rooms, doorways and walls"
    assert shapely.distance(building.exterior, shapely.union_all([r.polygon for r in home.rooms])) > 0.05


@some_homes
@given(SEEDS)
def test_every_room_is_reached_through_doors_past_the_furniture(seed: int) -> None:
    assert unreachable_rooms(home_of(seed), ROBOT_M) == ()


@some_homes
@given(SEEDS)
@example(33)
def test_a_doorway_lies_between_its_two_rooms_in_a_wall_of_ordinary_thickness(seed: int) -> None:
    home = home_of(seed)
    for door in home.doors:
        before = [home.room(name).polygon.intersection(thick_line(door.line, 0.6)).area for name in door.rooms]
        assert min(before) > 0.1, "there is floor of both on its two sides"
        width = float(np.linalg.norm(np.diff(as_points(door.line), axis=0)))
        assert 0.10 - 1e-6 <= door.polygon.area / width <= 0.20
        assert door.kind == "opening" or 0.8 <= width <= 1.0


@some_homes
@given(SEEDS)
def test_every_home_has_an_open_plan_part_and_a_kitchen_bath_and_bed(seed: int) -> None:
    home = home_of(seed)
    assert any(door.kind == "opening" and "Kitchen" in door.rooms for door in home.doors)
    assert {"hall", "living", "kitchen", "bath", "bed"} <= {room.use for room in home.rooms}


def test_some_rooms_are_l_shaped_and_some_walls_diagonal() -> None:
    corners = [len(shapely.get_coordinates(room.polygon)) - 1 for seed in range(10) for room in home_of(seed).rooms]
    assert {4, 6} <= set(corners)
    assert any(count % 2 for count in corners), "a corner that was cut off makes one more"


@some_homes
@given(SEEDS)
def test_furniture_stands_in_its_room_and_on_nothing_else(seed: int) -> None:
    home = home_of(seed)
    assert home.furniture
    for piece in home.furniture:
        assert shapely.contains(shapely.buffer(home.room(piece.room).polygon, 1e-3), piece.footprint)
        assert shapely.contains(shapely.buffer(piece.footprint, 1e-3), piece.solid)
    footprints = [piece.footprint for piece in home.furniture]
    assert shapely.union_all(footprints).area == pytest.approx(sum(f.area for f in footprints), abs=1e-6)


@some_homes
@given(SEEDS)
def test_the_robot_starts_at_the_origin_in_the_living_room(seed: int) -> None:
    home = home_of(seed)
    assert home.dock == pytest.approx((0.0, 0.0), abs=1e-9)
    assert shapely.contains(home.room("Living room").polygon, Point(home.dock))


def test_a_carried_polygon_stays_closed_whatever_the_rounding() -> None:
    rng = np.random.default_rng(0)
    ring = shapely.Point(1, 2).buffer(3).difference(shapely.Point(1, 2).buffer(1))
    moved = carried(ring, lambda points: Pose(1, 2, 0.3).apply(points) + rng.normal(0, 1e-12, points.shape))
    assert moved.area == pytest.approx(ring.area)
