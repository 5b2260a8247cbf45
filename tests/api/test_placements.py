"""Missions that fit no known frame: parked, and put where a person says (journey J8)."""

from concurrent.futures import ThreadPoolExecutor
from math import pi
from typing import Any

import numpy as np
import pytest
from httpx2 import Response
from shapely import Polygon

from stillroom.documents.images import as_grey
from stillroom.maps.geometry import Pose
from stillroom.maps.grid import OccupancyGrid
from tests.conftest import RobotCaller, Service, features
from tests.homes import Image, pixels
from tests.pipeline.test_registration import HOME, MIRRORED, turned

HOUSE, TWINS = HOME.grid, MIRRORED.grid
"""One that can be told at any angle, and one that looks the same from both ends."""
AFTER_RESET = Pose(5.0, 3.0, pi / 2)
NO_GO = {"op": "add_restriction", "kind": "no_go", "shape": [[1.0, 1.0], [2.0, 1.0], [2.0, 1.5], [1.0, 1.5]]}


def image(grid: OccupancyGrid) -> Image:
    return as_grey(grid.cells)


def send(robot: RobotCaller, mission: str, grid: OccupancyGrid, map_name: str = "ground", **meta: Any) -> Response:
    origin = grid.frame.origin
    frame: dict[str, Any] = {"resolution": grid.frame.resolution, "origin": [origin.x, origin.y, origin.yaw]}
    return robot.upload(mission, image(grid), map_name=map_name, **(frame | meta))


def place(service: Service, robot: RobotCaller, mission: str, floor: str, map_name: str = "ground") -> Response:
    path = f"{robot.path(map_name)}/missions/{mission}/placement"
    return service.operator.request("POST", path, json={"map": floor})


def rooms(document: dict[str, Any]) -> dict[str, dict[str, Any]]:
    return {f["id"]: f for f in features(document, "room")}


def outline(feature: dict[str, Any]) -> Polygon:
    rings = feature["geometry"]["coordinates"]
    return Polygon(rings[0], rings[1:])


@pytest.fixture
def twins(robot: RobotCaller) -> RobotCaller:
    """A robot whose ground floor has two rooms that nobody can tell apart."""
    assert send(robot, "0", TWINS).json()["outcome"] == "created"
    return robot


@pytest.fixture
def house(robot: RobotCaller) -> RobotCaller:
    assert send(robot, "0", HOUSE).json()["outcome"] == "created"
    return robot


def test_a_mission_from_another_floor_is_parked_and_changes_nothing(house: RobotCaller) -> None:
    before = house.get(house.path())
    mission = send(house, "1", TWINS).json()
    assert (mission["outcome"], mission["version"], mission["ablation"]) == ("parked", 1, None)
    assert [candidate["map"] for candidate in mission["candidates"]] == ["ground"]
    assert not mission["candidates"][0]["certain"]
    assert mission["decision"] is None
    assert "it may be a new one" in mission["reason"]
    assert house.get(house.path()).content == before.content
    assert np.array_equal(pixels(house.get(f"{house.path()}/missions/1/grid.png").content), image(TWINS))


def test_placed_on_a_new_floor_it_makes_a_map_whose_ids_clash_with_none(service: Service, house: RobotCaller) -> None:
    send(house, "1", TWINS)
    before = house.get(house.path())
    placed = place(service, house, "1", "upstairs")
    assert placed.status_code == 200, placed.text
    assert placed.json() == house.get(f"{house.path()}/missions/1").json()
    assert placed.json()["outcome"] == "parked"
    decision = placed.json()["decision"]
    assert (decision["map"], decision["outcome"], decision["version"]) == ("upstairs", "created", 1)
    assert decision["decided_by"] == "operator"
    upstairs = house.get(house.path("upstairs")).json()
    assert (upstairs["cause"], upstairs["made_by"], upstairs["mission"]) == ("created", "operator", "1~ground")
    assert len(rooms(upstairs)) == 2
    assert not rooms(upstairs).keys() & rooms(before.json()).keys()
    assert house.get(house.path()).content == before.content
    mission = house.get(f"{house.path('upstairs')}/missions/{decision['mission']}").json()
    assert (mission["outcome"], mission["map"]) == ("created", "upstairs")
    assert np.array_equal(pixels(house.get(upstairs["cells"]).content), image(TWINS))


def test_placed_on_a_known_floor_it_updates_that_and_leaves_its_numbering_alone(
    service: Service, twins: RobotCaller
) -> None:
    send(twins, "0", HOUSE, "upstairs")
    parked = send(twins, "100", turned(HOUSE, AFTER_RESET)).json()
    assert (parked["outcome"], parked["candidates"][0]["map"]) == ("parked", "upstairs")
    assert parked["candidates"][0]["certain"]
    assert "It looks like upstairs" in parked["reason"]
    decision = place(service, twins, "100", "upstairs").json()["decision"]
    assert (decision["outcome"], decision["version"]) == ("updated", 2), decision["reason"]
    upstairs = twins.get(twins.path("upstairs")).json()
    assert (upstairs["cause"], upstairs["made_by"]) == ("decision", "operator")
    # The robot goes on with its own numbers and ids.
    own = send(twins, "1", turned(HOUSE, AFTER_RESET), "upstairs").json()
    assert (own["outcome"], own["version"]) == ("updated", 3)
    assert send(twins, "100", turned(HOUSE, AFTER_RESET), "upstairs").status_code == 201


def test_after_a_reset_a_frame_that_can_be_told_is_found_by_itself(service: Service, house: RobotCaller) -> None:
    before = service.operator.edit(house.path(), 1, NO_GO).json()
    mission = send(house, "after-reset", turned(HOUSE, AFTER_RESET), sequence=0, epoch=1).json()
    assert (mission["outcome"], mission["version"]) == ("updated", 3), mission["reason"]
    after = house.get(house.path()).json()
    assert rooms(after).keys() == rooms(before).keys()
    (zone,) = features(after, "restriction")
    assert zone["properties"]["placement"] == "placed"
    expected = AFTER_RESET.apply(np.array(NO_GO["shape"]))
    assert np.allclose(zone["geometry"]["coordinates"][0][:4], expected, atol=0.1)


def test_after_a_reset_the_owner_gets_rooms_and_restrictions_back_with_one_call(
    service: Service, twins: RobotCaller
) -> None:
    rename = {"op": "rename_room", "id": "r1", "name": "Kitchen"}
    before = service.operator.edit(twins.path(), 1, rename, NO_GO).json()
    parked = send(twins, "after-reset", turned(TWINS, AFTER_RESET), sequence=0, epoch=1).json()
    assert (parked["outcome"], parked["version"]) == ("parked", 2)
    assert "brings back 2 rooms and 1 restriction" in parked["reason"]
    decision = place(service, twins, "after-reset", "ground").json()["decision"]
    assert (decision["outcome"], decision["version"]) == ("updated", 3), decision["reason"]
    after = twins.get(twins.path()).json()
    assert (after["cause"], after["made_by"], after["mission"]) == ("decision", "operator", "after-reset~ground")
    assert {i: f["properties"]["name"] for i, f in rooms(after).items()} == {
        i: f["properties"]["name"] for i, f in rooms(before).items()
    }
    for room_id, room in rooms(after).items():
        assert outline(room).area == pytest.approx(outline(rooms(before)[room_id]).area, rel=0.05)
    (zone,), (kept,) = features(after, "restriction"), features(before, "restriction")
    assert (zone["id"], zone["properties"]["placement"]) == (kept["id"], "placed")
    assert outline(zone).area == pytest.approx(outline(kept).area, rel=1e-3)
    assert {f["id"] for f in features(after, "divider")} == {f["id"] for f in features(before, "divider")}
    following = send(twins, "1", turned(TWINS, AFTER_RESET), epoch=1, base_version=3, tracking={"transform": [0, 0, 0]})
    assert (following.json()["outcome"], following.json()["version"]) == ("updated", 4)


def test_the_same_placement_again_or_at_once_is_one_and_another_is_refused(
    service: Service, house: RobotCaller
) -> None:
    send(house, "1", TWINS)
    with ThreadPoolExecutor(3) as pool:
        answers = list(pool.map(lambda _: place(service, house, "1", "upstairs"), range(3)))
    answers.append(place(service, house, "1", "upstairs"))
    assert [answer.status_code for answer in answers] == [200] * 4
    assert len({answer.text for answer in answers}) == 1
    assert len(house.get(f"{house.path('upstairs')}/versions").json()["items"]) == 1
    other = place(service, house, "1", "cellar")
    assert (other.status_code, other.json()["type"]) == (409, "/problems/already-decided")
    assert (other.json()["decided_by"], other.json()["map"]) == ("operator", "upstairs")
    maps = service.operator.get("/api/v1/robots").json()["items"][0]["maps"]
    assert [found["map"] for found in maps] == ["ground", "upstairs"]


def test_a_placement_that_changed_nothing_can_be_made_elsewhere(
    service: Service, house: RobotCaller, monkeypatch: pytest.MonkeyPatch
) -> None:
    send(house, "1", TWINS)
    with monkeypatch.context() as patch:
        patch.setattr("stillroom.service.gathering.update_map", lambda *_, **__: 1 / 0)
        assert place(service, house, "1", "ground").json()["decision"]["outcome"] == "reverted"
    assert house.get(house.path()).json()["version"] == 1
    moved = place(service, house, "1", "upstairs").json()["decision"]
    assert (moved["map"], moved["outcome"]) == ("upstairs", "created")


def test_a_parked_mission_that_is_older_than_the_map_in_force_does_not_replace_it(
    service: Service, twins: RobotCaller
) -> None:
    for sequence in (0, 1):
        parked = send(twins, f"reset-{sequence}", turned(TWINS, AFTER_RESET), sequence=sequence, epoch=1).json()
        assert parked["outcome"] == "parked"
    assert place(service, twins, "reset-1", "ground").json()["decision"]["outcome"] == "updated"
    before = twins.get(twins.path())
    assert place(service, twins, "reset-0", "ground").json()["decision"]["outcome"] == "superseded"
    assert twins.get(twins.path()).content == before.content


def test_a_placement_answers_the_question_that_the_mission_raised(service: Service, house: RobotCaller) -> None:
    for mission in ("1", "2"):
        (key,) = send(house, mission, TWINS).json()["conflicts"]
    (asked,) = house.get(f"{house.path()}/conflicts?state=open").json()["items"]
    assert (asked["id"], asked["kind"], asked["mission"], asked["fold_count"]) == (key, "wrong_map", "2", 1)
    path = f"{house.path()}/conflicts/{key}/decision"
    accepted = service.operator.request("POST", path, json={"response": "accept"})
    assert accepted.status_code == 422
    assert "which floor" in accepted.json()["detail"]
    place(service, house, "2", "upstairs")
    answered = house.get(f"{house.path()}/conflicts/{key}").json()
    assert (answered["state"], answered["decided_by"]) == ("accepted", "operator")
    assert answered["note"] == "Mission 2 was placed on upstairs."
    assert house.get(f"{house.path()}/missions/2").json()["decision"]["map"] == "upstairs"
    assert house.get(f"{house.path()}/missions/2/cells.png").status_code == 200


def test_a_mission_that_belongs_nowhere_is_rejected(service: Service, house: RobotCaller) -> None:
    (key,) = send(house, "1", TWINS).json()["conflicts"]
    path = f"{house.path()}/conflicts/{key}/decision"
    assert service.operator.request("POST", path, json={"response": "reject"}).json()["state"] == "rejected"
    decision = house.get(f"{house.path()}/missions/1").json()["decision"]
    assert (decision["response"], decision["conflict"], decision["version"]) == ("reject", key, 1)
    assert place(service, house, "1", "upstairs").json()["decision"]["outcome"] == "created"


def test_only_parked_missions_are_placed(service: Service, house: RobotCaller) -> None:
    taken = place(service, house, "0", "upstairs")
    assert (taken.status_code, taken.json()["type"]) == (409, "/problems/not-parked")
    service.worker.paused = True
    house.upload("1", wait=None)
    assert place(service, house, "1", "upstairs").status_code == 409
    service.worker.resume()
    assert place(service, house, "9", "upstairs").status_code == 404
    assert place(service, house, "0", "up stairs").status_code == 422
    assert [m["map"] for m in service.operator.get("/api/v1/robots").json()["items"][0]["maps"]] == ["ground"]


def test_a_placement_that_takes_long_is_told_so(service: Service, house: RobotCaller) -> None:
    send(house, "1", TWINS)
    service.worker.paused = True
    path = f"{house.path()}/missions/1/placement"
    answer = service.operator.request("POST", path, {"Prefer": "wait=0"}, json={"map": "upstairs"})
    assert (answer.status_code, answer.json()["decision"]["status"]) == (202, "queued")
    assert place_again(service, path) == (202, "queued")
    service.worker.resume()
    assert place_again(service, path) == (200, "done")


def place_again(service: Service, path: str) -> tuple[int, str]:
    answer = service.operator.request("POST", path, {"Prefer": "wait=0"}, json={"map": "upstairs"})
    return answer.status_code, answer.json()["decision"]["status"]


def test_missions_are_listed_with_what_was_decided(service: Service, house: RobotCaller) -> None:
    send(house, "1", TWINS)
    place(service, house, "1", "upstairs")
    listed = house.get(f"{house.path()}/missions").json()["items"]
    assert [(m["id"], m["decision"] and m["decision"]["map"]) for m in listed] == [("1", "upstairs"), ("0", None)]
    assert [m["id"] for m in house.get(f"{house.path('upstairs')}/missions").json()["items"]] == ["1~ground"]
