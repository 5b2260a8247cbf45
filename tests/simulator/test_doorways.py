"""What stands in doorways."""

import numpy as np
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from stillroom.maps.grid import distance_to
from stillroom.simulator.building import draw_home
from stillroom.simulator.changes import World
from stillroom.simulator.doorways import in_doorways
from stillroom.simulator.plans import thick_line
from stillroom.simulator.sensing import ROBOT_RADIUS_M, TRUTH_RESOLUTION_M, rasterise, reach, route

SEEDS = st.integers(0, 2**32 - 1)


@settings(max_examples=10)
@given(SEEDS)
def test_things_stand_in_doorways_or_right_before_them(seed: int) -> None:
    rng = np.random.default_rng(seed)
    home = draw_home(rng)
    things = in_doorways(home, 1.0, rng)
    assert set(things) == {door.id for door in home.doors}
    for door in home.doors:
        assert shapely.distance(things[door.id], door.polygon) < 0.4
        assert shapely.intersects(things[door.id], thick_line(door.line, 2.2))


def test_the_robot_gets_past_them_nearly_always() -> None:
    entered: list[bool] = []
    for seed in range(12):
        rng = np.random.default_rng(seed)
        home = draw_home(rng)
        world = World(home, in_doorways=tuple(in_doorways(home, 0.5, rng).values()))
        floor = rasterise(world)
        places = shapely.points(route(floor, reach(world, floor), rng))
        entered += [bool(shapely.intersects(room.polygon, places).any()) for room in home.rooms]
    assert np.mean(entered) > 0.9, "several things in a narrow hall may be one too many"


def test_there_is_less_room_in_a_doorway_with_something_in_it() -> None:
    home = draw_home(np.random.default_rng(3), 7)
    things = in_doorways(home, 1.0, np.random.default_rng(1))
    empty, full = World(home), World(home, in_doorways=tuple(things.values()))
    clear = [
        (distance_to(rasterise(world).solid, TRUTH_RESOLUTION_M) >= ROBOT_RADIUS_M).sum() for world in (empty, full)
    ]
    assert clear[1] < clear[0]


def test_the_share_says_how_many_and_which_stay_the_same_when_it_grows() -> None:
    home = draw_home(np.random.default_rng(3), 12)
    few, many = (in_doorways(home, share, np.random.default_rng(1)) for share in (0.5, 0.9))
    assert 0 < len(few) < len(many)
    assert all(many[key] == thing for key, thing in few.items())
    assert in_doorways(home, 0.0, np.random.default_rng(1)) == {}
