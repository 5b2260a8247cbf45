"""Gaps in walls: where a line that should lie on walls finds none."""

import numpy as np
import pytest
import shapely

from stillroom.maps.geometry import as_points
from stillroom.maps.grid import Cell, GridFrame, OccupancyGrid
from stillroom.pipeline.gaps import find_gaps
from stillroom.pipeline.params import PARAMS
from tests.drawing import paint, rectangle

FRAME = GridFrame(0.05, 100, 60)
BLANK = OccupancyGrid(FRAME, np.zeros((FRAME.height, FRAME.width), np.uint8))


def wall_mask(*pieces: tuple[float, float]) -> np.ndarray:
    """A wall of 0.1 m at y 1.5 with these stretches of x."""
    return paint(BLANK, Cell.OCCUPIED, *[rectangle(a, 1.5, b, 1.6) for a, b in pieces]).occupied


LINE = as_points([(0.5, 1.5), (4.5, 1.5)])


@pytest.mark.parametrize("width", [0.2, 0.6, 1.4, 2.5])
def test_a_gap_is_found_where_it_is_and_as_long_as_it_is(width: float) -> None:
    (gap,) = find_gaps([LINE], wall_mask((0.5, 1.5), (1.5 + width, 4.5)), FRAME, PARAMS)
    assert gap.bounded
    assert gap.chord_m == pytest.approx(width, abs=0.15)
    assert gap.path[0][0] == pytest.approx(1.5, abs=0.1)
    assert gap.path[-1][0] == pytest.approx(1.5 + width, abs=0.1)


def test_a_whole_wall_has_no_gap_and_each_gap_is_one() -> None:
    assert find_gaps([LINE], wall_mask((0.5, 4.5)), FRAME, PARAMS) == []
    assert len(find_gaps([LINE], wall_mask((0.5, 1.2), (1.8, 2.6), (3.2, 4.5)), FRAME, PARAMS)) == 2


def test_a_wall_that_ends_early_leaves_a_gap_without_an_end() -> None:
    (gap,) = find_gaps([LINE], wall_mask((0.5, 3.0)), FRAME, PARAMS)
    assert not gap.bounded


def test_a_wall_beside_the_line_is_no_gap_within_the_classification_distance() -> None:
    aside = as_points([(0.5, 1.5 - 0.2), (4.5, 1.5 - 0.2)])
    far = as_points([(0.5, 1.5 - 0.4), (4.5, 1.5 - 0.4)])
    assert find_gaps([aside], wall_mask((0.5, 4.5)), FRAME, PARAMS) == []
    assert all(not gap.bounded for gap in find_gaps([far], wall_mask((0.5, 4.5)), FRAME, PARAMS))


def test_a_ring_that_begins_in_a_gap_has_one_gap_there() -> None:
    ring = as_points([(2.5, 1.5), (4.5, 1.5), (4.5, 2.5), (0.5, 2.5), (0.5, 1.5), (2.5, 1.5)])
    outline = shapely.LinearRing(ring).buffer(0.05) - rectangle(2.2, 1.2, 2.8, 1.8)
    wall = paint(BLANK, Cell.OCCUPIED, *shapely.get_parts(outline)).occupied
    (gap,) = find_gaps([ring], wall, FRAME, PARAMS)
    assert gap.bounded
    assert gap.chord_m == pytest.approx(0.6, abs=0.15)


def test_many_lines_at_once_have_the_gaps_that_each_has_alone() -> None:
    wall = wall_mask((0.5, 1.2), (1.8, 2.6), (3.2, 4.0)).copy()
    wall[40:44, 10:90] = True
    ring = as_points([(1.5, 1.5), (4.5, 1.5), (4.5, 2.1), (0.5, 2.1), (0.5, 1.5), (1.5, 1.5)])
    nowhere, beyond = as_points([(1.0, 0.4), (2.0, 0.4)]), as_points([(3.5, 1.5), (9.0, 1.5)])
    lines = [LINE, ring, nowhere, as_points([(0.5, 2.1), (4.5, 2.1)]), beyond, LINE[::-1]]
    for leaps_m in (np.inf, 0.1):
        alone = [gap for line in lines for gap in find_gaps([line], wall, FRAME, PARAMS, leaps_m)]
        together = find_gaps(lines, wall, FRAME, PARAMS, leaps_m)
        assert len(together) > 8
        assert [(gap.path.tolist(), gap.bounded) for gap in together] == [
            (gap.path.tolist(), gap.bounded) for gap in alone
        ]


def test_where_there_are_no_lines_there_are_no_gaps() -> None:
    assert find_gaps([], wall_mask((0.5, 4.5)), FRAME, PARAMS) == []
