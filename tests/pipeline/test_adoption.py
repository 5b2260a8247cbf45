"""First maps with the rooms that the robot's own app already has."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from shapely import Polygon

from stillroom.maps.constraints import violations
from stillroom.maps.grid import GridFrame, OccupancyGrid
from stillroom.maps.semantics import Ids, Restriction, SemanticMap
from stillroom.pipeline.adoption import Labels, RobotSemantics, adopt_map, create_map_from_segments
from stillroom.pipeline.cells import cells_in
from stillroom.pipeline.creation import create_map
from stillroom.pipeline.params import PARAMS
from tests.drawing import Drawing, draw
from tests.grids import any_grid

HALL = """
    ####################
    #..................#
    #..................#
    #..................#
    #..................#
    #..................#
    #..................#
    #..................#
    #..................#
    ####################
"""
FLAT = """
    #####################
    #.........#.........#
    #.........#.........#
    #...................#
    #...................#
    #...................#
    #.........#.........#
    #.........#.........#
    #########...#########
    #...................#
    #...................#
    #...................#
    #####################
"""


def labelled(drawing: Drawing, *shapes: Polygon) -> Labels:
    """Segment k + 1 on the free cells of shape k; shapes in characters from the drawing's lower left corner."""
    labels = np.zeros(drawing.grid.cells.shape, np.int32)
    for label, shape in enumerate(shapes, 1):
        points = Polygon(np.asarray(shape.exterior.coords) * drawing.size_m)
        labels[cells_in([points], drawing.grid.frame) & drawing.grid.free] = label
    return labels


def box(x0: float, y0: float, x1: float, y1: float) -> Polygon:
    return Polygon([(x0, y0), (x1, y0), (x1, y1), (x0, y1)])


def made(drawing: Drawing, labels: Labels, *names: str | None) -> SemanticMap:
    semantic_map = create_map_from_segments(drawing.grid, labels, names or (None,) * int(labels.max()), "1", Ids())
    assert violations(semantic_map, drawing.grid, PARAMS.wall_reach_m) == ()
    return semantic_map


def shares(semantic_map: SemanticMap, labels: Labels, frame: GridFrame) -> dict[int, float]:
    """For each segment the best IoU with a room, in cells of the floor."""
    masks = [cells_in([room.polygon], frame) for room in semantic_map.rooms]
    return {
        label: max(float((mask & (labels == label)).sum() / (mask | (labels == label)).sum()) for mask in masks)
        for label in np.unique(labels[labels > 0]).tolist()
    }


def test_a_border_across_open_floor_becomes_one_divider_from_wall_to_wall() -> None:
    drawing = draw(HALL)
    labels = labelled(drawing, box(1, 1, 8, 9), box(8, 1, 19, 9))
    semantic_map = made(drawing, labels, "Cooking", None)
    assert [(room.name, room.named_by) for room in semantic_map.rooms] == [
        ("Room 1", "algorithm"),
        ("Cooking", "user"),
    ]
    (divider,) = semantic_map.dividers
    assert np.allclose(sorted(divider.line), [(1.6, 0.2), (1.6, 1.8)])
    assert divider.rooms == ("r1", "r2")


def test_a_border_with_a_corner_becomes_two_dividers_that_meet() -> None:
    drawing = draw(HALL)
    labels = labelled(drawing, box(1, 1, 19, 9), box(10, 4, 19, 9))
    semantic_map = made(drawing, labels)
    assert len(semantic_map.dividers) == 2
    assert min(shares(semantic_map, labels, drawing.grid.frame).values()) > 0.98


def test_three_segments_that_meet_in_one_point_become_three_dividers_to_it() -> None:
    drawing = draw(HALL)
    labels = labelled(drawing, box(1, 1, 19, 5), box(1, 5, 9, 9), box(9, 5, 19, 9))
    semantic_map = made(drawing, labels)
    assert len(semantic_map.rooms) == len(semantic_map.dividers) == 3
    assert min(shares(semantic_map, labels, drawing.grid.frame).values()) > 0.98


def test_a_segment_inside_another_is_a_room_in_a_room() -> None:
    drawing = draw(HALL)
    labels = labelled(drawing, box(1, 1, 19, 9), box(5, 3, 14, 7))
    semantic_map = made(drawing, labels, "Hall", "Carpet")
    assert {room.name: len(room.polygon.interiors) for room in semantic_map.rooms} == {"Hall": 1, "Carpet": 0}


def test_segments_that_doors_join_are_divided_in_the_doors_and_walls_stay_walls() -> None:
    drawing = draw(FLAT)
    labels = labelled(drawing, box(1, 5, 10, 12), box(11, 5, 20, 12), box(1, 1, 20, 4.5))
    semantic_map = made(drawing, labels, "Left", "Right", "Below")
    assert sorted(room.name for room in semantic_map.rooms) == ["Below", "Left", "Right"]
    assert min(shares(semantic_map, labels, drawing.grid.frame).values()) > 0.9


def test_a_segment_that_a_wall_parts_becomes_two_rooms_with_its_name() -> None:
    drawing = draw(HALL.replace("#..................#", "#.......#..........#"))
    labels = np.where(drawing.grid.free, 1, 0).astype(np.int32)
    semantic_map = made(drawing, labels, "Bath")
    assert [(room.name, room.named_by) for room in semantic_map.rooms] == [("Bath", "user"), ("Bath 2", "user")]
    assert semantic_map.dividers == ()


def test_a_ragged_border_becomes_a_straight_divider() -> None:
    drawing = draw(HALL)
    labels = labelled(drawing, box(1, 1, 8, 9), box(8, 1, 19, 9))
    rng = np.random.default_rng(4)
    for row in range(4, 36):
        labels[row, 32 : 32 + int(rng.integers(0, 3))] = 1
    semantic_map = made(drawing, labels)
    assert len(semantic_map.dividers) == 1
    assert min(shares(semantic_map, labels, drawing.grid.frame).values()) > 0.9


def test_crumbs_of_a_segment_belong_to_what_is_around_them() -> None:
    drawing = draw(HALL)
    labels = labelled(drawing, box(1, 1, 10, 9), box(10, 1, 19, 9))
    labels[20:22, 50:52] = 1
    assert len(made(drawing, labels).rooms) == 2


def test_floor_without_a_segment_joins_the_nearest_or_is_a_room_where_it_is_as_large_as_one() -> None:
    drawing = draw(HALL)
    small = labelled(drawing, box(1, 1, 10, 9), box(12, 1, 19, 9))
    assert len(made(drawing, small, "A", "B").rooms) == 2
    large = labelled(drawing, box(1, 1, 6, 9))
    assert [room.name for room in made(drawing, large, "A").rooms] == ["Room 1", "A"]


def test_without_segments_the_rooms_are_found_and_restrictions_taken_all_the_same() -> None:
    drawing = draw(FLAT)
    none = np.zeros(drawing.grid.cells.shape, np.int32)
    square = ((0.5, 0.5), (1.0, 0.5), (1.0, 1.0))
    said = RobotSemantics(
        none, (), (Restriction("", "no_go", square), Restriction("", "virtual_wall", ((90, 90), (91, 91))))
    )
    plain = create_map(drawing.grid, "1", Ids())
    adopted = adopt_map(drawing.grid, said, "1", Ids())
    assert adopted.rooms == plain.rooms
    assert [(r.id, r.kind, r.placed) for r in adopted.restrictions] == [
        ("z1", "no_go", True),
        ("z2", "virtual_wall", False),
    ]
    assert adopt_map(drawing.grid, None, "1", Ids()) == plain


def test_ids_go_on_from_those_that_were_given_out() -> None:
    drawing = draw(HALL)
    labels = labelled(drawing, box(1, 1, 8, 9), box(8, 1, 19, 9))
    used = Ids("2-", (("d", 4), ("r", 7)))
    semantic_map = create_map_from_segments(drawing.grid, labels, (None, None), "1", used)
    assert [room.id for room in semantic_map.rooms] == ["r2-8", "r2-9"]
    assert [divider.id for divider in semantic_map.dividers] == ["d2-5"]


@st.composite
def any_segments(draw: st.DrawFn) -> tuple[OccupancyGrid, Labels]:
    """Any grid with segments in blocks of any size, on walls and in the unknown too."""
    grid = draw(any_grid(60))
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    block = draw(st.sampled_from([1, 3, 10, 25]))
    height, width = grid.cells.shape
    coarse = rng.integers(0, draw(st.integers(1, 6)) + 1, (-(-height // block), -(-width // block)))
    labels = np.kron(coarse, np.ones((block, block), np.int64))[:height, :width]
    return grid, labels.astype(np.int32)


@given(any_segments())
def test_all_constraints_hold_whatever_the_segments(drawn: tuple[OccupancyGrid, Labels]) -> None:
    grid, labels = drawn
    semantic_map = create_map_from_segments(grid, labels, ("a", None, "b", "c", "d", "e"), "1", Ids())
    assert violations(semantic_map, grid, PARAMS.wall_reach_m) == ()
