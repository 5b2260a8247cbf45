"""Discovery: what becomes of space that no mission saw before (paper, section V and Figure new_space), and of space that is not seen."""

from collections.abc import Sequence

import numpy as np
import pytest
import shapely

from stillroom.maps.geometry import Pose
from stillroom.maps.grid import Cell, OccupancyGrid
from stillroom.maps.meta import MapMeta
from stillroom.maps.semantics import Ids, SemanticMap
from stillroom.pipeline.creation import create_map
from stillroom.pipeline.update import MapUpdate
from tests.drawing import draw, paint, rectangle
from tests.golden.homes import FOUR_ROOMS
from tests.golden.uploads import (
    assert_all_kept,
    assert_valid,
    between,
    conflicts_of,
    covers,
    first_map,
    kept,
    named,
    new_room,
    upload,
    uploads,
)
from tests.missions import sense

HOME = FOUR_ROOMS.grid
BASE = first_map(FOUR_ROOMS)
ROOM_D = rectangle(4.2, 0.2, 8.2, 2.0)
LEFT_HALF = paint(HOME, Cell.UNEXPLORED, rectangle(4.2, -1, 9, 6))


def without_d() -> OccupancyGrid:
    """The home before anybody opened the door from B to D."""
    shut = paint(HOME, Cell.UNEXPLORED, rectangle(4.25, -1, 9, 2.05))
    return paint(shut, Cell.OCCUPIED, rectangle(4.2, 2.0, 8.4, 2.2))


def named_map(grid: OccupancyGrid, letters: str) -> SemanticMap:
    """The first map of a part of the home."""
    created = create_map(grid, "0", Ids())
    rooms = {letter: FOUR_ROOMS.room(created, letter).id for letter in letters}
    assert sorted(rooms.values()) == sorted(room.id for room in created.rooms)
    return created


# -- new rooms -------------------------------------------------------------------------------------------------------


def test_a_room_behind_a_door_that_was_shut_before_is_new_with_a_divider_in_its_doorway() -> None:
    base = named_map(without_d(), "ABC")
    update = upload(base, HOME)
    assert update.outcome == "updated", update.reason
    assert_all_kept(base, update, HOME)
    room = new_room(update)
    assert room.id not in {r.id for r in base.rooms}
    assert room.made_by == "algorithm"
    assert covers(room.polygon, ROOM_D) > 0.95
    assert room.polygon.area < 1.1 * ROOM_D.area
    (divider,) = (d for d in update.map.dividers if room.id in d.rooms)
    assert (divider.made_by, divider.kind) == ("algorithm", "open")
    line, doorway = shapely.LineString(divider.line), rectangle(6.4, 1.85, 7.6, 2.35)
    assert line.within(doorway)
    assert line.length == pytest.approx(0.8, abs=0.2)
    assert "1 new room found" in update.reason


def test_a_new_room_stays_what_it_is_in_the_missions_after() -> None:
    base = named_map(without_d(), "ABC")
    rng = np.random.default_rng(4)
    missions = list(uploads(base, [HOME, *(sense(HOME, Pose(), rng, 0.1) for _ in range(4))], noise_m=0.02))
    (new,) = missions[0].discovered
    for update in missions[1:]:
        assert (update.outcome, update.discovered) == ("updated", ()), update.reason
        assert {room.id for room in update.map.rooms} == {*(r.id for r in base.rooms), new}
        assert min(kept(missions[0].map, update.map).values()) > 0.93


def test_two_rooms_found_at_once_are_two_rooms_and_the_way_between_them_is_found() -> None:
    base = named_map(paint(LEFT_HALF, Cell.OCCUPIED, rectangle(4.0, 0.0, 4.2, 4.6)), "AC")
    update = upload(base, HOME)
    assert_all_kept(base, update, HOME)
    assert len(update.discovered) == 2
    rooms = {letter: FOUR_ROOMS.room(update.map, letter) for letter in "ABCD"}
    assert len({room.id for room in rooms.values()}) == 4
    assert covers(rooms["D"].polygon, ROOM_D) > 0.9
    FOUR_ROOMS.divider(update.map, "A", "B")
    FOUR_ROOMS.divider(update.map, "B", "D")


ALCOVE = rectangle(8.2, 3.0, 8.9, 3.8)


def test_an_alcove_becomes_part_of_its_room() -> None:
    around = paint(HOME, Cell.OCCUPIED, ALCOVE.buffer(0.2, join_style="mitre") & rectangle(8.2, 2, 10, 5))
    grid = paint(around, Cell.FREE, ALCOVE)
    update = upload(BASE, grid)
    assert (update.outcome, update.discovered) == ("updated", ()), update.reason
    assert_all_kept(BASE, update, grid, 0.9)
    assert covers(named(update.map, "B").polygon, ALCOVE) > 0.9


# -- what is no room -------------------------------------------------------------------------------------------------


def leak(rng: np.random.Generator, window: shapely.Polygon, outward: Sequence[float], rays: int = 40) -> OccupancyGrid:
    """Rays that left through a window: a fan of free cells that ends nowhere."""
    x, y = window.centroid.coords[0]
    grid = paint(HOME, Cell.FREE, window)
    fan = []
    for angle in rng.uniform(-0.7, 0.7, rays):
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]) @ np.array(outward)
        far = np.array([x, y]) + turn * rng.uniform(0.8, 3.0)
        fan.append(shapely.LineString([(x, y), far]).buffer(0.06))
    seen = shapely.union_all(fan) & shapely.box(*_outside(outward))
    return paint(grid, Cell.FREE, *[part for part in shapely.get_parts(seen) if part.geom_type == "Polygon"])


def _outside(outward: Sequence[float]) -> tuple[float, float, float, float]:
    return (8.3, -5.0, 14.0, 10.0) if outward[0] > 0 else (-5.0, 4.5, 14.0, 10.0)


LEAKS = [(rectangle(8.2, 3.0, 8.4, 4.0), (1.0, 0.0)), (rectangle(1.5, 4.4, 2.6, 4.6), (0.0, 1.0))]


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(("window", "outward"), LEAKS, ids=["right", "top"])
def test_what_leaks_through_a_window_is_no_room_and_no_room_grows_into_it(
    window: shapely.Polygon, outward: tuple[float, float], seed: int
) -> None:
    grid = leak(np.random.default_rng(seed), window, outward)
    update = upload(BASE, grid)
    assert update.discovered == ()
    assert_all_kept(BASE, update, grid, 0.93)
    again = upload(update.map, grid, number=2)
    assert_all_kept(BASE, again, grid, 0.93)
    healed = upload(again.map, HOME, number=3)
    assert (healed.outcome, healed.map.meta) == ("updated", MapMeta.EMPTY)
    assert_all_kept(BASE, healed, HOME)


# -- partial missions ------------------------------------------------------------------------------------------------


def test_half_a_home_that_was_not_seen_is_no_change() -> None:
    updates = list(uploads(BASE, [LEFT_HALF, LEFT_HALF, HOME], noise_m=0.02))
    for update in updates:
        assert (update.outcome, update.conflicts, update.discovered) == ("updated", (), ()), update.reason
        assert min(kept(BASE, update.map).values()) > 0.93
    assert {s.name: s.visited for s in updates[0].rooms} == {"A": True, "B": False, "C": True, "D": False}
    assert [named(u.map, "B").last_visited for u in updates] == ["0", "0", "3"]


@pytest.mark.parametrize("part", [0.3, 0.6, 0.9])
def test_a_room_of_which_a_part_was_seen_keeps_its_whole_shape(part: float) -> None:
    grid = paint(HOME, Cell.UNEXPLORED, rectangle(8.2 - (1 - part) * 4.0, -1, 9, 2.0))
    update = upload(BASE, grid)
    assert (update.outcome, update.conflicts) == ("updated", ()), update.reason
    assert kept(BASE, update.map)["D"] > 0.93
    assert_valid(update.map, grid)


HALF_SEEN = draw(
    """
    ####################
    #...................
    #...................
    #...................
    #........A..........
    #...................
    #...................
    #...................
    #...................
    #...................
    ####################
    """,
    margin=20,
)
"""The left 3.8 m of a room of 1.8 m; the space to the right was not explored."""


def whole_room(width: int) -> OccupancyGrid:
    """The same room seen whole: `width` characters, wall included."""
    rows = ["#" * width, *["#" + "." * (width - 2) + "#"] * 9, "#" * width]
    whole, frame = draw("\n".join(rows)).grid, HALF_SEEN.grid.frame
    cells = np.zeros((frame.height, frame.width), np.uint8)
    cells[80 : 80 + whole.frame.height, 80 : 80 + whole.frame.width] = whole.cells
    return OccupancyGrid(frame, cells)


def half_seen() -> SemanticMap:
    return first_map(HALF_SEEN)


@pytest.mark.parametrize("width", [26, 30, 36])
def test_a_room_that_was_half_seen_grows_beyond_its_frontier_and_that_is_no_error(width: int) -> None:
    base, grid = half_seen(), whole_room(width)
    update = upload(base, grid)
    assert update.taken, update.reason
    (score,) = update.rooms
    assert (score.name, score.passed) == ("A", True)
    assert score.recall > 0.95
    assert conflicts_of(update, "drift") == []
    room = named(update.map, "A")
    assert room.id == base.rooms[0].id
    assert room.polygon.area > 1.2 * base.rooms[0].polygon.area
    assert_valid(update.map, grid)


def test_a_room_that_was_seen_for_a_fifth_only_grows_to_several_times_its_size() -> None:
    """Its precision would be far below a half, if the floor beyond the frontier counted."""
    narrow = paint(HALF_SEEN.grid, Cell.UNEXPLORED, rectangle(1.6, -1, 9, 3))
    base = create_map(narrow, "0", Ids())
    (before,) = base.rooms
    update = upload(base, whole_room(30))
    assert update.taken, update.reason
    after = update.map.room(before.id)
    assert after is not None
    assert covers(after.polygon, before.polygon) > 0.95
    assert all(score.passed for score in update.rooms)


# -- grown beyond a wall ---------------------------------------------------------------------------------------------


def test_a_new_way_between_two_rooms_is_put_to_a_person_or_parted() -> None:
    """A person broke a doorway of 0.8 m through the wall between C and D: the rooms stay apart."""
    grid = paint(HOME, Cell.FREE, rectangle(4.0, 0.8, 4.2, 1.6))
    update = upload(BASE, grid)
    assert_all_kept(BASE, update, grid)
    assert update.outcome == "resolved"
    assert update.conflicts
    assert {s.name for conflict in update.conflicts for s in conflict.rooms} & {"C", "D"}
    assert BASE.dividers == first_map(FOUR_ROOMS).dividers
    assert between(update.map, "A", "B").id == between(BASE, "A", "B").id


def _outcomes(updates: Sequence[MapUpdate]) -> list[str]:
    return [update.outcome for update in updates]


def test_growth_opens_no_drift() -> None:
    base = half_seen()
    updates = list(uploads(base, [whole_room(30)] * 6, noise_m=0.02))
    assert _outcomes(updates) == ["updated"] * 6
    assert [conflict for update in updates for conflict in conflicts_of(update, "drift")] == []
