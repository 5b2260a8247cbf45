"""Space that is not a real place is no floor, in this and in every later mission."""

from dataclasses import replace

import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import Polygon

from stillroom.errors import InvalidEdit
from stillroom.maps.constraints import violations
from stillroom.maps.geometry import Pose
from stillroom.maps.grid import Cell
from stillroom.maps.mission import Mission
from stillroom.maps.motion import Motion
from stillroom.maps.semantics import Ids, SemanticMap
from stillroom.pipeline.creation import create_map
from stillroom.pipeline.edits import AddDivider, MarkPhantom, RemovePhantom, apply_edits
from stillroom.pipeline.params import PARAMS
from stillroom.pipeline.phantoms import carry_phantoms, without_phantoms
from stillroom.pipeline.update import update_map
from tests.drawing import draw, rectangle

MIRROR = draw(
    """
    ############################
    #..............#...........#
    #..............#...........#
    #..............#...........#
    #..............#...........#
    #..........................#
    #..........................#
    #..............#...........#
    #..............#...........#
    ############################
    """
)
"""Two rooms of 2.8 x 1.6 m and 2.2 x 1.6 m; say that the right one is only what a mirror shows."""
RIGHT = ((3.1, 0.1), (5.5, 0.1), (5.5, 1.9), (3.1, 1.9))


FOUND = create_map(MIRROR.grid, "1", Ids())


@pytest.fixture
def mapped() -> SemanticMap:
    assert len(FOUND.rooms) == 2
    return FOUND


def marked(mapped: SemanticMap) -> SemanticMap:
    return apply_edits(mapped, [MarkPhantom(RIGHT)]).map


def test_a_phantom_takes_its_room_away_and_leaves_the_others_as_they_were(mapped: SemanticMap) -> None:
    result = apply_edits(mapped, [MarkPhantom(RIGHT)])
    (room,) = result.map.rooms
    (phantom,) = result.map.phantoms
    assert (phantom.id, phantom.shape) == ("p1", RIGHT)
    assert not shapely.intersects(room.polygon, Polygon(RIGHT).buffer(-0.01))
    assert list(result.retired.values()) == [None]
    assert violations(result.map, MIRROR.grid, PARAMS.wall_reach_m) == ()


def test_a_part_of_a_room_can_be_a_phantom(mapped: SemanticMap) -> None:
    corner = ((4.5, 1.0), (5.5, 1.0), (5.5, 2.0), (4.5, 2.0))
    result = apply_edits(mapped, [MarkPhantom(corner)])
    assert {room.id for room in result.map.rooms} == {room.id for room in mapped.rooms}
    lost = sum(r.polygon.area for r in mapped.rooms) - sum(r.polygon.area for r in result.map.rooms)
    assert lost == pytest.approx(0.9 * 0.8, abs=0.02)
    assert violations(result.map, MIRROR.grid, PARAMS.wall_reach_m) == ()


@pytest.mark.parametrize("x", [3.05, 3.15, 3.2, 3.35, 3.6])
@pytest.mark.parametrize("slant", [0.0, 0.1])
def test_what_a_phantom_leaves_of_a_room_goes_with_it_and_no_mission_looks_for_it(
    mapped: SemanticMap, x: float, slant: float
) -> None:
    """Nobody draws along a doorway to the centimetre."""
    result = apply_edits(mapped, [MarkPhantom(((x, 0.1), (5.5, 0.1), (5.5, 1.9), (x + slant, 1.9)))])
    (room,) = result.map.rooms
    assert violations(result.map, MIRROR.grid, PARAMS.wall_reach_m) == ()
    update = update_map(result.map, Mission("2", MIRROR.grid, Motion.rigid(Pose())))
    assert (update.outcome, [r.id for r in update.map.rooms]) == ("updated", [room.id]), update.reason


place = st.tuples(st.floats(0.0, 6.0).map(lambda x: round(x, 2)), st.floats(0.0, 2.2).map(lambda y: round(y, 2)))


@settings(max_examples=60)
@given(st.lists(place, min_size=3, max_size=6))
def test_whatever_is_marked_the_map_stays_valid_or_the_edit_is_refused(ring: list[tuple[float, float]]) -> None:
    try:
        result = apply_edits(FOUND, [MarkPhantom(tuple(ring))])
    except InvalidEdit:
        return
    assert violations(result.map, MIRROR.grid, PARAMS.wall_reach_m) == ()
    assert all(room.polygon.area >= 0.25 for room in result.map.rooms)


def test_a_phantom_stays_away_in_every_later_mission_and_moves_with_the_map(mapped: SemanticMap) -> None:
    current = marked(mapped)
    before = current.rooms[0]
    for number in range(2, 6):
        update = update_map(current, Mission(str(number), MIRROR.grid, Motion.rigid(Pose())))
        assert update.taken, update.reason
        current = update.map
        (room,) = current.rooms
        assert room.id == before.id
        assert room.polygon.area == pytest.approx(before.polygon.area, rel=0.03)
        assert len(current.phantoms) == 1


def test_what_was_no_place_is_one_again_when_a_mission_sees_it_after_the_mark_is_gone(mapped: SemanticMap) -> None:
    result = apply_edits(marked(mapped), [RemovePhantom("p1")])
    assert result.map.phantoms == ()
    assert [(p.code, p.feature) for p in result.problems] == [("comes-back", "p1")]
    update = update_map(result.map, Mission("2", MIRROR.grid, Motion.rigid(Pose())))
    total = sum(room.polygon.area for room in mapped.rooms)
    assert sum(room.polygon.area for room in (update.candidate or update.map).rooms) == pytest.approx(total, rel=0.1)


def test_the_robots_grid_itself_is_never_altered(mapped: SemanticMap) -> None:
    before = MIRROR.grid.cells.copy()
    corrected = without_phantoms(MIRROR.grid, marked(mapped).phantoms)
    assert (MIRROR.grid.cells == before).all()
    assert (corrected.cells[10:30, 70:100] == Cell.UNEXPLORED).all()
    assert (corrected.cells[:, :60] == before[:, :60]).all()
    assert without_phantoms(MIRROR.grid, ()) is MIRROR.grid


def test_a_phantom_moves_as_one_rigid_shape(mapped: SemanticMap) -> None:
    (moved,) = carry_phantoms(marked(mapped).phantoms, Motion.rigid(Pose(1.0, -2.0, 0.0)))
    assert moved.shape == tuple((round(x + 1.0, 4), round(y - 2.0, 4)) for x, y in RIGHT)


def test_dividers_are_cut_back_to_what_is_left_of_the_floor(mapped: SemanticMap) -> None:
    left = min(mapped.rooms, key=lambda room: room.polygon.bounds[0])
    divided = apply_edits(mapped, [AddDivider(((1.5, 0.2), (1.5, 1.8)))]).map
    across = ((1.0, 1.0), (2.0, 1.0), (2.0, 2.0), (1.0, 2.0))
    cut = apply_edits(divided, [MarkPhantom(across)]).map
    drawn = next(d for d in cut.dividers if d.made_by == "user")
    assert sorted(y for _, y in drawn.line) == [pytest.approx(0.2, abs=0.01), pytest.approx(1.0, abs=0.01)]
    assert cut.room(left.id) is not None
    assert violations(cut, MIRROR.grid, PARAMS.wall_reach_m) == ()


@pytest.mark.parametrize(
    ("shape", "words"),
    [
        (((0.0, 0.0), (1.0, 1.0)), "ring"),
        (((0.0, 0.0), (1.0, 1.0), (1.0, 0.0), (0.0, 1.0)), "cross"),
        (((50.0, 50.0), (51.0, 50.0), (51.0, 51.0)), "off the map"),
        (((-1.0, -1.0), (9.0, -1.0), (9.0, 9.0), (-1.0, 9.0)), "Nothing would be left"),
    ],
)
def test_shapes_that_are_none_and_phantoms_that_leave_nothing_are_refused(
    mapped: SemanticMap, shape: tuple[tuple[float, float], ...], words: str
) -> None:
    with pytest.raises(InvalidEdit, match=words):
        apply_edits(mapped, [MarkPhantom(shape)])


def test_a_phantom_where_there_is_no_floor_is_kept_with_a_warning(mapped: SemanticMap) -> None:
    wide = replace(mapped, rooms=tuple(r for r in mapped.rooms if r.polygon.bounds[0] < 1), dividers=())
    result = apply_edits(wide, [MarkPhantom(((3.5, 0.5), (4.0, 0.5), (4.0, 1.0), (3.5, 1.0)))])
    assert [(p.code, p.feature) for p in result.problems] == [("no-floor", "p1")]
    assert [room.polygon for room in result.map.rooms] == [room.polygon for room in wide.rooms]


def test_scraps_that_a_phantom_leaves_go_with_it(mapped: SemanticMap) -> None:
    inner = ((3.25, 0.25), (5.45, 0.25), (5.45, 1.75), (3.25, 1.75))
    result = apply_edits(mapped, [MarkPhantom(inner)])
    assert len(result.map.rooms) == 1
    assert not shapely.intersects(result.map.rooms[0].polygon, rectangle(3.5, 0.3, 5.4, 1.7))
