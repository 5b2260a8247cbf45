"""What changed between two versions, in words and numbers."""

from dataclasses import replace

import pytest
import shapely

from stillroom.maps.geometry import Pose
from stillroom.maps.meta import MapMeta, MetaDivider
from stillroom.maps.motion import IDENTITY, Motion
from stillroom.maps.semantics import SemanticMap
from stillroom.pipeline.comparison import Change, compare
from stillroom.pipeline.edits import (
    AddDivider,
    AddRestriction,
    MarkPhantom,
    MergeRooms,
    MoveDivider,
    PinRoom,
    RenameRoom,
    SetDividerKind,
    SetRoomKind,
)
from stillroom.pipeline.transfer import track
from tests.pipeline.test_edits import edit, named

ZONE = ((1.0, 1.0), (2.0, 1.0), (2.0, 2.0), (1.0, 2.0))
HOME = named(r1="Hall", r2="Living")


def said(before: SemanticMap, after: SemanticMap, motion: Motion = IDENTITY) -> list[tuple[str, str, str]]:
    return [(c.code, c.feature, c.text) for c in compare(before, after, motion)]


def test_nothing_is_said_of_what_stayed() -> None:
    assert compare(HOME, HOME, IDENTITY) == ()


def test_a_moved_divider_is_told_with_what_it_did_to_the_rooms() -> None:
    after = edit(MoveDivider("d1", ((4.7, 0.0), (4.7, 4.0))), previous=HOME)
    assert compare(HOME, after, IDENTITY) == (
        Change("room-shrank", "r1", "Hall", "Hall shrank by 1.2 m²", -1.2),
        Change("room-grew", "r2", "Living", "Living grew by 1.2 m²", 1.2),
        Change("divider-moved", "d1", "Hall / Living", "Divider Hall / Living moved by 30 cm", 0.3),
    )


def test_rooms_and_dividers_that_come_and_go_are_told() -> None:
    split = edit(AddDivider(((2.0, 0.0), (2.0, 4.0))), previous=HOME)
    assert ("room-added", "r3", "Hall 2 is new, from Hall (8.0 m²)") in said(HOME, split)
    assert ("divider-added", "d2", "Divider Hall / Hall 2 is new") in said(HOME, split)
    merged = edit(MergeRooms(("r1", "r2")), previous=HOME)
    assert ("room-ended", "r2", "Living is no room of its own any more") in said(HOME, merged)
    assert ("divider-removed", "d1") in {(code, feature) for code, feature, _ in said(HOME, merged)}


def test_settings_are_told() -> None:
    changed = edit(
        RenameRoom("r1", "Kitchen"),
        SetRoomKind("r2", "living_room"),
        PinRoom("r2"),
        SetDividerKind("d1", "door"),
        previous=HOME,
    )
    assert [text for _, _, text in said(HOME, changed)] == [
        "Hall is called Kitchen now",
        "Living is used as: living room",
        "Living was pinned",
        "Divider Kitchen / Living is a door now",
    ]
    assert "room-unpinned" in {code for code, _, _ in said(changed, HOME)}


def test_zones_phantoms_and_repairs_are_told() -> None:
    zoned = edit(AddRestriction("no_go", ZONE), previous=HOME)
    assert said(HOME, zoned) == [("restriction-added", "z1", "No-go zone z1 is new")]
    assert said(zoned, HOME) == [("restriction-removed", "z1", "No-go zone z1 is gone")]
    shifted = replace(zoned.restrictions[0], shape=tuple((x + 0.5, y) for x, y in ZONE), placed=False)
    moved = replace(zoned, restrictions=(shifted,))
    assert [code for code, _, _ in said(zoned, moved)] == ["restriction-moved", "restriction-placement"]
    ghost = edit(MarkPhantom(((6.0, 0.0), (8.0, 0.0), (8.0, 4.0), (6.0, 4.0))), previous=HOME)
    assert ("phantom-added", "p1") in {(code, feature) for code, feature, _ in said(HOME, ghost)}
    repaired = replace(HOME, meta=MapMeta(dividers=(MetaDivider("m1", ((0, 2), (5, 2)), ("r1",), "7"),)))
    assert [code for code, _, _ in said(HOME, repaired)] == ["repair-added"]


@pytest.mark.parametrize("pose", [Pose(3.0, -1.0, 0.0), Pose(0.0, 0.0, 1.2)])
def test_a_map_that_moved_as_a_whole_has_not_changed(pose: Pose) -> None:
    motion = Motion.rigid(pose)
    zoned = edit(AddRestriction("no_go", ZONE), previous=HOME)
    moved = track(zoned, motion, HOME.frame)
    shape = tuple(map(tuple, motion.apply(shapely.get_coordinates(shapely.Polygon(ZONE)))[:-1].tolist()))
    there = replace(moved, restrictions=(replace(zoned.restrictions[0], shape=shape),))
    assert compare(zoned, there, motion) == ()
