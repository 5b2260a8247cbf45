from math import pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from stillroom.maps import motion
from stillroom.maps.geometry import Pose
from stillroom.maps.motion import IDENTITY, Motion

lengths = st.floats(-20, 20)
poses = st.builds(Pose, lengths, lengths, st.floats(-pi, pi))
seeds = st.integers(0, 2**32)


def scattered(seed: int, count: int, spread: float = 3.0) -> np.ndarray:
    """Points (count, 2) on a lattice of a centimetre, all of them different."""
    points = np.random.default_rng(seed).normal(0, spread, (count, 2))
    return np.unique(np.round(points, 2), axis=0)


@given(poses, seeds)
def test_a_rigid_motion_moves_any_point_rigidly(pose: Pose, seed: int) -> None:
    points = scattered(seed, 10, 30)
    assert_allclose(Motion.rigid(pose).apply(points), pose.apply(points), atol=1e-6)


@given(poses, seeds, st.integers(2, 12))
def test_tracked_points_that_moved_rigidly_carry_every_other_point_rigidly(pose: Pose, seed: int, count: int) -> None:
    source = scattered(seed, count)
    others = scattered(seed + 1, 10, 10)
    if len(source) < 2:
        return
    motion = Motion.through(source, pose.apply(source))
    assert_allclose(motion.apply(others), pose.apply(others), atol=1e-5)


@given(seeds, st.integers(1, 30))
def test_tracked_points_move_exactly_as_tracked(seed: int, count: int) -> None:
    source = scattered(seed, count)
    target = source + np.random.default_rng(seed).normal(0, 0.3, source.shape)
    assert_allclose(Motion.through(source, target).apply(source), target, atol=1e-12)


@given(seeds)
def test_the_inverse_takes_tracked_points_back(seed: int) -> None:
    source = scattered(seed, 12)
    target = source + np.random.default_rng(seed).normal(0, 0.3, source.shape)
    motion = Motion.through(source, target)
    assert_allclose(motion.inverse().apply(motion.apply(source)), source, atol=1e-9)


@given(poses, poses, seeds)
def test_rigid_motions_one_after_another_are_both(second: Pose, first: Pose, seed: int) -> None:
    points = scattered(seed, 10)
    both = Motion.rigid(second).after(Motion.rigid(first))
    assert_allclose(both.apply(points), second.apply(first.apply(points)), atol=1e-5)


@given(seeds)
def test_motions_one_after_another_are_exact_at_the_first_ones_tracked_points(seed: int) -> None:
    rng = np.random.default_rng(seed)
    source = scattered(seed, 8)
    first = Motion.through(source, source + rng.normal(0, 0.2, source.shape))
    second = Motion.through(scattered(seed + 1, 8), np.add(scattered(seed + 1, 8), (0.3, 0.1)))
    assert_allclose(second.after(first).apply(source), second.apply(first.apply(source)), atol=1e-9)


def test_the_identity_is_neutral_before_and_after() -> None:
    points = scattered(1, 5)
    motion = Motion.rigid(Pose(1, 2, 0.3))
    assert_allclose(IDENTITY.apply(points), points)
    assert_allclose(motion.after(IDENTITY).apply(points), motion.apply(points))
    assert_allclose(IDENTITY.after(motion).apply(points), motion.apply(points))


def test_a_vertex_that_was_tracked_more_than_once_takes_the_mean() -> None:
    source = np.array([[1.0, 1.0], [1.0, 1.0], [4.0, 1.0]])
    target = np.array([[1.1, 1.0], [1.3, 1.2], [4.0, 1.0]])
    assert_allclose(Motion.through(source, target).apply(source), [[1.2, 1.1], [1.2, 1.1], [4.0, 1.0]])


def test_points_follow_what_was_tracked_near_them() -> None:
    left = np.array([[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 1.0]])
    right = np.add(left, (20.0, 0.0))
    motion = Motion.through(
        np.concatenate([left, right]), np.concatenate([np.add(left, (0.1, 0.0)), np.add(right, (0.0, 0.5))])
    )
    moved = motion.apply(np.array([[0.5, 0.5], [20.5, 0.5]]))
    assert_allclose(moved, [[0.6, 0.5], [20.5, 1.0]], atol=0.02)


def test_one_tracked_point_shifts_everything_alike() -> None:
    motion = Motion.through(np.array([[1.0, 1.0]]), np.array([[2.0, 0.5]]))
    assert_allclose(motion.apply(np.array([[10.0, 3.0]])), [[11.0, 2.5]])


def test_no_points_stay_no_points() -> None:
    assert Motion.rigid(Pose(1.0)).apply(np.zeros((0, 2))).shape == (0, 2)


def test_applying_a_motion_alters_neither_points_nor_motion() -> None:
    points, source = scattered(1, 5), scattered(2, 5)
    motion = Motion.through(source, source + 0.1)
    before, tracked = points.copy(), motion.source.copy()
    motion.apply(points)[:] = 7
    IDENTITY.apply(points)[:] = 7
    assert_allclose(points, before)
    assert_allclose(motion.source, tracked)


@given(seeds, st.integers(1, 500))
def test_points_that_are_looked_at_in_parts_move_as_all_together(seed: int, pairs: int) -> None:
    source, others = scattered(seed, 30), scattered(seed + 1, 40)
    moving = Motion(source, source + np.random.default_rng(seed).normal(0, 0.1, source.shape))
    whole = moving.apply(others), moving.consensus(others, 1.0, 0.2)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(motion, "MOST_PAIRS", pairs)
        assert_allclose(moving.apply(others), whole[0], atol=1e-9)
        assert_allclose(moving.consensus(others, 1.0, 0.2), whole[1], atol=1e-9)
