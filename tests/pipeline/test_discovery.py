"""Discovery's parts: which floor is new, whether it is a room, and where dividers and corrections belong."""

import numpy as np
import pytest
import shapely
from shapely import Polygon

from stillroom.maps.geometry import Pose, as_points
from stillroom.maps.grid import Cell, OccupancyGrid
from stillroom.maps.meta import Declined, MapMeta
from stillroom.maps.motion import IDENTITY
from stillroom.maps.semantics import Ids, SemanticMap
from stillroom.pipeline.creation import create_map
from stillroom.pipeline.discovery import discover, is_doorway, new_floor
from stillroom.pipeline.gaps import Gap, find_gaps
from stillroom.pipeline.params import PARAMS
from stillroom.pipeline.resolution import Attempt
from stillroom.pipeline.scores import score_rooms
from stillroom.pipeline.transfer import track, transfer_semantics
from tests.drawing import paint, rectangle
from tests.golden.homes import FOUR_ROOMS
from tests.golden.uploads import covers, first_map
from tests.missions import sense

HOME = FOUR_ROOMS.grid
BASE = first_map(FOUR_ROOMS)
STUDY = rectangle(8.4, 0.6, 9.6, 4.2)
DOORWAY = rectangle(8.15, 2.8, 8.45, 3.6)
"""Leads from B into the study."""


def with_study(*ways: Polygon) -> OccupancyGrid:
    """A study of 1.2 x 3.6 m on the right of the home."""
    walls = paint(HOME, Cell.OCCUPIED, rectangle(8.3, 0.4, 9.8, 4.4))
    return paint(walls, Cell.FREE, STUDY, *ways)


def attempt(grid: OccupancyGrid, base: SemanticMap = BASE) -> Attempt:
    tracked = track(base, IDENTITY, grid.frame)
    transfer = transfer_semantics(tracked, grid, "1", PARAMS, MapMeta.EMPTY)
    return Attempt(transfer, score_rooms(tracked, transfer.candidate, transfer.visited, PARAMS), grid)


@pytest.mark.parametrize("seed", range(4))
def test_jitter_is_no_new_floor(seed: int) -> None:
    made = attempt(sense(HOME, Pose(0.04, -0.04, 0.003), np.random.default_rng(seed), 0.15))
    assert new_floor(made.transfer, PARAMS) == []
    assert not discover(made, (), PARAMS)


def test_a_room_behind_a_new_doorway_is_new_floor_and_gets_a_divider_in_it() -> None:
    made = attempt(with_study(DOORWAY))
    (region,) = new_floor(made.transfer, PARAMS)
    assert covers(region, STUDY) > 0.8
    found = discover(made, (), PARAMS)
    assert found.corrections == ()
    (divider,) = found.dividers
    line = shapely.LineString(divider.line)
    assert line.within(DOORWAY.buffer(0.2))
    assert line.length == pytest.approx(0.8, abs=0.2)
    assert divider.made_by == "algorithm"


def test_two_doorways_get_a_divider_each() -> None:
    made = attempt(with_study(DOORWAY, rectangle(8.15, 0.8, 8.45, 1.6)))
    found = discover(made, (), PARAMS)
    assert len(found.dividers) == 2
    middles = sorted(float(as_points(d.line).mean(0)[1]) for d in found.dividers)
    assert middles == pytest.approx([1.2, 3.2], abs=0.15)


def test_an_alcove_is_too_small_to_look_at() -> None:
    grid = paint(HOME, Cell.OCCUPIED, rectangle(8.2, 2.6, 9.2, 4.0))
    made = attempt(paint(grid, Cell.FREE, rectangle(8.2, 2.8, 8.8, 3.4)))
    assert new_floor(made.transfer, PARAMS) == []


def test_what_was_seen_through_a_window_is_closed_where_the_wall_was() -> None:
    window = rectangle(8.2, 3.0, 8.4, 4.0)
    fan = Polygon([(8.4, 3.1), (11.0, 1.5), (11.0, 5.5), (8.4, 3.9)])
    made = attempt(paint(HOME, Cell.FREE, window, fan))
    found = discover(made, (), PARAMS)
    assert found.dividers == ()
    assert len(found.corrections) == 1
    assert found.corrections[0].polygon.intersects(window)
    assert found.corrections[0].cell == "occupied"


def test_a_doorway_that_a_person_declined_is_not_proposed_again() -> None:
    """Journey 7: "this is part of Living"."""
    made = attempt(with_study(DOORWAY))
    assert discover(made, (Declined(DOORWAY),), PARAMS).dividers == ()


def doorways(made: Attempt, place: Polygon) -> list[bool]:
    """Of the gaps in walls at a place, which lead to the one new region."""
    transfer = made.transfer
    (region,) = new_floor(transfer, PARAMS)
    walls = [as_points(w.line) for w in transfer.tracked.walls if w.kind == "wall"]
    gaps = find_gaps(walls, ~transfer.obstacles.floor, transfer.grid.frame, PARAMS)
    return [is_doorway(gap, region, transfer, PARAMS) for gap in gaps if shapely.LineString(gap.path).intersects(place)]


def test_a_gap_in_a_wall_that_goes_on_beyond_both_ends_is_a_doorway() -> None:
    assert any(doorways(attempt(with_study(DOORWAY)), DOORWAY.buffer(0.1)))


@pytest.mark.parametrize(
    ("region", "leads"),
    [
        (rectangle(4.5, 3.1, 7.5, 5.1), True),
        (rectangle(4.5, 3.1, 7.5, 4.1), False),
        (rectangle(5.0, 3.1, 5.8, 10.1), False),
    ],
    ids=["more than furniture covers", "no more than it covers", "no wider than the gap"],
)
def test_beside_a_gap_the_wall_may_be_missing_where_much_lies_behind_it(region: Polygon, leads: bool) -> None:
    gap = Gap(as_points([(5.0, 3.0), (5.8, 3.0)]))
    assert is_doorway(gap, region, attempt(HOME).transfer, PARAMS) == leads


@pytest.mark.parametrize("depth", [1.7, 2.0])
def test_what_was_under_a_bed_that_has_gone_is_no_new_room(depth: float) -> None:
    """The bed stood between two walls, in front of a third: the wall goes on beyond one end of its edge."""
    bed = rectangle(4.2, 4.4 - 1.4, 4.2 + depth, 4.4)
    base = create_map(paint(HOME, Cell.OCCUPIED, bed, rectangle(4.0, 2.0, 4.2, 3.0)), "0", Ids())
    grid = paint(HOME, Cell.OCCUPIED, rectangle(4.0, 2.0, 4.2, 4.4))
    made = attempt(grid, base)
    if regions := new_floor(made.transfer, PARAMS):
        assert covers(regions[0], bed) > 0.5
    assert discover(made, (), PARAMS).dividers == ()


def test_furniture_that_was_taken_for_a_wall_and_has_gone_leaves_no_doorway() -> None:
    """What filled a corner of A was no floor on the first map; there is no wall that goes on beyond it."""
    corner = rectangle(0.2, 3.3, 1.3, 4.4)
    base = create_map(paint(HOME, Cell.OCCUPIED, corner), "0", Ids())
    assert len(base.rooms) == 4
    assert not any(covers(room.polygon, corner) > 0.1 for room in base.rooms)
    made = attempt(HOME, base)
    assert discover(made, (), PARAMS).dividers == ()
    assert made.failed == frozenset()
