"""Alerts: raised by what is sure, ended by what is lower, told once each."""

from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from typing import Any

import pytest

from stillroom.service.fleet import alerts
from stillroom.service.fleet.alerts import watch
from stillroom.service.fleet.counting import catch_up
from stillroom.service.messages.topics import topics
from stillroom.service.messages.words import ENGLISH, GERMAN
from stillroom.store import alerts as rules
from stillroom.store import clock, people, receivers
from stillroom.store.receivers import NewReceiver
from stillroom.store.rows import DeliveryRow, as_row, columns
from stillroom.store.tables import delivery
from tests.conftest import RobotCaller, Service
from tests.fleets import START, Done, Fleet

ERIK, ANN = "erik@example.org", "ann@example.org"
ALERTS = "/api/v1/fleet/alerts"
RULE: dict[str, Any] = {"name": "doors", "measure": "needs_review", "above": 0.1, "below": 0.05, "firmware": ["5.2"]}


@pytest.fixture
def at(monkeypatch: pytest.MonkeyPatch) -> Callable[[int], None]:
    """Which day it is."""

    def day(number: int) -> None:
        monkeypatch.setattr(clock, "now", lambda _tx: START + timedelta(days=number, hours=6))

    return day


@pytest.mark.parametrize("engine", ["sqlite"])
def test_an_alert_is_told_when_it_is_raised_and_when_it_is_over_and_not_in_between(
    service: Service, at: Callable[[int], None]
) -> None:
    at(0)
    now = datetime.now(UTC)
    hook = {"url": "https://hooks.example.org/x", "scope": "fleet"}
    assert service.operator.request("POST", "/api/v1/webhooks", json=hook).status_code == 201
    with service.database.write() as tx:
        people.find_or_add(tx, ERIK, now)
        people.change(tx, ERIK, {"duty": "engineer"})
        for person, address in (("operator", "ops@example.org"), (f"user:{ERIK}", ERIK), (f"user:{ANN}", ANN)):
            receivers.add(tx, NewReceiver("email", person, address, now), now)
    assert service.operator.request("POST", ALERTS, json=RULE).status_code == 201
    homes = Fleet(service.database)

    def told(day: int, missions: int, failed: int) -> list[str]:
        at(day)
        fine = Done(day=day, firmware="5.2")
        bad = replace(fine, outcome="needs_review", failed=3)
        homes.add(*[replace(bad if n < failed else fine, robot=f"RB-{n}") for n in range(missions)])
        while catch_up(service.database):
            pass
        before = len(sent(service))
        watch(service.database)
        return [row.kind for row in sent(service)[before:]]

    assert told(0, 50, 40) == []  # too few to say anything
    assert told(1, 100, 15) == []  # 15 %, and perhaps less than 10
    assert told(2, 100, 30) == ["alert.raised"] * 3  # a program, an operator, an engineer
    assert told(2, 20, 6) == []  # looked at a moment ago
    (raised,) = service.operator.get(ALERTS).json()["items"]
    assert (raised["figures"]["share"], raised["figures"]["missions"]) == (0.3, 100)
    assert raised["raised_at"] is not None
    assert told(3, 100, 8) == []  # between the two
    assert told(4, 20, 0) == []
    assert told(5, 100, 3) == ["alert.ended"] * 3
    assert told(6, 100, 8) == []
    email, hooked = (next(row for row in sent(service) if ("page" in row.content) is mail) for mail in (True, False))
    assert hooked.content["type"] == "alert.raised"
    assert hooked.content["data"]["selection"]["firmware"] == ["5.2"]
    for words, said in ((ENGLISH, "30.0 %"), (GERMAN, "30,0 %")):
        (topic,) = topics(service.database, [email], "https://maps.example.org", words)
        assert (topic.title, topic.url) == (f"doors: {said}", "https://maps.example.org/fleet")
        assert "100" in topic.text


def sent(service: Service) -> list[DeliveryRow]:
    with service.database.read() as tx:
        query = columns(delivery, DeliveryRow)
        rows = tx.execute(delivery.select().with_only_columns(*query).order_by(delivery.c.id))
        return [as_row(DeliveryRow, row) for row in rows]


@pytest.mark.parametrize("engine", ["sqlite"])
def test_alerts_can_be_listed_and_removed_and_must_make_sense(service: Service, robot: RobotCaller) -> None:
    for wrong in ({"below": 0.2}, {"measure": "luck"}, {"days": 0}, {"name": ""}, {"minimum_n": 1}):
        assert service.operator.request("POST", ALERTS, json=RULE | wrong).status_code == 422
    assert service.operator.request("POST", ALERTS, json=RULE).status_code == 201
    assert service.operator.request("POST", ALERTS, json=RULE).status_code == 409
    assert robot.request("POST", ALERTS, json=RULE).status_code == 403
    watch(service.database)
    (listed,) = service.operator.get(ALERTS).json()["items"]
    assert (listed["name"], listed["raised_at"], listed["figures"]) == ("doors", None, None)
    assert listed["looked_at"] is not None
    assert service.operator.request("DELETE", f"{ALERTS}/doors").status_code == 204
    assert service.operator.request("DELETE", f"{ALERTS}/doors").status_code == 404


@pytest.mark.parametrize("engine", ["postgresql"])
def test_two_who_look_at_once_tell_once(service: Service, monkeypatch: pytest.MonkeyPatch) -> None:
    assert service.operator.request("POST", ALERTS, json=RULE | {"above": 0.0, "below": 0.0}).status_code == 201
    homes = Fleet(service.database)
    homes.add(*[Done(f"RB-{n}", outcome="needs_review", failed=3, firmware="5.2") for n in range(100)])
    catch_up(service.database)
    monkeypatch.setattr(clock, "now", lambda _tx: START)
    with service.database.read() as tx:
        (rule,) = rules.every(tx)
    told: list[str] = []
    monkeypatch.setattr(alerts, "tell_operators", lambda _tx, kind, *_: told.append(kind))
    for _ in range(2):
        alerts._look(service.database, rule, START)
    assert told == ["alert.raised"]
