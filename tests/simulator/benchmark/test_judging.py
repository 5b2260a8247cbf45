"""What counts as an error, and how much of a map rests on its meta layer."""

from dataclasses import replace

import numpy as np
import pytest

from stillroom.maps.grid import Cell, GridFrame, OccupancyGrid
from stillroom.maps.meta import MapMeta, MetaDivider, MetaOccupancy
from stillroom.maps.semantics import Divider, Room, SemanticMap
from stillroom.simulator.benchmark.judging import lost_and_wrong, meta_share
from stillroom.simulator.homes import box
from stillroom.simulator.truth import MapFit, Overlap, RoomFit

FRAME = GridFrame(0.05, 160, 80)
LEFT = Room("r1", "Left", 1, box(0, 0, 4, 4))
RIGHT = Room("r2", "Right", 2, box(4, 0, 8, 4))
TWO_ROOMS = SemanticMap(FRAME, (LEFT, RIGHT))
BETWEEN = ((4.0, 0.0), (4.0, 4.0))
OPEN = OccupancyGrid(FRAME, np.full((80, 160), Cell.FREE, np.uint8))


def fit_of(name: str, named: tuple[float, float] | None) -> RoomFit:
    best = Overlap("r1", 1.0, 1.0, 1.0)
    return RoomFit(name, best, None if named is None else Overlap("r2", *named, 0.3))


def test_a_named_room_is_lost_or_wrong_and_an_unnamed_one_neither() -> None:
    found = MapFit(
        (fit_of("Hall", None), fit_of("Study", (0.9, 0.5)), fit_of("Den", (0.51, 0.51)), fit_of("Attic", (0.1, 0.1)))
    )
    assert lost_and_wrong(found, {"Hall", "Study", "Den"}) == (("Hall",), ("Study",))
    assert lost_and_wrong(found, set()) == ((), ())


def with_meta(meta: MapMeta) -> SemanticMap:
    return replace(TWO_ROOMS, meta=meta)


def test_a_boundary_on_a_meta_divider_counts_by_its_length() -> None:
    held = with_meta(MapMeta(dividers=(MetaDivider("md1", BETWEEN, ("r1", "r2"), "3"),)))
    assert meta_share(held, OPEN) == pytest.approx(2 * 4 / 32, abs=0.02)


def test_so_does_one_on_meta_occupancy() -> None:
    held = with_meta(MapMeta(occupancy=(MetaOccupancy("mo1", box(3.95, 0, 4.05, 2), "occupied", "3"),)))
    assert meta_share(held, OPEN) == pytest.approx(2 * 2 / 32, abs=0.02)


def test_what_a_divider_or_a_sensed_wall_holds_does_not_count() -> None:
    meta = MapMeta(dividers=(MetaDivider("md1", BETWEEN, ("r1", "r2"), "3"),))
    divided = replace(with_meta(meta), dividers=(Divider("d1", BETWEEN),))
    assert meta_share(divided, OPEN) == 0.0
    cells = np.full((80, 160), Cell.FREE, np.uint8)
    cells[:40, 80] = Cell.OCCUPIED
    assert meta_share(with_meta(meta), OccupancyGrid(FRAME, cells)) == pytest.approx(2 * 2 / 32, abs=0.02)


def test_a_map_without_meta_layer_or_rooms_rests_on_none() -> None:
    assert meta_share(TWO_ROOMS, OPEN) == 0.0
    assert (
        meta_share(replace(with_meta(MapMeta(dividers=(MetaDivider("md1", BETWEEN, (), "3"),))), rooms=()), OPEN) == 0
    )
