"""The steps of conflict resolution: what each proposes, when it is tried, and that no more is kept than it takes."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
import shapely
from shapely import LineString, Polygon

from stillroom.maps.grid import Cell, OccupancyGrid
from stillroom.maps.meta import MapMeta, MetaDivider, MetaOccupancy
from stillroom.maps.mission import Mission
from stillroom.maps.motion import IDENTITY
from stillroom.pipeline.corrections import name_corrections
from stillroom.pipeline.gaps import Gap
from stillroom.pipeline.params import PARAMS
from stillroom.pipeline.resolution import (
    Attempt,
    cut_off,
    free_differences,
    meta_walls,
    minimise,
    needed,
    parting,
    resolve_conflicts,
    tracked_boundary,
    wall_differences,
)
from stillroom.pipeline.scores import score_rooms
from stillroom.pipeline.transfer import track, transfer_semantics
from stillroom.pipeline.update import RESOLVERS
from tests.drawing import paint, rectangle
from tests.golden.homes import FOUR_ROOMS
from tests.golden.uploads import covers, first_map, named

HOME = FOUR_ROOMS.grid
BASE = first_map(FOUR_ROOMS)
GAP_AC, GAP_CD = rectangle(3.2, 2.0, 4.0, 2.2), rectangle(4.0, 0.6, 4.2, 1.4)
BREACH = rectangle(4.2, 2.0, 6.4, 2.2)


def retrying(grid: OccupancyGrid) -> Callable[[MapMeta], Attempt]:
    """Fresh transfers of one mission, that counts them."""
    tracked = track(BASE, IDENTITY, grid.frame)

    def carried(meta: MapMeta) -> Attempt:
        transfer = transfer_semantics(tracked, grid, "1", PARAMS, meta)
        return Attempt(transfer, score_rooms(tracked, transfer.candidate, transfer.visited, PARAMS), grid)

    return carried


def with_gaps(*gaps: Polygon) -> OccupancyGrid:
    return paint(HOME, Cell.FREE, *gaps)


def occupied(polygon: Polygon) -> MetaOccupancy:
    return MetaOccupancy("", polygon, "occupied", "")


# -- what the steps propose ------------------------------------------------------------------------------------------


def test_a_section_that_was_wall_and_is_none_is_proposed_where_it_is() -> None:
    (section,) = wall_differences(retrying(with_gaps(GAP_AC))(MapMeta.EMPTY), PARAMS)
    assert (section.cell, section.id, section.since) == ("occupied", "", "")
    assert covers(section.polygon, GAP_AC) > 0.8
    assert shapely.difference(section.polygon, GAP_AC.buffer(0.15)).area < 0.01


def test_sections_beside_rooms_that_came_through_are_not_proposed() -> None:
    """The hole in the outer wall of B borders on no room that failed."""
    grid = with_gaps(GAP_AC, rectangle(8.2, 3.2, 8.4, 4.0))
    sections = wall_differences(retrying(grid)(MapMeta.EMPTY), PARAMS)
    assert len(sections) == 1
    assert sections[0].polygon.intersects(GAP_AC)


def test_sections_that_are_too_long_are_real_changes_and_not_proposed() -> None:
    assert wall_differences(retrying(with_gaps(BREACH))(MapMeta.EMPTY), PARAMS) == ()


def test_without_failed_rooms_nothing_is_proposed() -> None:
    whole = retrying(HOME)(MapMeta.EMPTY)
    assert whole.failed == frozenset()
    assert wall_differences(whole, PARAMS) == ()
    assert free_differences(whole, PARAMS) == ()
    assert tracked_boundary(whole.failed_rooms()) == ()


@pytest.mark.parametrize(("length", "kept"), [(0.6, 1), (1.3, 1), (1.7, 0), (3.0, 0)])
def test_a_gap_is_filled_up_to_a_length(length: float, kept: int) -> None:
    gap = Gap(shapely.get_coordinates(LineString([(1.0, 1.0), (1.0 + length, 1.0)])))
    assert len(meta_walls([gap], HOME.frame, PARAMS)) == kept


def test_both_faces_of_one_wall_are_one_section() -> None:
    faces = [Gap(shapely.get_coordinates(LineString([(1.0, y), (1.8, y)]))) for y in (1.0, 1.15)]
    (section,) = meta_walls(faces, HOME.frame, PARAMS)
    assert covers(section.polygon, rectangle(1.0, 1.0, 1.8, 1.15)) > 0.99


def test_the_tracked_boundary_of_a_lost_room_is_proposed_whole() -> None:
    attempt = retrying(with_gaps(BREACH))(MapMeta.EMPTY)
    lines = shapely.union_all([d.shape for d in tracked_boundary(attempt.failed_rooms())])
    for room in attempt.failed_rooms():
        assert shapely.difference(room.polygon.exterior, lines.buffer(0.02)).length < 0.01


def test_of_a_boundary_only_what_parts_rooms_is_kept() -> None:
    retry = retrying(with_gaps(BREACH))
    first = retry(MapMeta.EMPTY)
    second = retry(MapMeta(dividers=tracked_boundary(first.failed_rooms())))
    assert second.failed == frozenset()
    kept = parting(second)
    rooms = [room.polygon for room in second.transfer.candidate.rooms]
    for divider in kept:
        middle = divider.shape.interpolate(0.5, normalized=True)
        assert sum(room.distance(middle) < 0.05 for room in rooms) == 2
    assert 2.0 < sum(divider.shape.length for divider in kept) < 3.6


# -- when they are tried ---------------------------------------------------------------------------------------------


def test_steps_after_one_that_settled_all_are_not_tried() -> None:
    for grid, tried in ((HOME, []), (with_gaps(GAP_AC), ["meta_occupancy"]), (with_gaps(BREACH), list(RESOLVERS))):
        retry = retrying(grid)
        attempts = resolve_conflicts(retry(MapMeta.EMPTY), retry, RESOLVERS, PARAMS)
        assert list(attempts) == tried
        assert [name for name, attempt in attempts.items() if not attempt.failed] == tried[-1:]


def test_each_step_builds_on_the_one_before() -> None:
    retry = retrying(with_gaps(BREACH, rectangle(2.6, 2.0, 3.4, 2.2)))
    attempts = resolve_conflicts(retry(MapMeta.EMPTY), retry, RESOLVERS, PARAMS)
    occupancy, dividers = attempts["meta_occupancy"], attempts["meta_dividers"]
    assert occupancy.failed
    assert occupancy.meta.occupancy
    assert dividers.meta.occupancy == occupancy.meta.occupancy
    assert dividers.failed == frozenset()


# -- as little as possible -------------------------------------------------------------------------------------------


def test_corrections_that_part_nothing_are_dropped() -> None:
    """The one in the middle of A's floor and the one on a wall that stands part no rooms."""
    retry = retrying(with_gaps(GAP_AC))
    useless = (occupied(rectangle(4.0, 0.8, 4.2, 1.4)), occupied(rectangle(2.0, 3.2, 2.4, 3.3)))
    attempt = retry(MapMeta((occupied(GAP_AC), *useless)))
    assert attempt.failed == frozenset()
    assert [o.polygon for o in minimise(attempt, retry).meta.occupancy] == [GAP_AC]
    assert needed(attempt, keep=[useless[1]]).occupancy == (occupied(GAP_AC), useless[1])


def test_corrections_that_part_rooms_are_kept() -> None:
    retry = retrying(with_gaps(GAP_AC, GAP_CD))
    attempt = retry(MapMeta((occupied(GAP_AC), occupied(GAP_CD))))
    assert attempt.failed == frozenset()
    assert {o.polygon for o in minimise(attempt, retry).meta.occupancy} == {GAP_AC, GAP_CD}


def test_what_failed_is_not_made_smaller() -> None:
    retry = retrying(with_gaps(GAP_AC))
    failed = retry(MapMeta((occupied(rectangle(2.0, 3.2, 2.4, 3.3)),)))
    assert failed.failed
    assert minimise(failed, retry) is failed


def test_a_room_of_which_a_part_is_cut_off_is_named() -> None:
    assert cut_off(retrying(HOME)(MapMeta.EMPTY), PARAMS) == frozenset()
    wall = paint(HOME, Cell.OCCUPIED, rectangle(6.6, 0.0, 6.8, 2.2))
    attempt = retrying(wall)(MapMeta(occupancy=(occupied(rectangle(6.6, 0.0, 6.8, 2.2)),)))
    assert cut_off(attempt, PARAMS) == {named(BASE, "D").id}


# -- names -----------------------------------------------------------------------------------------------------------

LINE = ((4.2, 2.1), (6.4, 2.1))


def test_a_correction_in_the_place_of_one_before_keeps_its_id_and_since_when_it_stands() -> None:
    now = replace(BASE, meta=MapMeta((occupied(GAP_AC), occupied(GAP_CD)), (MetaDivider("", LINE, (), ""),)))
    moved = shapely.transform(GAP_AC, lambda points: points + np.array([0.05, 0.02]))
    before = MapMeta((MetaOccupancy("o7", moved, "occupied", "3", 2),), (MetaDivider("m4", LINE, (), "5", 1),))
    made = name_corrections(now, before, Mission("9", with_gaps(GAP_AC, GAP_CD, BREACH), IDENTITY))
    old, new = made.meta.occupancy
    assert (old.id, old.since, old.contradicted) == ("o7", "3", 3)
    assert (new.since, new.contradicted, new.id not in ("", "o7")) == ("9", 1, True)
    (line,) = made.meta.dividers
    assert (line.id, line.since, line.contradicted) == ("m4", "5", 2)


@pytest.mark.parametrize("y", [2.0, 2.1, 2.125, 2.2])
def test_a_meta_divider_through_open_floor_is_contradicted_wherever_it_lies_in_its_cell(y: float) -> None:
    line = ((4.5, y), (6.2, y))
    now = replace(BASE, meta=MapMeta((), (MetaDivider("", line, (), ""),)))
    grid = with_gaps(rectangle(4.2, 1.7, 6.4, 2.5))
    (divider,) = name_corrections(now, MapMeta.EMPTY, Mission("2", grid, IDENTITY)).meta.dividers
    assert divider.contradicted == 1


@pytest.mark.parametrize("cell", [Cell.UNEXPLORED, Cell.OCCUPIED])
def test_what_was_not_seen_and_what_agrees_contradicts_nothing(cell: Cell) -> None:
    now = replace(BASE, meta=MapMeta((occupied(GAP_AC),), (MetaDivider("", LINE, (), ""),)))
    grid = paint(HOME, cell, GAP_AC, BREACH)
    made = name_corrections(now, MapMeta.EMPTY, Mission("2", grid, IDENTITY))
    assert [c.contradicted for c in made.meta.occupancy] + [c.contradicted for c in made.meta.dividers] == [0, 0]


def test_a_free_correction_is_contradicted_by_obstacles() -> None:
    opening = MetaOccupancy("", rectangle(4.0, 2.9, 4.2, 3.5), "free", "")
    now = replace(BASE, meta=MapMeta((opening,)))
    shut = paint(HOME, Cell.OCCUPIED, opening.polygon)
    for grid, expected in ((shut, 1), (HOME, 0)):
        made = name_corrections(now, MapMeta.EMPTY, Mission("2", grid, IDENTITY))
        assert made.meta.occupancy[0].contradicted == expected
