"""Served maps against homes."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import shapely
from shapely import Polygon

from stillroom.maps.geometry import Pose, as_points
from stillroom.maps.grid import GridFrame, Mask
from stillroom.simulator.distortion import Distortion
from stillroom.simulator.homes import Home, TrueRoom, box
from stillroom.simulator.truth import MapFit, fit

STRAIGHT = Distortion(np.zeros((1, 2)), np.zeros((1, 2)), np.zeros(1))
FRAME = GridFrame(0.05, 240, 120, Pose(-1.0, -1.0))
EVERYWHERE = np.ones((120, 240), bool)
KITCHEN, OFFICE = box(0, 0, 4, 4), box(4.1, 0, 8.1, 4)
HOME = Home(
    (TrueRoom("Kitchen", "kitchen", KITCHEN), TrueRoom("Office", "work", OFFICE)),
    shapely.MultiPolygon(),
    (),
    (),
    (1.0, 1.0),
)


def served(**rooms: Polygon) -> dict[str, Any]:
    """A map document; rooms by name."""
    return {
        "features": [
            {
                "id": f"r{i}",
                "geometry": {"coordinates": [as_points(r.coords).tolist() for r in (room.exterior, *room.interiors)]},
                "properties": {"semantic": "room", "name": name},
            }
            for i, (name, room) in enumerate(rooms.items())
        ]
    }


def scored(explored: Mask = EVERYWHERE, bent: Distortion = STRAIGHT, **rooms: Polygon) -> MapFit:
    return fit(HOME, FRAME, explored, served(**rooms), bent)


def test_the_truth_fits_itself() -> None:
    found = scored(Kitchen=KITCHEN, Office=OFFICE)
    assert found.mean_iou == 1.0
    assert found.lost == found.misnamed == ()


def test_overlap_is_counted_as_the_paper_does() -> None:
    kitchen = scored(Kitchen=box(0, 0, 3, 4), Office=OFFICE).rooms[0].best
    assert kitchen.recall == pytest.approx(0.75, abs=0.02)
    assert kitchen.precision == pytest.approx(1.0)
    assert kitchen.iou == pytest.approx(0.75, abs=0.02)


def test_a_room_that_swallowed_its_neighbour_loses_one_of_them() -> None:
    found = scored(Kitchen=box(0, 0, 8.1, 4))
    assert found.rooms[0].best.precision == pytest.approx(0.5, abs=0.01)
    assert set(found.lost) >= {"Office"} or set(found.lost) >= {"Kitchen"}


def test_names_that_changed_places_are_found_out() -> None:
    found = scored(Kitchen=OFFICE, Office=KITCHEN)
    assert found.lost == ()
    assert set(found.misnamed) == {"Kitchen", "Office"}


def test_a_name_that_nobody_gave_is_not_held_against_the_map() -> None:
    found = scored(Room1=KITCHEN, Room2=OFFICE)
    assert found.misnamed == ()
    assert [room.named for room in found.rooms] == [None, None]


def test_what_was_never_seen_counts_neither_for_nor_against() -> None:
    left_half = EVERYWHERE.copy()
    left_half[:, 60:] = False  # x < 2
    found = scored(left_half, Kitchen=box(0, 0, 2, 4))
    assert found.mean_iou == 1.0
    assert [room.name for room in found.rooms] == ["Kitchen"], "the office was never seen"


def test_walls_and_doorways_are_nobodys_room() -> None:
    assert scored(Kitchen=box(-0.2, -0.2, 4.04, 4.2), Office=OFFICE).mean_iou > 0.995


def test_holes_are_not_part_of_a_room() -> None:
    hole = KITCHEN.difference(box(1, 1, 3, 3))
    assert scored(Kitchen=hole, Office=OFFICE).rooms[0].best.recall == pytest.approx(0.75, abs=0.02)


def test_a_bent_map_is_judged_where_it_lies_in_the_home() -> None:
    bent = replace(STRAIGHT, turns=np.array([0.05]), frame=Pose(3.0, -2.0, 1.0))
    moved = {
        name: Polygon(bent.apply(as_points(room.exterior.coords)[:-1]))
        for name, room in (("Kitchen", KITCHEN), ("Office", OFFICE))
    }
    assert scored(bent=bent, **moved).mean_iou > 0.99
    assert scored(**moved).mean_iou < 0.5


def test_a_map_without_rooms_loses_them_all() -> None:
    found = scored()
    assert found.mean_iou == 0.0
    assert found.lost == ("Kitchen", "Office")
