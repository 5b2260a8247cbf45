"""Journey J3: the robot came back with a turned map, then with one that creeps."""

import re
from collections.abc import Callable
from math import pi
from typing import Any

import numpy as np
import pytest
import shapely
from playwright.sync_api import Page, expect

from stillroom.documents.images import as_grey
from stillroom.maps.geometry import Pose, as_points
from stillroom.maps.grid import OccupancyGrid
from tests.drawing import iou
from tests.e2e import calling
from tests.e2e.asking import OWNER, causes, questions, read
from tests.e2e.conftest import OpenPage, Robot
from tests.e2e.looking import shown
from tests.e2e.test_placement import FRAME
from tests.golden.test_drift import STEP_M
from tests.golden.test_drift import home as creeping
from tests.pipeline.test_registration import HOME, MIRRORED, turned

TURN = Pose(5.0, 3.0, pi / 2)
ZONE = [[1.0, 1.0], [2.0, 1.0], [2.0, 1.5], [1.0, 1.5]]
MISSIONS = 12


def frame_of(grid: OccupancyGrid) -> dict[str, Any]:
    o = grid.frame.origin
    return {"resolution": grid.frame.resolution, "origin": [o.x, o.y, o.yaw]}


def features(document: Any, semantic: str) -> dict[str, Any]:
    return {f["id"]: f for f in document["features"] if f["properties"]["semantic"] == semantic}


def moved(feature: Any) -> shapely.Geometry:
    """Where the turn takes it."""
    shape = shapely.geometry.shape(feature["geometry"])
    return shapely.transform(shape, lambda points: TURN.apply(as_points(points)))


@pytest.mark.parametrize("home", [HOME, MIRRORED], ids=["one place fits", "two places fit"])
def test_a_pinned_map_that_comes_back_turned_goes_through_one_transform_or_waits_for_a_person(
    home: Any, robot: Robot, open_page: OpenPage
) -> None:
    robot.upload("0", as_grey(home.grid.cells), **FRAME)
    robot.edit(1, {"op": "add_restriction", "kind": "no_go", "shape": ZONE})
    before = read(robot)
    assert calling.put(f"{robot.path}/pin", headers=OWNER).status_code == 200
    grid = turned(home.grid, TURN)
    result = robot.upload("1", as_grey(grid.cells), **frame_of(grid))
    page = open_page(robot.page)
    if result["outcome"] == "parked":
        assert read(robot)["features"] == before["features"]
        expect(page.get_by_role("region", name="New floor, or an existing one?")).to_be_visible()
        return
    assert home is HOME
    shown(page, result["version"])
    after = read(robot)
    for semantic in ("room", "divider", "restriction"):
        assert features(after, semantic).keys() == features(before, semantic).keys()
    for id_, room in features(before, "room").items():
        assert iou(moved(room), shapely.geometry.shape(features(after, "room")[id_]["geometry"])) >= 0.9
    for id_, divider in features(before, "divider").items():
        line = shapely.geometry.shape(features(after, "divider")[id_]["geometry"])
        assert line.hausdorff_distance(moved(divider)) < 0.15
    for id_, zone in features(before, "restriction").items():
        kept = features(after, "restriction")[id_]
        assert kept["properties"]["placement"] == "placed"
        assert iou(moved(zone), shapely.geometry.shape(kept["geometry"])) >= 0.9


@pytest.fixture
def creeper(robot: Robot) -> Robot:
    """A hall with two rooms above it; Study, on the left, will slide."""
    robot.upload("0", as_grey(creeping().cells), **frame_of(creeping()))
    rooms = features(read(robot), "room")
    west_east = sorted(rooms, key=lambda id_: points_of(rooms[id_]).mean(0)[0])
    south = min(rooms, key=lambda id_: points_of(rooms[id_]).mean(0)[1])
    names = dict(zip((id_ for id_ in west_east if id_ != south), ("Study", "Bath"), strict=True)) | {south: "Hall"}
    robot.edit(1, *({"op": "rename_room", "id": id_, "name": name} for id_, name in names.items()))
    return robot


def points_of(feature: Any, x: float = 0.0) -> Any:
    """(n, 2), `x` metres farther on."""
    coordinates = feature["geometry"]["coordinates"]
    points = coordinates[0][:-1] if feature["geometry"]["type"] == "Polygon" else coordinates
    return np.add(points, (x, 0.0))


def creep(robot: Robot, mission: int) -> None:
    """The walls of Study are found 20 cm farther on, and the robot's tracking went with them."""
    known = read(robot)
    (study,) = (id_ for id_, f in features(known, "room").items() if f["properties"]["name"] == "Study")
    tracking = {
        "rooms": {id_: points_of(f, STEP_M * (id_ == study)).tolist() for id_, f in features(known, "room").items()},
        "dividers": {
            id_: points_of(f, STEP_M * (study in f["properties"]["rooms"])).tolist()
            for id_, f in features(known, "divider").items()
        },
    }
    grid = creeping(mission * STEP_M)
    still = {"base_version": known["version"], "tracking": tracking}
    assert robot.upload(str(mission), as_grey(grid.cells), **frame_of(grid), **still)["outcome"] == "updated"


def test_a_room_that_creeps_is_asked_about_before_a_fifth_of_it_is_gone_and_only_once(
    creeper: Robot, open_page: OpenPage, keep: Callable[[Page, str], None]
) -> None:
    for mission in range(1, 4):
        creep(creeper, mission)
    page = open_page("/questions")
    mine = page.get_by_role("listitem").filter(has_text=re.compile("Study has slid"))
    expect(page.get_by_text("Live", exact=True)).to_be_visible()
    creep(creeper, 4)  # of twenty steps across the room: recall 0.8
    expect(mine).to_contain_text("Study has slid 80 cm against the other rooms")
    page.goto("about:blank")
    for mission in range(5, MISSIONS + 1):
        creep(creeper, mission)
    (asked,) = questions(creeper)
    assert (asked["kind"], asked["rooms"][0]["recall"]) == ("drift", pytest.approx(0.4, abs=0.06))
    page.goto("/questions")
    expect(mine).to_contain_text("240 cm")
    mine.get_by_role("link").click()
    concerned = page.get_by_role("region", name="Rooms concerned")
    expect(concerned).to_contain_text("60 % of it lies where it was not before")
    changes = page.get_by_role("region", name="What changed")
    expect(changes).to_contain_text("Study: the dashed line is where it was when it was last confirmed")
    page.get_by_role("button", name="As confirmed").click()
    keep(page, "question-drift-1440-light")
    page.get_by_role("button", name="It is right as it is now").click()
    expect(page.get_by_role("heading", level=2, name="Decided")).to_be_focused()
    assert causes(creeper)[0] == "decision"
    creep(creeper, MISSIONS + 1)
    assert questions(creeper) == []
