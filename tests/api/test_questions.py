"""What a mission leaves to ask although nothing failed (journeys J2 and J7): is it a door, and what is the new room?"""

from typing import Any

import pytest

from tests.conflicts import expect, listed, send, shown
from tests.conftest import RobotCaller, Service, features
from tests.homes import changed

Json = dict[str, Any]
STILL: Json = {"tracking": {"transform": [0.0, 0.0, 0.0]}}


def in_force(robot: RobotCaller) -> Json:
    return expect(robot.get(robot.path()))


def upload(robot: RobotCaller, mission: str, change: str) -> Json:
    return send(robot, mission, changed(change), base_version=in_force(robot)["version"], **STILL)


def decide(service: Service, robot: RobotCaller, key: str, response: str, **rest: Any) -> Json:
    path = f"{robot.path()}/conflicts/{key}/decision"
    return expect(service.operator.request("POST", path, json={"response": response} | rest))


def edit(service: Service, robot: RobotCaller, *operations: Json) -> None:
    etag = f'"v{in_force(robot)["version"]}"'
    path = f"{robot.path()}/edits"
    expect(service.operator.request("POST", path, json={"operations": operations}, headers={"If-Match": etag}))


# -- doors -----------------------------------------------------------------------------------------------------------


@pytest.fixture
def reopened(mapped: RobotCaller) -> tuple[RobotCaller, str]:
    """The way between both rooms was closed in mission 1 and is open in mission 2; and what is asked about it."""
    assert upload(mapped, "1", "shut")["conflicts"] == []
    (key,) = upload(mapped, "2", "nothing")["conflicts"]
    assert listed(mapped, "open") == {key: "open"}
    return mapped, key


def test_a_way_that_was_closed_and_is_open_again_becomes_a_door_with_one_answer(
    service: Service, reopened: tuple[RobotCaller, str]
) -> None:
    robot, key = reopened
    question = shown(robot, key)
    assert (question["kind"], question["cause"]) == ("connectivity", "door_closed")
    (feature,) = question["proposals"][0]["features"]
    assert (feature["id"], feature["properties"]["kind"]) == (question["dividers"][0], "door")
    before = in_force(robot)
    assert decide(service, robot, key, "accept")["state"] == "accepted"
    after = in_force(robot)
    assert after["version"] == before["version"] + 1
    assert [d["properties"]["kind"] for d in features(after, "divider")] == ["door"]
    assert features(after, "room") == features(before, "room")


def test_a_way_that_is_no_door_is_not_asked_about_again(service: Service, reopened: tuple[RobotCaller, str]) -> None:
    robot, key = reopened
    version = in_force(robot)["version"]
    assert decide(service, robot, key, "reject")["state"] == "rejected"
    assert in_force(robot)["version"] == version
    upload(robot, "3", "shut")
    assert upload(robot, "4", "nothing")["conflicts"] == []


def test_the_question_about_a_door_waits_while_missions_come_and_goes_with_the_divider(
    service: Service, reopened: tuple[RobotCaller, str]
) -> None:
    robot, key = reopened
    upload(robot, "3", "nothing")
    assert listed(robot, "open") == {key: "open"}
    edit(service, robot, {"op": "set_divider_kind", "id": shown(robot, key)["dividers"][0], "kind": "door"})
    upload(robot, "4", "nothing")
    assert shown(robot, key)["state"] == "superseded"


# -- new rooms -------------------------------------------------------------------------------------------------------


@pytest.fixture
def annexed(mapped: RobotCaller) -> tuple[RobotCaller, str, str]:
    """A robot that found a room behind a new doorway; what that is called as a conflict, and the room."""
    mission = upload(mapped, "1", "annex")
    assert mission["outcome"] == "updated", mission["reason"]
    (room,), (key,) = mission["discovered_rooms"], mission["conflicts"]
    return mapped, key, room


def test_a_new_room_is_on_the_map_and_nobody_has_to_answer(annexed: tuple[RobotCaller, str, str]) -> None:
    robot, key, room = annexed
    found = shown(robot, key)
    assert (found["state"], found["default"]) == ("resolved_automatically", None)
    assert [r["id"] for r in found["rooms"]] == [room]
    assert listed(robot, "open") == {}


def test_a_new_room_that_is_part_of_another_is_joined_to_it_and_not_found_again(
    service: Service, annexed: tuple[RobotCaller, str, str]
) -> None:
    robot, key, room = annexed
    before = {f["id"]: f["properties"]["name"] for f in features(in_force(robot), "room")}
    decided = decide(service, robot, key, "reject")
    assert decided["state"] == "rejected"
    after = {f["id"]: f["properties"]["name"] for f in features(in_force(robot), "room")}
    assert after == {id_: name for id_, name in before.items() if id_ != room}
    again = upload(robot, "2", "annex")
    assert (again["outcome"], again["discovered_rooms"], again["conflicts"]) == ("updated", [], [])
    assert {f["id"] for f in features(in_force(robot), "room")} == set(after)


def test_both_answers_can_be_seen_before_they_are_given(
    service: Service, annexed: tuple[RobotCaller, str, str]
) -> None:
    robot, key, room = annexed
    for proposal, is_there in zip(shown(robot, key)["proposals"], (True, False), strict=True):
        document = expect(service.operator.request("GET", proposal["result"]))
        assert (room in {f["id"] for f in features(document, "room")}) == is_there
        assert decide(service, robot, key, "accept", proposal="p2")["state"] == "accepted" if not is_there else True


def test_what_was_found_waits_for_its_name_however_many_missions_come(
    service: Service, annexed: tuple[RobotCaller, str, str]
) -> None:
    robot, key, room = annexed
    upload(robot, "2", "annex")
    upload(robot, "3", "annex")
    assert shown(robot, key)["state"] == "resolved_automatically"
    edit(service, robot, {"op": "rename_room", "id": room, "name": "Study"})
    upload(robot, "4", "annex")
    assert shown(robot, key)["state"] == "superseded"


# -- corrections that the robot contradicts --------------------------------------------------------------------------


def test_a_way_that_the_robot_finds_mission_after_mission_can_be_taken_as_it_is(
    service: Service, mapped: RobotCaller
) -> None:
    for mission in range(1, 7):
        upload(mapped, str(mission), "open plan")
    (key,) = listed(mapped, "open")
    question = shown(mapped, key)
    assert (question["kind"], question["cause"]) == ("connectivity", "new_passage")
    assert [p["action"] for p in question["proposals"]] == ["meta_dividers", "take_new"]
    assert len(features(expect(service.operator.request("GET", question["proposals"][1]["result"])), "room")) == 1
    decide(service, mapped, key, "accept", proposal="p2")
    assert len(features(in_force(mapped), "room")) == 1
    again = upload(mapped, "7", "open plan")
    assert (again["outcome"], again["conflicts"]) == ("updated", [])
    assert len(features(in_force(mapped), "room")) == 1
