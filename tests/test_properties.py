"""Laws that hold for every input."""

import copy

import numpy as np
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from stillroom.maps.constraints import violations
from stillroom.maps.geometry import Pose
from stillroom.maps.grid import OccupancyGrid
from stillroom.maps.mission import Tracking
from stillroom.maps.semantics import Ids
from stillroom.pipeline.creation import create_map
from stillroom.pipeline.obstacles import corrected
from stillroom.pipeline.params import PARAMS
from stillroom.pipeline.update import MapUpdate, update_map
from tests.grids import any_grid
from tests.missions import mission, random_pose, sense, track_all


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(any_grid())
def test_a_map_created_from_any_grid_keeps_every_constraint(grid: OccupancyGrid) -> None:
    semantic_map = create_map(grid, "1", Ids())
    assert violations(semantic_map, grid, PARAMS.wall_reach_m) == ()
    ids = [room.id for room in semantic_map.rooms] + [divider.id for divider in semantic_map.dividers]
    ids += [wall.id for wall in semantic_map.walls] + [item.id for item in semantic_map.clutter]
    assert len(set(ids)) == len(ids)


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow])
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
