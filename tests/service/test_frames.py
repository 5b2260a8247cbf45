"""Frames of versions form a tree; between any two of them there is one motion."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from stillroom.maps.geometry import Pose
from stillroom.maps.motion import Motion
from stillroom.service.frames import Step, motion_between

POINTS = np.array([[0.0, 0.0], [3.0, 1.0], [-2.0, 4.0]])


@st.composite
def trees(draw: st.DrawFn) -> tuple[dict[int, Step], dict[int, Pose]]:
    """Versions 1..n with their steps, and where each one's frame lies in that of version 1."""
    steps: dict[int, Step] = {1: (None, None)}
    poses = {1: Pose()}
    small = st.floats(-2, 2)
    for number in range(2, draw(st.integers(2, 9))):
        older = draw(st.integers(1, number - 1))
        motion = draw(st.none() | st.builds(Pose, small, small, st.floats(-3, 3)))
        steps[number] = (older, None if motion is None else Motion.rigid(motion))
        poses[number] = poses[older] if motion is None else motion.after(poses[older])
    return steps, poses


@given(trees(), st.data())
def test_the_motion_between_two_versions_is_the_difference_of_their_frames(
    tree: tuple[dict[int, Step], dict[int, Pose]], data: st.DataObject
) -> None:
    steps, poses = tree
    start, end = (data.draw(st.sampled_from(sorted(poses))) for _ in range(2))
    motion = motion_between(steps.get, start, end)
    assert motion is not None
    expected = poses[end].after(poses[start].inverse()).apply(POINTS)
    assert np.allclose(motion.apply(POINTS), expected, atol=1e-6)


def test_versions_without_a_frame_in_common_have_no_motion_between_them() -> None:
    steps: dict[int, Step] = {1: (None, None), 2: (None, None)}
    assert motion_between(steps.get, 1, 2) is None


def test_a_version_that_is_not_known_has_no_motion() -> None:
    steps: dict[int, Step] = {1: (None, None)}
    assert motion_between(steps.get, 1, 7) is None


def test_where_nothing_moved_points_stay_exactly_where_they_are() -> None:
    steps: dict[int, Step] = {1: (None, None), 2: (1, None), 3: (2, None)}
    motion = motion_between(steps.get, 3, 1)
    assert motion is not None
    assert np.array_equal(motion.apply(POINTS), POINTS)
