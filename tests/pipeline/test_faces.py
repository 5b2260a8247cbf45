"""Pieces of the floor between cuts: they cover it exactly, whatever stands in it and however the map lies."""

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from shapely import MultiPolygon, Polygon

from stillroom.maps.geometry import Points, as_points, polygons_in
from stillroom.maps.grid import GridFrame
from stillroom.pipeline.cells import cells_in
from stillroom.pipeline.cuts import likely_cuts, outline_of, possible_cuts
from stillroom.pipeline.faces import Ends, faces
from stillroom.pipeline.params import PARAMS
from stillroom.pipeline.pieces import Pieces, clearance_of, over_segment
from tests.drawing import rectangle

FRAME = GridFrame(0.05, 200, 160)
HALL = rectangle(0.5, 0.5, 9.0, 7.0)
PILLAR, SPECK = rectangle(2.0, 3.0, 2.6, 3.5), rectangle(7.9, 5.9, 8.2, 6.2)
COURT = rectangle(4.0, 2.0, 7.0, 5.0)
"""A hole in the hall, in which there are two rooms of their own."""
INNER = shapely.union_all([rectangle(4.2, 2.2, 5.4, 4.8), rectangle(5.6, 2.2, 6.8, 4.8), rectangle(5.4, 3.0, 5.6, 3.8)])
RING = shapely.difference(HALL, shapely.union_all([PILLAR, SPECK, COURT]))


def parted(*parts: Polygon) -> Pieces:
    floor = shapely.orient_polygons(MultiPolygon(list(parts)))
    return over_segment(floor, cells_in(parts, FRAME), FRAME, PARAMS)


@pytest.mark.parametrize("parts", [(RING,), (RING, INNER)], ids=["with pillars", "with rooms in a courtyard"])
def test_pieces_cover_the_floor(parts: tuple[Polygon, ...]) -> None:
    pieces = parted(*parts)
    assert len(pieces.area) > 3
    assert pieces.area[0] == 0
    assert pieces.area.sum() == pytest.approx(sum(part.area for part in parts), rel=1e-9)
    cells = np.bincount(pieces.labels[cells_in(parts, FRAME)], minlength=len(pieces.area)) * FRAME.resolution**2
    assert np.abs(cells - pieces.area)[1:].max() < 0.2


def test_a_cut_has_on_its_sides_what_lies_there() -> None:
    pieces = parted(RING, INNER)
    middle = (pieces.cuts.a + pieces.cuts.b) / 2
    for side, sign in enumerate((1, -1)):
        places = FRAME.to_cells(middle + 0.1 * sign * pieces.cuts.left)
        column, row = np.floor(places).astype(int).T
        assert (pieces.labels[row, column] == pieces.sides[:, side]).mean() > 0.9


def test_without_cuts_there_are_no_pieces() -> None:
    pieces = parted(rectangle(1.0, 1.0, 4.0, 4.0))
    assert (len(pieces.sides), pieces.area.tolist()) == (0, [0.0])


@st.composite
def floors(draw: st.DrawFn) -> Polygon:
    """Rectangles joined, on the grid's lines: the largest part."""
    shapes = []
    for _ in range(draw(st.integers(2, 6))):
        x, y = draw(st.integers(10, 120)), draw(st.integers(10, 100))
        shapes.append(shapely.box(x, y, x + draw(st.integers(12, 70)), y + draw(st.integers(12, 50))))
    whole = shapely.transform(shapely.union_all(shapes), lambda p: as_points(p) * 0.05)
    part = max(polygons_in(shapely.set_precision(whole, 0.001)), key=lambda p: p.area)
    return shapely.simplify(part, 0.0)


@given(floors())
def test_a_mirrored_floor_has_mirrored_cuts(floor: Polygon) -> None:
    width = FRAME.width * FRAME.resolution

    def mirror(points: Points) -> Points:
        return np.stack([width - points[:, 0], points[:, 1]], 1)

    there, back = parted(floor), parted(shapely.transform(floor, mirror))
    assert len(there.sides) == len(back.sides)
    assert np.sort(there.area) == pytest.approx(np.sort(back.area), abs=1e-6)


@given(floors())
def test_pieces_cover_any_floor_that_cuts_reach(floor: Polygon) -> None:
    outline = outline_of(shapely.orient_polygons(MultiPolygon([floor])), FRAME, PARAMS)
    possible = possible_cuts(outline, clearance_of(cells_in([floor], FRAME), FRAME), FRAME, PARAMS)
    cuts = likely_cuts(possible, outline)
    _, area, _ = faces(outline, Ends.of(outline, cuts), FRAME)
    if len(cuts.a):
        assert area.sum() == pytest.approx(floor.area, rel=1e-9)
