"""Places without corrections: they move with the ground, and keep out whatever is proposed there."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from shapely import LineString, Polygon, box

from stillroom.maps.geometry import Pose
from stillroom.maps.meta import Declined, MapMeta, MetaDivider, MetaOccupancy
from stillroom.maps.motion import Motion
from stillroom.pipeline.declined import carry_declined, permitted

LINE = LineString([(0.0, 0.0), (0.0, 1.2)])
PLACES = st.sampled_from([LINE, box(0, 0, 0.3, 1.2), Polygon([(0, 0), (2, 0), (0, 1)])])


def divider(x: float, length: float = 1.2) -> MetaDivider:
    return MetaDivider("m1", ((x, 0.0), (x, length)), (), "1")


@given(PLACES, st.floats(-5, 5), st.floats(-5, 5), st.floats(-3, 3))
def test_a_place_is_carried_as_one_rigid_shape(shape: LineString | Polygon, x: float, y: float, yaw: float) -> None:
    (carried,) = carry_declined((Declined(shape, "2026-11-29T00:00:00Z"),), Motion.rigid(Pose(x, y, yaw)))
    assert carried.until == "2026-11-29T00:00:00Z"
    assert type(carried.shape) is type(shape)
    expected = Pose(x, y, yaw).apply(np.array(shape.boundary.coords if isinstance(shape, Polygon) else shape.coords))
    actual = np.array(carried.shape.boundary.coords if isinstance(shape, Polygon) else carried.shape.coords)
    assert np.abs(actual - expected).max() < 0.001


def test_nothing_is_corrected_at_a_declined_place_by_whatever_means() -> None:
    section = MetaOccupancy("o1", box(-0.1, 0.1, 0.1, 0.9), "occupied", "1")
    elsewhere = MetaOccupancy("o2", box(3, 0, 3.2, 1), "occupied", "1")
    meta = MapMeta((section, elsewhere), (divider(0.05), divider(3.0)))
    assert permitted(meta, ()) is meta
    assert permitted(meta, (Declined(LINE),)) == MapMeta((elsewhere,), (divider(3.0),))


def test_a_correction_that_lies_elsewhere_for_the_most_part_is_permitted() -> None:
    assert permitted(MapMeta(dividers=(divider(0.0, 6.0),)), (Declined(LINE),)).dividers
    assert not permitted(MapMeta(dividers=(divider(0.0, 1.5),)), (Declined(LINE),)).dividers
    assert permitted(MapMeta(dividers=(divider(0.6),)), (Declined(LINE),)).dividers


def test_small_refusals_beside_each_other_are_one_place() -> None:
    halves = tuple(Declined(LineString([(0, y), (0, y + 0.6)])) for y in (0.0, 0.6))
    assert not permitted(MapMeta(dividers=(divider(0.0),)), halves).dividers
