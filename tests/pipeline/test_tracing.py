"""Borders of masks: exact, and the same however a mask is turned or divided."""

import cv2
import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from stillroom.maps.grid import Mask
from stillroom.pipeline.tracing import Corners, trace

SIZES = st.integers(1, 30)


def speckled(seed: int, width: int, height: int) -> Mask:
    rng = np.random.default_rng(seed)
    return np.asarray(rng.random((height, width)) < rng.random())


def area(ring: Corners) -> float:
    x, y = ring.T
    return float((x * np.roll(y, -1) - np.roll(x, -1) * y).sum()) / 2


def lengths(rings: list[Corners]) -> list[tuple[int, float]]:
    return sorted((len(ring), area(ring)) for ring in rings)


def test_a_single_cell_has_its_four_corners_counter_clockwise() -> None:
    mask = np.zeros((3, 4), np.bool_)
    mask[1, 2] = True
    (ring,) = trace(mask)
    assert {tuple(corner) for corner in ring.tolist()} == {(2, 1), (3, 1), (3, 2), (2, 2)}
    assert area(ring) == 1


def test_a_hole_runs_clockwise() -> None:
    mask = np.ones((5, 5), np.bool_)
    mask[2, 2] = False
    assert sorted(area(ring) for ring in trace(mask)) == [-1, 25]


def test_cells_that_touch_over_a_corner_are_two_parts() -> None:
    assert [area(ring) for ring in trace(np.eye(2, dtype=np.bool_))] == [1, 1]


@given(st.integers(0, 2**32), SIZES, SIZES)
def test_borders_enclose_exactly_the_mask_in_as_many_parts_as_it_has(seed: int, width: int, height: int) -> None:
    mask = speckled(seed, width, height)
    rings = trace(mask)
    assert sum(map(area, rings)) == mask.sum()
    parts = cv2.connectedComponents(mask.view(np.uint8), connectivity=4)[0] - 1
    assert sum(area(ring) > 0 for ring in rings) == parts
    for ring in rings:
        steps = np.diff(np.append(ring, ring[:1], axis=0), axis=0)
        assert ((steps == 0).sum(1) == 1).all()
        assert ((steps[:, 0] == 0) != (np.roll(steps[:, 0], 1) == 0)).all()


@given(st.integers(0, 2**32), SIZES, SIZES, st.integers(0, 3), st.booleans())
def test_a_turned_or_mirrored_mask_has_the_same_borders(
    seed: int, width: int, height: int, quarters: int, mirrored: bool
) -> None:
    mask = speckled(seed, width, height)
    other = np.rot90(mask[:, ::-1] if mirrored else mask, quarters)
    assert lengths(trace(np.ascontiguousarray(other))) == lengths(trace(mask))


@given(st.integers(0, 2**32), SIZES, SIZES)
def test_finer_cells_have_the_same_borders(seed: int, width: int, height: int) -> None:
    mask = speckled(seed, width, height)
    fine = trace(np.kron(mask, np.ones((2, 2), np.bool_)))
    expected = shapely.MultiLineString([shapely.LinearRing(ring * 2) for ring in trace(mask)])
    assert shapely.equals(shapely.MultiLineString([shapely.LinearRing(ring) for ring in fine]), expected)


@pytest.mark.parametrize("shape", [(1, 1), (4, 7)])
def test_an_empty_mask_has_no_borders(shape: tuple[int, int]) -> None:
    assert trace(np.zeros(shape, np.bool_)) == []
