"""People look at maps, edit them and bring old versions back."""

from typing import Any

import numpy as np
import pytest

from stillroom.documents.stored import decode_map
from stillroom.store import maps as versions
from tests.conflicts import Core
from tests.conftest import RobotCaller, Service, features
from tests.homes import home, pixels

SPLIT = {"op": "add_divider", "line": [[0.05, 1.0], [3.9, 1.0]]}


def named(document: dict[str, Any]) -> dict[str, str]:
    return {f["id"]: f["properties"]["name"] for f in features(document, "room")}


def test_the_map_carries_its_version_as_etag_and_answers_304_to_those_who_have_it(mapped: RobotCaller) -> None:
    answer = mapped.get(mapped.path())
    assert answer.headers["ETag"] == '"v1"'
    known = mapped.get(mapped.path(), {"If-None-Match": 'W/"v0", W/"v1"'})
    assert (known.status_code, known.content, known.headers["ETag"]) == (304, b"", '"v1"')
    mapped.upload("1", home(shift=(1, 0)))
    assert mapped.get(mapped.path(), {"If-None-Match": '"v1"'}).status_code == 200


def test_versions_never_change(mapped: RobotCaller) -> None:
    first = mapped.get(f"{mapped.path()}/versions/1").json()
    mapped.upload("1", home(shift=(2, 1)))
    again = mapped.get(f"{mapped.path()}/versions/1")
    assert again.json() == first
    assert again.headers["ETag"] == '"v1"'
    assert mapped.get(f"{mapped.path()}/versions/9").status_code == 404


def test_an_edit_needs_the_version_it_was_made_to(service: Service, mapped: RobotCaller) -> None:
    edit = {"operations": [{"op": "rename_room", "id": "r1", "name": "Kitchen"}]}
    without = service.operator.request("POST", f"{mapped.path()}/edits", json=edit)
    assert (without.status_code, without.json()["type"]) == (428, "/problems/precondition-required")
    odd = service.operator.request("POST", f"{mapped.path()}/edits", {"If-Match": "yesterday"}, json=edit)
    assert odd.status_code == 422


def test_an_edit_makes_a_new_version_with_its_author(service: Service, mapped: RobotCaller) -> None:
    answer = service.operator.edit(mapped.path(), 1, {"op": "rename_room", "id": "r1", "name": " Kitchen "})
    document = answer.json()
    assert (answer.status_code, answer.headers["ETag"]) == (200, '"v2"')
    assert (document["cause"], document["made_by"], document["parent"]) == ("edit", "operator", 1)
    assert named(document)["r1"] == "Kitchen"
    assert document["problems"] == []
    in_force = mapped.get(mapped.path()).json()
    assert in_force == {name: value for name, value in document.items() if name != "problems"}


def test_a_stale_edit_is_refused_with_the_current_version(service: Service, mapped: RobotCaller) -> None:
    rename = {"op": "rename_room", "id": "r1", "name": "Kitchen"}
    service.operator.edit(mapped.path(), 1, rename)
    stale = service.operator.edit(mapped.path(), 1, rename)
    assert (stale.status_code, stale.json()["current"]) == (412, 2)
    assert mapped.get(mapped.path()).json()["version"] == 2


def test_a_dry_run_shows_the_map_and_changes_nothing(service: Service, mapped: RobotCaller) -> None:
    before = mapped.get(mapped.path()).json()
    preview = service.operator.edit(mapped.path(), 1, SPLIT, dry_run=True)
    assert preview.status_code == 200
    assert len(features(preview.json(), "room")) == 3
    assert "problems" in preview.json()
    assert mapped.get(mapped.path()).json() == before
    made = service.operator.edit(mapped.path(), 1, SPLIT).json()
    assert made["features"] == preview.json()["features"]


def test_ids_that_were_given_out_are_never_given_out_again(service: Service, mapped: RobotCaller) -> None:
    split = service.operator.edit(mapped.path(), 1, SPLIT).json()
    (third,) = set(named(split)) - {"r1", "r2"}
    restored = service.operator.request("POST", f"{mapped.path()}/versions/1/restore").json()
    assert set(named(restored)) == {"r1", "r2"}
    again = service.operator.edit(mapped.path(), 3, SPLIT).json()
    (fourth,) = set(named(again)) - {"r1", "r2"}
    assert fourth != third


def test_a_restored_version_is_a_new_one_and_nothing_is_lost(service: Service, mapped: RobotCaller) -> None:
    service.operator.edit(mapped.path(), 1, SPLIT)
    answer = service.operator.request("POST", f"{mapped.path()}/versions/1/restore")
    document = answer.json()
    assert (answer.status_code, answer.headers["ETag"]) == (201, '"v3"')
    assert (document["cause"], document["parent"], document["version"]) == ("restore", 2, 3)
    assert document["features"] == mapped.get(f"{mapped.path()}/versions/1").json()["features"]
    causes = [version["cause"] for version in mapped.get(f"{mapped.path()}/versions").json()["items"]]
    assert causes == ["restore", "edit", "created"]
    assert service.operator.request("POST", f"{mapped.path()}/versions/9/restore").status_code == 404


def test_a_room_answers_for_every_id_that_ever_was(service: Service, mapped: RobotCaller) -> None:
    split = service.operator.edit(mapped.path(), 1, SPLIT).json()
    (third,) = set(named(split)) - {"r1", "r2"}
    room = mapped.get(f"{mapped.path()}/rooms/{third}").json()
    assert room == next(f for f in split["features"] if f["id"] == third)
    merged = service.operator.edit(
        mapped.path(), 2, {"op": "merge_rooms", "ids": [room["properties"]["derived_from"], third]}
    )
    assert merged.status_code == 200, merged.text
    (ended,) = {"r1", "r2", third} - set(named(merged.json()))
    retired = mapped.get(f"{mapped.path()}/rooms/{ended}").json()
    assert retired["retired"] is True
    assert retired["survivor"] in named(merged.json())
    service.operator.request("POST", f"{mapped.path()}/versions/2/restore")
    assert mapped.get(f"{mapped.path()}/rooms/{ended}").json()["type"] == "Feature"
    assert mapped.get(f"{mapped.path()}/rooms/r99").status_code == 404


def test_a_room_that_a_restore_takes_away_is_survived_by_the_one_it_came_from(
    service: Service, mapped: RobotCaller
) -> None:
    split = service.operator.edit(mapped.path(), 1, SPLIT).json()
    (third,) = [f for f in features(split, "room") if f["id"] not in ("r1", "r2")]
    service.operator.request("POST", f"{mapped.path()}/versions/1/restore")
    retired = mapped.get(f"{mapped.path()}/rooms/{third['id']}").json()
    assert (retired["retired"], retired["survivor"]) == (True, third["properties"]["derived_from"])


@pytest.mark.parametrize(
    ("operation", "pointer"),
    [
        ({"op": "paint"}, "/operations/0"),
        ({"op": "add_divider", "line": [[0, 0]]}, "/operations/0/line/1"),
        ({"op": "add_divider", "line": [[0, 0], [1, "x"]]}, "/operations/0/line/1/1"),
        ({"op": "add_divider", "line": [[0, 0], [1, 1]], "kind": "wide"}, "/operations/0/kind"),
        ({"op": "rename_room", "id": "r1"}, "/operations/0/name"),
        ({"op": "rename_room", "id": "r1", "name": "  "}, "/operations/0/name"),
        ({"op": "rename_room", "id": "r1", "name": "A", "colour": "red"}, "/operations/0/colour"),
        ({"op": "merge_rooms", "ids": ["r1"]}, "/operations/0/ids"),
        ({"op": "remove_divider", "id": "d99"}, "/operations/0/id"),
    ],
)
def test_an_edit_that_cannot_be_applied_is_refused_with_a_pointer(
    service: Service, mapped: RobotCaller, operation: dict[str, Any], pointer: str
) -> None:
    answer = service.operator.edit(mapped.path(), 1, operation)
    assert (answer.status_code, answer.headers["Content-Type"]) == (422, "application/problem+json")
    assert pointer in [error["pointer"] for error in answer.json()["errors"]], answer.text
    assert mapped.get(mapped.path()).json()["version"] == 1


def test_numbers_that_are_not_finite_are_no_place_for_a_divider(service: Service, mapped: RobotCaller) -> None:
    body = b'{"operations": [{"op": "add_divider", "line": [[0, 0], [1, NaN]]}]}'
    headers = {"If-Match": '"v1"', "Content-Type": "application/json"}
    answer = service.operator.request("POST", f"{mapped.path()}/edits", headers, content=body)
    assert answer.status_code == 422


def test_the_grid_under_a_map_stays_the_robots_whatever_is_edited(service: Service, mapped: RobotCaller) -> None:
    service.operator.edit(mapped.path(), 1, SPLIT)
    document = mapped.get(mapped.path()).json()
    assert np.array_equal(pixels(mapped.get(document["grid"]).content), home())
    assert document["mission"] == "0"


def test_segments_are_home_assistants(service: Service, mapped: RobotCaller) -> None:
    service.operator.edit(mapped.path(), 1, {"op": "rename_room", "id": "r1", "name": "Kitchen"})
    room = next(f for f in features(mapped.get(mapped.path()).json(), "room") if f["id"] == "r1")
    segments = mapped.get(f"{mapped.path()}/segments").json()
    segment = {"id": str(room["properties"]["segment_id"]), "name": "Kitchen", "group": "ground"}
    assert segment in segments
    assert len(segments) == 2


def test_ids_and_segments_of_a_robots_maps_are_unique_over_all_of_them(mapped: RobotCaller) -> None:
    upstairs = mapped.upload("0", map_name="upstairs")
    assert upstairs.json()["outcome"] == "created"
    maps = [mapped.get(mapped.path(name)).json() for name in ("ground", "upstairs")]
    ids = [{f["id"] for f in document["features"]} for document in maps]
    segments = [{f["properties"]["segment_id"] for f in features(document, "room")} for document in maps]
    assert not ids[0] & ids[1]
    assert not segments[0] & segments[1]


def test_people_give_a_map_a_name_of_their_own(service: Service, mapped: RobotCaller) -> None:
    changed = service.operator.request("PATCH", mapped.path(), json={"name": "Ground floor", "review": "ask_first"})
    assert changed.status_code == 200
    assert (changed.json()["map"], changed.json()["name"], changed.json()["review"]) == (
        "ground",
        "Ground floor",
        "ask_first",
    )
    listed = service.operator.get("/api/v1/robots").json()["items"][0]["maps"][0]
    assert listed == changed.json()
    kept = service.operator.request("PATCH", mapped.path(), json={"review": "automatic"}).json()
    assert (kept["name"], kept["review"]) == ("Ground floor", "automatic")
    assert service.operator.request("PATCH", mapped.path(), json={"review": "never"}).status_code == 422


def test_versions_are_listed_newest_first_and_page_by_page(service: Service, mapped: RobotCaller) -> None:
    for version in (1, 2):
        service.operator.edit(mapped.path(), version, {"op": "rename_room", "id": "r1", "name": f"N{version}"})
    first = mapped.get(f"{mapped.path()}/versions?limit=2")
    assert [(v["version"], v["rooms"], v["cause"]) for v in first.json()["items"]] == [(3, 2, "edit"), (2, 2, "edit")]
    rest = mapped.get(first.headers["Link"].partition(">")[0].removeprefix("<")).json()
    assert [v["version"] for v in rest["items"]] == [1]
    assert mapped.get(f"{mapped.path()}/versions?limit=1001").status_code == 422


def test_a_map_whose_first_mission_waits_is_there_but_has_no_version(service: Service, robot: RobotCaller) -> None:
    service.worker.paused = True
    robot.upload("0", wait=None)
    assert robot.get(robot.path()).status_code == 404
    assert robot.get("/api/v1/robots").json()["items"][0]["maps"][0]["version"] is None
    assert robot.get(f"{robot.path()}/versions").json() == {"items": [], "next": None}
    service.worker.resume()
    assert robot.get(robot.path()).status_code == 200


def test_a_restored_version_and_a_pinned_one_are_confirmed(service: Service, mapped: RobotCaller) -> None:
    mapped.upload("1", home(shift=(1, 0)), base_version=1, tracking={"transform": [0.05, 0.0, 0.0]})
    assert confirmed(service, 2) == [False, False]  # moved as one rigid body, not traced anew
    service.operator.edit(mapped.path(), 2, {"op": "pin_room", "id": "r1"})
    assert confirmed(service, 3) == [True, False]
    service.operator.request("POST", f"{mapped.path()}/versions/2/restore")
    assert confirmed(service, 4) == [True, True]


def test_a_pinned_map_is_compared_with_the_shapes_that_were_pinned(
    service: Service, mapped: RobotCaller, core: Core
) -> None:
    mapped.upload("1", home(shift=(1, 0)), base_version=1, tracking={"transform": [0.05, 0.0, 0.0]})
    service.operator.request("PUT", f"{mapped.path()}/pin")
    mapped.upload("2", home(shift=(1, 0)))
    asked = [call["previous"] for call in core.asked]
    assert [room.anchor == room.polygon for room in asked[-1].rooms] == [True, True]
    assert [room.anchor == room.polygon for room in asked[0].rooms] == [True, True]
    mapped.upload("3", home(shift=(1, 0)))
    carried = [room.anchor for room in core.asked[-1]["previous"].rooms]
    assert carried != [room.polygon for room in core.asked[-1]["previous"].rooms]


def confirmed(service: Service, number: int) -> list[bool]:
    """Of each room of a version, whether its shape is the one that a person confirmed."""
    with service.database.read() as tx:
        row = versions.version_at(tx, 1, number)
    assert row is not None
    return [room.anchor == room.polygon for room in decode_map(row.document).rooms]
