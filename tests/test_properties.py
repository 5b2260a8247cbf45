"""Laws that hold for every input."""

import numpy as np
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from stillroom.maps.constraints import violations
from stillroom.maps.geometry import Pose
from stillroom.maps.grid import OccupancyGrid
from stillroom.maps.mission import Tracking
from stillroom.maps.semantics import Ids
from stillroom.pipeline.creation import create_map
from stillroom.pipeline.params import PARAMS
from stillroom.pipeline.update import update_map
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
    update = update_map(previous, mission("2", previous, tracking, grid))
    if update.taken:
        assert violations(update.map, grid, PARAMS.wall_reach_m) == ()
        assert all(score.passed for score in update.rooms)
        assert {score.id for score in update.rooms} == {room.id for room in previous.rooms}
    else:
        assert update.map is previous
        assert update.outcome in ("reverted", "parked")
