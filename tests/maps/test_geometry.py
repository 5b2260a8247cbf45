from math import pi

import numpy as np
import pytest
import shapely
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from shapely import GeometryCollection, LineString, MultiPolygon

from stillroom.maps.geometry import Pose, as_line, as_points, distinct, fit_pose, line_strings, polygons_in
from tests.drawing import rectangle

lengths = st.floats(-50, 50)
poses = st.builds(Pose, lengths, lengths, st.floats(-10, 10))
clouds = st.lists(st.tuples(lengths, lengths), min_size=1, max_size=8).map(np.array)


def test_a_pose_turns_counter_clockwise_and_then_shifts() -> None:
    assert_allclose(Pose(1, 2, pi / 2).apply(np.array([[1.0, 0.0]])), [[1, 3]], atol=1e-12)


@given(poses, clouds)
def test_the_inverse_of_a_pose_undoes_it(pose: Pose, points: np.ndarray) -> None:
    assert_allclose(pose.inverse().apply(pose.apply(points)), points, atol=1e-9)
    assert_allclose(pose.apply(pose.inverse().apply(points)), points, atol=1e-9)


@given(poses, poses, clouds)
def test_one_pose_after_another_is_both_in_that_order(second: Pose, first: Pose, points: np.ndarray) -> None:
    assert_allclose(second.after(first).apply(points), second.apply(first.apply(points)), atol=1e-9)


@given(poses, poses, poses, clouds)
def test_composing_poses_is_associative(a: Pose, b: Pose, c: Pose, points: np.ndarray) -> None:
    assert_allclose(a.after(b).after(c).apply(points), a.after(b.after(c)).apply(points), atol=1e-8)


@given(poses, clouds)
def test_the_fit_finds_the_motion_that_moved_the_points(pose: Pose, points: np.ndarray) -> None:
    assume(len(points) == 1 or np.ptp(points, axis=0).max() > 0.01)
    assert_allclose(fit_pose(points, pose.apply(points)).apply(points), pose.apply(points), atol=1e-6)


@given(poses, st.data())
def test_the_fit_is_the_least_squares_optimum(pose: Pose, data: st.DataObject) -> None:
    rng = np.random.default_rng(data.draw(st.integers(0, 2**32)))
    source = rng.normal(0, 2, (6, 2))
    target = pose.apply(source) + rng.normal(0, 0.1, (6, 2))
    weights = rng.random(6) + 0.1

    def cost(candidate: Pose) -> float:
        return float((weights * ((candidate.apply(source) - target) ** 2).sum(1)).sum())

    best = fit_pose(source, target, weights)
    for nudge in (Pose(0.01), Pose(-0.01), Pose(y=0.01), Pose(y=-0.01), Pose(yaw=0.01), Pose(yaw=-0.01)):
        assert cost(best) <= cost(nudge.after(best)) + 1e-9


def test_the_fit_of_one_point_is_a_translation() -> None:
    assert fit_pose(np.array([[1.0, 1.0]]), np.array([[3.0, 0.0]])) == Pose(2.0, -1.0, 0.0)


def test_points_that_weigh_nothing_have_no_say() -> None:
    source = np.array([[0.0, 0.0], [1.0, 0.0], [5.0, 5.0]])
    target = np.array([[1.0, 0.0], [2.0, 0.0], [-9.0, 9.0]])
    assert_allclose(fit_pose(source, target, np.array([1.0, 1.0, 0.0])).apply(source[:2]), target[:2], atol=1e-12)


def test_no_coordinates_are_no_points() -> None:
    assert as_points([]).shape == (0, 2)


def test_a_line_is_two_points_of_plain_numbers() -> None:
    assert as_line(np.array([[0, 1], [2, 3]], float)) == ((0.0, 1.0), (2.0, 3.0))


@pytest.mark.parametrize("wrong", [[[0, 0]], [[0, 0], [1, 1], [2, 2]]])
def test_a_line_has_exactly_two_points(wrong: list[list[float]]) -> None:
    with pytest.raises(ValueError, match="values to unpack"):
        as_line(np.array(wrong, float))


def test_polygons_are_found_in_any_geometry() -> None:
    a, b = rectangle(0, 0, 1, 1), rectangle(2, 0, 3, 1)
    mixed = GeometryCollection([MultiPolygon([a, b]), LineString([(0, 0), (1, 1)])])
    assert polygons_in(mixed) == [a, b]
    assert polygons_in([a, MultiPolygon([b])]) == [a, b]
    assert polygons_in(shapely.Polygon()) == []


@given(
    st.lists(st.tuples(st.sampled_from([-1.5, -0.0, 0.0, 2.0]), st.sampled_from([-3.0, -0.0, 0.0, 1e9])), max_size=30)
)
def test_distinct_points_are_those_of_the_rows_in_their_order(rows: list[tuple[float, float]]) -> None:
    points = as_points(rows)
    expected = np.unique(points, axis=0, return_index=True, return_inverse=True)
    for found, same in zip(distinct(points), expected, strict=True):
        assert_array_equal(found, same)


def test_lines_made_in_one_go_are_those_made_one_by_one() -> None:
    lines = [((0.0, 1.0), (2.0, 3.0)), ((1.0, 1.0), (1.5, 1.0), (1.5, 2.5))]
    assert line_strings(lines).tolist() == [LineString(line) for line in lines]
    assert len(line_strings([])) == 0
