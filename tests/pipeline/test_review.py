"""Updates that wait until a person agrees."""

from dataclasses import replace

import pytest
from shapely import LineString

from stillroom.maps.grid import Cell
from stillroom.maps.meta import Declined, MapMeta
from stillroom.maps.mission import Mission
from stillroom.maps.motion import IDENTITY
from stillroom.maps.semantics import Ids, SemanticMap
from stillroom.pipeline.creation import create_map
from stillroom.pipeline.review import hold_back
from stillroom.pipeline.update import MapUpdate, update_map
from tests.drawing import paint, rectangle
from tests.golden.homes import CORRIDOR

GAP = paint(CORRIDOR.grid, Cell.FREE, rectangle(4.7, 4.4, 5.1, 5.6))


@pytest.fixture(scope="module")
def home() -> SemanticMap:
    return create_map(CORRIDOR.grid, "0", Ids())


@pytest.fixture(scope="module")
def plain(home: SemanticMap) -> MapUpdate:
    update = update_map(home, Mission("1", CORRIDOR.grid, IDENTITY))
    assert (update.outcome, update.conflicts) == ("updated", ())
    return update


@pytest.fixture(scope="module")
def resolved(home: SemanticMap) -> MapUpdate:
    update = update_map(home, Mission("1", GAP, IDENTITY))
    assert update.outcome == "resolved"
    return update


def test_an_update_that_needed_the_meta_layer_waits_where_the_owner_wants_to_be_asked(
    home: SemanticMap, resolved: MapUpdate
) -> None:
    held = hold_back(home, "1", resolved, ask_first=True, pinned=False)
    assert (held.outcome, held.taken, held.succeeded_at) == ("needs_review", False, None)
    assert held.map is home
    assert held.ablation == resolved.ablation
    (conflict,) = held.conflicts
    assert conflict.id == resolved.conflicts[0].id
    assert not conflict.resolved
    assert [(p.id, p.action, p.recommended) for p in conflict.proposals] == [
        ("p1", "meta_occupancy", True),
        ("p2", "take_new", False),
        ("p3", "keep_previous", False),
    ]
    assert conflict.proposals[0].map is resolved.map
    assert conflict.proposals[2].map is home
    assert "waits" in held.reason


def test_what_waits_is_told_as_what_would_be(home: SemanticMap, resolved: MapUpdate) -> None:
    (told,) = hold_back(home, "1", resolved, ask_first=True, pinned=False).conflicts
    assert told.summary == resolved.conflicts[0].summary.replace(" was kept ", " would be kept ")
    assert " would be kept " in told.summary


def test_an_update_that_found_a_room_waits_too_and_says_which(home: SemanticMap, plain: MapUpdate) -> None:
    found = replace(plain, discovered=("r2",))
    held = hold_back(home, "1", found, ask_first=True, pinned=False)
    assert (held.outcome, held.discovered) == ("needs_review", ())
    (conflict,) = held.conflicts
    assert (conflict.kind, conflict.cause) == ("connectivity", "new_passage")
    assert conflict.summary == "Room 2 would be new."
    assert {score.id for score in conflict.rooms} == {"r2", "r4"}
    assert hold_back(home, "1", found, True, False).conflicts == held.conflicts
    assert hold_back(home, "2", found, True, False).conflicts[0].id != conflict.id


def test_an_update_that_needed_nothing_waits_for_nobody(home: SemanticMap, plain: MapUpdate) -> None:
    for ask_first, pinned in ((False, False), (True, False), (True, True)):
        assert hold_back(home, "1", plain, ask_first, pinned) is plain


def test_without_such_a_wish_nothing_waits(home: SemanticMap, resolved: MapUpdate) -> None:
    assert hold_back(home, "1", resolved, ask_first=False, pinned=False) is resolved


def test_a_pinned_map_changes_by_agreement_alone(home: SemanticMap, resolved: MapUpdate) -> None:
    assert hold_back(home, "1", resolved, ask_first=False, pinned=True).outcome == "needs_review"
    unexplained = replace(resolved, conflicts=())
    (conflict,) = hold_back(home, "1", unexplained, ask_first=False, pinned=True).conflicts
    assert conflict.summary == "The map would be corrected."


@pytest.mark.parametrize(("room", "waits"), [("r3", True), ("r1", False)])
def test_a_pinned_room_lets_nothing_pass_that_concerns_it(
    home: SemanticMap, resolved: MapUpdate, room: str, waits: bool
) -> None:
    pinned = replace(home, rooms=tuple(replace(r, pinned=r.id == room) for r in home.rooms))
    assert (hold_back(pinned, "1", resolved, False, False) is not resolved) == waits


def test_what_was_not_taken_stays_as_it_is(home: SemanticMap, resolved: MapUpdate) -> None:
    reverted = replace(resolved, taken=False, outcome="reverted", map=home)
    assert hold_back(home, "1", reverted, ask_first=True, pinned=True) is reverted


def test_a_home_that_was_refused_a_correction_keeps_that_in_what_it_proposes(home: SemanticMap) -> None:
    refused = replace(home, meta=MapMeta(declined=(Declined(LineString([(1, 1), (1, 2)])),)))
    update = update_map(refused, Mission("1", GAP, IDENTITY))
    assert update.outcome == "resolved"
    for m in (update.map, *(p.map for p in update.conflicts[0].proposals)):
        assert len(m.meta.declined) == 1
