"""Conflicts that missions open are kept, met again, and seen by those who may."""

from dataclasses import replace
from datetime import datetime, timedelta

from stillroom.maps.meta import MetaDivider
from stillroom.maps.mission import Mission
from stillroom.maps.semantics import SemanticMap
from stillroom.pipeline.conflicts import Proposal
from stillroom.pipeline.update import MapUpdate
from tests.conflicts import Core, conflict, listed, rejected, score, send, settled, shown, told
from tests.conftest import RobotCaller, Service
from tests.homes import home

LINE = ((2.0, -1.0), (2.0, 3.0))


def with_meta_divider(semantic_map: SemanticMap) -> SemanticMap:
    (name,), ids = semantic_map.ids.take("m")
    meta = replace(semantic_map.meta, dividers=(MetaDivider(name, LINE, ("r1",), "1"),))
    return replace(semantic_map, meta=meta, ids=ids)


def test_a_mission_that_is_not_taken_opens_its_conflict(service: Service, mapped: RobotCaller, core: Core) -> None:
    before = mapped.get(mapped.path()).content
    core.planned["1"] = rejected("c1")
    mission = send(mapped, "1")
    assert (mission["outcome"], mission["version"], mission["conflicts"]) == ("needs_review", 1, ["c1"])
    assert told(service)[-2]["outcome"] == "needs_review"
    assert mapped.get(mapped.path()).content == before
    found = shown(mapped, "c1")
    assert (found["kind"], found["cause"], found["state"]) == ("room_recall", "wall_gap", "open")
    assert (found["mission"], found["base_version"]) == ("1", 1)
    assert found["rooms"] == [
        {"id": "r1", "name": "Room r1", "precision": 0.97, "recall": 0.41, "passed": False, "visited": True}
    ]
    assert found["summary"] == "59 % of Room r1 is gone."
    assert [(p["id"], p["action"], p["recommended"]) for p in found["proposals"]] == [
        ("p1", "take_new", True),
        ("p2", "keep_previous", False),
    ]
    assert found["proposals"][0]["features"] == []
    assert (found["decided_by"], found["decided_at"], found["fold_count"]) == (None, None, 0)
    assert found == mapped.get(found["url"]).json()
    assert mapped.get(f"{mapped.path()}/missions").json()["items"][0]["conflicts"] == ["c1"]


def test_a_conflict_says_what_happens_where_nobody_answers(mapped: RobotCaller, core: Core) -> None:
    core.planned["1"] = rejected("c1")
    send(mapped, "1")
    found = shown(mapped, "c1")
    assert found["default"]["response"] == "reject"
    opened, due = (datetime.fromisoformat(moment) for moment in (found["opened_at"], found["default"]["at"]))
    assert due - opened == timedelta(days=7)


def test_what_the_meta_layer_settled_asks_nobody(mapped: RobotCaller, core: Core) -> None:
    core.planned["1"] = settled("c1", with_meta_divider)
    mission = send(mapped, "1")
    assert (mission["outcome"], mission["version"], mission["conflicts"]) == ("resolved", 2, ["c1"])
    assert mission["succeeded_at"] == "meta_dividers"
    found = shown(mapped, "c1")
    assert (found["state"], found["default"], found["base_version"]) == ("resolved_automatically", None, 1)
    (feature,) = found["proposals"][0]["features"]
    assert (feature["id"], feature["properties"]["semantic"]) == ("m1", "meta_divider")
    assert listed(mapped, "open") == {}
    assert listed(mapped, "resolved_automatically") == {"c1": "resolved_automatically"}


def test_a_mission_that_meets_the_same_again_opens_nothing_new(mapped: RobotCaller, core: Core) -> None:
    for mission, key in (("1", "c1"), ("2", "c2"), ("3", "c3")):
        core.planned[mission] = rejected(key)
        assert send(mapped, mission)["conflicts"] == ["c1"]
    found = shown(mapped, "c1")
    assert (found["fold_count"], found["mission"], found["state"]) == (2, "3", "open")
    assert listed(mapped) == {"c1": "open"}
    assert mapped.get(f"{mapped.path()}/conflicts/c2").status_code == 404


def test_a_conflict_about_something_else_is_another_one(mapped: RobotCaller, core: Core) -> None:
    core.planned["1"] = rejected("c1")
    core.planned["2"] = rejected("c2", rooms=("r2",), scores=(score("r1", 0.4, visited=False), score("r2")))
    core.planned["3"] = rejected("c3", kind="divider_lost", rooms=("r2",), dividers=("d1",), scores=(score("r2"),))
    send(mapped, "1")
    send(mapped, "2")
    assert listed(mapped) == {"c2": "open", "c1": "open"}  # the second mission did not see r1
    send(mapped, "3")
    assert listed(mapped) == {"c3": "open", "c2": "superseded", "c1": "superseded"}


def test_a_mission_that_carries_the_rooms_over_ends_the_conflict(mapped: RobotCaller, core: Core) -> None:
    core.planned["1"] = rejected("c1")
    send(mapped, "1")
    assert send(mapped, "2")["outcome"] == "updated"
    found = shown(mapped, "c1")
    assert (found["state"], found["superseded_by"], found["version"]) == ("superseded", "2", 2)
    assert (found["decided_by"], found["response"]) == ("robot:RB-1", None)
    assert found["decided_at"] >= found["opened_at"]
    assert listed(mapped, "open") == {}


def test_a_conflict_that_comes_back_after_it_ended_is_a_new_one(mapped: RobotCaller, core: Core) -> None:
    core.planned["1"], core.planned["3"] = rejected("c1"), rejected("c3")
    for mission in ("1", "2", "3"):
        send(mapped, mission)
    assert listed(mapped) == {"c3": "open", "c1": "superseded"}


def test_what_was_open_and_is_settled_by_the_meta_layer_needs_no_answer_any_more(
    mapped: RobotCaller, core: Core
) -> None:
    core.planned["1"] = rejected("c1", rooms=("r1", "r2"))
    core.planned["2"] = settled("c2", with_meta_divider)
    send(mapped, "1")
    send(mapped, "2")
    assert listed(mapped) == {"c2": "resolved_automatically", "c1": "superseded"}
    assert send(mapped, "3")["outcome"] == "updated"
    assert listed(mapped) == {"c2": "superseded", "c1": "superseded"}


def test_a_late_mission_opens_none_and_ends_none(mapped: RobotCaller, core: Core) -> None:
    core.planned |= {"5": rejected("c5"), "3": rejected("c3", rooms=("r2",))}
    send(mapped, "5")
    late = send(mapped, "3")
    assert (late["outcome"], late["conflicts"]) == ("superseded", [])
    assert send(mapped, "4")["outcome"] == "superseded"
    assert listed(mapped) == {"c5": "open"}


def test_a_parked_mission_asks_which_floor_it_is(mapped: RobotCaller, core: Core) -> None:
    def parked(previous: SemanticMap, _mission: Mission, update: MapUpdate) -> MapUpdate:
        keep = Proposal("p1", "keep_previous", True, previous)
        asked = conflict("c1", keep, kind="wrong_map", rooms=("r1", "r2"))
        return replace(update, outcome="parked", map=previous, taken=False, motion=None, rooms=(), conflicts=(asked,))

    core.planned["1"] = parked
    mission = send(mapped, "1")
    assert (mission["outcome"], mission["conflicts"]) == ("parked", ["c1"])
    assert shown(mapped, "c1")["kind"] == "wrong_map"
    assert send(mapped, "2")["outcome"] == "updated"
    assert listed(mapped) == {"c1": "open"}  # a mission that fits says nothing about the one that did not


def test_the_same_conflict_from_work_that_was_done_twice_is_kept_once(mapped: RobotCaller, core: Core) -> None:
    core.planned["1"] = rejected("c1", "c1")
    assert send(mapped, "1")["conflicts"] == ["c1"]
    assert mapped.upload("1", home(shift=(1, 0))).json()["conflicts"] == ["c1"]
    assert shown(mapped, "c1")["fold_count"] == 0


def test_ids_in_proposals_are_not_given_out_again(service: Service, mapped: RobotCaller, core: Core) -> None:
    def rejected_with_new_room(previous: SemanticMap, mission: Mission, update: MapUpdate) -> MapUpdate:
        _, ids = update.map.ids.take("r", 4)
        return rejected("c1")(previous, mission, replace(update, map=replace(update.map, ids=ids)))

    core.planned["1"] = rejected_with_new_room
    send(mapped, "1")
    split = {"op": "add_divider", "line": [[0.05, 1.0], [3.9, 1.0]]}
    made = service.operator.edit(mapped.path(), 1, split).json()
    assert {f["id"] for f in made["features"] if f["properties"]["semantic"] == "room"} == {"r1", "r2", "r7"}


def test_conflicts_are_listed_page_by_page(mapped: RobotCaller, core: Core) -> None:
    core.planned["1"] = rejected("c1", rooms=("r1",))
    core.planned["2"] = rejected("c2", rooms=("r2",), scores=(score("r1", 0.9, visited=False), score("r2")))
    send(mapped, "1")
    send(mapped, "2")
    first = mapped.get(f"{mapped.path()}/conflicts?limit=1")
    assert [found["id"] for found in first.json()["items"]] == ["c2"]
    assert f"cursor={first.json()['next']}" in first.headers["Link"]
    rest = mapped.get(f"{mapped.path()}/conflicts?limit=1&cursor={first.json()['next']}").json()
    assert ([found["id"] for found in rest["items"]], rest["next"]) == (["c1"], None)
    assert mapped.get(f"{mapped.path()}/conflicts?state=undecided").status_code == 422
    assert mapped.get(f"{mapped.path()}/conflicts?cursor=x").status_code == 422


def test_everybody_sees_the_conflicts_of_their_own_maps_alone(
    service: Service, mapped: RobotCaller, core: Core
) -> None:
    anns = service.add_robot("RB-2", owner="ann@example.org")
    anns.upload("0")
    core.planned["1"] = rejected("c1")
    send(mapped, "1")
    send(anns, "1")
    for who, robots in ((service.operator, ["RB-1"]), (mapped, ["RB-1"]), (anns, ["RB-2"])):
        items = who.get("/api/v1/conflicts?state=open").json()["items"]
        assert [(found["robot"], found["map"], found["id"]) for found in items] == [
            (id_, "ground", "c1") for id_ in robots
        ]
    assert anns.get(f"{mapped.path()}/conflicts").status_code == 403
    assert anns.get(f"{mapped.path()}/conflicts/c1").status_code == 403
    assert service.stranger.get("/api/v1/conflicts").status_code == 401
    assert mapped.get(f"{mapped.path('attic')}/conflicts").status_code == 404
    assert mapped.get(f"{mapped.path()}/conflicts/c9").status_code == 404


def test_opening_and_ending_are_told(service: Service, mapped: RobotCaller, core: Core) -> None:
    core.planned["1"] = rejected("c1")
    send(mapped, "1")
    send(mapped, "2")
    heard = [row for row in told(service) if row["kind"] == "conflict"]
    assert [(e["conflict"], e["state"], e["mission"], e["version"]) for e in heard] == [
        ("c1", "open", "1", 1),
        ("c1", "superseded", "2", 2),
    ]
