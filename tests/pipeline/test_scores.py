"""Precision and recall of rooms, exactly as the paper defines them: overlap C, only previous A, only new B."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from shapely import Polygon

from stillroom.maps.grid import GridFrame
from stillroom.maps.semantics import Room, SemanticMap
from stillroom.pipeline.params import PARAMS
from stillroom.pipeline.scores import RoomScore, score_rooms
from tests.drawing import rectangle

FRAME = GridFrame(0.05, 200, 200)


def room_map(**rooms: Polygon) -> SemanticMap:
    return SemanticMap(FRAME, tuple(Room(id_, id_.upper(), i, p) for i, (id_, p) in enumerate(rooms.items(), 1)))


def score(previous: Polygon, candidate: Polygon) -> RoomScore:
    (found,) = score_rooms(room_map(r1=previous), room_map(r1=candidate), {"r1"}, PARAMS)
    return found


def test_recall_is_the_share_of_the_previous_room_and_precision_the_share_of_the_new_one() -> None:
    found = score(rectangle(0, 0, 4, 2), rectangle(1, 0, 7, 2))
    assert (found.recall, found.precision) == (0.75, 0.5)


def test_a_room_carried_over_unchanged_scores_one_in_both() -> None:
    found = score(rectangle(0, 0, 4, 2), rectangle(0, 0, 4, 2))
    assert (found.recall, found.precision, found.passed) == (1.0, 1.0, True)


def test_recall_of_exactly_one_half_fails() -> None:
    found = score(rectangle(0, 0, 4, 2), rectangle(0, 0, 2, 2))
    assert (found.recall, found.precision, found.passed) == (0.5, 1.0, False)


def test_precision_of_exactly_one_half_fails() -> None:
    found = score(rectangle(0, 0, 2, 2), rectangle(0, 0, 4, 2))
    assert (found.recall, found.precision, found.passed) == (1.0, 0.5, False)


def test_both_just_above_one_half_pass() -> None:
    found = score(rectangle(0, 0, 4, 2), rectangle(1.984375, 0, 6, 2))
    assert 0.5 < found.recall < 0.51
    assert 0.5 < found.precision < 0.51
    assert found.passed


def test_one_of_both_above_one_half_is_not_enough() -> None:
    assert not score(rectangle(0, 0, 4, 2), rectangle(0, 0, 1.9, 2)).passed
    assert not score(rectangle(0, 0, 1.9, 2), rectangle(0, 0, 4, 2)).passed


def test_a_room_that_is_gone_scores_zero_and_fails() -> None:
    (found,) = score_rooms(room_map(r1=rectangle(0, 0, 4, 2)), room_map(), {"r1"}, PARAMS)
    assert (found.recall, found.precision, found.passed) == (0.0, 0.0, False)


def test_a_room_is_compared_with_the_room_of_its_own_id_only() -> None:
    here, there = rectangle(0, 0, 4, 2), rectangle(4, 0, 8, 2)
    found = score_rooms(room_map(r1=here, r2=there), room_map(r2=here, r1=there), {"r1", "r2"}, PARAMS)
    assert [(s.id, s.recall, s.passed) for s in found] == [("r1", 0.0, False), ("r2", 0.0, False)]


def test_a_room_that_was_not_visited_says_so_and_has_to_keep_its_shape() -> None:
    previous = room_map(r1=rectangle(0, 0, 4, 2), r2=rectangle(4, 0, 8, 2))
    kept, _ = score_rooms(previous, previous, {"r2"}, PARAMS)
    assert (kept.visited, kept.passed) == (False, True)
    candidate = room_map(r1=rectangle(0, 0, 1, 2), r2=rectangle(4, 0, 8, 2))
    unseen, seen = score_rooms(previous, candidate, {"r2"}, PARAMS)
    assert (unseen.visited, unseen.passed) == (False, False)
    assert (seen.visited, seen.passed) == (True, True)


def test_a_room_that_is_gone_fails_although_it_was_not_visited() -> None:
    previous = room_map(r1=rectangle(0, 0, 4, 2), r2=rectangle(4, 0, 8, 2))
    gone, _ = score_rooms(previous, room_map(r2=rectangle(4, 0, 8, 2)), {"r2"}, PARAMS)
    assert not gone.passed


def test_every_previous_room_is_scored_in_order_and_new_rooms_are_not() -> None:
    previous = room_map(r2=rectangle(4, 0, 8, 2), r1=rectangle(0, 0, 4, 2))
    candidate = room_map(r3=rectangle(8, 0, 9, 2), r1=rectangle(0, 0, 4, 2), r2=rectangle(4, 0, 8, 2))
    assert [(s.id, s.name) for s in score_rooms(previous, candidate, {"r1"}, PARAMS)] == [("r2", "R2"), ("r1", "R1")]


sides = st.floats(0.5, 8)


@given(sides, sides, st.floats(-8, 8))
def test_swapping_previous_and_new_swaps_precision_and_recall(a: float, b: float, shift: float) -> None:
    first, second = rectangle(0, 0, a, 2), rectangle(shift, 0, shift + b, 2)
    there, back = score(first, second), score(second, first)
    assert (there.recall, there.precision) == pytest.approx((back.precision, back.recall))
    assert there.passed == (there.recall > 0.5 and there.precision > 0.5)
