import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from shapely import LineString, MultiPolygon, Polygon

from stillroom.maps.geometry import Line
from stillroom.maps.semantics import Ids
from stillroom.pipeline.rooms import absorb, most_common, new_rooms, overlaps, partition, rooms_beside, segment_id
from tests.drawing import rectangle

HALL = rectangle(0, 0, 8, 4)


def floor(*parts: Polygon) -> MultiPolygon:
    return MultiPolygon(list(parts))


def vertices(polygon: Polygon) -> set[tuple[float, float]]:
    return {(x, y) for x, y in shapely.get_coordinates(polygon).tolist()}


def test_a_floor_without_dividers_is_one_piece() -> None:
    (piece,) = partition(floor(HALL), [])
    assert shapely.equals(piece, HALL)


def test_no_floor_has_no_pieces() -> None:
    assert partition(MultiPolygon(), [((0.0, 0.0), (1.0, 0.0))]) == ()


def test_neighbours_share_exactly_the_dividers_edge_and_its_vertices() -> None:
    line = ((3.0, 0.0), (3.0, 4.0))
    larger, smaller = partition(floor(HALL), [line])
    assert (larger.area, smaller.area) == (20.0, 12.0)
    assert shapely.equals(shapely.intersection(larger, smaller), LineString(line))
    assert set(line) <= vertices(larger) & vertices(smaller)


def test_a_divider_that_ends_on_another_gives_all_three_rooms_its_vertex() -> None:
    pieces = partition(floor(HALL), [((4.0, 0.0), (4.0, 4.0)), ((4.0, 2.0), (8.0, 2.0))])
    assert [piece.area for piece in pieces] == [16.0, 8.0, 8.0]
    assert all((4.0, 2.0) in vertices(piece) for piece in pieces)


def test_dividers_that_cross_cut_each_other() -> None:
    pieces = partition(floor(HALL), [((4.0, 0.0), (4.0, 4.0)), ((0.0, 2.0), (8.0, 2.0))])
    assert [piece.area for piece in pieces] == [8.0] * 4
    assert all((4.0, 2.0) in vertices(piece) for piece in pieces)


def test_an_end_that_is_a_fraction_of_a_millimetre_off_the_wall_still_divides() -> None:
    slanted = Polygon([(0, 0), (7.003, 0.501), (7.351, 4.219), (0.113, 4.007)])
    foot = shapely.get_coordinates(shapely.shortest_line(shapely.Point(3, 4), slanted.exterior))[1]
    line: Line = ((3.0, round(3 * 0.501 / 7.003, 3)), (round(float(foot[0]), 3), round(float(foot[1]), 3)))
    pieces = partition(floor(slanted), [line])
    assert len(pieces) == 2
    assert sum(piece.area for piece in pieces) == pytest.approx(slanted.area, abs=0.01)


def test_a_pillar_is_in_no_piece() -> None:
    pillar = rectangle(3, 1, 5, 3)
    pieces = partition(floor(HALL.difference(pillar)), [((4.0, 0.0), (4.0, 1.0)), ((4.0, 3.0), (4.0, 4.0))])
    assert [piece.area for piece in pieces] == [14.0, 14.0]
    assert not any(shapely.intersects(piece, rectangle(3.1, 1.1, 4.9, 2.9)) for piece in pieces)


def test_a_divider_that_ends_in_mid_air_divides_nothing() -> None:
    (piece,) = partition(floor(HALL), [((4.0, 0.0), (4.0, 2.0))])
    assert piece.area == 32.0


def test_small_pieces_join_the_neighbour_with_the_longest_common_edge() -> None:
    lines: list[Line] = [((4.0, 0.0), (4.0, 4.0)), ((3.9, 0.0), (3.9, 4.0))]
    pieces = partition(floor(HALL), lines, smallest_m2=0.5)
    assert sorted(round(piece.area, 3) for piece in pieces) == [16.0, 16.0]
    alone = partition(floor(rectangle(0, 0, 0.4, 0.4)), [], smallest_m2=0.5)
    assert [round(piece.area, 3) for piece in alone] == [0.16]


coordinates = st.integers(0, 80).map(lambda v: v / 10)
lines = st.lists(
    st.tuples(st.tuples(coordinates, st.just(0.0)), st.tuples(coordinates, st.just(4.0))), max_size=6, unique=True
)
angles = st.floats(-3, 3)


@given(lines, angles)
def test_pieces_are_valid_disjoint_and_make_up_the_floor(cuts: list[Line], yaw: float) -> None:
    turn = shapely.transform(
        np.array([HALL, *map(LineString, cuts)]),
        lambda p: np.round(p @ np.array([[np.cos(yaw), np.sin(yaw)], [-np.sin(yaw), np.cos(yaw)]]), 3),
    )
    hall, drawn = turn[0], [((a[0], a[1]), (b[0], b[1])) for a, b in (line.coords for line in turn[1:])]
    pieces = partition(floor(hall), drawn)
    assert all(piece.is_valid and not piece.is_empty for piece in pieces)
    assert sum(piece.area for piece in pieces) == pytest.approx(hall.area, abs=0.05)
    assert shapely.symmetric_difference(shapely.union_all(pieces), hall).area < 0.05
    common = overlaps(pieces, pieces)
    assert (common - np.diag(np.diag(common))).max(initial=0) < 1e-6
    for i, piece in enumerate(pieces):
        for other in pieces[i + 1 :]:
            corners = shapely.get_coordinates(shapely.intersection(piece, other)).tolist()
            assert {(x, y) for x, y in corners} <= vertices(piece) & vertices(other)


# -- rooms beside a divider ----------------------------------------------------------------------------------------


def test_a_divider_names_the_rooms_on_both_sides() -> None:
    line = ((3.0, 0.0), (3.0, 4.0))
    pieces = partition(floor(HALL), [line])
    assert [set(sides) for sides in rooms_beside([line], pieces)] == [{0, 1}]


def test_a_divider_within_a_room_names_that_room_once() -> None:
    assert rooms_beside([((4.0, 0.0), (4.0, 2.0))], [HALL]) == ((0,),)


def test_a_divider_along_three_rooms_names_all_three() -> None:
    long, short = ((4.0, 0.0), (4.0, 4.0)), ((4.0, 2.0), (8.0, 2.0))
    pieces = partition(floor(HALL), [long, short])
    along, across = rooms_beside([long, short], pieces)
    assert set(along) == {0, 1, 2}
    assert set(across) == {1, 2}


def test_a_divider_far_from_any_room_names_none() -> None:
    assert rooms_beside([((20.0, 0.0), (20.0, 2.0))], [HALL]) == ((),)
    assert rooms_beside([((20.0, 0.0), (20.0, 2.0))], []) == ((),)
    assert rooms_beside([], [HALL]) == ()


# -- areas, ids ----------------------------------------------------------------------------------------------------


def test_overlaps_are_the_common_areas_of_all_pairs() -> None:
    first = [rectangle(0, 0, 2, 2), rectangle(5, 5, 6, 6)]
    second = [rectangle(1, 0, 3, 2), rectangle(2, 0, 4, 2), rectangle(0, 0, 9, 9)]
    assert overlaps(first, second).tolist() == [[2.0, 0.0, 4.0], [0.0, 0.0, 1.0]]


@pytest.mark.parametrize(("first", "second"), [([], [HALL]), ([HALL], []), ([], [])])
def test_overlaps_with_nothing_are_an_empty_table(first: list[Polygon], second: list[Polygon]) -> None:
    assert overlaps(first, second).shape == (len(first), len(second))


def test_a_piece_is_absorbed_by_the_room_with_the_longest_common_edge() -> None:
    rooms = [rectangle(0, 0, 4, 4), rectangle(5, 0, 9, 1)]
    grown = absorb(rooms, [rectangle(4, 0, 5, 4), rectangle(20, 20, 21, 21)])
    assert [room.area for room in grown] == [20.0, 4.0]


def test_new_rooms_get_new_ids_names_and_small_numbers() -> None:
    rooms, ids = new_rooms([HALL, HALL], "7", Ids("", (("r", 4),)))
    assert [(r.id, r.name, r.segment_id, r.last_visited) for r in rooms] == [
        ("r5", "Room 5", 5, "7"),
        ("r6", "Room 6", 6, "7"),
    ]
    assert ids.take("r")[0] == ("r7",)


def test_small_numbers_never_name_rooms_of_two_maps_of_a_robot() -> None:
    numbers = [segment_id(f"r{prefix}{n}") for prefix in ("", "2-", "3-") for n in range(1, 200)]
    assert len(set(numbers)) == len(numbers)


@given(st.lists(st.tuples(st.integers(0, 6), st.integers(0, 6), st.integers(1, 5), st.integers(1, 5)), max_size=6))
def test_who_has_most_of_a_piece_and_whether_anybody_has_any_is_as_by_all_overlaps(
    boxes: list[tuple[int, int, int, int]],
) -> None:
    rooms = [rectangle(x, 0, x + 2, 8) for x in (0, 2, 4, 6, 9)]
    pieces = [rectangle(x + 0.25, y, x + 0.25 + width, y + height) for x, y, width, height in boxes]
    every, most = overlaps(rooms, pieces), most_common(rooms, pieces)
    assert most.argmax(0).tolist() == every.argmax(0).tolist()
    assert most.max(0).tolist() == every.max(0).tolist()
    assert (most <= every).all()
    shared = most.max(0) <= np.array([piece.area for piece in pieces]) / 2
    assert (most[:, shared] == every[:, shared]).all()
