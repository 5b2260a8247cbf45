"""Laws that hold for every input."""

from hypothesis import HealthCheck, given, settings

from stillroom.maps.constraints import violations
from stillroom.maps.grid import OccupancyGrid
from stillroom.maps.semantics import Ids
from stillroom.pipeline.creation import create_map
from stillroom.pipeline.params import PARAMS
from tests.grids import any_grid


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(any_grid())
def test_a_map_created_from_any_grid_keeps_every_constraint(grid: OccupancyGrid) -> None:
    semantic_map = create_map(grid, "1", Ids())
    assert violations(semantic_map, grid, PARAMS.wall_reach_m) == ()
    ids = [room.id for room in semantic_map.rooms] + [divider.id for divider in semantic_map.dividers]
    ids += [wall.id for wall in semantic_map.walls] + [item.id for item in semantic_map.clutter]
    assert len(set(ids)) == len(ids)
