"""Rooms against the shapes that a person last confirmed, after one rigid alignment of all of them."""

from math import radians

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from shapely import Polygon

from stillroom.maps.geometry import Points, Pose
from stillroom.maps.mission import Tracking, tracked_motion
from stillroom.maps.motion import IDENTITY, Motion
from stillroom.maps.semantics import Ids, Room, SemanticMap
from stillroom.pipeline.anchor import carry_anchors, find_drift, moved
from stillroom.pipeline.creation import create_map
from stillroom.pipeline.params import PARAMS
from tests.drawing import iou, rectangle
from tests.golden.homes import FOUR_ROOMS

SHAPES = (rectangle(0, 0, 4, 4), rectangle(4.2, 0, 8.2, 4), rectangle(0, 4.2, 8.2, 6.2))


def rooms(*now: Polygon, anchors: tuple[Polygon | None, ...] = SHAPES) -> list[Room]:
    """Three rooms in shapes of now, each with its anchor."""
    return [Room(f"r{i}", f"R{i}", i, p, anchor=a) for i, (p, a) in enumerate(zip(now, anchors, strict=True), 1)]


def shifted(polygon: Polygon, x: float, y: float = 0.0) -> Polygon:
    return moved(polygon, Pose(x, y))


def found(*now: Polygon, anchors: tuple[Polygon | None, ...] = SHAPES) -> list[str]:
    return [drift.room for drift in find_drift(rooms(*now, anchors=anchors), PARAMS)]


def test_rooms_as_they_were_confirmed_have_not_drifted() -> None:
    assert find_drift(rooms(*SHAPES), PARAMS) == ()


@pytest.mark.parametrize("metres", [0.5, 0.6, 0.8])
@pytest.mark.parametrize("which", [0, 1])
def test_a_room_that_slid_against_the_others_has_drifted_by_that_much(which: int, metres: float) -> None:
    now = [shifted(shape, -metres if i == which else 0.0) for i, shape in enumerate(SHAPES)]
    (drift,) = find_drift(rooms(*now), PARAMS)
    assert drift.room == f"r{which + 1}"
    assert drift.slid_m == pytest.approx(metres, abs=0.1)
    assert drift.recall == pytest.approx(1 - metres / 4, abs=0.04)
    assert drift.precision == pytest.approx(1 - metres / 4, abs=0.04)


def test_rooms_of_many_corners_and_of_few_are_compared_alike() -> None:
    round_ = shapely.Point(2, 2).buffer(2)
    anchors = (round_, *SHAPES[1:])
    now = [shifted(shape, 0.0, -0.5 if i == 1 else 0.0) for i, shape in enumerate(anchors)]
    (drift,) = find_drift(rooms(*now, anchors=anchors), PARAMS)
    assert drift.room == "r2"
    assert drift.slid_m == pytest.approx(0.5, abs=0.1)


def test_a_slide_of_ten_centimetres_is_no_drift_yet() -> None:
    assert found(shifted(SHAPES[0], 0.1), *SHAPES[1:]) == []


poses = st.builds(Pose, st.floats(-5, 5), st.floats(-5, 5), st.floats(-0.3, 0.3))


@given(poses)
def test_rooms_that_moved_together_have_not_drifted_wherever_their_anchors_were_carried(pose: Pose) -> None:
    """The anchors are carried with the frame; here they even lag a little."""
    lag = Pose(0.1, -0.1, 0.01)
    anchors = tuple(moved(shape, pose) for shape in SHAPES)
    now = [moved(anchor, lag) for anchor in anchors]
    assert found(*now, anchors=anchors) == []


def test_a_room_that_grew_on_one_side_has_not_drifted() -> None:
    assert found(rectangle(-3, 0, 4, 4), *SHAPES[1:]) == []
    assert found(*SHAPES[:2], rectangle(0, 4.2, 8.2, 9.2)) == []


def test_a_room_that_lost_a_strip_on_one_side_has_not_slid() -> None:
    """A wall that was moved: the shape is another, its other walls are where they were."""
    assert found(rectangle(0.45, 0, 4, 4), *SHAPES[1:]) == []


@pytest.mark.parametrize(("width", "asked"), [(2.3, True), (2.5, False)])
def test_a_room_of_which_less_than_three_fifths_are_left_has_shrunk_and_not_slid(width: float, asked: bool) -> None:
    drifts = find_drift(rooms(rectangle(4 - width, 0, 4, 4), *SHAPES[1:]), PARAMS)
    assert [(drift.room, drift.slid_m) for drift in drifts] == [("r1", 0.0)] * asked
    for drift in drifts:
        assert drift.recall == pytest.approx(width / 4, abs=0.03)
        assert drift.precision == pytest.approx(1, abs=0.03)


def test_rooms_without_an_anchor_are_not_judged() -> None:
    none = (None, None, None)
    assert find_drift(rooms(*SHAPES, anchors=none), PARAMS) == ()
    assert find_drift([], PARAMS) == ()
    now = (shifted(SHAPES[0], 0.9), *SHAPES[1:])
    assert "r1" not in found(*now, anchors=(None, *SHAPES[1:]))


# -- carrying --------------------------------------------------------------------------------------------------------


def moved_as(base: SemanticMap, tracking: Tracking) -> Motion:
    motion, _ = tracked_motion(base, tracking)
    assert motion is not None
    return motion


def test_anchors_that_do_not_move_stay_where_they_are() -> None:
    carried = carry_anchors(rooms(*SHAPES), IDENTITY)
    for before, after in zip(SHAPES, carried, strict=True):
        assert after is not None
        assert iou(before, after) > 0.9999


@pytest.mark.parametrize("pose", [Pose(1.0, -2.0), Pose(0.3, 0.1, radians(90)), Pose(0, 0, radians(-170))])
def test_anchors_move_with_the_frame(pose: Pose) -> None:
    base = create_map(FOUR_ROOMS.grid, "0", Ids())
    motion = moved_as(base, Tracking(transform=pose))
    for room, carried in zip(base.rooms, carry_anchors(base.rooms, motion), strict=True):
        assert carried is not None
        assert room.anchor is not None
        assert iou(carried, moved(room.anchor, pose)) > 0.999


@given(st.integers(0, 2**32))
def test_an_anchor_keeps_its_shape_whatever_was_tracked(seed: int) -> None:
    rng = np.random.default_rng(seed)
    base = create_map(FOUR_ROOMS.grid, "0", Ids())

    def wrong(points: Points) -> Points:
        return points + rng.normal(0, 0.1, points.shape)

    tracking = Tracking(rooms={r.id: wrong(shapely.get_coordinates(r.polygon.exterior)[:-1]) for r in base.rooms})
    motion = moved_as(base, tracking)
    for room, carried in zip(base.rooms, carry_anchors(base.rooms, motion), strict=True):
        assert carried is not None
        assert room.anchor is not None
        assert carried.area == pytest.approx(room.anchor.area)
        assert carried.length == pytest.approx(room.anchor.length)


def test_a_room_that_slides_does_not_take_the_anchors_of_the_others_along() -> None:
    base = create_map(FOUR_ROOMS.grid, "0", Ids())
    slides = base.rooms[0].id
    tracking = Tracking(
        rooms={
            r.id: shapely.get_coordinates(r.polygon.exterior)[:-1] + ((0.2, 0.0) if r.id == slides else (0.0, 0.0))
            for r in base.rooms
        }
    )
    motion = moved_as(base, tracking)
    for room, carried in zip(base.rooms, carry_anchors(base.rooms, motion), strict=True):
        assert carried is not None
        assert room.anchor is not None
        assert shapely.hausdorff_distance(carried, room.anchor) < 0.03
