"""People decide conflicts (journeys J1 and J2): once, whoever asks how often, and with all that follows from it."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from typing import Any

import numpy as np
import pytest
import sqlalchemy as sa
from httpx2 import Response

from stillroom.documents.stored import decode_map
from stillroom.maps.mission import Mission
from stillroom.maps.semantics import SemanticMap
from stillroom.pipeline.update import MapUpdate
from stillroom.service.decisions import expire
from stillroom.store import maps
from stillroom.store.tables import conflict as conflict_table
from stillroom.store.tables import ending
from tests.conflicts import Core, conflict, expect, listed, rejected, score, send, settled, shown, told
from tests.conftest import RobotCaller, Service, features
from tests.homes import Image, home, pixels

Json = dict[str, Any]
OPEN_PLAN = home(wall_between=False)
"""The wall between the two rooms is gone: it takes meta-dividers to keep them apart."""
STILL: Json = {"tracking": {"transform": [0.0, 0.0, 0.0]}}
LINE = [[4.0, -1.0], [4.0, 3.0]]
"""Where that wall was."""
RENAME = {"op": "rename_room", "id": "r1", "name": "Kitchen"}


def decide(
    service: Service, robot: RobotCaller, key: str, response: str, dry_run: bool = False, **rest: Any
) -> Response:
    query = "?dry_run=true" if dry_run else ""
    path = f"{robot.path()}/conflicts/{key}/decision{query}"
    return service.operator.request("POST", path, json={"response": response} | rest)


def send_open_plan(robot: RobotCaller, mission: str) -> Json:
    """The robot tracked that nothing moved since the version in force."""
    return send(robot, mission, OPEN_PLAN, base_version=in_force(robot)["version"], **STILL)


def in_force(robot: RobotCaller) -> Json:
    return expect(robot.get(robot.path()))


def rooms(document: Json) -> dict[str, str]:
    return {f["id"]: f["properties"]["name"] for f in features(document, "room")}


def causes(robot: RobotCaller) -> list[str]:
    """The newest first."""
    return [version["cause"] for version in robot.get(f"{robot.path()}/versions").json()["items"]]


def stored(service: Service, number: int) -> SemanticMap:
    with service.database.read() as tx:
        row = maps.version_at(tx, 1, number)
    assert row is not None
    return decode_map(row.document)


def without_frame(document: Json) -> Json:
    """What does not change when a map comes into force."""
    return {name: document[name] for name in ("version", "parent", "cause", "mission", "made_by", "frame", "features")}


@pytest.fixture
def asked(mapped: RobotCaller, core: Core) -> RobotCaller:
    """A robot whose mission 1 was not taken: conflict c1 is open. From then on the core answers for itself."""
    core.planned["1"] = rejected("c1")
    send(mapped, "1")
    core.planned.clear()
    return mapped


@pytest.fixture
def corrected(mapped: RobotCaller) -> tuple[RobotCaller, str]:
    """A robot whose mission 1 found the wall gone and was taken with meta-dividers; and what that conflict is called."""
    mission = send_open_plan(mapped, "1")
    assert mission["outcome"] == "resolved", mission["reason"]
    (found,) = (c for c in mapped.get(f"{mapped.path()}/conflicts").json()["items"] if c["kind"] == "room_lost")
    assert found["state"] == "resolved_automatically"
    return mapped, found["id"]


# -- accept --------------------------------------------------------------------------------------------------------


def test_keeping_the_rooms_as_they_were_closes_the_question_and_changes_no_id(
    service: Service, asked: RobotCaller
) -> None:
    before, segments = in_force(asked), asked.get(f"{asked.path()}/segments").json()
    found = expect(decide(service, asked, "c1", "accept", proposal="p2"))
    assert (found["state"], found["response"], found["proposal"]) == ("accepted", "accept", "p2")
    assert (found["decided_by"], found["version"]) == ("operator", 2)
    after = in_force(asked)
    assert (after["version"], after["cause"], after["made_by"], after["mission"]) == (2, "decision", "operator", "0")
    assert after["features"] == before["features"]
    assert asked.get(f"{asked.path()}/segments").json() == segments
    confirmed = stored(service, 2).room("r1")
    assert confirmed is not None
    assert confirmed.anchor == confirmed.polygon
    assert send(asked, "2")["outcome"] == "updated"


def test_the_new_map_comes_into_force_on_its_mission_s_grid(service: Service, asked: RobotCaller) -> None:
    found = expect(decide(service, asked, "c1", "accept"))  # as recommended
    assert found["proposal"] == "p1"
    after = in_force(asked)
    assert (after["version"], after["parent"], after["mission"], after["cause"]) == (2, 1, "1", "decision")
    assert rooms(after).keys() == {"r1", "r2"}
    assert np.array_equal(pixels(asked.get(after["grid"]).content), home(shift=(1, 0)))
    assert asked.get(after["grid"]).content == asked.get(f"{asked.path()}/missions/1/grid.png").content
    mission = expect(asked.get(f"{asked.path()}/missions/1"))
    assert (mission["outcome"], mission["version"]) == ("needs_review", 1)  # what processing found never changes
    decision = mission["decision"]
    assert (decision["conflict"], decision["response"], decision["version"]) == ("c1", "accept", 2)
    assert decision["decided_by"] == "operator"


@pytest.mark.parametrize("base", [1, 2])
def test_a_robot_that_left_before_or_after_the_decision_is_understood(
    service: Service, asked: RobotCaller, base: int
) -> None:
    expect(decide(service, asked, "c1", "accept"))
    shift = {1: 0.10, 2: 0.05}[base]  # version 1 lies a cell to the left of version 2
    moved = {"base_version": base, "tracking": {"transform": [shift, 0.0, 0.0]}}
    mission = send(asked, "2", home(shift=(2, 0)), **moved)
    assert (mission["outcome"], mission["version"]) == ("updated", 3), mission["reason"]
    left = min(x for f in features(in_force(asked), "room") for x, _ in f["geometry"]["coordinates"][0])
    assert left == pytest.approx(0.10, abs=0.02)


def test_a_correction_that_is_accepted_becomes_the_owner_s_own(
    service: Service, corrected: tuple[RobotCaller, str]
) -> None:
    robot, key = corrected
    before = in_force(robot)
    assert features(before, "meta_divider")
    found = expect(decide(service, robot, key, "accept"))
    assert (found["state"], found["version"]) == ("accepted", 3)
    after = in_force(robot)
    assert not features(after, "meta_divider")
    known = {f["id"] for f in features(before, "divider")}
    made = [f for f in features(after, "divider") if f["id"] not in known]
    assert made
    assert {f["properties"]["made_by"] for f in made} == {"user"}
    assert features(after, "room") == features(before, "room")
    mission = send_open_plan(robot, "2")
    assert (mission["outcome"], mission["conflicts"]) == ("updated", [])  # the meta layer is not needed any more
    assert rooms(in_force(robot)).keys() == {"r1", "r2"}


def test_a_map_that_was_taken_but_questioned_is_confirmed_as_it_is(
    service: Service, mapped: RobotCaller, core: Core
) -> None:
    def questioned(_previous: SemanticMap, _mission: Mission, update: MapUpdate) -> MapUpdate:
        rooms = tuple(replace(room, anchor=None) for room in update.map.rooms)
        return replace(update, map=replace(update.map, rooms=rooms), conflicts=(conflict("c1", kind="drift"),))

    core.planned["1"] = questioned
    assert send(mapped, "1")["outcome"] == "updated"
    (proposal,) = shown(mapped, "c1")["proposals"]
    assert (proposal["id"], proposal["action"], proposal["recommended"]) == ("p1", "take_new", True)
    expect(decide(service, mapped, "c1", "accept"))
    assert [room.id for room in stored(service, 3).rooms if room.anchor is not None] == ["r1"]
    assert in_force(mapped)["mission"] == "1"


def test_accepting_one_map_of_a_mission_settles_all_that_was_asked_about_it(
    service: Service, mapped: RobotCaller, core: Core
) -> None:
    def twice(previous: SemanticMap, mission: Mission, update: MapUpdate) -> MapUpdate:
        first = rejected("c1")(previous, mission, update)
        second = rejected("c2", rooms=("r2",))(previous, mission, update)
        return replace(first, conflicts=(*first.conflicts, *second.conflicts))

    core.planned["1"] = twice
    send(mapped, "1")
    expect(decide(service, mapped, "c2", "accept"))
    assert listed(mapped) == {"c2": "accepted", "c1": "superseded"}
    assert shown(mapped, "c1")["decided_by"] == "operator"
    assert decide(service, mapped, "c1", "reject").status_code == 409


def test_an_edit_made_meanwhile_survives_the_decision(service: Service, asked: RobotCaller) -> None:
    expect(service.operator.edit(asked.path(), 1, RENAME))
    expect(decide(service, asked, "c1", "accept", proposal="p1"))
    after = in_force(asked)
    assert (after["version"], after["mission"], rooms(after)["r1"]) == (3, "1", "Kitchen")
    assert causes(asked) == ["decision", "edit", "created"]


def test_a_proposal_that_fits_no_more_is_refused_and_the_question_stays(
    service: Service, asked: RobotCaller, core: Core
) -> None:
    def hopeless(previous: SemanticMap, _mission: Mission, update: MapUpdate) -> MapUpdate:
        return replace(update, outcome="reverted", map=previous, taken=False, conflicts=(conflict("c9"),))

    expect(service.operator.edit(asked.path(), 1, RENAME))
    core.planned["1"] = hopeless
    answer = decide(service, asked, "c1", "accept", proposal="p1")
    assert (answer.status_code, answer.json()["type"]) == (409, "/problems/proposal-outdated")
    assert listed(asked) == {"c1": "open"}
    assert expect(decide(service, asked, "c1", "reject"))["state"] == "rejected"


# -- reject, temporary ---------------------------------------------------------------------------------------------


def test_a_rejected_map_leaves_everything_as_it_is(service: Service, asked: RobotCaller) -> None:
    before = asked.get(asked.path()).content
    found = expect(decide(service, asked, "c1", "reject", note="The sofa stood there."))
    assert (found["state"], found["version"], found["note"]) == ("rejected", 1, "The sofa stood there.")
    assert asked.get(asked.path()).content == before
    assert listed(asked, "open") == {}


def test_a_correction_that_is_rejected_goes_with_what_it_held_apart(
    service: Service, corrected: tuple[RobotCaller, str]
) -> None:
    robot, key = corrected
    found = expect(decide(service, robot, key, "reject"))
    assert (found["state"], found["version"]) == ("rejected", 3)
    after = in_force(robot)
    assert not features(after, "meta_divider")
    (survivor,) = rooms(after)
    (gone,) = {"r1", "r2"} - {survivor}
    retired = expect(robot.get(f"{robot.path()}/rooms/{gone}"))
    assert (retired["retired"], retired["survivor"]) == (True, survivor)
    for mission in ("2", "3"):
        again = send_open_plan(robot, mission)
        assert (again["outcome"], again["conflicts"]) == ("updated", []), again["reason"]
        assert rooms(in_force(robot)).keys() == {survivor}
    assert all(place.until is None for place in stored(service, 5).meta.declined)
    assert stored(service, 5).meta.declined


def test_what_was_called_temporary_is_not_asked_again_for_a_week(
    service: Service, asked: RobotCaller, core: Core
) -> None:
    found = expect(decide(service, asked, "c1", "temporary"))
    assert (found["state"], found["response"]) == ("rejected", "temporary")
    for mission, key in (("2", "c2"), ("3", "c3")):
        core.planned[mission] = rejected(key)
        assert send(asked, mission)["conflicts"] == ["c1"]
    assert (listed(asked), shown(asked, "c1")["fold_count"]) == ({"c1": "rejected"}, 2)
    with service.database.write() as tx:
        tx.execute(sa.update(ending).values(decided_at=datetime.now(UTC) - timedelta(days=7, seconds=1)))
    core.planned["4"] = rejected("c4")
    assert send(asked, "4")["conflicts"] == ["c4"]
    assert listed(asked) == {"c4": "open", "c1": "rejected"}


def test_a_correction_is_put_off_until_a_week_from_now(service: Service, corrected: tuple[RobotCaller, str]) -> None:
    robot, key = corrected
    expect(decide(service, robot, key, "temporary"))
    declined = stored(service, 3).meta.declined
    assert declined
    for place in declined:
        assert place.until is not None
        left = datetime.fromisoformat(place.until) - datetime.now(UTC)
        assert timedelta(days=6, hours=23) < left <= timedelta(days=7)


def test_what_was_rejected_for_good_is_asked_again_when_it_happens_again(
    service: Service, asked: RobotCaller, core: Core
) -> None:
    expect(decide(service, asked, "c1", "reject"))
    core.planned["2"] = rejected("c2")
    send(asked, "2")
    assert listed(asked) == {"c2": "open", "c1": "rejected"}


# -- annotate ------------------------------------------------------------------------------------------------------


def test_the_owner_s_own_line_takes_the_place_of_a_correction(
    service: Service, corrected: tuple[RobotCaller, str]
) -> None:
    robot, key = corrected
    found = expect(decide(service, robot, key, "annotate", dividers=[LINE]))
    assert (found["state"], found["version"]) == ("annotated", 3)
    after = in_force(robot)
    assert (after["cause"], after["mission"], after["made_by"]) == ("decision", "1", "operator")
    assert not features(after, "meta_divider")
    assert "user" in {f["properties"]["made_by"] for f in features(after, "divider")}
    assert rooms(after).keys() == {"r1", "r2"}
    again = expect(decide(service, robot, key, "annotate", dividers=[LINE]))
    assert again == found
    other = decide(service, robot, key, "annotate", dividers=[[[1.0, -1.0], [1.0, 3.0]]])
    assert other.status_code == 409


def test_the_owner_s_own_line_settles_what_was_open(service: Service, mapped: RobotCaller, core: Core) -> None:
    core.planned["1"] = rejected("c1", rooms=("r1", "r2"))
    send_open_plan(mapped, "1")
    core.planned.clear()
    found = expect(decide(service, mapped, "c1", "annotate", dividers=[LINE]))
    assert (found["state"], found["version"]) == ("annotated", 2)
    assert rooms(in_force(mapped)).keys() == {"r1", "r2"}
    assert listed(mapped, "open") == {}


def test_a_line_in_mid_air_is_refused_with_its_place(service: Service, corrected: tuple[RobotCaller, str]) -> None:
    robot, key = corrected
    before = robot.get(robot.path()).content
    answer = decide(service, robot, key, "annotate", dividers=[LINE, [[1.5, 1.0], [2.4, 1.0]]])
    assert answer.status_code == 422
    assert [fault["pointer"] for fault in answer.json()["errors"]] == ["/dividers/1"]
    assert "mid-air" in answer.json()["detail"]
    assert robot.get(robot.path()).content == before
    assert shown(robot, key)["state"] == "resolved_automatically"


def test_lines_that_don_t_make_the_map_valid_are_refused_with_the_reason(
    service: Service, asked: RobotCaller, core: Core
) -> None:
    core.planned["1"] = rejected("c1")
    answer = decide(service, asked, "c1", "annotate", dividers=[[[2.0, -1.0], [2.0, 3.0]]])
    assert (answer.status_code, answer.json()["type"]) == (422, "/problems/invalid-input")
    assert "still not valid" in answer.json()["detail"]
    assert listed(asked) == {"c1": "open"}


# -- once ----------------------------------------------------------------------------------------------------------


def test_the_same_decision_again_is_the_same_answer(service: Service, asked: RobotCaller) -> None:
    first = decide(service, asked, "c1", "accept", proposal="p2")
    for again in (
        decide(service, asked, "c1", "accept", proposal="p2"),
        decide(service, asked, "c1", "accept", proposal="p2", note="told twice"),
    ):
        assert (again.status_code, again.content) == (200, first.content)
    assert causes(asked) == ["decision", "created"]


def test_another_decision_is_told_who_decided_and_when(service: Service, asked: RobotCaller) -> None:
    first = expect(decide(service, asked, "c1", "accept", proposal="p2"))
    for response, proposal in (("reject", None), ("accept", "p1"), ("accept", None), ("temporary", None)):
        answer = decide(service, asked, "c1", response, proposal=proposal)
        assert (answer.status_code, answer.json()["type"]) == (409, "/problems/already-decided")
        assert (answer.json()["decided_by"], answer.json()["decided_at"]) == ("operator", first["decided_at"])
    assert decide(service, asked, "c1", "reject", dry_run=True).status_code == 409
    assert in_force(asked)["version"] == 2


def test_taps_at_the_same_time_are_one_decision(service: Service, asked: RobotCaller) -> None:
    with ThreadPoolExecutor(5) as pool:
        answers = list(pool.map(lambda _: decide(service, asked, "c1", "accept", proposal="p1"), range(5)))
    assert {answer.status_code for answer in answers} == {200}
    assert len({answer.content for answer in answers}) == 1
    assert causes(asked) == ["decision", "created"]


def test_of_two_people_who_answer_at_once_one_is_told_about_the_other(service: Service, asked: RobotCaller) -> None:
    def answer(response: str) -> Response:
        return decide(service, asked, "c1", response)

    with ThreadPoolExecutor(2) as pool:
        accepted, rejected_ = pool.map(answer, ("accept", "reject"))
    assert sorted((accepted.status_code, rejected_.status_code)) == [200, 409]
    state = shown(asked, "c1")["state"]
    assert (state, causes(asked)) in (
        ("accepted", ["decision", "created"]),
        ("rejected", ["created"]),
    )


def test_answers_to_two_questions_at_once_are_both_kept(service: Service, mapped: RobotCaller, core: Core) -> None:
    core.planned["1"] = rejected("c1")
    core.planned["2"] = rejected("c2", rooms=("r2",), scores=(score("r1", 0.9, visited=False), score("r2")))
    send(mapped, "1")
    send(mapped, "2")
    with ThreadPoolExecutor(2) as pool:
        answers = list(
            pool.map(lambda key: expect(decide(service, mapped, key, "accept", proposal="p2")), ("c1", "c2"))
        )
    assert {answer["version"] for answer in answers} == {2, 3}
    assert causes(mapped) == ["decision", "decision", "created"]
    assert all(room.anchor == room.polygon for room in stored(service, 3).rooms)


def test_a_conflict_that_became_pointless_takes_no_decision(service: Service, asked: RobotCaller) -> None:
    send(asked, "2")
    answer = decide(service, asked, "c1", "accept")
    assert answer.status_code == 409
    assert (answer.json()["superseded_by"], answer.json()["state"]) == ("2", "superseded")
    assert "2" in answer.json()["detail"]


# -- deadlines -----------------------------------------------------------------------------------------------------


def let_time_pass(service: Service) -> None:
    with service.database.write() as tx:
        tx.execute(sa.update(conflict_table).values(due_at=datetime.now(UTC) - timedelta(seconds=1)))


def test_where_nobody_answers_the_default_takes_effect_once_and_is_told(service: Service, asked: RobotCaller) -> None:
    before = asked.get(asked.path()).content
    assert expire(service.database) == 0
    let_time_pass(service)
    with ThreadPoolExecutor(3) as pool:
        counts = list(pool.map(lambda _: expire(service.database), range(3)))
    assert sorted(counts) == [0, 0, 1]
    found = shown(asked, "c1")
    assert (found["state"], found["decided_by"], found["response"]) == ("expired", "deadline", None)
    assert asked.get(asked.path()).content == before
    assert [e["state"] for e in told(service) if e["kind"] == "conflict"] == ["open", "expired"]
    answer = decide(service, asked, "c1", "accept")
    assert (answer.status_code, answer.json()["decided_by"]) == (409, "deadline")
    assert expect(asked.get(f"{asked.path()}/missions/1"))["decision"] is None


def test_what_was_answered_or_asks_nobody_has_no_deadline(service: Service, asked: RobotCaller, core: Core) -> None:
    expect(decide(service, asked, "c1", "temporary"))
    core.planned["2"] = settled("c2", lambda m: m)
    send(asked, "2")
    let_time_pass(service)
    assert expire(service.database) == 0
    assert listed(asked) == {"c2": "resolved_automatically", "c1": "rejected"}


# -- looking first -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("proposal", ["p1", "p2"])
def test_what_would_be_in_force_is_what_comes_into_force(service: Service, asked: RobotCaller, proposal: str) -> None:
    before = asked.get(asked.path()).content
    dry = expect(decide(service, asked, "c1", "accept", dry_run=True, proposal=proposal))
    url = next(p["result"] for p in shown(asked, "c1")["proposals"] if p["id"] == proposal)
    would_be = expect(service.operator.get(url))
    assert asked.get(asked.path()).content == before
    assert listed(asked) == {"c1": "open"}
    assert {name: dry[name] for name in would_be if name != "created_at"} == {
        name: value for name, value in would_be.items() if name != "created_at"
    }
    sensed = pixels(asked.get(would_be["grid"]).content)
    assert np.array_equal(sensed, home(shift=(1, 0)) if proposal == "p1" else home())
    assert asked.get(would_be["cells"]).status_code == 200
    expect(decide(service, asked, "c1", "accept", proposal=proposal))
    assert without_frame(in_force(asked)) == without_frame(would_be)


def test_a_dry_run_says_which_rooms_would_end(service: Service, corrected: tuple[RobotCaller, str]) -> None:
    robot, key = corrected
    before = robot.get(robot.path()).content
    dry = expect(decide(service, robot, key, "reject", dry_run=True))
    (problem,) = dry["problems"]
    assert (problem["code"], problem["feature"] in ("r1", "r2")) == ("room-ended", True)
    assert "becomes part of" in problem["message"]
    assert len(rooms(dry)) == 1
    assert robot.get(robot.path()).content == before
    assert shown(robot, key)["state"] == "resolved_automatically"
    assert expect(decide(service, robot, key, "annotate", dry_run=True, dividers=[LINE]))["version"] == 3


def test_a_dry_run_of_a_rejection_shows_the_map_in_force(service: Service, asked: RobotCaller) -> None:
    dry = expect(decide(service, asked, "c1", "reject", dry_run=True))
    assert {name: dry[name] for name in in_force(asked)} == in_force(asked)


def test_what_was_proposed_can_be_seen_after_the_end(service: Service, asked: RobotCaller) -> None:
    url = f"{asked.path()}/conflicts/c1/proposals/p1"
    before = expect(service.operator.get(url))
    expect(decide(service, asked, "c1", "reject"))
    after = expect(service.operator.get(url))
    assert after["features"] == before["features"]
    assert service.operator.get(f"{asked.path()}/conflicts/c1/proposals/p9").status_code == 404


# -- all at once ---------------------------------------------------------------------------------------------------


def test_all_that_is_open_is_answered_at_once(service: Service, mapped: RobotCaller, core: Core) -> None:
    core.planned["1"] = rejected("c1")
    core.planned["2"] = rejected("c2", rooms=("r2",), scores=(score("r1", 0.9, visited=False), score("r2")))
    send(mapped, "1")
    send(mapped, "2")
    path = f"{mapped.path()}/conflicts/decision"
    first = expect(service.operator.request("POST", path, json={"response": "reject"}))
    assert {found["id"]: found["state"] for found in first["items"]} == {"c2": "rejected", "c1": "rejected"}
    assert expect(service.operator.request("POST", path, json={"response": "reject"}))["items"] == []
    for wrong in ({"response": "annotate", "dividers": [LINE]}, {"response": "accept", "proposal": "p1"}, {}):
        assert service.operator.request("POST", path, json=wrong).status_code == 422


def test_accepting_all_brings_the_newest_mission_into_force(service: Service, mapped: RobotCaller, core: Core) -> None:
    core.planned["1"] = rejected("c1")
    core.planned["2"] = rejected("c2", rooms=("r2",), scores=(score("r1", 0.9, visited=False), score("r2")))
    send(mapped, "1")
    send(mapped, "2")
    core.planned.clear()
    path = f"{mapped.path()}/conflicts/decision"
    answer = expect(service.operator.request("POST", path, json={"response": "accept"}))
    assert {found["id"]: found["state"] for found in answer["items"]} == {"c2": "accepted", "c1": "accepted"}
    assert causes(mapped)[0] == "decision"


# -- what can't be decided -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("body", "pointer"),
    [
        ({"response": "accept", "proposal": "p9"}, "/proposal"),
        ({"response": "reject", "proposal": "p9"}, "/proposal"),
        ({"response": "accept", "dividers": [LINE]}, "/dividers"),
        ({"response": "annotate"}, "/dividers"),
        ({"response": "annotate", "dividers": []}, "/dividers"),
        ({"response": "annotate", "dividers": [[[0.0, 0.0]]]}, "/dividers/0/1"),
        ({"response": "annotate", "dividers": [[[0.0, 1e9], [1.0, 0.0]]]}, "/dividers/0/0/1"),
        ({"response": "perhaps"}, "/response"),
        ({"response": "reject", "note": "x" * 1001}, "/note"),
        ({"response": "reject", "because": "so"}, "/because"),
        ({}, "/response"),
    ],
)
def test_a_decision_that_can_t_be_read_changes_nothing(
    service: Service, asked: RobotCaller, body: Json, pointer: str
) -> None:
    answer = service.operator.request("POST", f"{asked.path()}/conflicts/c1/decision", json=body)
    assert answer.status_code == 422, answer.text
    assert pointer in [fault["pointer"] for fault in answer.json()["errors"]]
    assert listed(asked) == {"c1": "open"}


def test_robots_decide_nothing(service: Service, asked: RobotCaller) -> None:
    path = f"{asked.path()}/conflicts/c1/decision"
    assert asked.request("POST", path, json={"response": "reject"}).status_code == 403
    assert service.stranger.request("POST", path, json={"response": "reject"}).status_code == 401
    assert decide(service, asked, "c9", "reject").status_code == 404


# -- asking first --------------------------------------------------------------------------------------------------


def ask_first(service: Service, robot: RobotCaller) -> None:
    settings = {"review": "ask_first"}
    assert service.operator.request("PATCH", robot.path(), json=settings).json()["review"] == "ask_first"


def test_who_wants_to_be_asked_first_is_asked_before_the_meta_layer_is_used(
    service: Service, mapped: RobotCaller
) -> None:
    ask_first(service, mapped)
    mission = send_open_plan(mapped, "1")
    assert (mission["outcome"], mission["version"]) == ("needs_review", 1)
    assert mission["ablation"] == {"transfer": False, "meta_occupancy": False, "meta_dividers": True}
    asked = next(c for c in mapped.get(f"{mapped.path()}/conflicts?state=open").json()["items"])
    assert next(p["action"] for p in asked["proposals"]) == "meta_dividers"
    assert asked["proposals"][0]["recommended"]
    expect(decide(service, mapped, asked["id"], "accept"))
    after = in_force(mapped)
    assert (after["version"], after["mission"]) == (2, "1")
    assert rooms(after).keys() == {"r1", "r2"}
    assert not features(after, "meta_divider")  # what was agreed to is the owner's own
    assert listed(mapped, "open") == {}
    assert send_open_plan(mapped, "2")["outcome"] == "updated"


def with_annex(image: Image) -> Image:
    """A room more, behind the upper wall of the left one."""
    image = image.copy()
    image[100:102, 50:60] = 254
    image[102:116, 20:90] = 254
    image[116:118, 18:92] = 0
    image[102:118, 18:20] = 0
    image[102:118, 90:92] = 0
    return image


def test_who_wants_to_be_asked_first_is_asked_before_rooms_are_added(service: Service, mapped: RobotCaller) -> None:
    ask_first(service, mapped)
    assert send(mapped, "1")["outcome"] == "updated"  # nothing to ask about
    mission = send(mapped, "2", with_annex(home()))
    assert (mission["outcome"], mission["version"], mission["discovered_rooms"]) == ("needs_review", 2, [])
    (asked,) = mapped.get(f"{mapped.path()}/conflicts?state=open").json()["items"]
    assert (asked["kind"], asked["cause"]) == ("connectivity", "new_passage")
    assert asked["summary"].endswith("would be new.")
    again = send(mapped, "3", with_annex(home()))
    assert again["conflicts"] == [asked["id"]]
    expect(decide(service, mapped, asked["id"], "accept"))
    assert len(rooms(in_force(mapped))) == 3
    assert in_force(mapped)["mission"] == "3"


def test_a_pinned_map_changes_only_when_somebody_agrees(service: Service, mapped: RobotCaller) -> None:
    assert service.operator.request("PUT", f"{mapped.path()}/pin").status_code == 200
    assert send_open_plan(mapped, "1")["outcome"] == "needs_review"
    assert in_force(mapped)["version"] == 1


def test_history_tells_every_decision(service: Service, asked: RobotCaller, core: Core) -> None:
    expect(decide(service, asked, "c1", "accept"))
    core.planned["2"] = rejected("c2")
    send(asked, "2")
    expect(decide(service, asked, "c2", "reject"))
    heard = [(e["kind"], e["conflict"], e["state"], e["version"]) for e in told(service) if e["mission"] in ("1", "2")]
    assert heard == [
        ("mission", None, None, 1),
        ("conflict", "c1", "open", 1),
        ("version", None, None, 2),
        ("conflict", "c1", "accepted", 2),
        ("mission", None, None, 2),
        ("conflict", "c2", "open", 2),
        ("conflict", "c2", "rejected", 2),
    ]
