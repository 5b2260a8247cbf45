import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from stillroom.maps.geometry import Points, Pose, as_points
from stillroom.maps.grid import GridFrame
from stillroom.maps.mission import Tracking, tracked_motion
from stillroom.maps.semantics import Divider, Room, SemanticMap
from tests.drawing import rectangle

BASE = SemanticMap(
    GridFrame(0.05, 200, 100),
    rooms=(Room("r1", "A", 1, rectangle(0, 0, 4, 4)), Room("r2", "B", 2, rectangle(4, 0, 8, 4))),
    dividers=(Divider("d1", ((4.0, 1.0), (4.0, 2.0))),),
)
"""Rooms side by side, which share the vertices (4, 0) and (4, 4)."""

shifts = st.tuples(st.floats(-1, 1), st.floats(-1, 1))


def ring(room_id: str) -> Points:
    room = BASE.room(room_id)
    assert room is not None
    return as_points(shapely.get_coordinates(room.polygon.exterior)[:-1])


def line(divider_id: str) -> Points:
    divider = BASE.divider(divider_id)
    assert divider is not None
    return as_points(divider.line)


@given(shifts)
def test_tracked_vertices_of_rooms_and_dividers_move_exactly(shift: tuple[float, float]) -> None:
    bent = ring("r1") + np.array([[0.0, 0.0], [0.1, 0.0], [0.0, 0.1], [0.1, 0.1]]) + shift
    motion, warnings = tracked_motion(BASE, Tracking(rooms={"r1": bent}, dividers={"d1": np.add(line("d1"), shift)}))
    assert warnings == ()
    assert motion is not None
    assert_allclose(motion.apply(ring("r1")), bent, atol=1e-9)
    assert_allclose(motion.apply(line("d1")), np.add(line("d1"), shift), atol=1e-9)


def test_the_closing_vertex_may_be_there_or_left_out() -> None:
    moved = np.add(ring("r1"), (0.2, 0.1))
    closed = np.concatenate([moved, moved[:1]])
    for tracked in (moved, closed):
        motion, warnings = tracked_motion(BASE, Tracking(rooms={"r1": tracked}))
        assert warnings == ()
        assert motion is not None
        assert_allclose(motion.apply(ring("r1")), moved, atol=1e-9)


def test_a_vertex_of_two_rooms_takes_the_mean_of_both() -> None:
    motion, _ = tracked_motion(
        BASE, Tracking(rooms={"r1": np.add(ring("r1"), (0.1, 0.0)), "r2": np.add(ring("r2"), (0.0, 0.2))})
    )
    assert motion is not None
    shared = np.array([[4.0, 0.0], [4.0, 4.0]])
    assert_allclose(motion.apply(shared), np.add(shared, (0.05, 0.1)), atol=1e-9)
    assert_allclose(motion.apply(np.array([[0.0, 0.0], [8.0, 4.0]])), [[0.1, 0.0], [8.0, 4.2]], atol=1e-9)


@pytest.mark.parametrize(
    ("tracking", "words"),
    [
        (Tracking(rooms={"r9": np.zeros((4, 2))}), "room r9"),
        (Tracking(dividers={"d9": np.zeros((2, 2))}), "divider d9"),
        (Tracking(rooms={"d1": np.zeros((2, 2))}), "room d1"),
        (Tracking(rooms={"r1": np.zeros((3, 2))}), "room r1"),
        (Tracking(rooms={"r1": np.zeros((6, 2))}), "room r1"),
        (Tracking(rooms={"r1": np.zeros((0, 2))}), "room r1"),
        (Tracking(dividers={"d1": np.zeros((1, 2))}), "divider d1"),
        (Tracking(dividers={"d1": np.zeros((3, 2))}), "divider d1"),
    ],
)
def test_an_entry_that_does_not_fit_the_base_is_ignored_with_a_warning(tracking: Tracking, words: str) -> None:
    motion, warnings = tracked_motion(BASE, tracking)
    assert motion is None
    assert len(warnings) == 1
    assert words in warnings[0]


def test_one_entry_that_does_not_fit_leaves_the_others_in_use() -> None:
    tracking = Tracking(rooms={"r1": np.add(ring("r1"), (0.3, 0.0)), "r2": np.zeros((7, 2)), "r3": np.zeros((4, 2))})
    motion, warnings = tracked_motion(BASE, tracking)
    assert len(warnings) == 2
    assert motion is not None
    assert_allclose(motion.apply(np.array([[6.0, 2.0]])), [[6.3, 2.0]], atol=1e-6)


def test_rooms_come_before_submaps_and_submaps_before_the_transform() -> None:
    submaps = ((Pose(), Pose(0.2)),)
    transform = Pose(0.3)
    everything = Tracking({"r1": np.add(ring("r1"), (0.1, 0.0))}, submaps=submaps, transform=transform)
    place = np.array([[0.0, 0.0]])
    for tracking, expected in (
        (everything, 0.1),
        (Tracking(submaps=submaps, transform=transform), 0.2),
        (Tracking(transform=transform), 0.3),
    ):
        motion, _ = tracked_motion(BASE, tracking)
        assert motion is not None
        assert_allclose(motion.apply(place), [[expected, 0.0]], atol=1e-6)


def test_dividers_alone_come_before_submaps() -> None:
    motion, _ = tracked_motion(
        BASE, Tracking(dividers={"d1": np.add(line("d1"), (0.1, 0.0))}, submaps=((Pose(), Pose(0.2)),))
    )
    assert motion is not None
    assert_allclose(motion.apply(line("d1")), np.add(line("d1"), (0.1, 0.0)), atol=1e-9)


def test_rooms_that_do_not_fit_leave_the_say_to_submaps() -> None:
    motion, warnings = tracked_motion(BASE, Tracking({"r9": np.zeros((4, 2))}, submaps=((Pose(), Pose(0.2)),)))
    assert len(warnings) == 1
    assert motion is not None
    assert_allclose(motion.apply(np.array([[0.0, 0.0]])), [[0.2, 0.0]], atol=1e-6)


@given(st.floats(-2, 2), st.floats(-2, 2), st.floats(-3, 3))
def test_the_transform_is_applied_to_everything(x: float, y: float, yaw: float) -> None:
    pose = Pose(x, y, yaw)
    motion, warnings = tracked_motion(BASE, Tracking(transform=pose))
    assert warnings == ()
    assert motion is not None
    points = np.array([[0.0, 0.0], [7.0, -3.0], [4.0, 2.0]])
    assert_allclose(motion.apply(points), pose.apply(points), atol=1e-6)


def test_a_submap_moves_what_is_nearest_to_where_it_was() -> None:
    left = (Pose(2.0, 2.0, 0.5), Pose(2.1, 2.0, 0.5))
    right = (Pose(6.5, 2.0, -1.0), Pose(6.5, 2.3, -1.0))
    motion, _ = tracked_motion(BASE, Tracking(submaps=(left, right)))
    assert motion is not None
    assert_allclose(motion.apply(ring("r1")), np.add(ring("r1"), (0.1, 0.0)), atol=1e-9)
    assert_allclose(motion.apply(np.array([[8.0, 0.0], [8.0, 4.0]])), [[8.0, 0.3], [8.0, 4.3]], atol=1e-9)


def test_a_submaps_motion_is_that_of_its_frame_from_one_pose_to_the_other() -> None:
    from_, to = Pose(3.0, 1.0, 0.4), Pose(3.5, 0.5, 0.7)
    motion, _ = tracked_motion(BASE, Tracking(submaps=((from_, to),)))
    assert motion is not None
    fixed_in_the_submap = np.array([[1.0, 0.5], [0.0, 0.0], [-2.0, 1.0]])
    assert_allclose(motion.apply(from_.apply(fixed_in_the_submap)), to.apply(fixed_in_the_submap), atol=1e-5)


def test_nothing_tracked_is_no_motion() -> None:
    assert tracked_motion(BASE, Tracking()) == (None, ())
