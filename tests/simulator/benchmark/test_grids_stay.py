"""The robot owns raw occupancy: whatever comes of a mission, no stored grid is altered."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from stillroom.simulator.benchmark.trial import Household, Trial
from stillroom.simulator.severities import HARD


@settings(max_examples=4)
@given(st.integers(0, 2**16), st.integers(0, 50))
def test_no_mission_alters_a_grid_on_any_path(seed: int, robot: int) -> None:
    household = Household(Trial(seed, robot, 5, HARD, None))
    copies = {sortie.number: sortie.sensed.grid.cells.copy() for sortie in household.sorties}
    outcomes = {record.outcome for record in household.run()}
    assert "created" in outcomes
    for sortie in household.sorties:
        assert np.array_equal(sortie.sensed.grid.cells, copies[sortie.number])
        assert not sortie.sensed.grid.cells.flags.writeable
    for version in household.service.versions:
        assert np.array_equal(version.grid.cells, copies[version.mission])
