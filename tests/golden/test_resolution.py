"""Conflict resolution, one case a figure of the paper and each way in which a home changes; and how long corrections stand."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
import shapely
from shapely import Polygon

from stillroom.maps.constraints import violations
from stillroom.maps.geometry import Pose
from stillroom.maps.grid import Cell, OccupancyGrid
from stillroom.maps.meta import MapMeta
from stillroom.maps.mission import Mission, Tracking, tracked_motion
from stillroom.maps.semantics import Ids, SemanticMap
from stillroom.pipeline.creation import create_map
from stillroom.pipeline.edits import AddDivider, RemoveDivider, apply_edits
from stillroom.pipeline.params import PARAMS
from stillroom.pipeline.update import MapUpdate, ResolverName, update_map
from tests.drawing import draw, paint, rectangle
from tests.golden.homes import FOUR_ROOMS, OPEN_PLAN
from tests.golden.uploads import (
    assert_all_kept,
    assert_valid,
    between,
    cells_of,
    conflicts_of,
    covers,
    first_map,
    kept,
    named,
    new_room,
    rows,
    upload,
    upload_untracked,
    uploads,
)
from tests.missions import mission, sense, track_all

HOME = FOUR_ROOMS.grid
BASE = first_map(FOUR_ROOMS, doors=[("A", "C")])
GAP = rectangle(3.2, 2.0, 4.0, 2.2)
"""0.8 m of the wall between A and C."""
GAPPED = paint(HOME, Cell.FREE, GAP)


# -- disconnected walls (Figures disconnected, disconnected_occ, wall_difference) ------------------------------------


def test_a_wall_in_pieces_is_put_together_again_from_what_was_wall_before() -> None:
    gaps = [rectangle(4.0, y, 4.2, y + 0.5) for y in (0.3, 1.4)]
    grid = paint(HOME, Cell.FREE, *gaps)
    update = upload(BASE, grid)
    assert (update.outcome, update.succeeded_at, rows(update)) == ("resolved", "meta_occupancy", (False, True, True))
    assert_all_kept(BASE, update, grid)
    assert update.map.meta.dividers == ()
    assert {o.cell for o in update.map.meta.occupancy} == {"occupied"}
    shapes = shapely.union_all([o.polygon for o in update.map.meta.occupancy])
    assert min(shapely.intersection(shapes, gap).area / gap.area for gap in gaps) > 0.8
    assert shapes.area < 2 * sum(gap.area for gap in gaps)


def test_what_was_not_sensed_of_a_wall_is_corrected_as_well_as_what_was_sensed_free() -> None:
    grid = paint(HOME, Cell.FREE, GAP.buffer(0.3, join_style="mitre") & rectangle(2.9, 1.9, 4.0, 2.3))
    unseen = paint(grid, Cell.UNEXPLORED, GAP)
    update = upload(BASE, unseen)
    assert_all_kept(BASE, update, unseen)


def test_the_robots_grid_says_free_where_the_meta_layer_says_wall() -> None:
    before = GAPPED.cells.copy()
    update = upload(BASE, GAPPED)
    assert update.outcome == "resolved"
    assert (GAPPED.cells == before).all()
    assert not GAPPED.cells.flags.writeable
    (correction,) = update.map.meta.occupancy
    assert Cell.FREE in cells_of(GAPPED, correction.polygon)


def test_without_the_meta_layer_the_walls_lie_on_what_was_sensed() -> None:
    update = upload(BASE, GAPPED)
    (correction,) = update.map.meta.occupancy
    walls = [wall for wall in update.map.walls if wall.kind == "wall"]
    far = [w for w in walls if not shapely.LineString(w.line).dwithin(correction.polygon, 0.1)]
    broken = violations(replace(update.map, walls=tuple(far), meta=MapMeta.EMPTY), GAPPED, PARAMS.wall_reach_m)
    assert [violation for violation in broken if violation.constraint.startswith("a wall")] == []


def test_a_gap_that_parts_nothing_is_not_corrected() -> None:
    other = rectangle(-0.05, 3.0, 0.25, 3.8)
    grid = paint(paint(GAPPED, Cell.FREE, other), Cell.UNEXPLORED, rectangle(-0.6, 2.8, -0.05, 4.0))
    update = upload(BASE, grid)
    assert_all_kept(BASE, update, grid)
    corrected = [o.polygon for o in update.map.meta.occupancy]
    assert max(covers(polygon, GAP) for polygon in corrected) > 0.8
    assert not any(polygon.intersects(other) for polygon in corrected)


def test_a_gap_beside_rooms_that_came_through_is_left_as_it_was_sensed() -> None:
    """Between A and B there is a divider anyway: an opening that grew a little fails no room."""
    grid = paint(HOME, Cell.FREE, rectangle(4.0, 2.4, 4.2, 2.8))
    update = upload(BASE, grid)
    assert (update.outcome, update.map.meta) == ("updated", MapMeta.EMPTY), update.reason
    assert_all_kept(BASE, update, grid)


# -- newly connected walls -------------------------------------------------------------------------------------------

LOBES = draw(
    """
    ##############################
    #.........#........#.........#
    #.........#........#.........#
    #.........#........#.........#
    #.........#........#.........#
    #....A.......................#
    #............................#
    #.........#........#.........#
    #.........#........#.........#
    #.........#........#.........#
    #.........#........#.........#
    ##############################
    """,
    margin=4,
)
"""One room of 5.6 x 2 m that a person left whole, with two narrowings of 0.4 m."""
SOCKETS = [rectangle(1.9, 1.0, 2.3, 1.4), rectangle(3.7, 1.0, 4.1, 1.4)]
"""What fills the narrowings from jamb to jamb."""


def one_room() -> SemanticMap:
    """The room of `LOBES`: if an algorithm divided it, a person removed the dividers."""
    created = create_map(LOBES.grid, "0", Ids())
    if created.dividers:
        created = apply_edits(created, [RemoveDivider(d.id) for d in created.dividers]).map
    assert len(created.rooms) == 1
    return replace(created, rooms=(replace(created.rooms[0], name="A", named_by="user"),))


def test_walls_that_look_connected_where_they_were_not_are_opened_by_free_corrections() -> None:
    base, grid = one_room(), paint(LOBES.grid, Cell.OCCUPIED, *SOCKETS)
    alone = upload(base, grid, resolvers=())
    assert rows(alone) == (False, False, False)
    update = upload(base, grid)
    assert (update.outcome, update.succeeded_at, rows(update)) == ("resolved", "meta_occupancy", (False, True, True))
    assert_all_kept(base, update, grid, 0.9)
    assert len(update.map.rooms) == 1
    assert {o.cell for o in update.map.meta.occupancy} == {"free"}
    shapes = shapely.union_all([o.polygon for o in update.map.meta.occupancy])
    assert all(shapes.intersects(thing) for thing in SOCKETS)
    assert shapely.difference(shapes, shapely.union_all(SOCKETS).buffer(0.05)).area < 0.01
    assert {conflict.cause for conflict in update.conflicts} == {"opening_closed"}


def test_openings_that_are_open_again_need_no_correction() -> None:
    base = one_room()
    closed, opened = uploads(base, [paint(LOBES.grid, Cell.OCCUPIED, *SOCKETS), LOBES.grid])
    assert closed.outcome == "resolved"
    assert (opened.outcome, opened.map.meta) == ("updated", MapMeta.EMPTY)
    assert_all_kept(base, opened, LOBES.grid)


def test_one_narrowing_that_is_closed_cuts_nothing_off() -> None:
    """More than half of the room would be left by itself; all of it is."""
    base, grid = one_room(), paint(LOBES.grid, Cell.OCCUPIED, SOCKETS[0])
    update = upload(base, grid)
    assert_all_kept(base, update, grid, 0.9)
    assert len(update.map.rooms) == 1


def test_the_transfer_alone_has_no_meta_layer() -> None:
    base, grid = one_room(), paint(LOBES.grid, Cell.OCCUPIED, SOCKETS[0])
    alone = upload(base, grid, resolvers=())
    assert (alone.outcome, alone.succeeded_at, alone.map.meta) == ("updated", "transfer", MapMeta.EMPTY)


def test_an_update_says_resolved_where_it_needed_more_than_the_transfer_and_only_there() -> None:
    base = one_room()
    for grid in (LOBES.grid, paint(LOBES.grid, Cell.OCCUPIED, SOCKETS[0]), paint(LOBES.grid, Cell.OCCUPIED, *SOCKETS)):
        update = upload(base, grid)
        assert update.taken
        assert (update.outcome == "updated") == (update.succeeded_at == "transfer") == rows(update)[0]


# -- additional dividers (Figure map_grow_conflict) ------------------------------------------------------------------

THREE = draw(
    """
    ########################################
    #............#............#............#
    #............#............#............#
    #............#............#............#
    #......A.....#.....B......#.....C......#
    #............#............#............#
    #............#............#............#
    #............#............#............#
    #............#............#............#
    ########################################
    """,
    margin=16,
)
"""Three rooms without a way between them; nothing was explored below."""


def three_rooms(below: Sequence[str]) -> OccupancyGrid:
    """`THREE` with other space below: rows of 40 characters, the first in the place of the rooms' lower wall."""
    text = ["########################################"]
    text += ["#............#............#............#"] * 8
    drawn = draw("\n".join([*text, *below]), margin=16 - len(below) + 1)
    frame, cells = drawn.grid.frame, np.zeros_like(THREE.grid.cells)
    top, side = 16 * 4, 16 * 4
    content = drawn.grid.cells
    inner = (16 - len(below) + 1) * 4
    body = content[inner : content.shape[0] - inner, inner : content.shape[1] - inner]
    cells[cells.shape[0] - top - body.shape[0] : cells.shape[0] - top, side : side + body.shape[1]] = body
    assert frame.resolution == THREE.grid.frame.resolution
    return OccupancyGrid(THREE.grid.frame, cells)


THREE_DOORS = three_rooms(
    [
        "#....####....#....####....#....####....#".replace("....####....", "####....####"),
        "#......................................#",
        "#......................................#",
        "#......................................#",
        "#......................................#",
        "#......................................#",
        "########################################",
    ]
)
"""Three ways of 0.8 m lead from a passage of 1 m, that was never seen, into the rooms."""
HALL = (
    "#......................................#",
    "#......................................#",
    "#......................................#",
    "#......................................#",
    "###...................................##",
    "  #...................................# ",
    "  #...................................# ",
    "  #...................................# ",
    "  ##############...####################  ",
    "               #...#                    ",
    "               #####                    ",
)
ONE_SPACE = three_rooms(["###.......####..........####..........##", *HALL])
"""The lower walls are gone for 1.4 to 2 m each, and a hall behind them joins the rooms."""
TO_THE_CORNER = three_rooms(["#.........####..........####..........##", *HALL])
"""The same, but A's lower wall is gone as far as the corner."""
PASSAGES = (
    pytest.param(THREE_DOORS, 0.2, id="doorways"),
    pytest.param(ONE_SPACE, 0.8, id="no walls"),
    pytest.param(TO_THE_CORNER, 0.8, id="to the corner"),
)


@pytest.mark.parametrize(("grid", "hall"), PASSAGES)
def test_a_passage_that_joins_rooms_leaves_them_as_they_were_and_is_a_new_room(
    grid: OccupancyGrid, hall: float
) -> None:
    base = first_map(THREE)
    update = upload(base, grid)
    assert_all_kept(base, update, grid, 0.9)
    assert rows(update)[2] is True
    room = new_room(update)
    assert room.id not in {r.id for r in base.rooms}
    assert covers(room.polygon, rectangle(0.8, -hall - 0.6, 7.2, -hall)) > 0.9
    parted = [d.rooms for d in update.map.meta.dividers] + [d.rooms for d in update.map.dividers]
    assert {room_id for sides in parted for room_id in sides} == {r.id for r in update.map.rooms}


# -- doors, furniture ------------------------------------------------------------------------------------------------

DOOR_AC = rectangle(1.15, 2.0, 2.05, 2.2)
OPENING_AB = rectangle(4.0, 2.75, 4.2, 3.65)


def test_an_opening_that_something_closed_keeps_both_rooms() -> None:
    grid = paint(HOME, Cell.OCCUPIED, OPENING_AB)
    update = upload(BASE, grid)
    assert_all_kept(BASE, update, grid)
    assert between(update.map, "A", "B").id == between(BASE, "A", "B").id


@pytest.mark.parametrize("half", [rectangle(4.0, 2.75, 4.2, 3.2), rectangle(4.0, 3.2, 4.2, 3.65)])
def test_a_half_blocked_doorway_keeps_both_rooms_and_its_divider(half: Polygon) -> None:
    grid = paint(HOME, Cell.OCCUPIED, half)
    update = upload(BASE, grid)
    assert update.outcome == "updated", update.reason
    assert_all_kept(BASE, update, grid)
    assert between(update.map, "A", "B").id == between(BASE, "A", "B").id


def test_a_shut_door_keeps_its_room_asks_nothing_and_counts_as_no_failure() -> None:
    """Journey 2: behind the door nothing was seen."""
    grid = paint(paint(HOME, Cell.OCCUPIED, DOOR_AC), Cell.UNEXPLORED, rectangle(-1, -1, 4.0, 2.0))
    update = upload(BASE, grid)
    assert (update.outcome, rows(update)) == ("updated", (True, True, True))
    assert update.conflicts == ()
    assert {score.name: (score.visited, score.passed) for score in update.rooms}["C"] == (False, True)
    assert named(update.map, "C").last_visited == "0"
    again = upload(update.map, HOME, number=2)
    assert (again.outcome, again.conflicts) == ("updated", ())
    assert named(again.map, "C").last_visited == "2"
    assert_all_kept(BASE, again, HOME)


def test_furniture_removed_from_a_wall_moves_no_room() -> None:
    cupboard = rectangle(0.2, 3.4, 0.7, 4.4)
    home = paint(HOME, Cell.OCCUPIED, cupboard)
    before = upload(BASE, home).map
    update = upload(before, HOME, number=2)
    assert (update.outcome, update.map.meta) == ("updated", MapMeta.EMPTY), update.reason
    assert_all_kept(before, update, HOME, 0.9)
    assert covers(named(update.map, "A").polygon, cupboard) > 0.9


def test_furniture_that_moves_to_another_wall_changes_no_rooms_shape() -> None:
    """Journey 7: clutter moves with the sofa."""
    here, there = rectangle(5.0, 2.2, 6.3, 3.0), rectangle(4.4, 3.9, 5.9, 4.4)
    before = upload(BASE, paint(HOME, Cell.OCCUPIED, here)).map
    grid = paint(HOME, Cell.OCCUPIED, there)
    update = upload(before, grid, number=2)
    assert_all_kept(BASE, update, grid, 0.93)
    clutter = shapely.union_all([item.polygon for item in update.map.clutter])
    assert shapely.intersection(clutter, here).area < 0.05


def test_a_wall_that_opened_beside_a_bed_that_moved_is_parted_along_the_wall() -> None:
    """Not around where the bed stood: the lost room's boundary was the bed's edge there, its neighbour's was the wall."""
    bed = rectangle(1.8, 3.1, 4.0, 4.4)
    before = upload(BASE, HOME).map
    base = create_map(paint(HOME, Cell.OCCUPIED, bed), "0", Ids())
    a, b = (min(base.rooms, key=lambda r: -covers(r.polygon, named(before, name).polygon)) for name in "AB")
    grid = paint(HOME, Cell.FREE, rectangle(4.0, 2.2, 4.2, 4.4))
    update = upload(base, grid)
    assert update.outcome == "resolved", update.reason
    rooms = {room.id: room.polygon for room in update.map.rooms}
    assert covers(rooms[a.id], bed) > 0.95
    assert shapely.intersection(rooms[b.id], bed).area < 0.01
    assert sum(d.shape.length for d in update.map.meta.dividers) < 3.0


# -- open plan -------------------------------------------------------------------------------------------------------


def divided() -> SemanticMap:
    """The room of `OPEN_PLAN`, 5.6 x 3 m, in two by a person where there is no wall."""
    base = apply_edits(first_map(OPEN_PLAN), [AddDivider(((3.6, 0.1), (3.6, 3.3)))]).map
    assert len(base.rooms) == 2
    return replace(base, rooms=tuple(replace(r, name=f"Part {r.id}") for r in base.rooms))


@pytest.mark.parametrize("seed", range(3))
def test_a_room_that_a_person_divided_where_no_wall_is_stays_divided(seed: int) -> None:
    base, rng = divided(), np.random.default_rng(seed)
    sofa = rectangle(1.0 + seed, 1.0, 2.5 + seed, 1.8)
    grid = sense(paint(OPEN_PLAN.grid, Cell.OCCUPIED, sofa), Pose(), rng, 0.1)
    update = upload(base, grid, noise_m=0.03, seed=seed)
    assert update.outcome == "updated", update.reason
    assert_all_kept(base, update, grid, 0.93)
    (divider,) = update.map.dividers
    assert (divider.id, divider.made_by) == (base.dividers[0].id, "user")


# -- thin, diagonal, wrong and missing -------------------------------------------------------------------------------

THIN = draw(
    "\n".join(
        [
            "#" * 81,
            *["#" + "." * 39 + "#" + "." * 39 + "#"] * 30,
            *["#" + "." * 79 + "#"] * 16,
            *["#" + "." * 39 + "#" + "." * 39 + "#"] * 30,
            "#" + "." * 20 + "A" + "." * 18 + "#" + "." * 20 + "B" + "." * 18 + "#",
            "#" * 81,
        ]
    ),
    cells=1,
    margin=20,
)
"""Two rooms behind walls of a single cell, 5 cm."""


@pytest.mark.parametrize("seed", range(3))
def test_walls_of_a_single_cell_carry_rooms(seed: int) -> None:
    base = first_map(THIN)
    update = upload(base, THIN.grid, Pose(0.04, -0.03), noise_m=0.03, seed=seed)
    assert update.taken
    assert min(kept(base, update.map).values()) > 0.95
    assert_valid(update.map, THIN.grid)


def test_a_gap_in_a_wall_of_a_single_cell_is_corrected() -> None:
    base = first_map(THIN)
    grid = paint(THIN.grid, Cell.FREE, rectangle(1.95, 0.4, 2.1, 1.2))
    update = upload(base, grid)
    assert_all_kept(base, update, grid)


def turned(grid: OccupancyGrid, degrees: float) -> OccupancyGrid:
    """A home that stands askew to its grid."""
    larger = draw("#", cells=1, origin=Pose(-5, -3)).grid
    larger = OccupancyGrid(replace(larger.frame, width=300, height=260), np.zeros((260, 300), np.uint8))
    return OccupancyGrid(larger.frame, _onto(grid, larger, Pose(yaw=np.radians(degrees))))


def _onto(grid: OccupancyGrid, larger: OccupancyGrid, pose: Pose) -> np.ndarray:
    frame = larger.frame
    columns, rows_ = np.meshgrid(np.arange(frame.width) + 0.5, np.arange(frame.height) + 0.5)
    places = pose.inverse().apply(frame.to_map(np.stack([columns.ravel(), rows_.ravel()], 1)))
    cells = np.floor(grid.frame.to_cells(places)).astype(int)
    inside = ((cells >= 0) & (cells < (grid.frame.width, grid.frame.height))).all(1)
    values = np.zeros(len(cells), np.uint8)
    values[inside] = grid.cells[cells[inside, 1], cells[inside, 0]]
    return values.reshape(frame.height, frame.width)


def test_a_gap_in_a_home_that_stands_askew_to_its_grid_is_corrected() -> None:
    pose = Pose(yaw=np.radians(30))
    askew = turned(HOME, 30)
    here = upload_in(BASE, askew, pose)
    assert min(kept(BASE, here.map, pose).values()) > 0.95
    gap = shapely.transform(GAP, pose.apply)
    grid = paint(askew, Cell.FREE, gap.buffer(0.03, join_style="mitre"))
    update = upload(here.map, grid, number=2)
    assert_all_kept(here.map, update, grid)
    assert (update.succeeded_at, rows(update)) == ("meta_occupancy", (False, True, True))


def upload_in(base: SemanticMap, grid: OccupancyGrid, pose: Pose) -> MapUpdate:
    update = upload(base, grid, pose)
    assert update.taken, update.reason
    return update


@pytest.mark.parametrize("off", [(1.5, 0.0), (-0.9, 1.2), (0.0, -3.0)])
def test_a_vertex_that_was_tracked_grossly_wrong_moves_no_wall(off: tuple[float, float]) -> None:
    for room in BASE.rooms:
        tracking = track_all(BASE, Pose(), np.random.default_rng(0), 0.01)
        points = tracking.rooms[room.id].copy()
        points[1] += off
        wrong = Tracking(rooms={**tracking.rooms, room.id: points}, dividers=tracking.dividers)
        motion, _ = tracked_motion(BASE, wrong)
        update = update_map(BASE, Mission("1", HOME, motion))
        assert_all_kept(BASE, update, HOME)
        assert update.outcome == "updated"


def test_a_gap_is_corrected_where_nothing_was_tracked_at_all() -> None:
    pose = Pose(0.3, 0.2, 0.05)
    grid = sense(GAPPED, pose, np.random.default_rng(5), 0.0)
    update = upload_untracked(BASE, grid)
    assert (update.outcome, update.succeeded_at) == ("resolved", "meta_occupancy"), update.reason
    assert min(kept(BASE, update.map, pose).values()) > 0.93


# -- wrecked grids, other floors -------------------------------------------------------------------------------------


def test_a_grid_with_its_walls_twice_is_no_map_and_is_kept_out() -> None:
    copy = sense(HOME, Pose(0.5, 0.35, 0.12), np.random.default_rng(1), 0.0)
    cells = np.where(copy.cells == Cell.OCCUPIED, np.uint8(Cell.OCCUPIED), HOME.cells)
    cells = np.where((HOME.cells == Cell.UNEXPLORED) & (copy.cells == Cell.FREE), np.uint8(Cell.FREE), cells)
    update = upload(BASE, OccupancyGrid(HOME.frame, cells))
    assert (update.outcome, update.taken) == ("reverted", False), update.reason
    assert update.map is BASE
    assert [conflict.kind for conflict in update.conflicts] == ["wrong_map"]


UPSTAIRS = draw(
    """
                   #####################
                   #...................#
    ################...................#
    #.........#........................#
    #.........#........#...............#
    #.........#........#...............#
    #.........#........##########..#####
    #.........####..####...............#
    #..................................#
    #..................................#
    #.........##########..##############
    #.........#..............#
    ####..#####..............#
       #.....................#
       #......#..............#
       #......#..............#
       #......#..............#
       #......#..............#
       #......################
       ########
    """,
    margin=8,
)


def test_another_floor_is_parked_with_or_without_tracking() -> None:
    for update in (upload(BASE, UPSTAIRS.grid), upload_untracked(BASE, UPSTAIRS.grid)):
        assert (update.outcome, update.taken, update.map is BASE) == ("parked", False, True), update.reason
        assert [conflict.kind for conflict in update.conflicts] == ["wrong_map"]


# -- the results table's rows ----------------------------------------------------------------------------------------

BREACH = paint(HOME, Cell.FREE, rectangle(4.2, 1.95, 6.4, 2.25))
"""2.2 m of the wall between B and D are gone: too much for meta-occupancy."""
ROWS: list[tuple[tuple[ResolverName, ...], OccupancyGrid, tuple[bool, bool, bool]]] = [
    ((), HOME, (True, True, True)),
    ((), GAPPED, (False, False, False)),
    (("meta_occupancy",), GAPPED, (False, True, True)),
    (("meta_occupancy",), BREACH, (False, False, False)),
    (("meta_dividers",), GAPPED, (False, False, True)),
    (("meta_occupancy", "meta_dividers"), BREACH, (False, False, True)),
]


@pytest.mark.parametrize(("resolvers", "grid", "expected"), ROWS)
def test_fewer_resolvers_give_the_other_rows_of_the_results_table(
    resolvers: tuple[ResolverName, ...], grid: OccupancyGrid, expected: tuple[bool, bool, bool]
) -> None:
    update = upload(BASE, grid, resolvers=resolvers)
    assert rows(update) == expected
    assert update.taken == expected[2]
    if not update.taken:
        assert update.map is BASE
        assert update.outcome in ("reverted", "needs_review")
        assert update.succeeded_at is None


def test_a_mission_that_is_not_taken_asks_where_there_is_a_choice_and_says_what_was_lost() -> None:
    update = upload(BASE, BREACH, resolvers=())
    choices = {p.action for conflict in update.conflicts for p in conflict.proposals}
    assert "keep_previous" in choices
    assert update.outcome == ("needs_review" if choices - {"keep_previous"} else "reverted")
    lost = [score.name for score in update.rooms if not score.passed]
    assert lost
    assert all(name in update.reason for name in lost)


def test_an_owners_line_parts_what_the_robot_finds_in_one() -> None:
    """Without any resolver the mission would not be taken; with a divider where the wall was it is, and the divider is the owner's."""
    tracking = track_all(BASE, Pose(), np.random.default_rng(0), 0.0)
    line = ((4.2, 2.1), (6.6, 2.1))
    sent = mission("1", BASE, tracking, BREACH)
    update = update_map(BASE, sent, resolvers=(), annotations=[line])
    assert update.taken, update.reason
    assert min(kept(BASE, update.map).values()) > 0.93
    drawn = [d for d in update.map.dividers if BASE.divider(d.id) is None]
    assert any(
        d.made_by == "user" and shapely.LineString(d.line).distance(shapely.LineString(line)) < 0.1 for d in drawn
    )
    assert not update_map(BASE, sent, resolvers=()).taken


# -- the meta layer lives --------------------------------------------------------------------------------------------


def test_a_correction_stands_since_the_mission_that_first_needed_it_and_goes_when_the_wall_is_sensed_again() -> None:
    first, second, third, healed, again = uploads(BASE, [GAPPED, GAPPED, GAPPED, HOME, GAPPED], noise_m=0.02)
    standing = [update.map.meta.occupancy for update in (first, second, third)]
    assert [[(o.id, o.since) for o in layer] for layer in standing] == [[(standing[0][0].id, "1")]] * 3
    assert (healed.outcome, healed.map.meta) == ("updated", MapMeta.EMPTY)
    (correction,) = again.map.meta.occupancy
    assert (correction.since, correction.id != standing[0][0].id) == ("5", True)
    assert_all_kept(BASE, again, GAPPED)


def test_corrections_of_other_places_have_ids_of_their_own() -> None:
    elsewhere = paint(HOME, Cell.FREE, rectangle(4.0, 0.6, 4.2, 1.4))
    first, second = uploads(BASE, [GAPPED, elsewhere])
    (here,), (there,) = first.map.meta.occupancy, second.map.meta.occupancy
    assert here.id != there.id
    assert (here.since, there.since, there.contradicted <= 1) == ("1", "2", True)


def test_a_correction_that_five_missions_contradicted_becomes_a_question() -> None:
    asked = []
    for update in uploads(BASE, [GAPPED] * 6):
        (correction,) = update.map.meta.occupancy
        questions = conflicts_of(update, "connectivity")
        asked.append((correction.contradicted, len(questions)))
        for question in questions:
            assert {score.name for score in question.rooms} >= {"A", "C"}
            assert "1" in question.summary
            assert not question.resolved
    assert asked == [(1, 0), (2, 0), (3, 0), (4, 0), (5, 1), (6, 1)]


def test_a_meta_divider_that_five_missions_contradicted_becomes_a_question_too() -> None:
    *others, fourth, fifth = uploads(BASE, [BREACH] * 5)
    assert all(not conflicts_of(update, "connectivity") for update in (*others, fourth))
    questions = conflicts_of(fifth, "connectivity")
    assert questions
    for question in questions:
        assert {score.name for score in question.rooms} <= {"B", "D"}
        for proposal in question.proposals:
            assert_valid(proposal.map, BREACH)


def test_a_mission_that_saw_nothing_there_contradicts_nothing() -> None:
    first = upload(BASE, GAPPED)
    unseen = paint(GAPPED, Cell.UNEXPLORED, GAP.buffer(0.02, join_style="mitre"))
    second = upload(first.map, unseen, number=2)
    assert second.taken
    assert all(o.contradicted == first.map.meta.occupancy[0].contradicted for o in second.map.meta.occupancy)
    assert_all_kept(BASE, second, unseen)


# -- what a person reads ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("grid", [GAPPED, BREACH], ids=["gap", "breach"])
def test_a_conflict_that_the_meta_layer_settled_says_so_and_can_be_turned_down(grid: OccupancyGrid) -> None:
    update = upload(BASE, grid)
    lost = [c for c in update.conflicts if c.kind in ("room_lost", "room_recall", "room_precision")]
    assert lost
    for conflict in lost:
        assert conflict.resolved
        assert conflict.cause in ("wall_gap", "new_passage")
        assert conflict.summary.endswith(".")
        assert any(score.name in conflict.summary for score in conflict.rooms)
        first, *rest = conflict.proposals
        assert (first.recommended, first.map) == (True, update.map)
        assert [p.action for p in rest] == ["take_new"]
        for proposal in conflict.proposals:
            assert_valid(proposal.map, grid)


@pytest.mark.parametrize("grid", [GAPPED, BREACH, HOME], ids=["gap", "breach", "same"])
def test_the_same_mission_gives_the_same_conflicts_and_another_gives_others(grid: OccupancyGrid) -> None:
    first, second, other = upload(BASE, grid), upload(BASE, grid), upload(BASE, grid, number=2)
    assert first.conflicts == second.conflicts
    ids = [conflict.id for conflict in first.conflicts]
    assert len(set(ids)) == len(ids)
    assert not set(ids) & {conflict.id for conflict in other.conflicts}
    assert mission("1", BASE, Tracking(), grid).grid is grid
