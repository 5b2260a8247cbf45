"""What happens in homes between missions."""

from dataclasses import replace

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from stillroom.simulator.building import draw_home
from stillroom.simulator.changes import late_rooms, move_furniture, shut_doors, skip_rooms, world_during
from stillroom.simulator.effects import Effects, Streams
from stillroom.simulator.homes import Home, unreachable_rooms

SEEDS = st.integers(0, 2**32 - 1)


@pytest.fixture(scope="module")
def home() -> Home:
    return draw_home(np.random.default_rng(5), 9)


@settings(max_examples=10)
@given(SEEDS)
def test_furniture_moves_within_its_room_and_never_shuts_a_room_off(seed: int) -> None:
    rng = np.random.default_rng(seed)
    before = draw_home(rng)
    after = move_furniture(move_furniture(before, 0.5, rng), 0.5, rng)
    assert [(f.id, f.room) for f in after.furniture] == [(f.id, f.room) for f in before.furniture]
    assert before.furniture != after.furniture
    assert unreachable_rooms(after, 0.2) == ()
    for old, new in zip(before.furniture, after.furniture, strict=True):
        assert old.movable or old == new
        assert new.footprint.area == pytest.approx(old.footprint.area)
        assert shapely.contains(shapely.buffer(after.room(new.room).polygon, 1e-3), new.footprint)


def test_a_share_of_the_furniture_moves(home: Home) -> None:
    def moved(share: float) -> int:
        after = move_furniture(home, share, np.random.default_rng(1))
        return sum(a != b for a, b in zip(home.furniture, after.furniture, strict=True))

    movable = sum(piece.movable for piece in home.furniture)
    assert moved(0.0) == 0
    assert 0 < moved(0.3) < moved(1.0) <= movable
    assert moved(1.0) > 0.6 * movable


def test_doors_shut_but_openings_and_the_way_out_of_the_dock_do_not(home: Home) -> None:
    shut = shut_doors(home, 1.0, np.random.default_rng(1))
    kinds = {door.id: door for door in home.doors}
    assert shut
    assert all(kinds[key].kind == "door" and "Living room" not in kinds[key].rooms for key in shut)
    assert shut_doors(home, 0.0, np.random.default_rng(1)) == frozenset()


def test_rooms_that_come_late_lie_behind_one_door(home: Home) -> None:
    late = late_rooms(home, 2, np.random.default_rng(1))
    assert len(late) == 2
    assert all([door.kind for door in home.doors_of(name)] == ["door"] for name in late)


def test_rooms_that_are_left_out_are_dead_ends(home: Home) -> None:
    skipped = skip_rooms(home, 1.0, np.random.default_rng(1))
    assert skipped
    assert all(len(home.doors_of(name)) == 1 for name in skipped)
    assert "Living room" not in skipped
    assert skip_rooms(home, 0.0, np.random.default_rng(1)) == frozenset()


def test_a_late_room_is_shut_until_its_mission_comes(home: Home) -> None:
    effects = replace(Effects.NONE, rooms_late=1, late_until=3)
    shut = [world_during(home, mission, effects, Streams(1)).shut for mission in range(5)]
    assert len(shut[0]) == 1
    assert shut == [shut[0]] * 3 + [frozenset()] * 2


def test_the_first_mission_visits_every_room(home: Home) -> None:
    effects = replace(Effects.NONE, rooms_skipped=1.0)
    assert world_during(home, 0, effects, Streams(1)).skipped == frozenset()
    assert world_during(home, 1, effects, Streams(1)).skipped


def test_without_effects_the_world_is_the_home(home: Home) -> None:
    world = world_during(home, 7, Effects.NONE, Streams(1))
    assert world.home is home
    assert not world.shut
    assert not world.skipped
