"""What people delete is gone: no row and no file of it is left, while the fleet's figures stay what they were."""

import json
from collections.abc import Callable
from hashlib import sha256

import pytest
import sqlalchemy as sa

from stillroom.service.access import Person
from stillroom.service.erasing import sweep_grids
from stillroom.service.fleet.counting import catch_up
from stillroom.service.fleet.grants import look
from stillroom.service.messages.announcing import announce
from stillroom.service.verifying import verify
from stillroom.store import erasing, people
from stillroom.store.clock import now
from stillroom.store.grids import GridStore, Put
from stillroom.store.tables import metadata
from tests.conflicts import expect
from tests.conftest import Caller, Json, RobotCaller, Service
from tests.fuzz.neighbourhood import PRIVATE, Neighbourhood, settle
from tests.homes import home, png

BOB = "bob@example.org"
RATES = "/api/v1/fleet/failure-rates?group_by=day"


def furnished(service: Service) -> tuple[Neighbourhood, RobotCaller, Caller]:
    """Three homes, and Bob's with all that can be known of one: also where it is not by its robot's name."""
    neighbours = settle(service)
    robot, bob = neighbours.homes[2].robot, neighbours.callers["neighbour"]
    expect(robot.upload("3", home(shift=(3, 0))), 201)
    expect(bob.request("PUT", f"/api/v1/robots/{robot.id}/test", json={"test": True}))
    expect(bob.request("PATCH", "/api/v1/notifications", json={"language": "de", "email": ["conflict"]}))
    look(service.database, Person("erik@example.org", "engineer"), robot.id, "ground", "0", "figure")
    with service.database.write() as tx:
        people.join(tx, BOB, "mel@example.org", "member", now(tx))
        people.join(tx, "ann@example.org", BOB, "viewer", now(tx))
    announce(service.database, "https://maps.example.org")
    catch_up(service.database, 10)
    return neighbours, robot, bob


def rows_with(service: Service, *words: str) -> list[str]:
    """Every row of every table that says one of the words."""
    with service.database.read() as tx:
        return [
            f"{table.name}: {row}"
            for table in metadata.sorted_tables
            for row in tx.execute(sa.select(table)).all()
            if any(word in json.dumps(list(row), default=str, ensure_ascii=False) for word in words)
        ]


def files(service: Service) -> set[str]:
    return {stored.path for stored in service.grids.list()}


def test_of_a_home_that_is_deleted_no_row_and_no_file_remains_and_the_fleets_figures_stay(service: Service) -> None:
    neighbours, robot, bob = furnished(service)
    rates, before = expect(service.operator.get(RATES)), files(service)
    anns = expect(neighbours.callers["owner"].get(neighbours.homes[1].robot.path()))
    assert len(rows_with(service, BOB, PRIVATE, '"bobs"')) > 30
    assert bob.request("DELETE", "/api/v1/home").status_code == 422
    assert bob.request("DELETE", "/api/v1/home?confirm=ann@example.org").status_code == 422
    gone: Json = expect(bob.request("DELETE", f"/api/v1/home?confirm={BOB}"))
    assert gone == {"robots": ["bobs"], "maps": 1, "missions": 4}
    assert rows_with(service, BOB, PRIVATE) == []
    (left,) = rows_with(service, '"bobs"')
    assert left.startswith("robot:"), "the robot itself, which is nobody's"
    assert len(before - files(service)) == 1, "the grid that Ann's robot had not sent, too"
    assert expect(service.operator.get(RATES)) == rates
    assert expect(neighbours.callers["owner"].get(neighbours.homes[1].robot.path())) == anns
    assert neighbours.homes[1].robot.get("/api/v1/robots/anns/maps/ground/versions/1/grid.png").status_code == 200
    report = verify(service.database, service.grids)
    assert report.holds, report.examples
    assert bob.get("/api/v1/robots").status_code == 401
    assert robot.upload("4").status_code == 403, "until somebody claims it"


def test_a_robot_whose_data_are_deleted_begins_anew_and_stays_its_owners(service: Service) -> None:
    neighbours, robot, bob = furnished(service)
    path = f"/api/v1/robots/{robot.id}/maps"
    assert bob.request("DELETE", f"{path}?confirm=anns").status_code == 422
    assert neighbours.callers["owner"].request("DELETE", f"{path}?confirm=bobs").status_code == 403
    assert robot.request("DELETE", f"{path}?confirm=bobs").status_code == 403
    assert expect(bob.request("DELETE", f"{path}?confirm=bobs"))["missions"] == 4
    (left,) = rows_with(service, '"bobs"')
    assert left.startswith("robot:")
    assert bob.get(robot.path()).status_code == 404
    again = expect(robot.upload("0"), 201)
    assert (again["outcome"], again["version"]) == ("created", 1)


def asked_again(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Keys of grids that uploads look for once more; the list grows."""
    keys: list[str] = []
    keep = GridStore.keep

    def noted(store: GridStore, key: str, content: bytes) -> None:
        keys.append(key)
        keep(store, key, content)

    monkeypatch.setattr(GridStore, "keep", noted)
    return keys


def between(monkeypatch: pytest.MonkeyPatch, happens: Callable[[str], None]) -> None:
    """`happens` after the next grid is stored, and before its mission is."""
    put = GridStore.put

    def stored(store: GridStore, content: bytes) -> Put:
        monkeypatch.setattr(GridStore, "put", put)
        done = put(store, content)
        happens(done.key)
        return done

    monkeypatch.setattr(GridStore, "put", stored)


def test_an_upload_asks_the_store_once_more_only_where_its_grid_may_have_been_deleted(
    service: Service, robot: RobotCaller, monkeypatch: pytest.MonkeyPatch
) -> None:
    expect(robot.upload("0", home()), 201)
    again = asked_again(monkeypatch)
    expect(robot.upload("1", home(shift=(1, 0))), 201)
    assert again == []
    expect(robot.upload("2", home(shift=(1, 0))), 201)
    assert len(again) == 1, "the same grid was there"
    with service.database.write() as tx:
        erasing.discard(tx, ["0" * 64], now(tx))
    expect(robot.upload("3", home(shift=(3, 0))), 201)
    assert len(again) == 2, "a sweep may be at it"
    sweep_grids(service.database, service.grids)
    expect(robot.upload("4", home(shift=(4, 0))), 201)
    assert len(again) == 3, "there was one"
    expect(robot.upload("5", home(shift=(5, 0))), 201)
    assert len(again) == 3


@pytest.mark.parametrize("was_there", [False, True])
@pytest.mark.parametrize("ended", [False, True])
def test_an_upload_whose_grid_is_swept_before_its_mission_is_stored_keeps_it(
    service: Service, robot: RobotCaller, monkeypatch: pytest.MonkeyPatch, was_there: bool, ended: bool
) -> None:
    expect(robot.upload("0", home()), 201)
    content = png(home(shift=(1, 0)))
    if was_there:
        service.grids.put(content)

    def swept(key: str) -> None:
        with service.database.write() as tx:
            erasing.discard(tx, [key], now(tx))
        if ended:
            sweep_grids(service.database, service.grids)
        else:  # whoever swept was killed before it was written down
            service.grids.delete([key])
        assert sha256(content).hexdigest() not in {path.rpartition("/")[2] for path in files(service)}

    between(monkeypatch, swept)
    expect(robot.upload("1", content), 201)
    assert service.grids.get(sha256(content).hexdigest()) == content


def test_an_upload_of_a_grid_that_is_being_deleted_keeps_it(service: Service) -> None:
    key = service.grids.put(b"anything").key
    service.grids.delete([key, "0" * 64])
    assert files(service) == set()
    service.grids.keep(key, b"anything")
    service.grids.keep(key, b"anything")
    assert service.grids.get(key) == b"anything"
