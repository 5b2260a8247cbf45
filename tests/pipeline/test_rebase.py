"""Three-way merge by feature: what one person asked of an older map, done to the map as others have changed it."""

from dataclasses import replace

import pytest

from stillroom.maps.geometry import Pose, as_points
from stillroom.maps.motion import IDENTITY, Motion
from stillroom.maps.semantics import SemanticMap
from stillroom.pipeline.edits import (
    AddDivider,
    AddRestriction,
    MarkPhantom,
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
from stillroom.pipeline.edits.rebase import Rebased, rebase, touched
from stillroom.pipeline.transfer import track
from tests.pipeline.test_edits import HALL, areas, edit, room

LEFT = AddDivider(((2.0, 0.0), (2.0, 4.0)))
RIGHT = AddDivider(((6.5, 0.0), (6.5, 4.0)))
ZONE = ((1.0, 1.0), (2.0, 1.0), (2.0, 2.0), (1.0, 2.0))


def merged(mine: list[Operation], theirs: list[Operation], base: SemanticMap = HALL) -> Rebased:
    current = edit(*theirs, previous=base)
    return rebase(base, current, mine, IDENTITY, touched(base, current))


def result(found: Rebased) -> SemanticMap:
    assert found.clashes == ()
    assert found.result is not None
    return found.result.map


def clash(found: Rebased) -> tuple[str, str | None]:
    assert found.result is None
    (one,) = found.clashes
    return one.pointer, one.feature


def test_changes_of_different_rooms_come_together() -> None:
    both = result(merged([LEFT, RenameRoom("r1", "Kitchen")], [RIGHT, RenameRoom("r2", "Bath")]))
    assert sorted(areas(both).values()) == [6.0, 6.0, 8.0, 12.0]
    assert (room(both, "r1").name, room(both, "r2").name) == ("Kitchen", "Bath")


def test_different_properties_of_one_room_come_together() -> None:
    both = result(merged([SetRoomKind("r1", "kitchen"), PinRoom("r1")], [RenameRoom("r1", "Kitchen")]))
    assert (room(both, "r1").kind, room(both, "r1").name, room(both, "r1").pinned) == ("kitchen", "Kitchen", True)


@pytest.mark.parametrize(
    ("mine", "theirs", "feature"),
    [
        (RenameRoom("r1", "Kitchen"), RenameRoom("r1", "Bath"), "r1"),
        (SetRoomKind("r1", "kitchen"), SetRoomKind("r1", "bathroom"), "r1"),
        (RenameRoom("r2", "Bath"), MergeRooms(("r1", "r2")), "r2"),
        (MoveDivider("d1", ((4.0, 0.0), (4.0, 4.0))), MoveDivider("d1", ((6.0, 0.0), (6.0, 4.0))), "d1"),
        (MoveDivider("d1", ((4.0, 0.0), (4.0, 4.0))), RemoveDivider("d1"), "d1"),
        (SetDividerKind("d1", "door"), RemoveDivider("d1"), "d1"),
        (RemoveDivider("d1"), MoveDivider("d1", ((6.0, 0.0), (6.0, 4.0))), "d1"),
        (LEFT, AddDivider(((0.0, 2.0), (5.0, 2.0))), "r1"),
        (MergeRooms(("r1", "r2")), LEFT, "r1"),
    ],
)
def test_what_both_changed_differently_is_for_a_person_to_say(mine: Operation, theirs: Operation, feature: str) -> None:
    assert clash(merged([mine], [theirs])) == ("/operations/0", feature)


@pytest.mark.parametrize(
    "both",
    [
        RenameRoom("r1", "Kitchen"),
        SetRoomKind("r1", "kitchen"),
        PinRoom("r1"),
        MergeRooms(("r1", "r2")),
        RemoveDivider("d1"),
        SetDividerKind("d1", "door"),
        MoveDivider("d1", ((4.0, 0.0), (4.0, 4.0))),
    ],
)
def test_what_both_wanted_alike_is_done_once(both: Operation) -> None:
    found = merged([both], [both])
    assert found.operations == ()
    assert result(found) == edit(both)


def test_what_can_not_be_applied_any_more_is_said_of_the_operation_that_asked_for_it() -> None:
    base = edit(AddDivider(((5.0, 2.0), (8.0, 2.0))))
    current = edit(RemoveDivider("d2"), previous=base)
    hanging = AddDivider(((6.0, 0.0), (6.0, 2.0)))
    theirs = {touch for touch in touched(base, current) if touch[0].startswith("d")}
    found = rebase(base, current, [RenameRoom("r1", "Hall"), hanging], IDENTITY, theirs)
    assert [c.pointer for c in found.clashes] == ["/operations/1/line/1"]


def test_a_missions_wobble_is_no_change_of_a_persons() -> None:
    moved = Motion.rigid(Pose(1.0, 2.0, 0.0))
    current = track(HALL, moved, HALL.frame)
    line = ((4.0, 0.0), (4.0, 4.0))
    found = rebase(HALL, current, [MoveDivider("d1", line)], moved, frozenset())
    assert found.operations == (MoveDivider("d1", ((5.0, 2.0), (5.0, 6.0))),)


def test_what_was_drawn_on_the_old_map_lands_where_it_was_meant_on_the_new_one() -> None:
    turned = Motion.rigid(Pose(10.0, 0.0, 1.5707963267948966))
    current = track(HALL, turned, replace(HALL.frame, width=400, height=400))
    mine: list[Operation] = [LEFT, AddRestriction("no_go", ZONE), MarkPhantom(ZONE), RenameRoom((1.0, 1.0), "Pantry")]
    found = rebase(HALL, current, mine, turned, frozenset())
    line, zone, phantom, name = found.operations
    assert isinstance(line, AddDivider)
    assert isinstance(zone, AddRestriction)
    assert isinstance(phantom, MarkPhantom)
    assert isinstance(name, RenameRoom)
    assert as_points(line.line) == pytest.approx(turned.apply(as_points(LEFT.line)), abs=1e-3)
    assert as_points(zone.shape) == pytest.approx(turned.apply(as_points(ZONE)), abs=1e-3)
    assert zone.shape == phantom.shape
    assert as_points([name.room]) == pytest.approx(turned.apply(as_points([(1.0, 1.0)])), abs=1e-3)


def test_zones_that_are_gone_need_not_be_removed_but_can_not_be_moved() -> None:
    base = edit(AddRestriction("no_go", ZONE))
    assert merged([RemoveRestriction("z1")], [RemoveRestriction("z1")], base).operations == ()
    shifted = tuple((x + 1, y) for x, y in ZONE)
    assert clash(merged([MoveRestriction("z1", shifted)], [RemoveRestriction("z1")], base))[1] == "z1"
    farther = tuple((x + 2, y) for x, y in ZONE)
    assert clash(merged([MoveRestriction("z1", shifted)], [MoveRestriction("z1", farther)], base))[1] == "z1"


def test_on_another_grid_every_shape_counts_as_changed() -> None:
    assert touched(HALL, HALL) == frozenset()
    assert touched(HALL, HALL, same_grid=False) == {("d1", "line"), ("r1", "shape"), ("r2", "shape")}
