"""People edit maps that others and the robot change meanwhile; they look back, and undo."""

from typing import Any

import pytest
from httpx2 import Response

from tests.conftest import RobotCaller, Service, features
from tests.homes import home

Json = dict[str, Any]
SPLIT = {"op": "add_divider", "line": [[1.0, -1.0], [1.0, 3.0]]}
ZONE = [[0.5, 0.5], [1.5, 0.5], [1.5, 1.5], [0.5, 1.5]]


def rename(room: str, name: str) -> Json:
    return {"op": "rename_room", "id": room, "name": name}


def named(document: Json) -> dict[str, str]:
    return {f["id"]: f["properties"]["name"] for f in features(document, "room")}


def undo(service: Service, robot: RobotCaller, version: int) -> Response:
    return service.operator.request("POST", f"{robot.path()}/versions/{version}/undo")


# -- suggested dividers --------------------------------------------------------------------------------------------


def test_a_person_sees_more_or_fewer_rooms_before_anything_changes(service: Service, mapped: RobotCaller) -> None:
    def suggested(sensitivity: float) -> Json:
        answer = mapped.get(f"{mapped.path()}/edits/suggested?sensitivity={sensitivity}")
        assert (answer.status_code, answer.headers["ETag"]) == (200, '"v1"'), answer.text
        found: Json = answer.json()
        return found

    before = mapped.get(mapped.path()).json()
    assert suggested(0) == {"version": 1, "operations": []}
    fewer = suggested(-10)["operations"]
    assert {operation["op"] for operation in fewer} == {"remove_divider"}
    preview = service.operator.request(
        "POST", f"{mapped.path()}/edits?dry_run=true", json={"operations": fewer}, headers={"If-Match": '"v1"'}
    )
    assert preview.status_code == 200, preview.text
    assert len(features(preview.json(), "room")) < len(features(before, "room"))
    assert mapped.get(mapped.path()).json() == before


@pytest.mark.parametrize("sensitivity", ["11", "-11", "nan", "inf", "many"])
def test_a_sensitivity_that_is_none_is_refused(mapped: RobotCaller, sensitivity: str) -> None:
    answer = mapped.get(f"{mapped.path()}/edits/suggested?sensitivity={sensitivity}")
    assert (answer.status_code, answer.headers["Content-Type"]) == (422, "application/problem+json")


# -- merging -------------------------------------------------------------------------------------------------------


def test_a_stale_edit_that_still_applies_comes_back_as_a_merge_to_be_sent(
    service: Service, mapped: RobotCaller
) -> None:
    service.operator.edit(mapped.path(), 1, rename("r1", "Kitchen"))
    stale = service.operator.edit(mapped.path(), 1, rename("r2", "Bath"), {"op": "pin_room", "id": "r1"})
    problem = stale.json()
    assert (stale.status_code, problem["type"]) == (412, "/problems/stale-version")
    assert (problem["current"], problem["mergeable"], problem["merge_conflicts"]) == (2, True, [])
    assert named(problem["merge_preview"]) == {"r1": "Kitchen", "r2": "Bath"}
    assert mapped.get(mapped.path()).json()["version"] == 2
    sent = service.operator.edit(mapped.path(), problem["current"], *problem["merge_operations"])
    assert sent.status_code == 200, sent.text
    assert named(sent.json()) == {"r1": "Kitchen", "r2": "Bath"}
    assert sent.json()["features"] == problem["merge_preview"]["features"]


def test_a_stale_edit_that_speaks_against_anothers_is_not_merged(service: Service, mapped: RobotCaller) -> None:
    service.operator.edit(mapped.path(), 1, rename("r1", "Kitchen"))
    problem = service.operator.edit(mapped.path(), 1, rename("r2", "Bath"), rename("r1", "Hall")).json()
    assert (problem["mergeable"], problem["merge_preview"]) == (False, None)
    (clash,) = problem["merge_conflicts"]
    assert (clash["pointer"], clash["feature"]) == ("/operations/1", "r1")
    assert "Kitchen" in clash["detail"]
    assert clash["operation"] == rename("r1", "Hall") | {"at": None}
    assert problem["merge_operations"] == [rename("r2", "Bath") | {"at": None}]


def test_a_divider_drawn_while_the_robot_was_out_lands_where_it_was_meant(
    service: Service, mapped: RobotCaller
) -> None:
    mission = mapped.upload("1", home(shift=(4, 2)), base_version=1, tracking={"transform": [0.2, 0.1, 0.0]}).json()
    assert (mission["outcome"], mission["version"], mission["left_with"]) == ("updated", 2, 1)
    problem = service.operator.edit(mapped.path(), 1, SPLIT).json()
    assert problem["mergeable"] is True
    (moved,) = problem["merge_operations"]
    assert [round(x, 2) for x, _ in moved["line"]] == [1.2, 1.2]
    made = service.operator.edit(mapped.path(), 2, *problem["merge_operations"]).json()
    assert len(features(made, "room")) == 3


def test_an_edit_made_while_the_robot_was_out_survives_the_upload_with_the_older_base(
    service: Service, mapped: RobotCaller
) -> None:
    service.operator.edit(mapped.path(), 1, rename("r1", "Kitchen"))
    service.operator.edit(mapped.path(), 2, SPLIT, {"op": "add_restriction", "kind": "no_go", "shape": ZONE})
    mission = mapped.upload("1", home(shift=(2, 0)), base_version=1, tracking={"transform": [0.1, 0.0, 0.0]}).json()
    assert (mission["outcome"], mission["version"]) == ("updated", 4)
    document = mapped.get(mapped.path()).json()
    assert "Kitchen" in named(document).values()
    assert len(features(document, "room")) == 3
    (zone,) = features(document, "restriction")
    assert zone["geometry"]["coordinates"][0][0] == pytest.approx([0.6, 0.5], abs=0.05)


@pytest.mark.parametrize("version", [0, 7])
def test_a_version_that_never_was_is_nothing_to_merge_from(service: Service, mapped: RobotCaller, version: int) -> None:
    problem = service.operator.edit(mapped.path(), version, rename("r1", "Hall"))
    assert (problem.status_code, problem.json()["current"], problem.json()["mergeable"]) == (412, 1, False)


def test_a_dry_run_on_a_stale_version_tells_the_same(service: Service, mapped: RobotCaller) -> None:
    service.operator.edit(mapped.path(), 1, rename("r1", "Kitchen"))
    stale = service.operator.edit(mapped.path(), 1, SPLIT, dry_run=True)
    assert (stale.status_code, stale.json()["mergeable"]) == (412, True)


# -- dry runs and refusals -----------------------------------------------------------------------------------------


def test_a_dry_run_says_what_each_operation_makes(service: Service, mapped: RobotCaller) -> None:
    zone = {"op": "add_restriction", "kind": "no_mop", "shape": ZONE}
    preview = service.operator.edit(mapped.path(), 1, rename("r1", "Hall"), SPLIT, zone, dry_run=True).json()
    made = {entry["pointer"]: entry["feature"] for entry in preview["made"]}
    assert list(made) == ["/operations/1", "/operations/2"]
    assert made["/operations/1"] in {f["id"] for f in features(preview, "divider")}
    assert made["/operations/2"] in {f["id"] for f in features(preview, "restriction")}
    assert preview["version"] == 2
    assert preview["cells"].endswith("/versions/1/cells.png"), "a preview lies on the grid of the version in force"


def test_a_refusal_offers_an_operation_that_mends_it(service: Service, mapped: RobotCaller) -> None:
    loose = SPLIT | {"line": [[1.0, -1.0], [1.0, 1.0]]}
    refused = service.operator.edit(mapped.path(), 1, loose, dry_run=True)
    problem = refused.json()
    assert (refused.status_code, problem["errors"][0]["pointer"]) == (422, "/operations/0/line/1")
    (fix,) = problem["fixes"]
    assert (fix["pointer"], fix["title"]) == ("/operations/0", "extend to wall")
    assert service.operator.edit(mapped.path(), 1, fix["operation"]).status_code == 200


def test_a_room_is_named_by_its_id_or_by_a_point_but_not_by_both(service: Service, mapped: RobotCaller) -> None:
    both = rename("r1", "Hall") | {"at": [1.0, 1.0]}
    neither = {"op": "rename_room", "name": "Hall"}
    for operation in (both, neither):
        assert service.operator.edit(mapped.path(), 1, operation).status_code == 422
    part = service.operator.edit(mapped.path(), 1, SPLIT, {"op": "rename_room", "at": [0.5, 1.0], "name": "Pantry"})
    assert "Pantry" in named(part.json()).values()


@pytest.mark.parametrize(
    "operation",
    [
        {"op": "set_room_kind", "id": "r1", "kind": "dungeon"},
        {"op": "mark_phantom", "shape": [[0, 0], [1, 1]]},
        {"op": "mark_phantom", "shape": [[0, 0], [1, 1], [1, 0], [0, 1]]},
        {"op": "mark_phantom", "shape": [[0, 0], [1, 0], [1, 1]] * 1000},
        {"op": "add_restriction", "kind": "no_go", "shape": [[0, 0], [1, 0], [1, 1e300]]},
        {"op": "move_restriction", "id": "z1", "shape": ZONE},
        {"op": "remove_phantom", "id": "p1"},
        {"op": "accept_meta_divider", "id": "m1"},
        {"op": "add_divider", "line": [[1, 1], [1, 1]]},
        {"op": "add_divider", "line": [[1, 1], [1, "NaN"]]},
        {"op": "rename_room", "id": "r1", "name": "a\u202eb"},
        {"op": "rename_room", "id": "r1", "name": "x" * 10_000},
        {"op": "format_disk"},
    ],
)
def test_what_is_no_edit_is_a_problem_with_a_pointer_and_nothing_is_applied(
    service: Service, mapped: RobotCaller, operation: Json
) -> None:
    before = mapped.get(mapped.path()).content
    answer = service.operator.edit(mapped.path(), 1, rename("r2", "Bath"), operation)
    assert answer.status_code == 422, answer.text
    assert answer.headers["Content-Type"] == "application/problem+json"
    assert answer.json()["errors"][0]["pointer"].startswith("/operations/1")
    assert mapped.get(mapped.path()).content == before


def test_ten_thousand_operations_are_refused_at_once(service: Service, mapped: RobotCaller) -> None:
    answer = service.operator.edit(mapped.path(), 1, *[SPLIT] * 10_000)
    assert (answer.status_code, answer.json()["errors"][0]["pointer"]) == (422, "/operations")


def test_a_robot_edits_undoes_and_pins_nothing(mapped: RobotCaller) -> None:
    assert mapped.edit(mapped.path(), 1, SPLIT).status_code == 403
    assert mapped.request("POST", f"{mapped.path()}/versions/1/undo").status_code == 403
    assert mapped.request("PUT", f"{mapped.path()}/pin").status_code == 403
    assert mapped.request("PATCH", f"{mapped.path()}/versions/1", json={"name": "x"}).status_code == 403


def test_phantoms_and_kinds_are_in_the_map_and_stay_through_missions(service: Service, mapped: RobotCaller) -> None:
    right = [[4.0, -1.2], [8.2, -1.2], [8.2, 3.2], [4.0, 3.2]]
    rooms = features(mapped.get(mapped.path()).json(), "room")
    left = min(rooms, key=lambda room: min(x for x, _ in room["geometry"]["coordinates"][0]))
    kitchen = {"op": "set_room_kind", "id": left["id"], "kind": "kitchen"}
    made = service.operator.edit(mapped.path(), 1, kitchen, {"op": "mark_phantom", "shape": right}).json()
    (room,) = features(made, "room")
    (phantom,) = features(made, "phantom")
    assert (room["properties"]["kind"], phantom["id"]) == ("kitchen", "p1")
    for number in (1, 2):
        mission = mapped.upload(str(number), home(), base_version=2, tracking={"transform": [0.0, 0.0, 0.0]}).json()
        assert mission["outcome"] in ("updated", "resolved"), mission["reason"]
        document = mapped.get(mapped.path()).json()
        assert [f["id"] for f in features(document, "room")] == [room["id"]]
        assert [f["id"] for f in features(document, "phantom")] == ["p1"]
    (ended,) = {"r1", "r2"} - {room["id"]}
    assert mapped.get(f"{mapped.path()}/rooms/{ended}").json()["retired"] is True


# -- undo ----------------------------------------------------------------------------------------------------------


def test_undo_and_redo_go_back_and_forth_without_end(service: Service, mapped: RobotCaller) -> None:
    first = mapped.get(mapped.path()).json()
    split = service.operator.edit(mapped.path(), 1, SPLIT).json()
    number = 2
    for wanted in (first, split, first, split):
        answer = undo(service, mapped, number)
        assert answer.status_code == 201, answer.text
        number = answer.json()["version"]
        assert (answer.headers["ETag"], answer.json()["cause"]) == (f'"v{number}"', "restore")
        assert answer.json()["features"] == wanted["features"]
        assert mapped.get(mapped.path()).json()["features"] == wanted["features"]
    assert number == 6


def test_an_edit_is_taken_back_after_the_robot_and_others_changed_the_map(
    service: Service, mapped: RobotCaller
) -> None:
    service.operator.edit(mapped.path(), 1, rename("r1", "Kitchen"), rename("r2", "Bath"))
    merged = service.operator.edit(mapped.path(), 2, {"op": "merge_rooms", "ids": ["r1", "r2"]}).json()
    (survivor,) = named(merged)
    mapped.upload("1", home(shift=(2, 0)), base_version=3, tracking={"transform": [0.1, 0.0, 0.0]})
    service.operator.edit(mapped.path(), 4, {"op": "add_restriction", "kind": "no_go", "shape": ZONE})
    answer = undo(service, mapped, 3)
    assert answer.status_code == 201, answer.text
    document = mapped.get(mapped.path()).json()
    assert named(document) == {"r1": "Kitchen", "r2": "Bath"}
    assert survivor in named(document)
    assert document["mission"] == "1"
    assert len(features(document, "restriction")) == 1


def test_what_can_not_be_taken_back_says_why(service: Service, mapped: RobotCaller) -> None:
    service.operator.edit(mapped.path(), 1, rename("r1", "Kitchen"))
    service.operator.edit(mapped.path(), 2, rename("r1", "Hall"))
    answer = undo(service, mapped, 2)
    assert (answer.status_code, answer.json()["type"]) == (409, "/problems/changed-since")
    assert "changed again" in answer.json()["detail"]
    assert undo(service, mapped, 1).status_code == 409
    assert undo(service, mapped, 9).status_code == 404
    assert mapped.get(mapped.path()).json()["version"] == 3


# -- looking back --------------------------------------------------------------------------------------------------


def test_two_versions_are_compared_in_words(service: Service, mapped: RobotCaller) -> None:
    service.operator.edit(mapped.path(), 1, rename("r1", "Kitchen"))
    mapped.upload("1", home(shift=(4, 2)), base_version=2, tracking={"transform": [0.2, 0.1, 0.0]})
    diff = mapped.get(f"{mapped.path()}/versions/1/diff/3").json()
    assert (diff["from_version"], diff["to_version"]) == (1, 3)
    assert [change["text"] for change in diff["changes"]] == ["Room 1 is called Kitchen now"]
    assert diff["moved"] == [pytest.approx(0.2, abs=0.03), pytest.approx(0.1, abs=0.03), pytest.approx(0.0, abs=0.01)]
    back = mapped.get(f"{mapped.path()}/versions/3/diff/1").json()
    assert [change["text"] for change in back["changes"]] == ["Kitchen is called Room 1 now"]
    assert mapped.get(f"{mapped.path()}/versions/1/diff/9").status_code == 404


def test_a_version_has_the_name_that_people_give_it(service: Service, mapped: RobotCaller) -> None:
    path = f"{mapped.path()}/versions/1"
    before = mapped.get(path).content
    named_ = service.operator.request("PATCH", path, json={"name": " As it should be "})
    assert (named_.status_code, named_.json()["name"]) == (200, "As it should be")
    assert mapped.get(f"{mapped.path()}/versions").json()["items"][0]["name"] == "As it should be"
    assert mapped.get(path).content == before, "nothing else of a version ever changes"
    assert service.operator.request("PATCH", path, json={"name": None}).json()["name"] is None
    wrongs: list[Json] = [{"name": ""}, {"name": "x" * 101}, {"name": "a\nb"}, {"document": {}}, {}]
    for wrong in wrongs:
        assert service.operator.request("PATCH", path, json=wrong).status_code == 422
    assert service.operator.request("PATCH", f"{mapped.path()}/versions/9", json={"name": "x"}).status_code == 404


def test_a_map_is_pinned_to_the_version_in_force_or_to_an_older_one(service: Service, mapped: RobotCaller) -> None:
    pin = f"{mapped.path()}/pin"
    assert service.operator.request("PUT", pin).json()["pinned"] == 1
    service.operator.edit(mapped.path(), 1, SPLIT)
    assert service.operator.request("PUT", pin, json={"version": 1}).json()["pinned"] == 3
    document = mapped.get(mapped.path()).json()
    assert (document["version"], document["cause"], len(features(document, "room"))) == (3, "restore", 2)
    assert service.operator.get("/api/v1/robots").json()["items"][0]["maps"][0]["pinned"] == 3
    assert service.operator.request("DELETE", pin).json()["pinned"] is None
    assert service.operator.request("PUT", pin, json={"version": 9}).status_code == 404
    assert service.operator.request("PUT", pin, json={"version": "newest"}).status_code == 422
