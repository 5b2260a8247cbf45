"""Laws that hold for every input."""

import copy

import numpy as np
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from stillroom.maps.constraints import violations
from stillroom.maps.geometry import Pose
from stillroom.maps.grid import Cell, OccupancyGrid, look_up
from stillroom.maps.mission import Tracking
from stillroom.maps.semantics import Ids, SemanticMap
from stillroom.pipeline.creation import create_map
from stillroom.pipeline.obstacles import corrected
from stillroom.pipeline.params import PARAMS
from stillroom.pipeline.update import RESOLVERS, MapUpdate, ResolverName, update_map
from tests.drawing import paint, rectangle
from tests.golden.homes import FOUR_ROOMS
from tests.grids import any_grid
from tests.missions import mission, random_pose, sense, track_all


@settings(max_examples=150)
@given(any_grid())
def test_a_map_created_from_any_grid_keeps_every_constraint(grid: OccupancyGrid) -> None:
    semantic_map = create_map(grid, "1", Ids())
    assert violations(semantic_map, grid, PARAMS.wall_reach_m) == ()
    ids = [room.id for room in semantic_map.rooms] + [divider.id for divider in semantic_map.dividers]
    ids += [wall.id for wall in semantic_map.walls] + [item.id for item in semantic_map.clutter]
    assert len(set(ids)) == len(ids)


@settings(max_examples=60)
@given(any_grid(50), any_grid(50), st.integers(0, 2**32), st.sampled_from(["same", "sensed", "other"]), st.booleans())
def test_an_update_with_any_grid_is_taken_whole_and_valid_or_not_at_all(
    first: OccupancyGrid, other: OccupancyGrid, seed: int, kind: str, tracked: bool
) -> None:
    rng = np.random.default_rng(seed)
    pose = random_pose(rng, 0.1, 0.05) if kind == "sensed" else Pose()
    grid = {"same": first, "sensed": sense(first, pose, rng), "other": other}[kind]
    previous = create_map(first, "1", Ids())
    tracking = track_all(previous, pose, rng, 0.05) if tracked else Tracking()
    cells, before = grid.cells.copy(), copy.deepcopy(previous)
    update = update_map(previous, mission("2", previous, tracking, grid))
    assert (grid.cells == cells).all()
    assert not grid.cells.flags.writeable
    assert previous == before
    if update.taken:
        assert violations(update.map, corrected(grid, update.map.meta.occupancy), PARAMS.wall_reach_m) == ()
        assert all(score.passed for score in update.rooms)
        assert {score.id for score in update.rooms} == {room.id for room in previous.rooms}
        assert update.outcome == ("resolved" if update.map.meta.corrects else "updated")
    else:
        assert update.map is previous
        assert update.outcome in ("needs_review", "reverted", "parked")
    assert_conflicts_are_whole(update)


def assert_conflicts_are_whole(update: MapUpdate) -> None:
    """Ids that are unique, sentences for a person, and proposals that could be in force."""
    ids = [conflict.id for conflict in update.conflicts]
    assert len(set(ids)) == len(ids)
    for conflict in update.conflicts:
        assert conflict.summary[:1].isupper() or conflict.summary[:1].isdigit()
        assert conflict.summary.endswith(".")
        assert [proposal.id for proposal in conflict.proposals] == [f"p{n + 1}" for n in range(len(conflict.proposals))]
    choices = {proposal.action for conflict in update.conflicts for proposal in conflict.proposals}
    if not update.taken:
        assert (update.outcome == "needs_review") == bool(choices - {"keep_previous"})


FOUR = create_map(FOUR_ROOMS.grid, "0", Ids())
places = st.tuples(st.floats(0.2, 8.0), st.floats(0.2, 4.4), st.floats(0.2, 2.0), st.floats(0.2, 2.0))


@settings(max_examples=40)
@given(
    st.lists(st.tuples(places, st.sampled_from(list(Cell))), min_size=1, max_size=4),
    st.integers(0, 2**32),
    st.sampled_from([RESOLVERS, RESOLVERS[:1], ()]),
)
def test_whatever_changes_in_a_home_the_answer_is_whole(
    changes: list[tuple[tuple[float, float, float, float], Cell]], seed: int, resolvers: tuple[ResolverName, ...]
) -> None:
    """Pieces of the home freed, blocked or unseen: the grid, the previous map, the candidate and every proposal keep their word."""
    rng = np.random.default_rng(seed)
    grid = sense(FOUR_ROOMS.grid, Pose(), rng, 0.05)
    for (x, y, width, height), cell in changes:
        grid = paint(grid, cell, rectangle(x, y, x + width, y + height))
    cells = grid.cells.copy()
    sent = mission("1", FOUR, track_all(FOUR, Pose(), rng, 0.03), grid)
    update = update_map(FOUR, sent, resolvers=resolvers)
    assert (grid.cells == cells).all()
    assert not grid.cells.flags.writeable
    assert create_map(FOUR_ROOMS.grid, "0", Ids()) == FOUR
    assert update.taken or update.map is FOUR
    assert_conflicts_are_whole(update)
    assert update.conflicts == update_map(FOUR, sent, resolvers=resolvers).conflicts
    for conflict in update.conflicts:
        for proposal in conflict.proposals:
            if proposal.map is not FOUR:
                assert violations(proposal.map, corrected(grid, proposal.map.meta.occupancy), PARAMS.wall_reach_m) == ()
    if update.taken:
        assert {room.id for room in FOUR.rooms} <= {room.id for room in update.map.rooms}
        assert_walls_rest_on_what_was_sensed(update.map, grid)
        assert resolvers or not update.map.meta.corrects


def assert_walls_rest_on_what_was_sensed(semantic_map: SemanticMap, grid: OccupancyGrid) -> None:
    """Away from the meta-occupancy, every wall lies near cells that the robot sensed as occupied: the meta layer can be dropped."""
    corrections = shapely.union_all([o.polygon for o in semantic_map.meta.occupancy])
    reach = PARAMS.wall_reach_m + 3 * grid.frame.resolution
    for wall in semantic_map.walls:
        if wall.kind == "wall":
            samples = shapely.get_coordinates(shapely.segmentize(shapely.LineString(wall.line), 0.1))
            far = shapely.distance(shapely.points(samples), corrections) > reach if corrections.area else np.True_
            gaps = look_up(grid.occupied_distance, grid.frame.to_cells_inside(samples), np.inf)
            assert (gaps[np.broadcast_to(far, gaps.shape)] <= reach).all(), wall.id
