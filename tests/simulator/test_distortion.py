"""How maps are bent: smoothly, nearly rigidly, and back again."""

from dataclasses import replace
from math import radians

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stillroom.simulator.building import draw_home
from stillroom.simulator.distortion import Distortion, distortion_at
from stillroom.simulator.effects import Effects, Streams
from stillroom.simulator.homes import Home

JITTER = replace(Effects.NONE, jitter_m=0.04, jitter_deg=0.4)


@pytest.fixture(scope="module")
def home() -> Home:
    return draw_home(np.random.default_rng(2), 8)


def places(home: Home, count: int = 500) -> np.ndarray:
    x0, y0, x1, y1 = home.walls.bounds
    return np.random.default_rng(0).uniform((x0, y0), (x1, y1), (count, 2))


@settings(max_examples=20)
@given(st.integers(0, 2**32 - 1), st.integers(0, 20))
def test_undoing_takes_every_point_back_to_where_it_came_from(seed: int, mission: int) -> None:
    home = draw_home(np.random.default_rng(2), 8)
    effects = replace(JITTER, drift_m=0.5, drift_deg=30.0)
    bent = distortion_at(home, mission, effects, Streams(seed))
    there = places(home)
    assert np.abs(bent.undo(bent.apply(there)) - there).max() < 1e-6


def test_without_jitter_and_drift_nothing_moves(home: Home) -> None:
    assert np.array_equal(distortion_at(home, 9, Effects.NONE, Streams(1)).apply(places(home)), places(home))


def test_what_lies_together_moves_together(home: Home) -> None:
    bent, here = distortion_at(home, 3, JITTER, Streams(1)), places(home)
    near = here + np.array([0.5, 0.0])
    stretch = np.linalg.norm(bent.apply(near) - bent.apply(here), axis=1) / 0.5
    moved = np.linalg.norm(bent.apply(here) - here, axis=1)
    assert moved.max() > 0.02
    assert np.abs(stretch - 1).max() < 0.05


def test_a_turned_sub_map_turns_what_is_around_it() -> None:
    turn = radians(2.0)
    bent = Distortion(np.array([[1.0, 2.0]]), np.array([[0.1, 0.0]]), np.array([turn]))
    moved = bent.apply(np.array([[1.0, 2.0], [2.0, 2.0]]))
    assert moved[0] == pytest.approx((1.1, 2.0))
    assert moved[1] == pytest.approx((1.1 + np.cos(turn), 2.0 + np.sin(turn)))


def test_sub_maps_wander_but_stay_about_their_places(home: Home) -> None:
    shifts = np.array([distortion_at(home, mission, JITTER, Streams(4)).shifts for mission in range(40)])
    steps = np.diff(shifts, axis=0)
    assert shifts.std() == pytest.approx(JITTER.jitter_m, rel=0.2)
    assert 0.2 * JITTER.jitter_m < steps.std() < 0.8 * JITTER.jitter_m


def test_a_frame_drifts_farther_and_farther(home: Home) -> None:
    effects = replace(Effects.NONE, drift_m=0.1, drift_deg=1.0)
    frames = [distortion_at(home, mission, effects, Streams(4)).frame for mission in (0, 1, 60)]
    lengths = [float(np.hypot(frame.x, frame.y)) for frame in frames]
    assert lengths[0] == 0.0 < lengths[1] < lengths[2]
