"""The fleet's figures over HTTP: from real uploads, edits and decisions."""

import csv
import io
import sys
from datetime import UTC, datetime, timedelta
from typing import Any

import pyarrow.parquet
import pytest
import sqlalchemy as sa

from stillroom.service.fleet import escapes
from stillroom.store.tables import mission, version
from tests.conflicts import Core, rejected
from tests.conftest import RobotCaller, Service, features
from tests.homes import changed, home

FLEET = "/api/v1/fleet"
OPERATORS_ONLY = [
    ("GET", "failure-rates"),
    ("GET", "failure-rates.csv"),
    ("GET", "failure-rates.parquet"),
    ("GET", "filters"),
    ("GET", "robots"),
    ("GET", "causes"),
    ("GET", "causes/0123456789abcdef"),
    ("PUT", "causes/0123456789abcdef/mute"),
    ("DELETE", "causes/0123456789abcdef/mute"),
    ("GET", "missions"),
    ("GET", "unprocessed"),
]


def ask(service: Service, path: str) -> Any:
    answer = service.operator.get(f"{FLEET}/{path}")
    assert answer.status_code == 200, answer.text
    return answer.json()


def total(service: Service) -> Any:
    return ask(service, "failure-rates")["total"]


@pytest.mark.parametrize(("method", "path"), OPERATORS_ONLY)
def test_the_fleets_figures_are_for_operators_alone(
    service: Service, robot: RobotCaller, method: str, path: str
) -> None:
    assert service.stranger.request(method, f"{FLEET}/{path}").status_code == 401
    assert robot.request(method, f"{FLEET}/{path}").status_code == 403
    assert service.operator.request(method, f"{FLEET}/{path}", json={}).status_code in (200, 404)


def test_an_upload_that_is_sent_again_and_again_is_one_mission(service: Service, mapped: RobotCaller) -> None:
    for _ in range(3):
        mapped.upload("5", home(shift=(1, 0)), firmware="5.2", model="S9")
    mapped.upload("3", home(shift=(1, 0)), firmware="5.2", model="S9")  # late
    found = ask(service, "failure-rates?group_by=firmware")
    (row,) = found["items"]
    assert (row["key"], row["missions"], row["robots"], row["failed"]["transfer"]) == ("5.2", 1, 1, 0)
    assert row["rates"]["transfer"] == 0.0
    low, high = row["ci95"]["transfer"]
    assert (low, row["sufficient"]) == (0.0, False)
    assert high > 0.7
    assert found["waiting"] == 0


def test_what_was_put_to_a_person_is_a_failure_with_a_cause(service: Service, mapped: RobotCaller, core: Core) -> None:
    core.planned["1"] = rejected("c1", kind="room_lost")
    mapped.upload("1", home(shift=(1, 0)), firmware="5.2", model="S9")
    mapped.upload("2", home(shift=(1, 0)), firmware="5.2", model="S9")
    assert (total(service)["missions"], total(service)["needs_review"]) == (2, 1)
    (cause,) = ask(service, "causes")["items"]
    about = {name: cause[name] for name in ("kind", "cause", "state", "missions", "robots", "needs_review", "share")}
    assert about == {
        "kind": "room_lost",
        "cause": "wall_gap",
        "state": "new",
        "missions": 1,
        "robots": 1,
        "needs_review": 1,
        "share": 1.0,
    }
    whole = ask(service, f"causes/{cause['id']}")
    assert (whole["firmware"], whole["model"]) == ({"5.2": 1}, {"S9": 1})
    answer = service.operator.get(cause["url"])
    (failed,) = answer.json()["items"]
    assert (failed["robot"], failed["map"], failed["mission"], failed["outcome"]) == (
        mapped.id,
        "ground",
        "1",
        "needs_review",
    )


def test_a_cause_can_be_muted_for_a_while_or_for_good(service: Service, mapped: RobotCaller, core: Core) -> None:
    core.planned["1"] = rejected("c1")
    mapped.upload("1", home(shift=(1, 0)))
    (cause,) = ask(service, "causes")["items"]
    path = f"{FLEET}/causes/{cause['id']}/mute"
    past = {"until": "2020-01-01T00:00:00Z"}
    assert service.operator.request("PUT", path, json=past).status_code == 422
    later = (datetime.now(UTC) + timedelta(days=3)).isoformat()
    muted = service.operator.request("PUT", path, json={"until": later, "note": "doors of the fair"}).json()
    assert (muted["state"], muted["note"], muted["muted_by"]) == ("muted", "doors of the fair", "operator")
    assert ask(service, "causes?state=new")["items"] == []
    assert service.operator.request("DELETE", path).json()["state"] == "new"
    assert service.operator.request("PUT", path, json={}).json()["muted_until"] is None
    assert ask(service, "causes?state=muted")["items"][0]["id"] == cause["id"]


@pytest.mark.parametrize(
    "query",
    ["from=yesterday", "from=2026-11-02&to=2026-11-01", "from=1900-01-01", "group_by=owner", "size=5", "interval=none"],
)
def test_a_question_that_makes_no_sense_is_refused(service: Service, query: str) -> None:
    answer = service.operator.get(f"{FLEET}/failure-rates?{query}")
    assert answer.status_code == 422
    assert answer.headers["Content-Type"] == "application/problem+json"
    assert answer.json()["errors"]


def test_days_and_moments_select_both_days(service: Service, mapped: RobotCaller) -> None:
    mapped.upload("1", home(shift=(1, 0)))
    now = datetime.now(UTC)
    for first, last, n in (
        (now.date().isoformat(), now.date().isoformat(), 1),
        (now.strftime("%Y-%m-%dT%H:%M:%SZ"), now.strftime("%Y-%m-%dT%H:%M:%SZ"), 1),
        ("2020-01-01", "2020-01-31", 0),
    ):
        assert ask(service, f"failure-rates?from={first}&to={last}")["total"]["missions"] == n


def test_the_rates_can_be_had_as_a_table_that_spreadsheets_take_for_no_formula(
    service: Service, mapped: RobotCaller
) -> None:
    mapped.upload("1", home(shift=(1, 0)), firmware="=1+1")
    answer = service.operator.get(f"{FLEET}/failure-rates.csv?group_by=firmware")
    assert answer.headers["Content-Type"].startswith("text/csv")
    first, second = csv.DictReader(io.StringIO(answer.text))
    assert (first["key"], first["missions"], first["transfer_count"], first["transfer_rate"]) == (
        "'=1+1",
        "1",
        "0",
        "0.0",
    )
    assert second["key"] == "all"


@pytest.mark.parametrize("engine", ["sqlite"])
def test_the_rates_can_be_had_as_parquet(
    service: Service, mapped: RobotCaller, monkeypatch: pytest.MonkeyPatch
) -> None:
    mapped.upload("1", home(shift=(1, 0)), firmware="=1+1")
    answer = service.operator.get(f"{FLEET}/failure-rates.parquet?group_by=firmware")
    assert answer.headers["Content-Disposition"].endswith('.parquet"')
    first, second = pyarrow.parquet.read_table(io.BytesIO(answer.content)).to_pylist()
    assert (first["key"], first["missions"], first["transfer_rate"], first["sufficient"]) == ("=1+1", 1, 0.0, False)
    assert second["key"] == "all"
    nothing = service.operator.get(f"{FLEET}/failure-rates.parquet?from=2020-01-01&to=2020-01-02")
    (row,) = pyarrow.parquet.read_table(io.BytesIO(nothing.content)).to_pylist()
    assert (row["missions"], row["transfer_rate"]) == (0, None)
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    refused = service.operator.get(f"{FLEET}/failure-rates.parquet")
    assert (refused.status_code, "stillroom[parquet]" in refused.json()["detail"]) == (503, True)


def test_what_can_be_selected_by_is_listed(service: Service, mapped: RobotCaller) -> None:
    mapped.upload("1", home(shift=(1, 0)), firmware="5.2", model="S9")
    assert total(service)["missions"] == 1
    found = ask(service, "filters")
    assert (found["firmware"], found["model"], found["size"]) == (["5.2"], ["S9"], ["1-3"])


# -- missions that could not be processed ---------------------------------------------------------------------------


def broken(*_asked: Any) -> Any:
    raise RuntimeError("a fault that is mended later")


def test_a_mission_that_could_not_be_processed_is_listed_and_can_be_run_again(
    service: Service, mapped: RobotCaller, core: Core
) -> None:
    core.planned["1"] = broken
    mapped.upload("1", home(shift=(1, 0)))
    mapped.upload("2", home(shift=(1, 0)), map_name="upstairs")
    (failed,) = ask(service, "unprocessed")["items"]
    assert (failed["mission"], failed["attempts"], failed["robot"]) == ("1", 1, mapped.id)
    assert "RuntimeError: a fault that is mended later" in failed["error"]
    assert (total(service)["missions"], total(service)["reverted"]) == (1, 1)
    (cause,) = ask(service, "causes")["items"]
    assert (cause["kind"], cause["cause"], cause["stage"]) == ("error", "RuntimeError", "processing")
    del core.planned["1"]
    again = service.operator.request("POST", failed["url"] + "/run")
    assert (again.status_code, again.headers["Location"]) == (202, failed["url"])
    service.worker.resume()
    assert ask(service, "unprocessed")["items"] == []
    found = service.operator.get(f"{mapped.path()}/missions/1").json()
    assert (found["outcome"], found["version"]) == ("updated", 2)
    assert (total(service)["missions"], total(service)["reverted"]) == (1, 0)
    assert ask(service, "causes")["items"] == []
    refused = service.operator.request("POST", failed["url"] + "/run")
    assert (refused.status_code, refused.json()["type"].rsplit("/", 1)[1]) == (409, "not-unprocessed")


def test_a_mission_that_is_run_again_after_a_newer_one_is_late(
    service: Service, mapped: RobotCaller, core: Core
) -> None:
    core.planned["1"] = broken
    for key in ("1", "2"):
        mapped.upload(key, home(shift=(1, 0)))
    del core.planned["1"]
    (failed,) = ask(service, "unprocessed")["items"]
    assert service.operator.request("POST", failed["url"] + "/run").status_code == 202
    service.worker.resume()
    assert service.operator.get(f"{mapped.path()}/missions/1").json()["outcome"] == "superseded"
    assert total(service)["missions"] == 1
    assert mapped.request("POST", failed["url"] + "/run").status_code == 403


# -- escapes: taken by itself, and then corrected by a person -------------------------------------------------------


def counted(service: Service) -> tuple[int, int]:
    found = total(service)
    return found["missions"], found["escapes"]


def test_a_restore_holds_against_the_first_mission_that_it_undoes(service: Service, mapped: RobotCaller) -> None:
    for key in ("1", "2", "3"):
        assert mapped.upload(key, home(shift=(1, 0))).json()["outcome"] == "updated"
    restored = service.operator.request("POST", f"{mapped.path()}/versions/2/restore")
    assert restored.status_code == 201
    assert counted(service) == (3, 1)
    (escaped,) = ask(service, "missions?escaped=true")["items"]
    assert escaped["mission"] == "2"
    again = service.operator.request("POST", f"{mapped.path()}/versions/2/restore")  # changes nothing any more
    assert again.status_code == 201
    assert counted(service) == (3, 1)
    assert mapped.upload("4", home(shift=(1, 0))).json()["outcome"] == "updated"
    assert counted(service) == (4, 1)


def test_a_restore_after_a_week_holds_against_nothing(service: Service, mapped: RobotCaller) -> None:
    mapped.upload("1", home(shift=(1, 0)))
    longer = datetime.now(UTC) - escapes.WITHIN - timedelta(hours=1)
    with service.database.write() as tx:
        tx.execute(sa.update(version).values(created_at=longer))
        tx.execute(sa.update(mission).values(finished_at=longer))
    service.operator.request("POST", f"{mapped.path()}/versions/1/restore")
    assert counted(service) == (1, 0)


def edit(service: Service, robot: RobotCaller, *operations: Any) -> None:
    document = robot.get(robot.path()).json()
    answer = service.operator.edit(robot.path(), document["version"], *operations)
    assert answer.status_code == 200, answer.text


def test_names_and_zones_correct_nothing(service: Service, mapped: RobotCaller) -> None:
    mapped.upload("1", home(shift=(1, 0)))
    edit(service, mapped, {"op": "rename_room", "id": "r1", "name": "Kitchen"})
    edit(service, mapped, {"op": "add_restriction", "kind": "no_mop", "shape": [[0.2, 0.2], [0.6, 0.2], [0.6, 0.6]]})
    assert counted(service) == (1, 0)


def test_taking_back_ones_own_edit_holds_against_no_mission(service: Service, mapped: RobotCaller) -> None:
    mapped.upload("1", home(shift=(1, 0)))
    edit(service, mapped, {"op": "rename_room", "id": "r1", "name": "Kitchen"})
    assert service.operator.request("POST", f"{mapped.path()}/versions/3/undo").status_code == 201
    assert counted(service) == (1, 0)


def test_an_edit_of_rooms_that_no_mission_changed_holds_against_none(service: Service, mapped: RobotCaller) -> None:
    mapped.upload("1", home())
    first, second = (room["id"] for room in features(mapped.get(mapped.path()).json(), "room"))
    edit(service, mapped, {"op": "merge_rooms", "ids": [first, second]})
    assert counted(service) == (1, 0)


def test_an_edit_holds_against_the_mission_that_changed_the_same_rooms(service: Service, mapped: RobotCaller) -> None:
    mapped.upload("1", home())
    (new,) = mapped.upload("2", changed("annex")).json()["discovered_rooms"]
    mapped.upload("3", changed("annex"))
    beside = next(
        room
        for kind in ("divider", "meta_divider")
        for divider in features(mapped.get(mapped.path()).json(), kind)
        for room in divider["properties"]["rooms"]
        if new in divider["properties"]["rooms"] and room != new
    )
    edit(service, mapped, {"op": "merge_rooms", "ids": [beside, new]})
    assert counted(service) == (3, 1)
    (escaped,) = ask(service, "missions?escaped=true")["items"]
    assert escaped["mission"] == "2"


@pytest.mark.parametrize(("answer", "escapes_then"), [("accept", 0), ("reject", 1)])
def test_an_answer_corrects_what_was_settled_without_asking_only_where_it_changes_the_map(
    service: Service, mapped: RobotCaller, answer: str, escapes_then: int
) -> None:
    (conflict,) = mapped.upload("1", changed("annex")).json()["conflicts"]
    path = f"{mapped.path()}/conflicts/{conflict}/decision"
    assert service.operator.request("POST", path, json={"response": answer}).status_code == 200
    assert counted(service) == (1, escapes_then)


def test_bringing_a_mission_into_force_that_was_not_taken_corrects_nothing(
    service: Service, mapped: RobotCaller, core: Core
) -> None:
    mapped.upload("1", home(shift=(1, 0)))
    core.planned["2"] = rejected("c1")
    mapped.upload("2", changed("annex"))
    path = f"{mapped.path()}/conflicts/c1/decision"
    assert service.operator.request("POST", path, json={"response": "accept"}).status_code == 200
    assert counted(service) == (2, 0)
