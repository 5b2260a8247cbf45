import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from shapely import Polygon

from stillroom.maps.areas import common_areas
from tests.drawing import rectangle

corners = st.tuples(st.integers(-9, 9), st.integers(-9, 9))
clouds = st.lists(corners, min_size=3, max_size=12)


def common(first: Polygon, second: Polygon) -> float:
    return float(common_areas(np.array([first], dtype=object), np.array([second], dtype=object))[0])


def shape(corners: list[tuple[int, int]], yaw: float) -> Polygon:
    """One valid polygon, concave and with holes as it comes, turned and far from the origin."""
    points = np.array(corners, dtype=np.float64) @ np.array([[np.cos(yaw), np.sin(yaw)], [-np.sin(yaw), np.cos(yaw)]])
    parts = shapely.get_parts(
        shapely.make_valid(Polygon(points + np.array([100, -50])), method="structure", keep_collapsed=False)
    )
    return max(parts, key=lambda part: part.area, default=Polygon())


@given(clouds, clouds, st.sampled_from([0.0, 0.5, 1.5]))
def test_common_areas_are_those_of_the_intersections(
    a: list[tuple[int, int]], b: list[tuple[int, int]], yaw: float
) -> None:
    first, second = shape(a, yaw), shape(b, yaw)
    assert common(first, second) == pytest.approx(first.intersection(second).area, abs=1e-8)


def test_a_hole_is_no_common_area_whichever_way_its_ring_runs() -> None:
    shell, hole = shapely.get_coordinates(rectangle(0, 0, 4, 4)), shapely.get_coordinates(rectangle(1, 1, 3, 3))
    for ring in (hole, hole[::-1]):
        for around in (shell, shell[::-1]):
            assert common(Polygon(around, [ring]), rectangle(2, 0, 4, 4)) == pytest.approx(6.0)


def test_each_polygon_is_compared_with_its_own_partner() -> None:
    first = np.array([rectangle(0, 0, 2, 2), Polygon(), rectangle(0, 0, 4, 1)], dtype=object)
    second = np.array([rectangle(1, 1, 3, 3), rectangle(0, 0, 1, 1), rectangle(1, 0, 2, 9)], dtype=object)
    assert common_areas(first, second).tolist() == pytest.approx([1.0, 0.0, 1.0])
    assert common_areas(first[:0], second[:0]).tolist() == []


def test_neighbours_have_nothing_in_common() -> None:
    turned = shapely.transform(
        np.array([rectangle(0, 0, 3, 4), rectangle(3, 0, 8, 4)]), lambda p: p @ np.array([[0.8, 0.6], [-0.6, 0.8]]) + 7
    )
    assert common(*turned) == 0.0
