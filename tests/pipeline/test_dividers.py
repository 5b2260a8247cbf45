"""Where a drawn or tracked divider ends. The contract: each end is cut back or extended along the divider's own line to the first wall or
divider within reach, else moved to the nearest one within it; ends drawn into a wall are trimmed to its face."""

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from shapely import MultiPolygon, Polygon

from stillroom.maps.geometry import Line, Pose, as_line, as_points
from stillroom.pipeline.dividers import Adrift, Attached, Outline, attach
from tests.drawing import rectangle

REACH_M = 0.5
HALL = MultiPolygon([rectangle(0, 0, 8, 4)])
TWO_ROOMS = MultiPolygon([rectangle(0, 0, 3.9, 4).union(rectangle(3.9, 1, 4.1, 2)).union(rectangle(4.1, 0, 8, 4))])
"""A wall 0.2 m thick at x = 4 with a doorway from y = 1 to 2."""


def attached(line: Line, floor: MultiPolygon = HALL, others: tuple[Line, ...] = ()) -> Line:
    found = attach(line, Outline(floor), others, REACH_M)
    assert isinstance(found, Attached), found
    return found.line


def test_ends_on_walls_stay() -> None:
    assert attached(((3.0, 0.0), (3.0, 4.0))) == ((3.0, 0.0), (3.0, 4.0))


def test_short_ends_are_extended_along_the_line() -> None:
    assert_allclose(attached(((3.0, 0.4), (4.0, 3.6))), ((2.875, 0.0), (4.125, 4.0)), atol=0.001)


def test_ends_beyond_a_wall_are_trimmed_to_its_face() -> None:
    assert attached(((3.0, -0.3), (3.0, 4.45))) == ((3.0, 0.0), (3.0, 4.0))


def test_ends_drawn_into_doorposts_are_trimmed_to_their_faces() -> None:
    assert attached(((4.0, 0.7), (4.0, 2.4)), TWO_ROOMS) == ((4.0, 1.0), (4.0, 2.0))


def test_an_end_moves_to_the_first_wall_along_the_line_rather_than_to_a_nearer_one_beside_it() -> None:
    assert_allclose(attached(((0.2, 0.4), (0.2, 4.0))), ((0.2, 0.0), (0.2, 4.0)))


def test_an_end_without_a_wall_along_its_line_moves_to_the_nearest_one() -> None:
    beside = ((0.3, 2.0), (7.6, 3.6))
    assert attached(beside)[0][0] == 0.0
    post = MultiPolygon([rectangle(0, 0, 8, 4).difference(rectangle(4.0, 0.0, 4.2, 2.0))])
    (x, y), top = attached(((3.7, 1.9), (3.7, 4.0)), post)
    assert (x, y) == (4.0, 1.9)
    assert top == (3.7, 4.0)


def test_an_end_stops_at_the_first_divider_within_reach() -> None:
    other = ((0.0, 2.0), (8.0, 2.0))
    assert attached(((3.0, 0.1), (3.0, 1.7)), others=(other,)) == ((3.0, 0.0), (3.0, 2.0))
    assert attached(((3.0, 0.1), (3.0, 2.2)), others=(other,)) == ((3.0, 0.0), (3.0, 2.0))


@pytest.mark.parametrize(
    ("line", "end", "gap"),
    [
        (((3.0, 0.0), (3.0, 2.8)), 1, 1.2),
        (((3.0, 1.5), (3.0, 4.0)), 0, 1.5),
        (((3.0, 0.0), (3.0, 3.49)), 1, 0.51),
    ],
)
def test_an_end_out_of_reach_is_named_with_its_distance(line: Line, end: int, gap: float) -> None:
    found = attach(line, Outline(HALL), (), REACH_M)
    assert isinstance(found, Adrift)
    assert found.end == end
    assert found.gap_m == pytest.approx(gap, abs=0.001)


def test_just_within_reach_is_attached() -> None:
    assert attached(((3.0, 0.49), (3.0, 3.51))) == ((3.0, 0.0), (3.0, 4.0))


def test_a_divider_outside_the_home_is_refused() -> None:
    assert isinstance(attach(((20.0, 0.0), (20.0, 4.0)), Outline(HALL), (), REACH_M), Adrift)


def test_a_divider_on_no_floor_is_refused() -> None:
    assert isinstance(attach(((0.0, 0.0), (1.0, 0.0)), Outline(MultiPolygon()), (), REACH_M), Adrift)


def test_a_divider_without_length_is_refused() -> None:
    assert isinstance(attach(((3.0, 0.0), (3.0, 0.0)), Outline(HALL), (), REACH_M), Adrift)


inside = st.tuples(st.floats(0.05, 7.95), st.floats(0.05, 3.95))
anywhere = st.tuples(st.floats(-2, 10), st.floats(-2, 6))


@given(anywhere, anywhere)
def test_what_is_attached_ends_on_walls_and_both_ends_moved_no_further_than_reach(
    a: tuple[float, float], b: tuple[float, float]
) -> None:
    found = attach((a, b), Outline(TWO_ROOMS), (), REACH_M)
    if isinstance(found, Adrift):
        return
    ends = as_points(found.line)
    assert shapely.distance(shapely.points(ends), TWO_ROOMS.boundary).max() < 0.002
    for before, after in zip(as_points((a, b)), ends, strict=True):
        if TWO_ROOMS.intersects(shapely.Point(before)):
            assert np.hypot(*(after - before)) <= REACH_M + 0.002


@given(inside, inside, st.floats(-3, 3))
def test_attaching_does_not_depend_on_how_the_home_is_turned(
    a: tuple[float, float], b: tuple[float, float], yaw: float
) -> None:
    turn = Pose(yaw=yaw)
    turned: MultiPolygon = shapely.transform(HALL, turn.apply)
    there = attach(as_line(turn.apply(as_points((a, b)))), Outline(turned), (), REACH_M)
    here = attach((a, b), Outline(HALL), (), REACH_M)
    if type(there) is not type(here):
        # a line that runs a few millimetres beside a wall divides something, or nothing, by the last digit
        found, floor = (here, HALL) if isinstance(here, Attached) else (there, turned)
        assert isinstance(found, Attached)
        beside = shapely.points(shapely.get_coordinates(shapely.segmentize(shapely.LineString(found.line), 0.01)))
        assert shapely.distance(beside, floor.boundary).max() < 0.01
        return
    if isinstance(here, Attached) and isinstance(there, Attached):
        assert_allclose(as_points(there.line), turn.apply(as_points(here.line)), atol=0.01)


def test_a_divider_ends_on_the_edge_of_a_pillar() -> None:
    pillar = MultiPolygon([Polygon(rectangle(0, 0, 8, 4).exterior, [rectangle(3.5, 1.5, 4.5, 2.5).exterior])])
    assert attached(((4.0, 0.1), (4.0, 1.4)), pillar) == ((4.0, 0.0), (4.0, 1.5))


def test_an_end_that_reaches_past_a_wall_into_the_next_room_is_cut_back() -> None:
    assert_allclose(attached(((0.3, 3.0), (4.2, 3.0)), TWO_ROOMS), ((0.0, 3.0), (3.9, 3.0)))


@given(inside, inside)
def test_attaching_again_changes_nothing(a: tuple[float, float], b: tuple[float, float]) -> None:
    found = attach((a, b), Outline(TWO_ROOMS), (), REACH_M)
    if isinstance(found, Attached):
        assert_allclose(attached(found.line, TWO_ROOMS), found.line, atol=0.003)


def test_a_divider_wholly_in_a_wall_is_refused() -> None:
    assert isinstance(attach(((4.0, 2.5), (4.0, 3.5)), Outline(TWO_ROOMS), (), REACH_M), Adrift)
