"""Which pieces of floor are rooms after a transfer."""

from dataclasses import replace

import shapely

from stillroom.maps.grid import Cell, OccupancyGrid
from stillroom.maps.meta import MapMeta, MetaOccupancy
from stillroom.maps.motion import IDENTITY
from stillroom.maps.semantics import Ids, SemanticMap
from stillroom.pipeline.creation import create_map
from stillroom.pipeline.params import PARAMS
from stillroom.pipeline.transfer import Transfer, track, transfer_semantics
from tests.drawing import paint, rectangle
from tests.golden.homes import OPEN_PLAN

HOME = OPEN_PLAN.grid
BASE = create_map(HOME, "0", Ids())
BEHIND = rectangle(4.2, 0.2, 5.8, 3.2)
"""4.8 m² of the one room."""
ACROSS = MetaOccupancy("o1", rectangle(4.0, 0.0, 4.2, 3.4), "occupied", "0")


def parted(grid: OccupancyGrid, base: SemanticMap = BASE) -> Transfer:
    return transfer_semantics(track(base, IDENTITY, grid.frame), grid, "1", PARAMS, MapMeta((ACROSS,)))


def test_a_part_of_a_room_that_is_cut_off_is_a_new_room_where_the_robot_saw_it() -> None:
    transfer = parted(HOME)
    (new,) = transfer.new_rooms
    room = transfer.candidate.room(new)
    assert room is not None
    assert (room.derived_from, room.last_visited) == (BASE.rooms[0].id, "1")
    assert shapely.intersection(room.polygon, BEHIND).area > 0.95 * BEHIND.area


def test_what_is_cut_off_and_was_not_seen_is_no_room() -> None:
    transfer = parted(paint(HOME, Cell.UNEXPLORED, BEHIND))
    assert transfer.new_rooms == ()
    assert [room.id for room in transfer.candidate.rooms] == [BASE.rooms[0].id]


def test_a_room_stays_though_a_mission_sees_nothing_of_it() -> None:
    both = parted(HOME).candidate
    transfer = parted(paint(HOME, Cell.UNEXPLORED, BEHIND), replace(both, meta=MapMeta.EMPTY))
    assert {room.id for room in transfer.candidate.rooms} == {room.id for room in both.rooms}
