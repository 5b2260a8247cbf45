"""Corrections that a person makes the map's own or refuses, on walls with gaps of which the robot saw through."""

from dataclasses import replace

import numpy as np
import pytest
import shapely

from stillroom.maps.constraints import violations
from stillroom.maps.geometry import Pose
from stillroom.maps.grid import Cell, OccupancyGrid
from stillroom.maps.mission import Mission
from stillroom.maps.motion import IDENTITY
from stillroom.maps.semantics import Ids, SemanticMap
from stillroom.pipeline.creation import create_map
from stillroom.pipeline.decisions import confirm, corrections_of, grid_under, own, refuse
from stillroom.pipeline.params import PARAMS
from stillroom.pipeline.update import MapUpdate, update_map
from tests.drawing import iou, paint, rectangle
from tests.golden.homes import CORRIDOR
from tests.missions import mission, random_pose, sense, track_all

SMALL, LARGE = 1.2, 2.0
"""Gaps (metres) in the wall between two rooms: the one is filled by meta-occupancy, the other takes meta-dividers."""


@pytest.fixture(scope="module")
def home() -> SemanticMap:
    return create_map(CORRIDOR.grid, "0", Ids())


def with_gap(gap_m: float) -> OccupancyGrid:
    return paint(CORRIDOR.grid, Cell.FREE, rectangle(4.7, 4.4, 5.1, 4.4 + gap_m))


def next_mission(m: SemanticMap, grid: OccupancyGrid, mission_id: str = "2") -> MapUpdate:
    return update_map(m, Mission(mission_id, grid, IDENTITY))


def resolved(home: SemanticMap, gap_m: float) -> SemanticMap:
    update = next_mission(home, with_gap(gap_m), "1")
    assert update.outcome == "resolved"
    assert bool(update.map.meta.occupancy) == (gap_m == SMALL)
    assert bool(update.map.meta.dividers) == (gap_m == LARGE)
    return update.map


def is_valid(m: SemanticMap, grid: OccupancyGrid) -> bool:
    return not violations(m, grid_under(m, grid), PARAMS.wall_reach_m)


@pytest.mark.parametrize("gap_m", [SMALL, LARGE])
def test_corrections_that_are_made_one_s_own_change_no_room_and_are_no_corrections_any_more(
    home: SemanticMap, gap_m: float
) -> None:
    m, grid = resolved(home, gap_m), with_gap(gap_m)
    owned = own(m, corrections_of(m, ["r3"]), grid)
    assert not owned.meta.corrects
    assert owned.rooms == m.rooms
    made = [d for d in owned.dividers if d.id not in {d.id for d in m.dividers}]
    assert {d.made_by for d in made} <= {"user"}
    assert (len(owned.phantoms), bool(made)) == ((1, False) if gap_m == SMALL else (0, True))
    assert is_valid(owned, grid)


@pytest.mark.parametrize("gap_m", [SMALL, LARGE])
@pytest.mark.parametrize("later", [False, True], ids=["the gap stays", "the wall is sensed again"])
def test_what_was_made_one_s_own_holds_the_rooms_apart_without_the_meta_layer(
    home: SemanticMap, gap_m: float, later: bool
) -> None:
    m, grid = resolved(home, gap_m), with_gap(gap_m)
    owned = own(m, corrections_of(m, ["r3"]), grid)
    update = next_mission(owned, CORRIDOR.grid if later else grid)
    assert (update.outcome, update.conflicts) == ("updated", ())
    for before, after in zip(m.rooms, update.map.rooms, strict=True):
        assert iou(before.polygon, after.polygon) > 0.98


@pytest.mark.parametrize("gap_m", [SMALL, LARGE])
def test_what_was_made_one_s_own_survives_missions_that_wander(home: SemanticMap, gap_m: float) -> None:
    rng = np.random.default_rng(4)
    grid = with_gap(gap_m)
    m = own(resolved(home, gap_m), corrections_of(resolved(home, gap_m), ["r3"]), grid)
    first = m
    here = Pose()
    for number in range(2, 8):
        pose = random_pose(rng, 0.04, 0.003)
        tracking = track_all(m, pose.after(here.inverse()), rng, noise_m=0.02)
        update = update_map(m, mission(str(number), m, tracking, sense(grid, pose, rng)))
        assert (update.outcome, update.conflicts) == ("updated", ()), update.reason
        m, here = update.map, pose
    back = here.inverse()
    for before, after in zip(first.rooms, m.rooms, strict=True):
        moved = shapely.transform(after.polygon, back.apply)
        assert iou(before.polygon, moved) > 0.95, before.id


@pytest.mark.parametrize("gap_m", [SMALL, LARGE])
def test_what_is_refused_lets_the_rooms_run_together(home: SemanticMap, gap_m: float) -> None:
    m, grid = resolved(home, gap_m), with_gap(gap_m)
    decided = refuse(m, corrections_of(m, ["r3"]), grid, "1")
    assert decided.retired == {"r3": "r2"}
    assert [room.id for room in decided.map.rooms] == ["r1", "r2", "r4", "r5"]
    assert not decided.map.meta.corrects
    assert is_valid(decided.map, grid)
    merged = decided.map.room("r2")
    assert merged is not None
    assert merged.anchor == merged.polygon
    for room in decided.map.rooms:
        before = m.room(room.id)
        assert before is not None
        assert room.id == "r2" or room.anchor == before.anchor
    assert all("r3" not in divider.rooms for divider in decided.map.dividers)


@pytest.mark.parametrize("gap_m", [SMALL, LARGE])
def test_what_was_refused_is_not_corrected_again(home: SemanticMap, gap_m: float) -> None:
    m, grid = resolved(home, gap_m), with_gap(gap_m)
    refused = refuse(m, corrections_of(m, ["r3"]), grid, "1").map
    again = replace(refused, rooms=home.rooms, dividers=home.dividers, walls=home.walls)
    update = next_mission(again, grid)  # were the rooms apart once more, the gap would still stay open
    assert (update.taken, update.outcome) == (False, "needs_review")
    assert not next_mission(refused, grid).map.meta.corrects
    assert len(next_mission(refused, grid).map.meta.declined) == len(refused.meta.declined)


def test_a_merged_room_keeps_the_name_that_a_person_gave(home: SemanticMap) -> None:
    m = resolved(home, LARGE)
    named = replace(m, rooms=tuple(replace(r, name="Study", named_by="user") if r.id == "r3" else r for r in m.rooms))
    decided = refuse(named, corrections_of(named, ["r3"]), with_gap(LARGE), "1")
    assert [room.name for room in decided.map.rooms if room.id == "r2"] == ["Study"]


def test_only_the_corrections_beside_the_named_rooms_are_meant(home: SemanticMap) -> None:
    for gap_m in (SMALL, LARGE):
        m = resolved(home, gap_m)
        assert corrections_of(m, ["r2"]).corrects
        assert not corrections_of(m, ["r1"]).corrects
        assert corrections_of(m, []) == m.meta


def test_a_person_confirms_the_shapes_of_rooms(home: SemanticMap) -> None:
    drifted = replace(home, rooms=tuple(replace(room, anchor=None) for room in home.rooms))
    confirmed = confirm(drifted, ["r2", "r9"])
    assert [room.id for room in confirmed.rooms if room.anchor is not None] == ["r2"]
    assert confirmed.rooms[1].anchor == confirmed.rooms[1].polygon
