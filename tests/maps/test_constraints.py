"""The constraints of the paper's Tables I and II: for each a map that holds and maps that break it."""

from dataclasses import replace
from math import pi

import pytest
from shapely import Polygon

from stillroom.maps.constraints import violations
from stillroom.maps.geometry import Pose
from stillroom.maps.meta import MapMeta, MetaDivider
from stillroom.maps.semantics import Clutter, Divider, Room, SemanticMap, Wall
from tests.drawing import draw, rectangle

HOME = draw("""
    ######################
    #.........#..........#
    #.........#..........#
    #.........#..........#
    #.........#..........#
    #....................#
    #....................#
    #....................#
    #....................#
    #.......##...........#
    #.......##...........#
    #.........#..........#
    ######################
""")
"""Two rooms of 1.8 x 2.2 m and 2 x 2.2 m whose wall is open from y = 0.8 to 1.6, with an object in the left one."""

LEFT, RIGHT = rectangle(0.2, 0.2, 2.0, 2.4), rectangle(2.2, 0.2, 4.2, 2.4)
PASSAGE = rectangle(2.0, 0.8, 2.2, 1.6)
OBJECT = rectangle(1.6, 0.4, 2.0, 0.8)

VALID = SemanticMap(
    HOME.grid.frame,
    rooms=(
        Room("r1", "Left", 1, LEFT),
        Room("r2", "Right", 2, Polygon([*RIGHT.exterior.coords[1:4], (2.2, 1.6), (2.0, 1.6), (2.0, 0.8), (2.2, 0.8),
                                        (2.2, 0.2)])),
    ),
    dividers=(Divider("d1", ((2.0, 0.8), (2.0, 1.6)), rooms=("r1", "r2")),),
    walls=(
        Wall("w1", ((2.0, 1.6), (2.0, 2.4), (0.2, 2.4), (0.2, 0.2), (2.0, 0.2), (2.0, 0.8))),
        Wall("w2", ((2.0, 0.8), (2.2, 0.8), (2.2, 0.2), (4.2, 0.2), (4.2, 2.4), (2.2, 2.4), (2.2, 1.6), (2.0, 1.6))),
    ),
    clutter=(Clutter("k1", OBJECT),),
)  # fmt: skip


def broken(semantic_map: SemanticMap) -> set[tuple[str, str]]:
    return {(v.constraint, v.feature) for v in violations(semantic_map, HOME.grid, 0.20)}


def with_divider(line: tuple[tuple[float, float], tuple[float, float]]) -> SemanticMap:
    return replace(VALID, dividers=(*VALID.dividers, Divider("d2", line)))


def with_meta(*lines: tuple[tuple[float, float], tuple[float, float]]) -> SemanticMap:
    dividers = tuple(MetaDivider(f"m{i}", line, (), "7") for i, line in enumerate(lines, 1))
    return replace(VALID, meta=MapMeta(dividers=dividers))


def test_a_map_that_keeps_every_constraint_has_no_violation() -> None:
    assert violations(VALID, HOME.grid, 0.20) == ()


def test_clutter_must_lie_on_occupancy_pixels() -> None:
    adrift = replace(VALID, clutter=(Clutter("k1", OBJECT), Clutter("k2", rectangle(0.8, 1.2, 1.2, 1.6))))
    assert broken(adrift) == {("clutter lies on occupancy pixels", "k2")}


def test_clutter_that_touches_an_object_with_a_corner_alone_does_not_lie_on_it() -> None:
    loose = replace(VALID, clutter=(Clutter("k1", rectangle(0.6, 0.6, 1.6, 1.6)),))
    assert broken(loose) == {("clutter lies on occupancy pixels", "k1")}


def test_a_wall_must_lie_within_the_wall_distance_of_occupied_pixels() -> None:
    rule = "a wall lies within the wall distance of occupied pixels"
    near = Wall("w3", ((0.35, 0.6), (0.35, 2.0)))
    far = Wall("w3", ((0.2, 1.5), (1.0, 1.5)))
    assert broken(replace(VALID, walls=(*VALID.walls, near))) == set()
    assert broken(replace(VALID, walls=(*VALID.walls, far))) == {(rule, "w3")}


def test_a_border_to_unexplored_space_needs_no_occupied_pixel() -> None:
    opening = Wall("w3", ((0.2, 1.5), (1.0, 1.5)), "open")
    assert broken(replace(VALID, walls=(*VALID.walls, opening))) == set()


@pytest.mark.parametrize(
    "line",
    [((0.2, 2.0), (2.0, 2.0)), ((0.2, 1.2), (2.0, 1.2)), ((2.0, 1.2), (4.2, 1.2))],
    ids=["wall to wall", "wall to divider", "divider to wall"],
)
def test_a_divider_may_end_on_walls_and_other_dividers(
    line: tuple[tuple[float, float], tuple[float, float]],
) -> None:
    assert broken(with_divider(line)) == set()


@pytest.mark.parametrize("line", [((0.2, 1.2), (1.0, 1.2)), ((1.0, 1.2), (2.0, 1.2)), ((0.5, 1.2), (1.5, 1.2))])
def test_a_divider_must_not_end_in_mid_air(line: tuple[tuple[float, float], tuple[float, float]]) -> None:
    assert broken(with_divider(line)) == {("a divider ends on a wall or another divider", "d2")}


def test_a_divider_does_not_end_on_itself() -> None:
    loose = replace(VALID, dividers=(*VALID.dividers, Divider("d2", ((0.2, 1.2), (1.0, 1.2)))))
    assert broken(loose) == {("a divider ends on a wall or another divider", "d2")}


def test_a_divider_ends_on_a_meta_divider_that_stands_in_for_a_wall() -> None:
    meta = with_meta(((1.0, 0.2), (1.0, 2.4)))
    resting = replace(meta, dividers=(*VALID.dividers, Divider("d2", ((0.2, 1.2), (1.0, 1.2)))))
    assert broken(resting) == set()


def test_a_divider_without_any_wall_to_end_on_is_a_violation() -> None:
    alone = SemanticMap(HOME.grid.frame, dividers=(Divider("d1", ((1.0, 1.0), (2.0, 1.0))),))
    assert broken(alone) == {("a divider ends on a wall or another divider", "d1")}


def test_a_meta_divider_may_end_on_walls_and_other_meta_dividers() -> None:
    assert broken(with_meta(((1.0, 0.2), (1.0, 2.4)), ((0.2, 1.2), (1.0, 1.2)))) == set()


def test_a_meta_divider_must_not_end_in_mid_air() -> None:
    assert broken(with_meta(((1.0, 0.2), (1.0, 1.4)))) == {("a meta-divider ends on a wall or meta-divider", "m1")}


def test_a_room_must_be_enclosed_by_walls_and_dividers() -> None:
    rule = "a room is enclosed by wall sections and dividers"
    assert broken(replace(VALID, dividers=())) == {(rule, "r1"), (rule, "r2")}
    assert broken(replace(VALID, walls=VALID.walls[1:])) >= {(rule, "r1")}


def test_a_gap_of_a_hand_in_a_wall_opens_a_room() -> None:
    below = Wall("w3", ((0.2, 1.19), (0.2, 0.2), (2.0, 0.2), (2.0, 0.8)))
    above = Wall("w1", ((2.0, 1.6), (2.0, 2.4), (0.2, 2.4), (0.2, 1.41)))
    gap = replace(VALID, walls=(above, below, VALID.walls[1]))
    assert broken(gap) == {("a room is enclosed by wall sections and dividers", "r1")}


def test_a_meta_divider_encloses_a_room_as_a_divider_does() -> None:
    instead = MapMeta(dividers=(MetaDivider("m1", VALID.dividers[0].line, ("r1", "r2"), "7"),))
    assert broken(replace(VALID, dividers=(), meta=instead)) == set()


def test_rooms_must_be_disjoint() -> None:
    twice = replace(VALID, rooms=(*VALID.rooms, Room("r3", "Left again", 3, LEFT)))
    assert broken(twice) == {("rooms are disjoint", "r1")}


def test_a_room_must_be_a_valid_polygon() -> None:
    bow_tie = Room("r1", "Left", 1, Polygon([(0.2, 0.2), (2.0, 2.4), (2.0, 0.2), (0.2, 2.4)]))
    assert ("a room is one valid polygon", "r1") in broken(replace(VALID, rooms=(bow_tie, VALID.rooms[1])))


def test_a_map_of_nothing_breaks_no_constraint() -> None:
    assert violations(SemanticMap(HOME.grid.frame), HOME.grid, 0.20) == ()


def test_a_wall_is_judged_in_the_grids_own_frame() -> None:
    grid = draw("....\n....\n....\n....\n####", origin=Pose(5.0, 1.0, pi / 2)).grid
    along, across = Wall("w1", ((4.9, 1.0), (4.9, 1.7))), Wall("w2", ((4.9, 1.1), (4.2, 1.1)))
    assert {v.feature for v in violations(SemanticMap(grid.frame, walls=(along, across)), grid, 0.20)} == {"w2"}
