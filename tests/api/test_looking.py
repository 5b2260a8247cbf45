"""An owner sees who looked at the maps and who changed them."""

from datetime import timedelta
from typing import Any

import pytest

from stillroom.errors import GrantRequired
from stillroom.service import looking
from stillroom.service.access import Person
from stillroom.service.fleet.grants import look
from stillroom.service.retaining import sweep
from stillroom.store import people
from stillroom.store.clock import now
from tests.api.test_access import signed_in
from tests.conflicts import expect
from tests.conftest import Caller, Service

ANN, VERA = "ann@example.org", "vera@example.org"
Json = dict[str, Any]


def log_of(caller: Caller, robot: str = "RB-1") -> list[Json]:
    found: list[Json] = expect(caller.get(f"/api/v1/robots/{robot}/log"))["items"]
    return found


def test_an_owner_sees_who_looked_who_changed_when_and_from_where(service: Service) -> None:
    robot = service.add_robot("RB-1", ANN)
    expect(robot.upload("0"), 201)
    with service.database.write() as tx:
        people.join(tx, ANN, VERA, "viewer", now(tx))
    ann, vera = signed_in(service, ANN), signed_in(service, VERA)
    for _ in range(3):
        expect(vera.get(robot.path()))
    assert vera.get(f"{robot.path()}/versions/1/grid.png").status_code == 200
    assert vera.request("PATCH", robot.path(), json={"name": "Mine"}).status_code == 403, "and is in no log"
    expect(ann.request("PATCH", robot.path(), json={"name": "Ground floor"}))
    expect(ann.request("PATCH", robot.path(), json={"name": "Ground"}))
    with pytest.raises(GrantRequired):
        look(service.database, Person("erik@example.org", "engineer"), "RB-1", "ground", "0", "figure")
    expect(ann.request("PUT", "/api/v1/robots/RB-1/test", json={"test": True}))
    look(service.database, Person("erik@example.org", "engineer"), "RB-1", "ground", "0", "figure")
    entries = log_of(ann)
    told = [(one["who"], one["did"], one["what"], one["times"]) for one in entries]
    assert told[0] == ("user:erik@example.org", "plan", "ground: figure", 1)
    assert sorted(told[1:]) == [
        ("user:ann@example.org", "change", "ground: map", 2),
        ("user:vera@example.org", "look", "ground: map", 1),
        ("user:vera@example.org", "look", "ground: versions grid.png", 1),
    ]
    assert {one["source"] for one in entries} == {"testclient", None}
    assert all(one["at"].endswith("Z") for one in entries)
    for other in (vera, robot, signed_in(service, "bob@example.org")):
        assert other.get("/api/v1/robots/RB-1/log").status_code == 403
    first = expect(ann.get("/api/v1/robots/RB-1/log?limit=2"))
    second = expect(ann.get(f"/api/v1/robots/RB-1/log?limit=2&cursor={first['next']}"))
    assert first["items"] + second["items"] == entries
    assert second["next"] is None


def test_looks_of_one_minute_are_written_once_and_old_ones_are_forgotten(
    service: Service, monkeypatch: pytest.MonkeyPatch
) -> None:
    robot = service.add_robot("RB-1", ANN)
    expect(robot.upload("0"), 201)
    ann = signed_in(service, ANN)
    for _ in range(5):
        expect(ann.get(robot.path()))
    assert [one["times"] for one in log_of(ann)] == [1]
    monkeypatch.setattr(looking, "EVERY_S", 0.0)
    expect(ann.get(robot.path()))
    assert sum(one["times"] for one in log_of(ann)) == 6, "those between are not lost"
    monkeypatch.setattr("stillroom.service.retaining.KEPT", timedelta(0))
    sweep(service.database, service.grids)
    assert log_of(ann) == []
