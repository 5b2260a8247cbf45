"""What the walls in a grid say about where the map before lies on it."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from stillroom.maps.geometry import Pose
from stillroom.maps.motion import Motion
from stillroom.maps.semantics import Ids
from stillroom.pipeline import alignment
from stillroom.pipeline.alignment import align
from stillroom.pipeline.creation import create_map
from stillroom.pipeline.params import PARAMS
from tests.golden.homes import FOUR_ROOMS

HOME = FOUR_ROOMS.grid
BEFORE = create_map(HOME, "0", Ids())
SLID = Pose(0.08, -0.05)
MOVED = replace(HOME, frame=replace(HOME.frame, origin=SLID.after(HOME.frame.origin)))


def test_walls_say_how_far_a_robot_slid() -> None:
    found = align(BEFORE, Motion.rigid(Pose()), MOVED, PARAMS.alignment_reach_m, PARAMS)
    assert_allclose(found.motion.apply(BEFORE.vertices()), SLID.apply(BEFORE.vertices()), atol=0.02)
    assert found.share > 0.95
    assert found.seen > 0.95


@pytest.mark.parametrize("block", [1, 7])
def test_places_that_are_looked_at_in_parts_shift_as_all_together(block: int, monkeypatch: pytest.MonkeyPatch) -> None:
    bent = Motion(
        BEFORE.vertices(), BEFORE.vertices() + np.random.default_rng(0).normal(0, 0.03, BEFORE.vertices().shape)
    )
    whole = align(BEFORE, bent, MOVED, PARAMS.alignment_reach_m, PARAMS)
    monkeypatch.setattr(alignment, "BLOCK", block)
    parts = align(BEFORE, bent, MOVED, PARAMS.alignment_reach_m, PARAMS)
    assert_allclose(parts.motion.target, whole.motion.target, atol=1e-4)
