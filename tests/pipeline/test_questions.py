"""Questions about a map that was taken: is it a door, and what is the new room?"""

from dataclasses import replace

import pytest
import shapely

from stillroom.maps.constraints import violations
from stillroom.maps.grid import Cell, OccupancyGrid
from stillroom.maps.mission import Mission
from stillroom.maps.motion import IDENTITY
from stillroom.maps.semantics import Divider, Ids, SemanticMap
from stillroom.pipeline.creation import create_map
from stillroom.pipeline.decisions import joined, make_doors
from stillroom.pipeline.params import PARAMS
from stillroom.pipeline.questions import ask, is_discovery, is_door
from stillroom.pipeline.update import MapUpdate, update_map
from tests.drawing import paint, rectangle
from tests.golden.homes import FOUR_ROOMS
from tests.golden.uploads import between, first_map, named

HOME = FOUR_ROOMS.grid
BASE = first_map(FOUR_ROOMS)
SHUT = paint(HOME, Cell.OCCUPIED, rectangle(1.15, 2.0, 2.05, 2.2))
"""The way from A to C is closed."""
CLOSED_D = paint(
    paint(HOME, Cell.UNEXPLORED, rectangle(4.25, -1, 9, 2.05)), Cell.OCCUPIED, rectangle(4.2, 2.0, 8.4, 2.2)
)
"""Before anybody opened the door from B to D."""


def asked(previous: SemanticMap, grid: OccupancyGrid, number: int) -> MapUpdate:
    update = update_map(previous, Mission(str(number), grid, IDENTITY))
    return ask(previous, str(number), update)


def way(m: SemanticMap) -> Divider:
    return between(m, "A", "C")


# -- doors -----------------------------------------------------------------------------------------------------------


def test_a_way_that_was_closed_and_is_open_again_is_asked_about_once() -> None:
    shut = asked(BASE, SHUT, 1)
    assert (way(shut.map).shut, shut.conflicts) == ("once", ())
    still = asked(shut.map, SHUT, 2)
    assert (way(still.map).shut, still.conflicts) == ("once", ())
    open_ = asked(still.map, HOME, 3)
    (conflict,) = open_.conflicts
    assert is_door(conflict)
    assert (conflict.kind, conflict.cause, conflict.resolved) == ("connectivity", "door_closed", False)
    assert conflict.dividers == (way(BASE).id,)
    assert {room.name for room in conflict.rooms} == {"A", "C"}
    assert "Is there a door?" in conflict.summary
    assert way(open_.map).shut == "asked"
    (proposal,) = conflict.proposals
    assert way(proposal.map).kind == "door"
    later = asked(asked(open_.map, SHUT, 4).map, HOME, 5)
    assert later.conflicts == ()


def test_a_door_is_not_asked_about() -> None:
    base = make_doors(BASE, [way(BASE).id])
    assert way(base).kind == "door"
    open_ = asked(asked(base, SHUT, 1).map, HOME, 2)
    assert (open_.conflicts, way(open_.map).shut) == ((), "never")


def test_a_way_that_nobody_saw_open_is_not_asked_about() -> None:
    """The room behind it was not seen in the mission in which nothing closed the way."""
    shut = asked(BASE, SHUT, 1)
    unseen = asked(shut.map, paint(HOME, Cell.UNEXPLORED, rectangle(-1, -1, 3.95, 1.9)), 2)
    assert (unseen.conflicts, way(unseen.map).shut) == ((), "once")


def test_what_is_no_divider_any_more_cannot_become_a_door() -> None:
    assert make_doors(BASE, ["d99"]) is BASE


# -- new rooms -------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def found() -> MapUpdate:
    base = create_map(CLOSED_D, "0", Ids())
    letters = {FOUR_ROOMS.room(base, letter).id: letter for letter in "ABC"}
    rooms = tuple(replace(room, name=letters[room.id], named_by="user") for room in base.rooms)
    return asked(replace(base, rooms=rooms), HOME, 1)


def test_a_new_room_is_told_with_what_it_lies_beside_and_needs_no_answer(found: MapUpdate) -> None:
    (new,) = found.discovered
    (conflict,) = found.conflicts
    assert is_discovery(conflict)
    assert conflict.resolved
    assert [room.id for room in conflict.rooms] == [new]
    assert conflict.summary.startswith("A new room was found beside B: ")
    (divider,) = (d for d in found.map.dividers if new in d.rooms)
    assert conflict.dividers == (divider.id,)
    assert [(p.action, p.recommended) for p in conflict.proposals] == [("take_new", True), ("keep_previous", False)]
    assert conflict.proposals[0].map is found.map


def test_it_can_be_part_of_its_neighbour_which_stays_what_it_is_called(found: MapUpdate) -> None:
    (new,) = found.discovered
    whole = found.conflicts[0].proposals[1].map
    before, after = named(found.map, "B"), named(whole, "B")
    assert after.id == before.id
    assert new not in {room.id for room in whole.rooms} | {room for d in whole.dividers for room in d.rooms}
    assert after.polygon.area == pytest.approx(before.polygon.area + found.map.room(new).polygon.area, rel=0.01)  # type: ignore[union-attr]
    assert violations(whole, HOME, PARAMS.wall_reach_m) == ()


def test_the_larger_of_both_may_be_the_new_one(found: MapUpdate) -> None:
    (new,) = found.discovered
    b = named(found.map, "B").id
    decided = joined(found.map, b, new)
    assert decided.retired == {b: new}
    assert {room.id for room in decided.map.rooms} == {room.id for room in found.map.rooms} - {b}


def test_where_it_was_made_part_of_another_it_is_not_found_again(found: MapUpdate) -> None:
    whole = found.conflicts[0].proposals[1].map
    again = asked(whole, HOME, 2)
    assert (again.outcome, again.discovered, again.conflicts) == ("updated", (), ())
    assert shapely.symmetric_difference(named(again.map, "B").polygon, named(whole, "B").polygon).area < 0.3


def test_nothing_is_asked_about_a_map_that_was_not_taken(found: MapUpdate) -> None:
    kept = replace(found, taken=False, conflicts=())
    assert ask(BASE, "1", kept) is kept
