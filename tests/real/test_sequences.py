"""Missions of real homes through the API. The maps are private: they are read from ../shared/data where it is there."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from shapely.geometry import shape

from stillroom.documents.images import as_grey, encode_png
from stillroom.documents.valetudo import read_valetudo
from stillroom.maps.geometry import as_points
from stillroom.maps.grid import OccupancyGrid
from tests.conftest import RobotCaller, Service, features

DATA = Path(__file__).parents[3] / "shared" / "data"
HOME = "valetudo/home_1c/1c_1096_{}.json"
UPSTAIRS = "seq/elsabot_upstairs"
STILL = {"transform": [0.0, 0.0, 0.0]}

pytestmark = pytest.mark.skipif(not DATA.is_dir(), reason="real maps: ../shared/data is not here")


def valetudo(name: str) -> OccupancyGrid:
    return read_valetudo(json.loads((DATA / HOME.format(name)).read_text())).grid


def upload(robot: RobotCaller, number: int, grid: OccupancyGrid, **meta: Any) -> dict[str, Any]:
    frame = grid.frame
    answer = robot.upload(
        str(number),
        encode_png(as_grey(grid.cells[::-1])),
        resolution=frame.resolution,
        origin=[frame.origin.x, frame.origin.y, frame.origin.yaw],
        **meta,
    )
    assert answer.status_code == 201, answer.text
    mission: dict[str, Any] = answer.json()
    return mission


def rooms(document: dict[str, Any]) -> dict[str, shapely.Polygon]:
    return {room["id"]: shape(room["geometry"]) for room in features(document, "room")}


def names(document: dict[str, Any]) -> dict[str, str]:
    return {room["id"]: room["properties"]["name"] for room in features(document, "room")}


def test_four_maps_of_one_flat_keep_the_rooms_that_its_owner_made(service: Service, robot: RobotCaller) -> None:
    owner, path = service.operator, robot.path()
    dumps = [
        valetudo(name) for name in ("fullcleanup", "areacleanup", "zonedcleanup", "virtualwall_and_forbidden_zone")
    ]
    assert upload(robot, 0, dumps[0])["outcome"] == "created"
    made = owner.get(path).json()
    own = [
        {"op": "add_divider", "line": [[31.75, -33.2], [33.2, -33.2]], "kind": "door"},
        {"op": "add_divider", "line": [[34.7, -33.35], [36.6, -33.35]]},
        {"op": "add_divider", "line": [[33.3, -33.5], [33.3, -35.6]]},
        {"op": "add_divider", "line": [[30.8, -33.2], [30.8, -33.6]]},
    ]
    cleared = [{"op": "remove_divider", "id": divider["id"]} for divider in features(made, "divider")]
    divided = owner.edit(path, made["version"], *cleared, *own)
    assert divided.status_code == 200, divided.text
    ids = sorted(rooms(divided.json()))
    assert len(ids) == 5
    renames = [{"op": "rename_room", "id": room, "name": f"Mine {n}"} for n, room in enumerate(ids)]
    before = owner.edit(path, divided.json()["version"], *renames).json()
    lines = {d["id"]: shape(d["geometry"]) for d in features(before, "divider")}
    for number, grid in enumerate(dumps[1:], 1):
        mission = upload(robot, number, grid, base_version=before["version"], tracking=STILL)
        assert mission["outcome"] == "updated", mission["reason"]
        after = owner.get(path).json()
        assert names(after) == names(before)
        was, now = rooms(before), rooms(after)
        for room in ids:
            assert was[room].intersection(now[room]).area / was[room].union(now[room]).area > 0.95
        assert all(lines[d["id"]].hausdorff_distance(shape(d["geometry"])) < 0.35 for d in features(after, "divider"))
        floor = shapely.union_all(list(now.values()))
        free = grid.frame.to_map(as_points(np.argwhere(grid.free)[:, ::-1]) + 0.5)
        assert shapely.contains_xy(floor.buffer(grid.frame.resolution), free).mean() > 0.98
        before = after


def test_six_maps_of_one_floor_in_six_frames_are_carried_over_or_honestly_refused(
    service: Service, robot: RobotCaller
) -> None:
    """Two years apart, turned by quarters, tracked by nobody. What is taken fits; what is not leaves the map alone."""
    outcomes = []
    before = None
    for number, file in enumerate(sorted((DATA / UPSTAIRS).glob("*.pgm"))):
        side = file.with_suffix(".yaml").read_text()
        origin = json.loads(side.split("origin:")[1].split("\n")[0].strip())
        answer = robot.upload(
            str(number), file.read_bytes(), grid_type="image/x-portable-graymap", resolution=0.05, origin=origin
        )
        mission = answer.json()
        after = service.operator.get(robot.path()).json()
        outcomes.append(mission["outcome"])
        taken = mission["outcome"] in ("updated", "resolved")
        if taken:
            assert all(room["precision"] > 0.5 and room["recall"] > 0.5 for room in mission["rooms"] if room["visited"])
        if before is not None and not taken:
            assert after["version"] == before["version"]
        if before is not None:
            assert set(rooms(after)) >= set(rooms(before))
        before = after
    assert outcomes[0] == "created"
    assert set(outcomes[1:]) <= {"updated", "resolved", "needs_review", "reverted", "parked"}
    assert sum(outcome in ("updated", "resolved") for outcome in outcomes) >= 3
