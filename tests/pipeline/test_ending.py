"""Rooms that end by themselves: what was a room once, is less than one now and can't be found."""

from dataclasses import replace

import pytest

from stillroom.maps.mission import Mission
from stillroom.maps.motion import IDENTITY
from stillroom.maps.semantics import Divider, Ids, Room, SemanticMap
from stillroom.pipeline.creation import create_map
from stillroom.pipeline.ending import withered, without
from stillroom.pipeline.params import PARAMS
from stillroom.pipeline.review import hold_back
from stillroom.pipeline.update import MapUpdate, update_map
from tests.drawing import rectangle
from tests.golden.homes import OPEN_PLAN

HALL = create_map(OPEN_PLAN.grid, "0", Ids()).rooms[0]
REST = Room("r9", "Room 9", 9, rectangle(2.6, 1.4, 3.4, 2.2), anchor=rectangle(2.6, 1.0, 4.6, 2.2))
"""0.64 m² in the middle of the hall are left of 2.4."""


def home(rest: Room = REST, *dividers: Divider) -> SemanticMap:
    made = create_map(OPEN_PLAN.grid, "0", Ids())
    hall = replace(HALL, polygon=HALL.polygon.difference(rest.polygon), name="Hall", named_by="user")
    return replace(made, rooms=(hall, rest), dividers=dividers)


def carried(m: SemanticMap) -> MapUpdate:
    """By the transfer alone: nothing holds the rest in the middle of the floor."""
    return update_map(m, Mission("1", OPEN_PLAN.grid, IDENTITY), resolvers=())


def test_a_room_of_which_hardly_anything_is_left_ends_where_it_is_not_found() -> None:
    update = carried(home())
    assert (update.outcome, update.taken) == ("updated", True), update.reason
    assert [room.id for room in update.map.rooms] == [HALL.id]
    assert update.retired == {"r9": HALL.id}
    assert (
        update.warnings[0] == "Room 9 had become less than a room and was not found again. Its floor belongs to Hall."
    )


@pytest.mark.parametrize(
    "rest",
    [
        replace(REST, named_by="user"),
        replace(REST, made_by="user"),
        replace(REST, pinned=True),
        replace(REST, kind="bathroom"),
        replace(REST, anchor=REST.polygon),
        replace(REST, anchor=None),
        replace(REST, polygon=rectangle(2.6, 1.2, 3.8, 2.2)),
    ],
    ids=["named", "drawn", "pinned", "used", "confirmed", "without a shape to compare", "large enough"],
)
def test_any_other_lost_room_is_put_to_a_person(rest: Room) -> None:
    m = home(rest)
    assert withered(m, {"r9"}, PARAMS) == frozenset()
    update = carried(m)
    assert (update.outcome, update.map, update.retired) == ("needs_review", m, {})


def test_a_room_beside_a_divider_that_a_person_drew_is_put_to_a_person() -> None:
    drawn = Divider("d1", ((2.6, 1.4), (3.4, 1.4)), made_by="user", rooms=(HALL.id, "r9"))
    assert withered(home(REST, drawn), {"r9"}, PARAMS) == frozenset()
    assert withered(home(REST, replace(drawn, made_by="algorithm")), {"r9"}, PARAMS) == {"r9"}


def test_a_room_that_was_carried_over_does_not_end_however_small() -> None:
    assert withered(home(), {HALL.id}, PARAMS) == frozenset()


def test_a_map_keeps_its_last_room() -> None:
    m = replace(home(), rooms=(REST,))
    update = carried(m)
    assert (update.taken, update.map, update.retired) == (False, m, {})


def test_two_rooms_that_end_at_once_are_told_of_once_each() -> None:
    other = replace(REST, id="r8", name="Room 8", segment_id=8, polygon=rectangle(1.0, 1.4, 1.8, 2.2))
    m = home()
    hall = replace(m.rooms[0], polygon=m.rooms[0].polygon.difference(other.polygon))
    update = carried(replace(m, rooms=(hall, REST, other)))
    assert update.retired == {"r9": HALL.id, "r8": HALL.id}
    assert len([line for line in update.warnings if "less than a room" in line]) == 2


def test_the_dividers_of_a_room_that_ends_go_with_it() -> None:
    between = Divider("d1", ((2.6, 1.4), (3.4, 1.4)), rooms=(HALL.id, "r9"))
    other = Divider("d2", ((1.0, 0.2), (1.0, 3.2)), rooms=(HALL.id,))
    assert without(home(REST, between, other), {"r9"}).dividers == (other,)


@pytest.mark.parametrize(("ask_first", "pinned"), [(True, False), (False, True)])
def test_a_room_does_not_end_unasked_where_the_owner_wants_to_be_asked(ask_first: bool, pinned: bool) -> None:
    m = home()
    held = hold_back(m, "1", carried(m), ask_first, pinned)
    assert (held.outcome, held.map, held.retired) == ("needs_review", m, {})
