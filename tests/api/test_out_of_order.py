"""Robots on bad links, and people who edit while the robot is out (journeys J5 and J6)."""

import json
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest

from tests.conftest import RobotCaller, Service, features
from tests.homes import home, pixels

SPLIT = {"op": "add_divider", "line": [[0.05, 1.0], [3.9, 1.0]]}
"""Through the western room."""


def names(document: dict[str, Any]) -> dict[str, str]:
    return {f["id"]: f["properties"]["name"] for f in features(document, "room")}


def moved(document: dict[str, Any], dx: float, dy: float) -> dict[str, Any]:
    """All rooms and dividers of a version as a robot tracked them."""

    def move(points: list[list[float]]) -> list[list[float]]:
        return [[x + dx, y + dy] for x, y in points]

    return {
        "rooms": {f["id"]: move(f["geometry"]["coordinates"][0]) for f in features(document, "room")},
        "dividers": {f["id"]: move(f["geometry"]["coordinates"]) for f in features(document, "divider")},
    }


def causes(robot: RobotCaller) -> list[str]:
    return [version["cause"] for version in robot.get(f"{robot.path()}/versions").json()["items"]]


def test_retries_get_the_same_answer_whatever_happened_since(service: Service, mapped: RobotCaller) -> None:
    first = mapped.upload("1", home(shift=(1, 0)))
    assert (first.status_code, first.json()["version"]) == (201, 2)
    service.operator.edit(mapped.path(), 2, {"op": "rename_room", "id": "r1", "name": "Kitchen"})
    again = [mapped.upload("1", home(shift=(1, 0)))]
    mapped.upload("2", home(shift=(2, 0)))
    with ThreadPoolExecutor(2) as pool:
        again += pool.map(lambda _: mapped.upload("1", home(shift=(1, 0))), range(2))
    service.operator.request("POST", f"{mapped.path()}/versions/1/restore")
    again += [mapped.upload("1", home(shift=(1, 0)), wait=wait) for wait in (30, None)]
    assert [answer.status_code for answer in again] == [200] * 5
    assert {answer.text for answer in again} == {first.text}
    assert causes(mapped) == ["restore", "mission", "edit", "mission", "created"]


def test_a_retry_of_a_mission_that_still_waits_is_told_so(service: Service, mapped: RobotCaller) -> None:
    service.worker.paused = True
    answers = [mapped.upload("1", home(shift=(1, 0)), wait=None) for _ in range(2)]
    assert [answer.status_code for answer in answers] == [202, 202]
    assert answers[0].json() == answers[1].json()
    service.worker.resume()
    assert mapped.upload("1", home(shift=(1, 0))).json()["outcome"] == "updated"
    assert causes(mapped) == ["mission", "created"]


def test_other_bytes_are_refused_before_and_after_the_first_is_processed(service: Service, mapped: RobotCaller) -> None:
    service.worker.paused = True
    mapped.upload("1", home(shift=(1, 0)), wait=None)
    assert mapped.upload("1", home(shift=(2, 0))).status_code == 409
    service.worker.resume()
    assert mapped.upload("1", home(shift=(2, 0))).status_code == 409
    kept = mapped.get(f"{mapped.path()}/missions/1/grid.png")
    assert np.array_equal(pixels(kept.content), home(shift=(1, 0)))


def test_yesterdays_mission_after_todays_changes_nothing_and_todays_retry_neither(mapped: RobotCaller) -> None:
    today = mapped.upload("18", home(shift=(1, 0)))
    before = mapped.get(mapped.path())
    yesterday = mapped.upload("17", home(shift=(0, 1)))
    assert (yesterday.status_code, yesterday.json()["outcome"]) == (201, "superseded")
    assert (yesterday.json()["version"], yesterday.json()["ablation"]) == (2, None)
    assert all(0 < room["recall"] <= 1 for room in yesterday.json()["rooms"])
    assert mapped.upload("18", home(shift=(1, 0))).text == today.text
    assert mapped.get(mapped.path()).content == before.content
    assert mapped.upload("19").json()["outcome"] == "updated"


def test_of_two_missions_with_one_sequence_number_the_one_that_came_later_counts_as_the_newer(
    service: Service, mapped: RobotCaller
) -> None:
    service.worker.paused = True
    for mission, shift in (("b", 1), ("a", 2)):
        mapped.upload(mission, home(shift=(shift, 0)), sequence=5, wait=None)
    service.worker.resume()
    outcomes = {m["id"]: (m["outcome"], m["version"]) for m in mapped.get(f"{mapped.path()}/missions").json()["items"]}
    assert outcomes == {"0": ("created", 1), "b": ("updated", 2), "a": ("updated", 3)}


def test_the_epoch_outranks_the_sequence_also_among_those_that_wait(service: Service, mapped: RobotCaller) -> None:
    service.worker.paused = True
    mapped.upload("after-reset", home(shift=(1, 0)), sequence=0, epoch=1, wait=None)
    mapped.upload("9", home(shift=(0, 1)), wait=None)
    service.worker.resume()
    versions = mapped.get(f"{mapped.path()}/versions").json()["items"]
    assert [version["mission"] for version in versions] == ["after-reset", "9", "0"]


def test_edits_made_while_the_robot_was_out_meet_its_new_occupancy(service: Service, mapped: RobotCaller) -> None:
    """J6: left with v1, renamed in v2, divided in v3, uploaded as v4."""
    base = mapped.get(mapped.path()).json()
    service.operator.edit(mapped.path(), 1, {"op": "rename_room", "id": "r2", "name": "Kitchen"})
    divided = service.operator.edit(mapped.path(), 2, SPLIT).json()
    (added,) = {f["id"] for f in features(divided, "divider")} - {f["id"] for f in features(base, "divider")}
    grid = home(shift=(6, 4))
    mission = mapped.upload("1", grid, base_version=1, tracking=moved(base, 0.3, 0.2)).json()
    assert (mission["outcome"], mission["base_version"], mission["version"]) == ("updated", 3, 4), mission["reason"]
    assert mission["warnings"] == []
    result = mapped.get(mapped.path()).json()
    assert names(result) == names(divided)
    assert "Kitchen" in names(result).values()
    before, after = (next(f for f in features(d, "divider") if f["id"] == added) for d in (divided, result))
    shift = np.subtract(after["geometry"]["coordinates"], before["geometry"]["coordinates"])
    assert np.allclose(shift, [0.3, 0.2], atol=0.08)
    assert np.array_equal(pixels(mapped.get(result["grid"]).content), grid)
    for room in features(result, "room"):
        assert mapped.get(f"{mapped.path()}/rooms/{room['id']}").json() == room


def test_tracking_of_rooms_that_were_merged_meanwhile_moves_what_they_became(
    service: Service, mapped: RobotCaller
) -> None:
    base = mapped.get(mapped.path()).json()
    merged = service.operator.edit(mapped.path(), 1, {"op": "merge_rooms", "ids": ["r1", "r2"]}).json()
    ((survivor, _),) = names(merged).items()
    mission = mapped.upload("1", home(shift=(6, 4)), base_version=1, tracking=moved(base, 0.3, 0.2)).json()
    assert (mission["outcome"], mission["warnings"]) == ("updated", []), mission["reason"]
    assert names(mapped.get(mapped.path()).json()) == names(merged)
    (ended,) = {"r1", "r2"} - {survivor}
    assert mapped.get(f"{mapped.path()}/rooms/{ended}").json()["survivor"] == survivor


@pytest.mark.parametrize("restored", [1, 2])
def test_tracking_from_a_version_that_a_restore_left_aside_goes_through_the_frames_they_share(
    service: Service, mapped: RobotCaller, restored: int
) -> None:
    """v2 lies 0.5 m east of v1; v3 is one of the two again. The robot left with v2 and sees all where v2 had it."""
    step = mapped.upload("1", home(shift=(10, 0)), base_version=1, tracking={"transform": [0.5, 0.0, 0.0]}).json()
    assert (step["outcome"], step["version"]) == ("updated", 2)
    base = mapped.get(f"{mapped.path()}/versions/2").json()
    service.operator.request("POST", f"{mapped.path()}/versions/{restored}/restore")
    mission = mapped.upload("2", home(shift=(10, 0)), base_version=2, tracking=moved(base, 0.0, 0.0)).json()
    assert (mission["outcome"], mission["base_version"], mission["version"]) == ("updated", 3, 4), mission["reason"]
    assert all(room["recall"] > 0.95 for room in mission["rooms"])
    now = {f["id"]: f["geometry"]["coordinates"] for f in features(mapped.get(mapped.path()).json(), "room")}
    for room in features(base, "room"):
        corners = np.asarray(room["geometry"]["coordinates"][0])
        assert np.allclose(np.mean(now[room["id"]][0], 0), corners.mean(0), atol=0.2)


def test_an_unknown_base_falls_back_on_registration(mapped: RobotCaller) -> None:
    mission = mapped.upload("1", home(shift=(3, 0)), base_version=99, tracking={"transform": [9.0, 9.0, 1.0]}).json()
    assert (mission["outcome"], mission["base_version"]) == ("updated", 1)
    assert "99" in json.dumps(mission["warnings"])


def test_the_map_is_made_by_the_first_mission_that_the_core_can_digest(
    robot: RobotCaller, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patch:
        patch.setattr("stillroom.service.gathering.create_semantic_map", lambda *_, **__: 1 / 0)
        for mission in ("5", "6"):
            failed = robot.upload(mission).json()
            assert (failed["outcome"], failed["version"], failed["base_version"]) == ("reverted", None, None)
    assert robot.get(robot.path()).status_code == 404
    assert robot.get(f"{robot.path()}/missions/5/grid.png").status_code == 200
    assert robot.upload("7").json()["outcome"] == "created"
    assert robot.upload("6").json()["outcome"] == "reverted"  # the same answer as before
    assert robot.upload("4").json()["outcome"] == "superseded"
