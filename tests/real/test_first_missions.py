"""Every real map can be a first mission: no error, and all constraints hold."""

from pathlib import Path

import numpy as np
import pytest

from stillroom.documents.files import ASSUMED, open_map
from stillroom.documents.stored import decode_map, encode_map
from stillroom.maps.constraints import violations
from stillroom.maps.grid import OccupancyGrid
from stillroom.maps.semantics import Ids
from stillroom.pipeline.adoption import RobotSemantics, adopt_map
from stillroom.pipeline.cells import cells_in
from stillroom.pipeline.params import PARAMS
from tests.conftest import RobotCaller, Service
from tests.real.shared import DATA, parameters

A_FEW_OF_EACH = (
    "ros_maps/gpdas__house.pgm",
    "ros_maps/movecare_*.p?m",
    "ros_maps/ryuichiueda__ueda_room.png",
    "ros_maps/sjohns09__*.pgm",
    "ros_maps/brain__vw_ground_truth_full_edited.png",
    "movecare_homes/home_03.png",
    "movecare_homes/home_11.pgm",
    "valetudo/**/*.json",
    "ipa_room_segmentation/lab_c_scan*.png",
    "ipa_room_segmentation/office_a_furnitures_trashbins.png",
    "seq/elsabot_*/*.pgm",
    "seq/gdc2_locations/01*.png",
    "seq/growth_cartesium/map03.png",
    "seq/montreal2018/06*.pgm",
    "seq/rodney_second_floor/*.pgm",
)
UNREACHED_SHARE = 0.5
"""At least this much of what the robot's app calls a segment lies in the room that has most of it."""


def opened(path: Path) -> tuple[OccupancyGrid, RobotSemantics | None]:
    file = open_map(path)
    return file.read(ASSUMED | file.meta if file.is_image else {})


@pytest.mark.parametrize("path", parameters(*A_FEW_OF_EACH))
def test_all_constraints_hold_on_the_first_map(path: Path) -> None:
    grid, semantics = opened(path)
    made = adopt_map(grid, semantics, "1", Ids())
    assert violations(made, grid, PARAMS.wall_reach_m) == ()
    assert violations(decode_map(encode_map(made)), grid, PARAMS.wall_reach_m) == ()


@pytest.mark.parametrize("path", parameters("valetudo/**/*.json"))
def test_the_segments_of_a_robot_are_its_rooms(path: Path) -> None:
    grid, semantics = opened(path)
    if semantics is None or not semantics.has_rooms:
        pytest.skip("the map has no segments")
    made = adopt_map(grid, semantics, "1", Ids())
    rooms = np.zeros(grid.cells.shape, np.int32)
    for number, room in enumerate(made.rooms, 1):
        rooms[cells_in([room.polygon], grid.frame)] = number
    floor = (rooms > 0) & grid.free
    shares = []
    for label in range(1, len(semantics.names) + 1):
        mine = (semantics.labels == label) & grid.free
        if mine.sum() * grid.frame.resolution**2 < PARAMS.face_area_m2:
            continue
        best = int(np.bincount(rooms[mine], minlength=2)[1:].argmax()) + 1
        shares.append(float(((rooms == best) & mine).sum() / (((rooms == best) & floor) | mine).sum()))
        room = made.rooms[best - 1]
        if semantics.names[label - 1] is not None and shares[-1] > UNREACHED_SHARE:
            assert room.named_by == "user"
    assert np.median(shares) > 0.95
    assert np.mean(np.array(shares) > 0.8) > 0.9, shares


@pytest.mark.parametrize("path", parameters("valetudo/**/z10*restrictions.json", "ros_maps/gpdas__house.pgm"))
def test_it_can_be_uploaded(service: Service, robot: RobotCaller, path: Path) -> None:
    file = open_map(path)
    meta = (ASSUMED | file.meta) if file.is_image else {"resolution": None, "origin": None}
    answer = robot.upload("1", file.content, grid_type=file.media_type, wait=None, **meta)
    assert answer.status_code in (201, 202), answer.text
    service.worker.settle()
    assert robot.get(f"{robot.path()}/missions/1").json()["outcome"] == "created"
    assert robot.get(robot.path()).json()["version"] == 1


def test_each_of_the_few_is_there_where_there_are_any() -> None:
    if not DATA.is_dir():
        pytest.skip(f"there are no real maps in {DATA}")
    assert [pattern for pattern in A_FEW_OF_EACH if not list(DATA.glob(pattern))] == []
