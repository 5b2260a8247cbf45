"""Automatic dividers: which cuts there can be, what speaks for them, and which part rooms."""

from dataclasses import replace

import numpy as np
import pytest
import shapely
from shapely import MultiPolygon, Polygon

from stillroom.maps.geometry import Line, as_points
from stillroom.maps.grid import GridFrame
from stillroom.pipeline.cells import cells_in
from stillroom.pipeline.cuts import likely_cuts, outline_of, possible_cuts
from stillroom.pipeline.params import PARAMS
from stillroom.pipeline.pieces import over_segment
from stillroom.pipeline.segmentation import WEIGHTS, join_pieces, propose_dividers
from tests.drawing import rectangle

FRAME = GridFrame(0.05, 240, 160)
ROOMS = shapely.union_all(
    [rectangle(0.5, 0.5, 5.0, 4.5), rectangle(5.2, 0.5, 9.0, 4.5), rectangle(5.0, 2.0, 5.2, 2.9)], grid_size=0.001
)
"""Two rooms with a doorway of 0.9 m."""
CORRIDOR = shapely.union_all(
    [
        rectangle(0.5, 3.0, 11.0, 4.6),
        rectangle(0.5, 0.5, 5.4, 2.8),
        rectangle(5.6, 0.5, 11.0, 2.8),
        rectangle(4.3, 2.8, 5.2, 3.0),
        rectangle(5.8, 2.8, 6.7, 3.0),
        rectangle(0.5, 4.8, 5.4, 7.0),
        rectangle(5.6, 4.8, 11.0, 7.0),
        rectangle(4.3, 4.6, 5.2, 4.8),
        rectangle(5.8, 4.6, 6.7, 4.8),
    ],
    grid_size=0.001,
)
"""Four rooms on a corridor of 1.6 m; their doors stand side by side, so that walls are in line across the corridor between them."""
NICHE = shapely.union_all(
    [
        rectangle(0.5, 0.5, 6.5, 4.0),
        rectangle(2.4, 4.0, 4.6, 4.8),
        rectangle(3.0, 4.8, 3.9, 5.0),
        rectangle(1.0, 5.0, 6.0, 7.5),
    ],
    grid_size=0.001,
)
"""Two rooms; cupboards on both sides of the door between them leave a niche 2.2 m wide and 0.8 m deep."""


def dividers_of(floor: Polygon, sensitivity: float = 0.0) -> tuple[Line, ...]:
    params = replace(PARAMS, divider_sensitivity=sensitivity)
    return propose_dividers(MultiPolygon([floor]), cells_in([floor], FRAME), FRAME, params)


def test_a_doorway_between_two_rooms_is_the_only_divider() -> None:
    ((a, b),) = dividers_of(ROOMS)
    assert sorted([a, b]) == [pytest.approx((5.1, 2.0), abs=0.01), pytest.approx((5.1, 2.9), abs=0.01)]


def test_a_corridor_is_not_cut_where_walls_of_rooms_meet_it() -> None:
    lines = dividers_of(CORRIDOR)
    assert len(lines) == 4
    assert all(abs(a[1] - b[1]) < 0.01 and abs(a[0] - b[0]) < 1.0 for a, b in lines)


def test_a_niche_between_cupboards_belongs_to_its_room() -> None:
    (line,) = dividers_of(NICHE)
    assert shapely.LineString(line).length == pytest.approx(0.9, abs=0.05)


def test_walls_beyond_a_cut_count_only_where_they_part_its_two_sides() -> None:
    floor = shapely.orient_polygons(MultiPolygon([CORRIDOR]))
    pieces = over_segment(floor, cells_in([CORRIDOR], FRAME), FRAME, PARAMS)
    column = list(WEIGHTS).index("wall_between")
    apart, joined = (
        pieces.features(groups, np.arange(len(pieces.sides)), PARAMS)[:, column]
        for groups in (np.arange(len(pieces.area)), join_pieces(pieces, PARAMS))
    )
    across = np.abs(pieces.cuts.along[:, 1]) > 0.98
    over_the_corridor = across & (pieces.cuts.length > 1.5)
    assert over_the_corridor.any()
    assert apart[over_the_corridor].max() < 0.3
    assert np.sort(joined[~across & (pieces.cuts.length < 1.0)])[-4:].min() > 1.0


def test_likely_cuts_neither_cross_nor_close_the_same_opening_twice() -> None:
    mask = cells_in([CORRIDOR], FRAME)
    clearance = np.full(mask.shape, 1.0, np.float32)
    outline = outline_of(shapely.orient_polygons(MultiPolygon([CORRIDOR])), FRAME, PARAMS)
    cuts = likely_cuts(possible_cuts(outline, clearance, FRAME, PARAMS), outline)
    lines = [shapely.LineString([a, b]) for a, b in zip(cuts.a, cuts.b, strict=True)]
    assert len(lines) > 4
    for i, line in enumerate(lines):
        assert not shapely.crosses(line, lines[i + 1 :]).any()


def test_more_sensitive_is_more_dividers() -> None:
    counts = [len(dividers_of(CORRIDOR, sensitivity)) for sensitivity in (-30.0, 0.0, 4.0)]
    assert counts[0] == 0
    assert counts[1] == 4
    assert counts[2] >= 4


def test_no_floor_has_no_dividers() -> None:
    assert propose_dividers(MultiPolygon(), np.zeros((160, 240), np.bool_), FRAME, PARAMS) == ()


def test_dividers_end_on_the_outline() -> None:
    for floor in (ROOMS, CORRIDOR, NICHE):
        ends = as_points(dividers_of(floor))
        assert shapely.distance(shapely.points(ends), shapely.boundary(floor)).max() < 0.002
