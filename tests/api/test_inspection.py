"""Fleet engineers look at missions; floor plans are looked at with the owner's leave alone, and each look is logged."""

from datetime import UTC, datetime, timedelta
from typing import Any

import pytest
import sqlalchemy as sa

from stillroom.service.messages.sending import notification
from stillroom.service.messages.topics import topics
from stillroom.service.messages.words import ENGLISH, GERMAN
from stillroom.store import receivers
from stillroom.store.fleet_tables import plan_grant
from stillroom.store.receivers import NewReceiver
from stillroom.store.rows import DeliveryRow, as_row, columns
from stillroom.store.tables import delivery
from tests.api.test_access import signed_in
from tests.conflicts import Core, rejected
from tests.conftest import Caller, RobotCaller, Service, features
from tests.homes import changed, home, pixels

FLEET = "/api/v1/fleet"
ANN, BOB = "ann@example.org", "bob@example.org"
REASON = "The kitchen was lost in mission 1."


@pytest.fixture
def anns(service: Service) -> RobotCaller:
    """Ann's robot: its second mission was put to her."""
    robot = service.add_robot("RB-7", ANN)
    robot.upload("0")
    return robot


def mission(robot: RobotCaller, key: str = "1", rest: str = "") -> str:
    return f"{FLEET}/robots/{robot.id}/maps/ground/missions/{key}{rest}"


def ask(service: Service, robot: RobotCaller, hours: int = 2) -> Any:
    body = {"robot": robot.id, "reason": REASON, "hours": hours}
    return service.operator.request("POST", f"{FLEET}/grants", json=body)


def answer(who: Caller, grant: str, word: str) -> Any:
    return who.request("POST", f"/api/v1/grants/{grant}/answer", json={"answer": word})


def views(who: Caller, robot: RobotCaller) -> list[Any]:
    found = who.get(f"/api/v1/robots/{robot.id}/views")
    assert found.status_code == 200, found.text
    items: list[Any] = found.json()["items"]
    return items


def test_engineers_see_numbers_and_nothing_that_people_wrote(service: Service, anns: RobotCaller, core: Core) -> None:
    ann = signed_in(service, ANN)
    rename = {"op": "rename_room", "id": "r1", "name": "Secret cellar"}
    assert ann.edit(anns.path(), 1, rename).status_code == 200
    core.planned["1"] = rejected("c1", kind="room_lost")
    anns.upload(
        "1", home(shift=(1, 0)), firmware="5.2", model="S9", tracking={"transform": [0.05, 0, 0]}, base_version=1
    )
    anns.upload("2", home(shift=(1, 0)))
    answered = service.operator.get(mission(anns))
    assert answered.status_code == 200, answered.text
    found = answered.json()
    assert "cellar" not in answered.text
    assert "coordinates" not in answered.text
    assert (found["outcome"], found["firmware"], found["tracked"]) == ("needs_review", "5.2", ["transform"])
    assert (found["previous"], found["next"], found["plan"]) == ("0", "2", "none")
    assert [room["id"] for room in found["rooms"]] == ["r1", "r2"]
    (conflict,) = found["conflicts"]
    assert (conflict["kind"], conflict["state"], conflict["response"]) == ("room_lost", "superseded", None)
    assert found["timings_ms"]["total"] > 0
    history = service.operator.get(mission(anns, "")[:-1]).json()["items"]
    assert [(step["mission"], step["outcome"]) for step in history] == [
        ("2", "updated"), ("1", "needs_review"), ("0", "created"),
    ]  # fmt: skip
    assert service.operator.get(mission(anns, "99")).status_code == 404
    for nobody in (ann, anns):
        assert nobody.get(mission(anns)).status_code == 403


def test_a_floor_plan_is_not_shown_without_leave(service: Service, anns: RobotCaller) -> None:
    anns.upload("1", home(shift=(1, 0)))
    for what in ("/figure", "/cells.png"):
        refused = service.operator.get(mission(anns, "1", what))
        assert refused.status_code == 403
        assert refused.headers["Content-Type"] == "application/problem+json"
        assert (refused.json()["type"].rsplit("/", 1)[1], refused.json()["plan"]) == ("grant-required", "none")
    assert views(signed_in(service, ANN), anns) == []


def test_with_leave_the_floor_plan_is_shown_until_it_ends_and_the_owner_sees_who_looked(
    service: Service, anns: RobotCaller
) -> None:
    anns.upload("1", changed("annex"))
    ann, bob = signed_in(service, ANN), signed_in(service, BOB)
    asked = ask(service, anns)
    assert (asked.status_code, asked.json()["state"]) == (201, "asked")
    assert ask(service, anns).status_code == 409  # once is enough
    grant = asked.json()["id"]
    assert service.operator.get(mission(anns, "1", "/figure")).json()["plan"] == "asked"
    assert [one["reason"] for one in ann.get("/api/v1/grants").json()["items"]] == [REASON]
    assert bob.get("/api/v1/grants").json()["items"] == []
    for nobody in (bob, service.operator, anns):
        assert answer(nobody, grant, "grant").status_code == 403
    granted = answer(ann, grant, "grant").json()
    assert (granted["state"], granted["answered_by"]) == ("granted", f"user:{ANN}")
    until = datetime.fromisoformat(granted["expires_at"])
    assert timedelta(minutes=110) < until - datetime.now(UTC) <= timedelta(hours=2)
    assert answer(ann, grant, "refuse").status_code == 409

    shown = service.operator.get(mission(anns, "1", "/figure"))
    assert shown.status_code == 200, shown.text
    figure = shown.json()
    assert (figure["outcome"], figure["taken"]) == ("updated", True)
    assert len([f for f in figure["candidate"] if f["properties"]["semantic"] == "room"]) == 3
    assert {f["properties"]["name"] for f in figure["tracked"] if f["properties"]["semantic"] == "room"} == {"r1", "r2"}
    assert {difference["change"] for difference in figure["differences"]} >= {"found"}
    picture = service.operator.get(figure["cells"])
    assert (picture.headers["Content-Type"], picture.headers["Cache-Control"]) == ("image/png", "no-store")
    height, width = pixels(picture.content).shape[:2]
    assert (width, height) == (figure["frame"]["width"], figure["frame"]["height"])

    seen = [(view["viewer"], view["what"], view["why"], view["grant"]) for view in views(ann, anns)]
    assert seen == [("operator", "cells", "granted", grant), ("operator", "figure", "granted", grant)]
    assert bob.get(f"/api/v1/robots/{anns.id}/views").status_code == 403
    with service.database.write() as tx:
        tx.execute(sa.update(plan_grant).values(expires_at=datetime.now(UTC) - timedelta(seconds=1)))
    assert service.operator.get(mission(anns, "1", "/figure")).status_code == 403
    assert ann.get("/api/v1/grants").json()["items"][0]["state"] == "expired"
    assert ask(service, anns).status_code == 201  # it can be asked again


def test_leave_can_be_taken_back_and_refused(service: Service, anns: RobotCaller) -> None:
    anns.upload("1", home(shift=(1, 0)))
    ann = signed_in(service, ANN)
    grant = ask(service, anns).json()["id"]
    answer(ann, grant, "grant")
    assert service.operator.get(mission(anns, "1", "/cells.png")).status_code == 200
    revoked = ann.request("DELETE", f"/api/v1/grants/{grant}")
    assert (revoked.json()["state"], revoked.json()["ended_by"]) == ("revoked", f"user:{ANN}")
    assert service.operator.get(mission(anns, "1", "/cells.png")).status_code == 403
    second = ask(service, anns).json()["id"]
    assert answer(ann, second, "refuse").json()["state"] == "refused"
    assert service.operator.get(mission(anns, "1", "/cells.png")).status_code == 403
    third = ask(service, anns).json()["id"]
    assert service.operator.request("DELETE", f"/api/v1/grants/{third}").json()["state"] == "withdrawn"
    assert answer(ann, third, "grant").status_code == 409
    assert signed_in(service, BOB).request("DELETE", f"/api/v1/grants/{third}").status_code == 403
    assert ann.request("DELETE", "/api/v1/grants/grant_x").status_code == 404


def test_a_question_that_nobody_answers_expires(service: Service, anns: RobotCaller) -> None:
    ann = signed_in(service, ANN)
    grant = ask(service, anns).json()["id"]
    with service.database.write() as tx:
        tx.execute(sa.update(plan_grant).values(expires_at=datetime.now(UTC) - timedelta(seconds=1)))
    assert answer(ann, grant, "grant").status_code == 409


def test_robots_of_nobody_and_those_that_their_owners_lend_for_tests_need_no_leave_but_are_logged(
    service: Service, mapped: RobotCaller, anns: RobotCaller
) -> None:
    for robot in (mapped, anns):
        robot.upload("1", home(shift=(1, 0)))
    ann = signed_in(service, ANN)
    path = f"/api/v1/robots/{anns.id}/test"
    assert service.operator.request("PUT", path, json={"test": True}).status_code == 403
    assert anns.request("PUT", path, json={"test": True}).status_code == 403
    assert ann.request("PUT", path, json={"test": True}).json() == {"robot": anns.id, "test": True}
    for robot, why in ((mapped, "unowned"), (anns, "test")):
        assert service.operator.get(mission(robot, "1", "/figure")).status_code == 200
        assert ask(service, robot).json()["plan"] == why
    assert [view["why"] for view in views(ann, anns)] == ["test"]
    assert ann.request("PUT", path, json={"test": False}).json()["test"] is False
    assert service.operator.get(mission(anns, "1", "/figure")).status_code == 403


@pytest.mark.parametrize(
    "body", [{}, {"robot": "RB-7", "reason": "short"}, {"robot": "RB-7", "reason": REASON, "hours": 999}]
)
def test_a_question_that_says_too_little_is_refused(service: Service, anns: RobotCaller, body: Any) -> None:
    assert service.operator.request("POST", f"{FLEET}/grants", json=body).status_code == 422
    assert anns.request("POST", f"{FLEET}/grants", json={"robot": anns.id, "reason": REASON}).status_code == 403


def test_the_first_mission_has_a_figure_without_a_previous_map(service: Service, mapped: RobotCaller) -> None:
    figure = service.operator.get(mission(mapped, "0", "/figure")).json()
    assert (figure["outcome"], figure["tracked"], figure["differences"]) == ("created", [], [])
    assert len([f for f in figure["candidate"] if f["properties"]["semantic"] == "room"]) == 2


def test_a_figure_starts_from_the_version_that_was_in_force_then(service: Service, mapped: RobotCaller) -> None:
    tracking = {"transform": [0.0, 0.0, 0.0]}
    outcome = mapped.upload("1", changed("open plan"), base_version=1, tracking=tracking).json()
    assert outcome["outcome"] == "resolved"
    mapped.upload("2", home(shift=(1, 0)))
    document = mapped.get(mapped.path()).json()
    merge = {"op": "merge_rooms", "ids": [room["id"] for room in features(document, "room")]}
    assert service.operator.edit(mapped.path(), document["version"], merge).status_code == 200
    figure = service.operator.get(mission(mapped, "1", "/figure")).json()
    assert figure["ablation"] == outcome["ablation"]
    assert [room["id"] for room in figure["rooms"]] == [room["id"] for room in outcome["rooms"]]


def test_the_owner_is_told_of_the_question_until_it_is_answered(service: Service, anns: RobotCaller) -> None:
    now = datetime.now(UTC)
    with service.database.write() as tx:
        receivers.add(tx, NewReceiver("email", f"user:{ANN}", ANN, now), now)
        receivers.add(tx, NewReceiver("email", f"user:{BOB}", BOB, now), now)
    grant = ask(service, anns, hours=5).json()["id"]
    with service.database.read() as tx:
        query = sa.select(*columns(delivery, DeliveryRow)).where(delivery.c.kind == "grant")
        waiting = [as_row(DeliveryRow, row) for row in tx.execute(query)]
    assert len(waiting) == 1
    for words, said in ((ENGLISH, "for 5 hours"), (GERMAN, "für 5 Stunden")):
        (topic,) = topics(service.database, waiting, "https://maps.example.org", words)
        assert topic.url == f"https://maps.example.org/access/{grant}"
        assert said in topic.text
        assert REASON in topic.text
        assert notification([topic], words)["url"] == f"/access/{grant}"
    answer(signed_in(service, ANN), grant, "refuse")
    assert topics(service.database, waiting, "https://maps.example.org", ENGLISH) == []
