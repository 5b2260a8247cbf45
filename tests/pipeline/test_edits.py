"""What people may do to a map: each operation, all or none, and whose ids and names stay."""

from dataclasses import replace

import numpy as np
import pytest
import shapely
from shapely import LineString

from stillroom.errors import InvalidEdit
from stillroom.maps.grid import GridFrame
from stillroom.maps.semantics import Divider, Ids, Room, SemanticMap, Wall
from stillroom.pipeline.edits import (
    LONGEST_NAME,
    MOST_OPERATIONS,
    AddDivider,
    EditResult,
    MergeRooms,
    MoveDivider,
    Operation,
    RemoveDivider,
    RenameRoom,
    SetDividerKind,
    apply_edits,
)
from tests.drawing import rectangle

HALL = SemanticMap(
    GridFrame(0.05, 160, 80),
    rooms=(
        Room("r1", "Room 1", 1, rectangle(0, 0, 5, 4), last_visited="7"),
        Room("r2", "Room 2", 2, rectangle(5, 0, 8, 4), last_visited="6"),
    ),
    dividers=(Divider("d1", ((5.0, 0.0), (5.0, 4.0)), rooms=("r1", "r2")),),
    walls=(Wall("w1", ((0.0, 0.0), (8.0, 0.0), (8.0, 4.0), (0.0, 4.0), (0.0, 0.0))),),
    ids=Ids("", (("d", 1), ("r", 2), ("v", 1))),
)
"""A hall of 8 x 4 m: r1 has the left 5 m, r2 the right 3 m."""


def named(**names: str) -> SemanticMap:
    rooms = (replace(r, name=names[r.id], named_by="user") if r.id in names else r for r in HALL.rooms)
    return replace(HALL, rooms=tuple(rooms))


def edit(*operations: Operation, previous: SemanticMap = HALL) -> SemanticMap:
    return apply_edits(previous, operations).map


def refused(*operations: Operation, previous: SemanticMap = HALL) -> InvalidEdit:
    with pytest.raises(InvalidEdit) as caught:
        apply_edits(previous, operations)
    return caught.value


def areas(semantic_map: SemanticMap) -> dict[str, float]:
    return {room.id: round(room.polygon.area, 2) for room in semantic_map.rooms}


def room(semantic_map: SemanticMap, room_id: str) -> Room:
    found = semantic_map.room(room_id)
    assert found is not None
    return found


def divider(semantic_map: SemanticMap, divider_id: str) -> Divider:
    found = semantic_map.divider(divider_id)
    assert found is not None
    return found


# -- dividers ------------------------------------------------------------------------------------------------------


def test_a_drawn_divider_splits_a_room_and_the_larger_part_keeps_the_id() -> None:
    edited = edit(AddDivider(((2.0, 0.0), (2.0, 4.0))))
    assert areas(edited) == {"r1": 12.0, "r2": 12.0, "r3": 8.0}
    part = room(edited, "r3")
    assert (part.derived_from, part.made_by, part.segment_id, part.last_visited) == ("r1", "user", 3, "7")
    assert divider(edited, "d2") == Divider("d2", ((2.0, 0.0), (2.0, 4.0)), "open", "user", divider(edited, "d2").rooms)
    assert set(divider(edited, "d2").rooms) == {"r1", "r3"}


def test_the_larger_part_keeps_the_id_whichever_side_it_is_on() -> None:
    edited = edit(AddDivider(((4.0, 0.0), (4.0, 4.0))))
    assert areas(edited) == {"r1": 16.0, "r2": 12.0, "r3": 4.0}
    assert set(divider(edited, "d1").rooms) == {"r3", "r2"}


def test_both_parts_of_a_split_room_share_the_dividers_edge() -> None:
    edited = edit(AddDivider(((2.0, 0.3), (2.5, 3.8))))
    line = LineString(divider(edited, "d2").line)
    common = shapely.intersection(room(edited, "r1").polygon, room(edited, "r3").polygon)
    assert common.length == pytest.approx(line.length, abs=0.002)


def test_a_drawn_divider_may_be_a_door() -> None:
    assert divider(edit(AddDivider(((2.0, 0.0), (2.0, 4.0)), "door")), "d2").kind == "door"


def test_ends_are_drawn_to_the_walls_within_reach() -> None:
    assert divider(edit(AddDivider(((2.0, 0.45), (2.0, 4.4)))), "d2").line == ((2.0, 0.0), (2.0, 4.0))


@pytest.mark.parametrize(
    ("line", "pointer", "words"),
    [
        (((2.0, 0.0), (2.0, 3.0)), "/operations/0/line/1", "1.00 m"),
        (((2.0, 0.8), (2.0, 4.0)), "/operations/0/line/0", "0.80 m"),
    ],
)
def test_an_end_out_of_reach_is_refused_by_name_with_its_distance(
    line: tuple[tuple[float, float], tuple[float, float]], pointer: str, words: str
) -> None:
    error = refused(AddDivider(line))
    assert [fault.pointer for fault in error.faults] == [pointer]
    assert words in error.faults[0].detail


@pytest.mark.parametrize(
    "line", [((1.0, 1.0), (1.0, 1.0)), ((np.nan, 0.0), (1.0, 4.0)), ((1.0, 0.0), (np.inf, 4.0)), ((1.0, 0.0),)]
)
def test_a_divider_is_two_different_points_of_real_numbers(line: tuple[tuple[float, float], ...]) -> None:
    error = refused(AddDivider(line))  # type: ignore[arg-type]
    assert error.faults[0].pointer == "/operations/0/line"


def test_a_divider_may_end_on_one_drawn_in_the_same_batch_whatever_their_order() -> None:
    long, short = AddDivider(((2.5, 0.0), (2.5, 4.0))), AddDivider(((0.0, 2.0), (2.4, 2.0)))
    for batch in ((long, short), (short, long)):
        edited = edit(*batch)
        assert sorted(areas(edited).values()) == [5.0, 5.0, 10.0, 12.0]


def test_a_divider_that_separates_nothing_is_kept_with_a_warning() -> None:
    pillar = shapely.difference(rectangle(0, 0, 5, 4), rectangle(2, 1.5, 3, 2.5))
    previous = replace(HALL, rooms=(replace(HALL.rooms[0], polygon=pillar), HALL.rooms[1]))
    result = apply_edits(previous, [AddDivider(((2.5, 2.5), (2.5, 4.0)))])
    assert divider(result.map, "d2").rooms == ("r1",)
    assert [(p.code, p.severity, p.feature) for p in result.problems] == [("separates-nothing", "warning", "d2")]
    assert set(areas(result.map)) == {"r1", "r2"}


def test_a_moved_divider_keeps_its_id_and_both_rooms_keep_theirs() -> None:
    edited = edit(MoveDivider("d1", ((4.5, 0.1), (4.5, 3.9))))
    assert areas(edited) == {"r1": 18.0, "r2": 14.0}
    assert divider(edited, "d1").line == ((4.5, 0.0), (4.5, 4.0))
    assert divider(edited, "d1").made_by == "user"


def test_the_kind_of_a_divider_changes_nothing_else() -> None:
    edited = edit(SetDividerKind("d1", "door"))
    assert (divider(edited, "d1").kind, divider(edited, "d1").line) == ("door", HALL.dividers[0].line)
    assert areas(edited) == areas(HALL)


def test_where_a_divider_is_removed_the_larger_room_keeps_its_id() -> None:
    result = apply_edits(HALL, [RemoveDivider("d1")])
    assert areas(result.map) == {"r1": 32.0}
    assert result.map.dividers == ()
    assert result.retired == {"r2": "r1"}


@pytest.mark.parametrize(
    "operation", [MoveDivider("d9", ((4.0, 0.0), (4.0, 4.0))), RemoveDivider("d9"), SetDividerKind("d9", "door")]
)
def test_a_divider_that_is_not_there_is_refused(operation: Operation) -> None:
    error = refused(RenameRoom("r1", "Hall"), operation)
    assert [fault.pointer for fault in error.faults] == ["/operations/1/id"]
    assert "d9" in error.faults[0].detail


def test_a_divider_that_is_removed_twice_is_refused() -> None:
    assert refused(RemoveDivider("d1"), RemoveDivider("d1")).faults[0].pointer == "/operations/1/id"


def test_dividers_that_were_not_touched_keep_their_ids_and_lines() -> None:
    slightly_off = replace(HALL, dividers=(replace(HALL.dividers[0], line=((5.0, 0.004), (5.0, 3.997))),))
    edited = edit(AddDivider(((2.0, 0.0), (2.0, 4.0))), previous=slightly_off)
    assert divider(edited, "d1").line == ((5.0, 0.004), (5.0, 3.997))


def test_a_divider_that_would_end_in_mid_air_keeps_what_it_ends_on_from_being_removed() -> None:
    crossed = edit(AddDivider(((0.0, 2.0), (5.0, 2.0))))
    error = refused(RemoveDivider("d1"), previous=crossed)
    assert "d2" in error.detail
    assert areas(edit(RemoveDivider("d1"), RemoveDivider("d2"), previous=crossed)) == {"r2": 32.0}


def test_a_divider_that_would_end_in_mid_air_keeps_what_it_ends_on_from_being_moved() -> None:
    crossed = edit(AddDivider(((0.0, 2.0), (5.0, 2.0))))
    assert "d2" in refused(MoveDivider("d1", ((5.5, 0.0), (5.5, 4.0))), previous=crossed).detail
    followed = edit(
        MoveDivider("d1", ((5.5, 0.0), (5.5, 4.0))), MoveDivider("d2", ((0.0, 2.0), (5.3, 2.0))), previous=crossed
    )
    assert divider(followed, "d2").line[1] == (5.5, 2.0)


# -- merging -------------------------------------------------------------------------------------------------------


def test_merged_rooms_are_one_and_the_larger_keeps_its_id_and_numbers() -> None:
    result = apply_edits(HALL, [MergeRooms(("r2", "r1"))])
    assert areas(result.map) == {"r1": 32.0}
    assert room(result.map, "r1").segment_id == 1
    assert result.map.dividers == ()
    assert result.retired == {"r2": "r1"}


def test_a_name_given_by_a_person_beats_one_made_by_the_algorithm() -> None:
    for operation in (MergeRooms(("r1", "r2")), RemoveDivider("d1")):
        merged = room(edit(operation, previous=named(r2="Kitchen")), "r1")
        assert (merged.name, merged.named_by) == ("Kitchen", "user")


def test_of_two_names_given_by_persons_the_larger_rooms_stays() -> None:
    merged = room(edit(MergeRooms(("r1", "r2")), previous=named(r1="Hall", r2="Kitchen")), "r1")
    assert merged.name == "Hall"


def test_rooms_that_do_not_touch_can_not_be_merged() -> None:
    three = edit(AddDivider(((2.0, 0.0), (2.0, 4.0))))
    error = refused(MergeRooms(("r3", "r2")), previous=three)
    assert [fault.pointer for fault in error.faults] == ["/operations/0/ids"]


def test_rooms_that_touch_in_a_corner_alone_can_not_be_merged() -> None:
    four = edit(AddDivider(((0.0, 2.0), (5.0, 2.0))), AddDivider(((5.0, 2.0), (8.0, 2.0))))
    upper_left = next(r.id for r in four.rooms if r.polygon.contains(shapely.Point(1, 3)))
    lower_right = next(r.id for r in four.rooms if r.polygon.contains(shapely.Point(7, 1)))
    assert refused(MergeRooms((upper_left, lower_right)), previous=four).faults[0].pointer == "/operations/0/ids"


@pytest.mark.parametrize("ids", [(), ("r1",), ("r1", "r1")])
def test_merging_takes_two_different_rooms(ids: tuple[str, ...]) -> None:
    assert refused(MergeRooms(ids)).faults[0].pointer == "/operations/0/ids"


def test_merging_with_a_room_that_is_not_there_is_refused() -> None:
    assert refused(MergeRooms(("r1", "r9"))).faults[0].pointer == "/operations/0/ids/1"


def test_merging_leaves_what_divides_them_from_others() -> None:
    three = edit(AddDivider(((0.0, 2.0), (5.0, 2.0))))
    halves = [r.id for r in three.rooms if r.id != "r2"]
    merged = edit(MergeRooms(tuple(halves)), previous=three)
    assert divider(merged, "d1").line == HALL.dividers[0].line
    assert merged.divider("d2") is None
    assert areas(merged) == {"r1": 20.0, "r2": 12.0}


def test_merging_over_a_part_of_a_divider_keeps_its_other_part() -> None:
    three = edit(AddDivider(((0.0, 2.0), (5.0, 2.0))))
    upper = next(r.id for r in three.rooms if r.polygon.contains(shapely.Point(1, 3)))
    merged = edit(MergeRooms((upper, "r2")), previous=three)
    assert sorted(areas(merged).values()) == [10.0, 22.0]
    assert sorted(divider(merged, "d1").line) == [(5.0, 0.0), (5.0, 2.0)]
    assert sorted(divider(merged, "d2").line) == [(0.0, 2.0), (5.0, 2.0)]


def test_three_rooms_in_a_row_can_be_merged_at_once() -> None:
    three = edit(AddDivider(((2.0, 0.0), (2.0, 4.0))))
    result = apply_edits(three, [MergeRooms(("r1", "r2", "r3"))])
    assert [r.polygon.area for r in result.map.rooms] == [pytest.approx(32.0)]
    assert set(result.retired.values()) == {result.map.rooms[0].id}
    assert len(result.retired) == 2


# -- names ---------------------------------------------------------------------------------------------------------


def test_a_room_gets_the_name_a_person_gives() -> None:
    renamed = room(edit(RenameRoom("r1", "  Küche & Bad 🛁 ")), "r1")
    assert (renamed.name, renamed.named_by) == ("Küche & Bad 🛁", "user")


def test_names_are_kept_in_composed_form() -> None:
    assert room(edit(RenameRoom("r1", "Ku\u0308che")), "r1").name == "K\u00fcche"


def test_the_longest_name_is_taken_and_a_longer_one_refused() -> None:
    assert room(edit(RenameRoom("r1", "x" * LONGEST_NAME)), "r1").name == "x" * LONGEST_NAME
    assert refused(RenameRoom("r1", "x" * (LONGEST_NAME + 1))).faults[0].pointer == "/operations/0/name"


@pytest.mark.parametrize("name", ["", "   ", "a\nb", "a\x00b", "a\x7fb", "a\x85b", "a\u2028b", "\ud800"])
def test_empty_names_and_control_characters_are_refused(name: str) -> None:
    assert [fault.pointer for fault in refused(RenameRoom("r1", name)).faults] == ["/operations/0/name"]


def test_a_room_that_is_not_there_can_not_be_named() -> None:
    assert refused(RenameRoom("r9", "Hall")).faults[0].pointer == "/operations/0/id"


def test_the_last_of_several_names_counts() -> None:
    assert room(edit(RenameRoom("r1", "A"), RenameRoom("r1", "B")), "r1").name == "B"


def test_the_smaller_part_of_a_named_room_is_numbered() -> None:
    split = edit(AddDivider(((2.0, 0.0), (2.0, 4.0))), previous=named(r1="Kitchen", r2="Kitchen 2"))
    assert (room(split, "r1").name, room(split, "r3").name) == ("Kitchen", "Kitchen 3")


def test_naming_a_room_that_the_same_batch_merges_names_the_survivor() -> None:
    assert room(edit(MergeRooms(("r1", "r2")), RenameRoom("r2", "Studio")), "r1").name == "Studio"


def test_a_second_room_of_the_same_name_is_allowed_with_a_warning() -> None:
    result = apply_edits(named(r1="Bath"), [RenameRoom("r2", "Bath")])
    assert [(p.code, p.feature) for p in result.problems] == [("same-name", "r2")]


# -- the batch -----------------------------------------------------------------------------------------------------


def test_a_batch_is_applied_wholly_or_not_at_all_and_the_previous_map_stays() -> None:
    before = replace(HALL)
    refused(RenameRoom("r1", "Hall"), AddDivider(((2.0, 0.0), (2.0, 4.0))), RemoveDivider("d9"))
    edit(RenameRoom("r1", "Hall"), AddDivider(((2.0, 0.0), (2.0, 4.0))))
    assert before == HALL


def test_every_end_that_finds_nothing_is_named() -> None:
    error = refused(AddDivider(((1.0, 0.0), (1.0, 2.0))), AddDivider(((3.0, 2.0), (3.0, 4.0))))
    assert [fault.pointer for fault in error.faults] == ["/operations/0/line/1", "/operations/1/line/0"]


@pytest.mark.parametrize("count", [0, MOST_OPERATIONS + 1])
def test_a_batch_is_neither_empty_nor_endless(count: int) -> None:
    assert refused(*[RenameRoom("r1", "Hall")] * count).faults[0].pointer == "/operations"


def test_a_batch_is_judged_as_a_whole() -> None:
    swapped = edit(RemoveDivider("d1"), AddDivider(((5.0, 0.0), (5.0, 4.0)), "door"))
    assert areas(swapped) == areas(HALL)
    assert [(d.id, d.kind) for d in swapped.dividers] == [("d2", "door")]


def test_ids_are_never_used_again() -> None:
    once = edit(AddDivider(((2.0, 0.0), (2.0, 4.0))))
    without = edit(RemoveDivider("d2"), previous=once)
    again = edit(AddDivider(((2.0, 0.0), (2.0, 4.0))), previous=without)
    assert [d.id for d in again.dividers] == ["d1", "d3"]
    assert set(areas(again)) == {"r1", "r2", "r4"}


def test_rooms_that_an_edit_does_not_reach_keep_their_very_vertices() -> None:
    askew = replace(HALL, rooms=(HALL.rooms[0], replace(HALL.rooms[1], polygon=_from_another_corner(HALL.rooms[1]))))
    edited = edit(AddDivider(((2.0, 0.0), (2.0, 4.0))), previous=askew)
    assert room(edited, "r2").polygon.equals_exact(askew.rooms[1].polygon)


def _from_another_corner(which: Room) -> shapely.Polygon:
    corners = shapely.get_coordinates(which.polygon.exterior)[:-1]
    return shapely.Polygon(np.roll(corners, 2, axis=0))


def test_what_an_edit_does_not_concern_stays_as_it_was() -> None:
    edited = edit(RenameRoom("r2", "Kitchen"), AddDivider(((2.0, 0.0), (2.0, 4.0))))
    assert (edited.walls, edited.clutter, edited.restrictions, edited.meta, edited.frame) == (
        HALL.walls, HALL.clutter, HALL.restrictions, HALL.meta, HALL.frame,
    )  # fmt: skip


def test_a_part_of_less_than_a_square_metre_is_made_with_a_warning() -> None:
    result: EditResult = apply_edits(HALL, [AddDivider(((0.2, 0.0), (0.2, 4.0)))])
    assert [(p.code, p.feature) for p in result.problems] == [("small-room", "r3")]
