"""One edit taken back, on the map as it is now."""

import pytest

from stillroom.errors import InvalidEdit
from stillroom.maps.geometry import Pose, as_points
from stillroom.maps.motion import IDENTITY, Motion
from stillroom.maps.semantics import SemanticMap
from stillroom.pipeline.edits import (
    AddDivider,
    AddRestriction,
    MergeRooms,
    MoveDivider,
    MoveRestriction,
    Operation,
    PinRoom,
    RemoveDivider,
    RemoveRestriction,
    RenameRoom,
    SetDividerKind,
    SetRoomKind,
)
from stillroom.pipeline.edits.rebase import touched
from stillroom.pipeline.edits.undo import undo
from stillroom.pipeline.transfer import track
from tests.pipeline.test_edits import HALL, areas, edit, named, room

ZONE = ((1.0, 1.0), (2.0, 1.0), (2.0, 2.0), (1.0, 2.0))
OPERATIONS: list[Operation] = [
    AddDivider(((2.0, 0.0), (2.0, 4.0))),
    MoveDivider("d1", ((4.0, 0.0), (4.0, 4.0))),
    RemoveDivider("d1"),
    MergeRooms(("r1", "r2")),
    SetDividerKind("d1", "door"),
    RenameRoom("r1", "Kitchen"),
    SetRoomKind("r1", "kitchen"),
    PinRoom("r1"),
    AddRestriction("no_go", ZONE),
    MoveRestriction("z1", tuple((x + 1, y) for x, y in ZONE)),
    RemoveRestriction("z1"),
]


def same(first: SemanticMap, second: SemanticMap) -> None:
    """Equal but for what no id names: anchors, counters of ids."""
    assert areas(first) == areas(second)
    assert {(r.id, r.name, r.named_by, r.kind, r.pinned, r.segment_id) for r in first.rooms} == {
        (r.id, r.name, r.named_by, r.kind, r.pinned, r.segment_id) for r in second.rooms
    }
    assert {(d.id, d.line, d.kind) for d in first.dividers} == {(d.id, d.line, d.kind) for d in second.dividers}
    assert set(first.restrictions) == set(second.restrictions)


@pytest.mark.parametrize("operation", OPERATIONS, ids=lambda o: type(o).__name__)
def test_undoing_what_was_done_is_as_if_it_never_was_and_redoing_as_if_it_was(operation: Operation) -> None:
    before = edit(AddRestriction("no_mop", ZONE), previous=named(r1="Hall", r2="Bath"))
    done = edit(operation, previous=before)
    undone = undo(before, done, done, IDENTITY, frozenset()).map
    same(undone, before)
    same(undo(done, undone, undone, IDENTITY, frozenset()).map, done)


def test_what_was_done_since_stays() -> None:
    done = edit(AddDivider(((2.0, 0.0), (2.0, 4.0))))
    later = edit(RenameRoom("r2", "Bath"), AddDivider(((6.5, 0.0), (6.5, 4.0))), previous=done)
    undone = undo(HALL, done, later, IDENTITY, touched(done, later)).map
    assert areas(undone) == {"r1": 20.0, "r2": 6.0, "r4": 6.0}
    assert room(undone, "r2").name == "Bath"


def test_a_room_that_ended_comes_back_with_its_id_and_settings_after_others_changed_the_map() -> None:
    before = edit(SetRoomKind("r2", "bathroom"), previous=named(r1="Hall", r2="Bath"))
    done = edit(MergeRooms(("r1", "r2")), previous=before)
    later = edit(AddRestriction("no_go", ZONE), previous=done)
    undone = undo(before, done, later, IDENTITY, touched(done, later)).map
    assert areas(undone) == areas(before)
    assert (room(undone, "r2").name, room(undone, "r2").kind) == ("Bath", "bathroom")
    assert [d.id for d in undone.dividers] == ["d1"]
    assert len(undone.restrictions) == 1


def test_a_mission_in_between_moves_what_comes_back() -> None:
    done = edit(RemoveDivider("d1"))
    motion = Motion.rigid(Pose(1.0, 2.0, 0.0))
    later = track(done, motion, done.frame)
    undone = undo(HALL, done, later, motion, frozenset()).map
    (divider,) = undone.dividers
    assert as_points(divider.line) == pytest.approx(as_points([(6.0, 2.0), (6.0, 6.0)]), abs=0.002)
    assert areas(undone) == pytest.approx(areas(HALL), abs=0.01)


def test_what_somebody_changed_again_is_not_taken_back_behind_their_back() -> None:
    done = edit(RenameRoom("r1", "Kitchen"))
    later = edit(RenameRoom("r1", "Bath"), previous=done)
    with pytest.raises(InvalidEdit, match="changed again"):
        undo(HALL, done, later, IDENTITY, touched(done, later))
