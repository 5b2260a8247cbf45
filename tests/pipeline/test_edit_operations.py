"""Operations on what rooms are used for, on pins, repairs and restrictions; what refusals offer."""

from dataclasses import replace

import pytest

from stillroom.errors import InvalidEdit
from stillroom.maps.meta import MapMeta, MetaDivider
from stillroom.maps.semantics import Divider, Restriction, SemanticMap
from stillroom.pipeline.edits import (
    AcceptMetaDivider,
    AddDivider,
    AddRestriction,
    Fix,
    MergeRooms,
    MoveDivider,
    MoveRestriction,
    Operation,
    PinRoom,
    RemoveDivider,
    RenameRoom,
    SetRoomKind,
    apply_edits,
)
from tests.pipeline.test_edits import HALL, areas, edit, named, refused, room

SPLIT = AddDivider(((2.0, 0.0), (2.0, 4.0)))
REPAIRED = replace(
    HALL, dividers=(), meta=MapMeta(dividers=(MetaDivider("m1", ((5.0, 0.0), (5.0, 4.0)), ("r1", "r2"), "6"),))
)
"""The hall, its rooms held apart by a repair of the service alone."""


def fixes(error: InvalidEdit) -> tuple[Fix, ...]:
    found: tuple[Fix, ...] = error.extra.get("fixes", ())  # type: ignore[assignment]
    return found


def test_a_room_is_used_as_a_person_says_until_nobody_does() -> None:
    kitchen = edit(SetRoomKind("r1", "kitchen"))
    assert room(kitchen, "r1").kind == "kitchen"
    assert room(edit(SetRoomKind("r1", None), previous=kitchen), "r1").kind is None


def test_both_parts_of_a_split_have_the_settings_of_the_whole() -> None:
    whole = edit(SetRoomKind("r1", "kitchen"), PinRoom("r1"))
    split = edit(SPLIT, previous=whole)
    assert [(r.id, r.kind, r.pinned) for r in split.rooms if r.id != "r2"] == [
        ("r1", "kitchen", True),
        ("r3", "kitchen", True),
    ]


def test_what_is_said_of_a_room_that_the_same_batch_divides_counts_for_all_its_parts() -> None:
    split = edit(SetRoomKind("r1", "kitchen"), PinRoom("r1"), SPLIT, RenameRoom("r1", "Kitchen"))
    assert [(r.id, r.kind, r.pinned, r.name) for r in split.rooms if r.id != "r2"] == [
        ("r1", "kitchen", True, "Kitchen"),
        ("r3", "kitchen", True, "Room 3"),
    ]


def test_a_merger_keeps_the_settings_of_either_room() -> None:
    settled = edit(SetRoomKind("r2", "bedroom"), PinRoom("r2"))
    merged = room(edit(MergeRooms(("r1", "r2")), previous=settled), "r1")
    assert (merged.kind, merged.pinned) == ("bedroom", True)
    both = edit(SetRoomKind("r1", "kitchen"), previous=settled)
    assert room(edit(MergeRooms(("r1", "r2")), previous=both), "r1").kind == "kitchen"


def test_a_part_that_the_batch_itself_makes_is_named_by_a_point_in_it() -> None:
    edited = edit(SPLIT, RenameRoom((1.0, 2.0), "Pantry"), SetRoomKind((1.0, 2.0), "storage"))
    pantry = room(edited, "r3")
    assert (pantry.name, pantry.named_by, pantry.kind) == ("Pantry", "user", "storage")
    assert refused(RenameRoom((90.0, 2.0), "Nowhere")).faults[0].pointer == "/operations/0/at"


def test_an_edit_confirms_the_shapes_that_it_changes_and_no_others() -> None:
    edited = edit(SPLIT)
    assert [(r.id, r.anchor == r.polygon) for r in edited.rooms] == [("r1", True), ("r2", False), ("r3", True)]


# -- repairs -------------------------------------------------------------------------------------------------------


def test_a_repair_that_is_accepted_is_a_divider_of_the_owners() -> None:
    result = apply_edits(REPAIRED, [AcceptMetaDivider("m1")])
    assert result.map.dividers == (Divider("d2", ((5.0, 0.0), (5.0, 4.0)), "open", "user", ("r1", "r2")),)
    assert result.map.meta == MapMeta()
    assert areas(result.map) == areas(HALL)
    assert result.made == {"/operations/0": "d2"}


def test_a_repair_is_accepted_together_with_what_it_ends_on() -> None:
    crossing = MetaDivider("m2", ((0.0, 2.0), (5.0, 2.0)), (), "6")
    both = replace(REPAIRED, meta=MapMeta(dividers=(*REPAIRED.meta.dividers, crossing)))
    accepted = edit(AcceptMetaDivider("m2"), previous=both)
    assert sorted(d.line for d in accepted.dividers) == [((0.0, 2.0), (5.0, 2.0)), ((5.0, 0.0), (5.0, 4.0))]
    assert accepted.meta.dividers == ()


def test_merging_rooms_that_a_repair_held_apart_takes_the_repair_away() -> None:
    merged = edit(MergeRooms(("r1", "r2")), previous=REPAIRED)
    assert areas(merged) == {"r1": 32.0}
    assert merged.meta.dividers == ()


def test_a_repair_never_ends_in_mid_air() -> None:
    resting = replace(HALL, meta=MapMeta(dividers=(MetaDivider("m1", ((0.0, 2.0), (5.0, 2.0)), (), "6"),)))
    assert "m1" in refused(RemoveDivider("d1"), previous=resting).detail


def test_a_repair_that_is_not_there_can_not_be_accepted() -> None:
    assert refused(AcceptMetaDivider("m9")).faults[0].pointer == "/operations/0/id"


# -- restrictions --------------------------------------------------------------------------------------------------

ZONE = ((1.0, 1.0), (2.0, 1.0), (2.0, 2.0), (1.0, 2.0))


def test_a_restriction_that_was_lost_is_placed_again_where_a_person_draws_it() -> None:
    lost = replace(HALL, restrictions=(Restriction("z1", "no_go", ZONE, placed=False),))
    moved = edit(MoveRestriction("z1", tuple((x + 1, y) for x, y in ZONE)), previous=lost)
    assert moved.restrictions == (
        Restriction("z1", "no_go", ((2.0, 1.0), (3.0, 1.0), (3.0, 2.0), (2.0, 2.0)), placed=True),
    )
    assert refused(MoveRestriction("z1", ZONE[:2]), previous=lost).faults[0].pointer == "/operations/0/shape"
    assert refused(MoveRestriction("z9", ZONE)).faults[0].pointer == "/operations/0/id"


def test_a_zone_that_shuts_a_whole_room_out_is_allowed_with_a_warning() -> None:
    wide = ((4.9, -0.1), (8.1, -0.1), (8.1, 4.1), (4.9, 4.1))
    result = apply_edits(HALL, [AddRestriction("no_go", wide)])
    assert [(p.code, p.feature) for p in result.problems] == [("room-forbidden", "z1")]
    again = apply_edits(result.map, [RenameRoom("r1", "Hall")])
    assert again.problems == (), "only what the edit itself causes is told"


# -- fixes ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("drawn", "mended"),
    [
        (AddDivider(((2.0, 0.0), (2.0, 2.5))), AddDivider(((2.0, 0.0), (2.0, 4.0)))),
        (AddDivider(((2.0, 1.2), (2.0, 2.5)), "door"), AddDivider(((2.0, 0.0), (2.0, 4.0)), "door")),
        (AddDivider(((1.0, 2.0), (3.0, 2.0))), AddDivider(((0.0, 2.0), (5.0, 2.0)))),
        (MoveDivider("d1", ((6.0, 1.0), (6.0, 3.0))), MoveDivider("d1", ((6.0, 0.0), (6.0, 4.0)))),
    ],
)
def test_a_divider_in_mid_air_is_offered_to_be_extended_to_the_walls(drawn: Operation, mended: Operation) -> None:
    error = refused(drawn)
    assert fixes(error) == (Fix("/operations/0", "extend to wall", mended),)
    edit(mended)


def test_nothing_is_offered_where_no_wall_lies_ahead() -> None:
    assert fixes(refused(AddDivider(((-3.0, 9.0), (-2.0, 9.5))))) == ()


def test_what_would_lose_its_end_is_offered_to_be_removed_too() -> None:
    crossed = edit(AddDivider(((0.0, 2.0), (5.0, 2.0))))
    error = refused(RemoveDivider("d1"), previous=crossed)
    assert fixes(error) == (Fix("/operations", "remove it too", RemoveDivider("d2")),)
    edit(RemoveDivider("d1"), RemoveDivider("d2"), previous=crossed)


# -- names ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["מטבח", "مطبخ", "👩‍👧 Zimmer", "<script>alert(1)</script>", "می‌روم"])
def test_names_are_text_in_any_script_and_nothing_else(name: str) -> None:
    assert room(edit(RenameRoom("r1", name)), "r1").name == name


@pytest.mark.parametrize("name", ["a\u202eb", "a\u2066b", "\ufeffa", "a\u200bb", "x" * 10_000])
def test_characters_that_turn_the_line_around_or_hide_are_refused(name: str) -> None:
    assert refused(RenameRoom("r1", name)).faults[0].pointer == "/operations/0/name"


def test_only_the_twin_that_the_edit_makes_is_told() -> None:
    twins = named(r1="Bath", r2="Bath")
    assert apply_edits(twins, [SetRoomKind("r1", "bathroom")]).problems == ()
    first: SemanticMap = named(r1="Hall", r2="Bath")
    assert [p.feature for p in apply_edits(first, [RenameRoom("r1", "Bath")]).problems] == ["r1"]
