"""Robots upload what they have, and people take maps away in the formats of others."""

import io
import json
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from stillroom.documents.files import MapFile
from stillroom.documents.nav2 import read_yaml
from stillroom.documents.valetudo import read_valetudo
from stillroom.maps.geometry import as_points
from stillroom.maps.grid import Cell, GridFrame, OccupancyGrid
from tests.conftest import RobotCaller, Service, features
from tests.documents.test_valetudo import document, entity, layer
from tests.homes import FREE, OCCUPIED, home, pixels

Json = dict[str, Any]


def valetudo(*, segments: bool = True) -> Json:
    """The home of `tests.homes` as a Valetudo map: x0 = -1 m, its lower edge at y = -2 m."""
    image = home()[::-1]
    rows = [(y, row) for y, row in enumerate(image)]

    def runs(value: int, low: int, high: int) -> list[int]:
        found: list[int] = []
        for y, row in rows:
            for x in range(low, high):
                if row[x] == value:
                    found += [x - 20, y - 80, 1]
        return found

    if segments:
        layers = [
            layer("segment", runs(FREE, 0, 100), segmentId="16", name="Küche"),
            layer("segment", runs(FREE, 100, 200), segmentId="17"),
        ]
    else:
        layers = [layer("floor", runs(FREE, 0, 200))]
    restrictions = (
        entity("no_go_area", 10, 50, 60, 50, 60, 90, 10, 90),
        entity("no_mop_area", 500, 0, 600, 0, 600, 80, 500, 80),
        entity("virtual_wall", 100, 60, 200, 60),
    )
    return document(*layers, layer("wall", runs(OCCUPIED, 0, 200)), entities=restrictions)


def occupancy_grid() -> Json:
    percent = np.select([home() == FREE, home() == OCCUPIED], [0, 100], -1)
    info = {"resolution": 0.05, "width": 200, "height": 120, "origin": {"position": {"x": -1.0, "y": -2.0, "z": 0.0}}}
    return {"header": {"frame_id": "map"}, "info": info, "data": percent.ravel().tolist()}


def send(robot: RobotCaller, mission: str, grid: Json, **meta: Any) -> Any:
    content = json.dumps(grid).encode()
    meta = {"resolution": None, "origin": None} | meta
    return robot.upload(mission, content, grid_type="application/json", **meta)


def test_the_rooms_names_and_restrictions_of_a_valetudo_map_are_those_of_the_first_version(robot: RobotCaller) -> None:
    mission = send(robot, "0", valetudo())
    assert (mission.status_code, mission.json()["outcome"]) == (201, "created"), mission.text
    made = robot.get(robot.path()).json()
    rooms = features(made, "room")
    assert {room["properties"]["name"] for room in rooms} > {"Küche"}
    assert all(room["properties"]["area"] == pytest.approx(15.9, abs=0.3) for room in rooms)
    assert len(features(made, "divider")) == 1
    kinds = {z["properties"]["kind"]: z for z in features(made, "restriction")}
    assert set(kinds) == {"no_go", "no_mop", "virtual_wall"}
    assert kinds["virtual_wall"]["geometry"]["coordinates"] == [[1.0, -0.6], [2.0, -0.6]]
    assert kinds["no_go"]["properties"]["placement"] == "placed"


def test_segments_and_restrictions_of_later_missions_are_ignored(robot: RobotCaller) -> None:
    send(robot, "0", valetudo())
    before = robot.get(robot.path()).json()
    later = valetudo()
    later["layers"][0]["metaData"]["name"] = "Bad"
    later["entities"] = []
    assert send(robot, "1", later).json()["outcome"] == "updated"
    after = robot.get(robot.path()).json()
    assert [r["properties"]["name"] for r in features(after, "room")] == [
        r["properties"]["name"] for r in features(before, "room")
    ]
    assert len(features(after, "restriction")) == 3


def test_the_same_home_in_every_format_lies_in_the_same_place(service: Service) -> None:
    areas = []
    for number, grid in enumerate((valetudo(segments=False), occupancy_grid(), None)):
        robot = service.add_robot(f"RB-{number}")
        answer = robot.upload("0") if grid is None else send(robot, "0", grid)
        assert answer.json()["outcome"] == "created", answer.text
        rooms = features(robot.get(robot.path()).json(), "room")
        areas.append(sorted(tuple(np.round(r["geometry"]["coordinates"][0], 2).ravel().tolist()) for r in rooms))
    assert areas[0] == areas[1] == areas[2]


def test_the_grid_of_a_json_mission_is_a_picture_of_three_greys(robot: RobotCaller) -> None:
    send(robot, "0", occupancy_grid())
    for path in ("missions/0/grid.png", "versions/1/grid.png", "versions/1/cells.png"):
        assert np.array_equal(pixels(robot.get(f"{robot.path()}/{path}").content), home())


def test_a_json_mission_follows_a_picture_of_the_same_home(mapped: RobotCaller) -> None:
    assert send(mapped, "1", occupancy_grid(), resolution=0.05, origin=[-1, -2, 0]).json()["outcome"] == "updated"


@pytest.mark.parametrize(
    ("meta", "pointer"),
    [({"resolution": 0.1}, "/meta/resolution"), ({"origin": [0.0, 0.0, 0.0]}, "/meta/origin")],
)
def test_meta_that_contradicts_the_grid_is_refused_and_nothing_is_stored(
    robot: RobotCaller, meta: Json, pointer: str
) -> None:
    answer = send(robot, "0", occupancy_grid(), **meta)
    assert (answer.status_code, answer.json()["errors"][0]["pointer"]) == (422, pointer)
    assert robot.get("/api/v1/robots").json()["items"][0]["maps"] == []


# -- out -----------------------------------------------------------------------------------------------------------


@pytest.fixture
def adopted(robot: RobotCaller) -> RobotCaller:
    assert send(robot, "0", valetudo()).json()["outcome"] == "created"
    return robot


def exported(robot: RobotCaller, kind: str, version: int = 1) -> Any:
    answer = robot.get(f"{robot.path()}/versions/{version}/export?format={kind}")
    assert answer.status_code == 200, answer.text
    return answer


def unpacked(content: bytes) -> dict[str, bytes]:
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def in_mission_frame(robot: RobotCaller) -> GridFrame:
    frame = robot.get(robot.path()).json()["frame"]
    return GridFrame(frame["resolution"], frame["width"], frame["height"])


def test_nav2_files_give_the_same_grid_again(adopted: RobotCaller) -> None:
    answer = exported(adopted, "nav2")
    assert answer.headers["Content-Type"] == "application/zip"
    assert answer.headers["Content-Disposition"] == 'attachment; filename="RB-1-ground-v1.zip"'
    files = unpacked(answer.content)
    image, meta = read_yaml(files["RB-1-ground-v1.yaml"])
    again = adopted.upload("again", files[image], map_name="again", grid_type="image/x-portable-graymap", **meta)
    assert again.json()["outcome"] == "created"
    here, there = (adopted.get(f"{adopted.path(name)}/versions/1/cells.png").content for name in ("ground", "again"))
    assert np.array_equal(pixels(here), pixels(there))
    assert adopted.get(adopted.path("again")).json()["frame"] == adopted.get(adopted.path()).json()["frame"]


def test_a_valetudo_map_comes_back_with_its_rooms_names_and_restrictions(adopted: RobotCaller) -> None:
    answer = exported(adopted, "valetudo")
    back = read_valetudo(answer.json())
    assert sorted(name or "" for name in back.semantics.names) == ["", "Küche"]
    assert [r.kind for r in back.semantics.restrictions] == ["no_go", "no_mop", "virtual_wall"]
    again = adopted.upload(
        "0", answer.content, map_name="again", grid_type="application/json", resolution=None, origin=None
    )
    assert again.json()["outcome"] == "created"

    def rooms(name: str) -> list[tuple[str, float]]:
        found = features(adopted.get(adopted.path(name)).json(), "room")
        return sorted((r["properties"]["name"], round(r["properties"]["area"])) for r in found)

    assert [area for _, area in rooms("again")] == [area for _, area in rooms("ground")]


def test_geojson_is_the_map_as_the_api_gives_it(adopted: RobotCaller) -> None:
    answer = exported(adopted, "geojson")
    assert answer.headers["Content-Type"] == "application/geo+json"
    assert answer.json() == adopted.get(f"{adopted.path()}/versions/1").json()


def test_the_keep_out_mask_holds_zones_and_walls_in_the_grid_s_own_frame(adopted: RobotCaller) -> None:
    files = unpacked(exported(adopted, "keepout").content)
    name, meta = read_yaml(files["RB-1-ground-v1-keepout.yaml"])
    grid, _ = MapFile(Path(name), "image/x-portable-graymap", files[name], meta).read({})
    blocked = grid.frame.to_map(as_points(np.argwhere(grid.occupied)[:, ::-1]) + 0.5)
    assert blocked.min(0).tolist() == pytest.approx([0.1, -0.9], abs=0.06)
    assert blocked.max(0).tolist() == pytest.approx([2.0, -0.5], abs=0.06)
    assert grid.frame.width == in_mission_frame(adopted).width


def test_the_occupancy_grid_and_the_picture_can_be_had_too(adopted: RobotCaller) -> None:
    message = exported(adopted, "occupancy_grid").json()
    assert len(message["data"]) == message["info"]["width"] * message["info"]["height"]
    assert set(message["data"]) == {0, 100}
    picture = exported(adopted, "png")
    assert picture.headers["Content-Type"] == "image/png"
    assert pixels(picture.content).ndim == 3


def test_another_format_another_version_and_another_robot_are_refused(service: Service, adopted: RobotCaller) -> None:
    path = f"{adopted.path()}/versions/1/export"
    assert adopted.get(path).status_code == 422
    assert adopted.get(f"{path}?format=dwg").status_code == 422
    assert adopted.get(f"{adopted.path()}/versions/9/export?format=png").status_code == 404
    assert service.add_robot("RB-2").get(f"{path}?format=png").status_code == 403
    assert service.stranger.get(f"{path}?format=png").status_code == 401


def test_an_edited_version_is_exported_with_its_edits(service: Service, adopted: RobotCaller) -> None:
    room = features(adopted.get(adopted.path()).json(), "room")[0]["id"]
    edit = service.operator.edit(adopted.path(), 1, {"op": "rename_room", "id": room, "name": "Bad"})
    assert edit.status_code == 200, edit.text
    names = [name for name in read_valetudo(exported(adopted, "valetudo", 2).json()).semantics.names if name]
    assert "Bad" in names


def test_cells_of_the_export_are_those_that_were_sensed(adopted: RobotCaller) -> None:
    back: OccupancyGrid = read_valetudo(exported(adopted, "valetudo").json()).grid
    assert int((back.cells == Cell.FREE).sum()) == int((home() == FREE).sum())
