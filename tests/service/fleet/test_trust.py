"""Rates that can be trusted: each of the things that make others' figures wrong, over the whole service."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from typing import Any

import pytest
import sqlalchemy as sa

from stillroom.store import clock, lanes, maps, missions
from stillroom.store.fleet_tables import counted
from stillroom.store.tables import mission, version
from tests.conflicts import Core, rejected
from tests.conftest import RobotCaller, Service
from tests.homes import home
from tests.service.fleet import recount

YEARS = "from=2020-01-01&to=2029-12-31"


def figures(service: Service, by: str = "day") -> dict[str, dict[str, float]]:
    """As the dashboard has them; they are those of the missions' rows, counted one by one."""
    answer = service.operator.get(f"/api/v1/fleet/failure-rates?{YEARS}&group_by={by}")
    assert answer.status_code == 200, answer.text
    found = {row["key"]: recount.told(row) for row in answer.json()["items"]}
    with service.database.read() as tx:
        escaped = set(tx.execute(sa.select(counted.c.mission_id).where(counted.c.escaped_at.is_not(None))).scalars())
    assert found == recount.rows(recount.recount(service.database, escaped), by)
    return found


def total(service: Service) -> dict[str, float]:
    days = figures(service).values()
    names = ("missions", "transfer", "needs_review", "reverted", "parked", "escapes")
    return {name: sum(day[name] for day in days) for name in names if any(day[name] for day in days)}


def shifted(key: int) -> Any:
    return home(shift=(1 + key % 2, 0))


def test_a_mission_that_is_sent_five_times_twice_at_once_and_by_a_worker_that_died_is_one(
    service: Service, mapped: RobotCaller, core: Core
) -> None:
    core.planned["1"] = rejected("c1")
    service.worker.paused = True
    with ThreadPoolExecutor(2) as robots:
        sent = list(robots.map(lambda _: mapped.upload("1", shifted(1), wait=None).status_code, range(5)))
    assert set(sent) <= {200, 202}
    first = lanes.claim(service.database)  # by a worker that is never heard of again
    assert first is not None
    with service.database.write() as tx:
        lanes.expire(tx, first.map_id)
    service.worker.resume()
    assert mapped.upload("1", shifted(1)).json()["outcome"] == "needs_review"
    assert total(service) == {"missions": 1, "needs_review": 1}


def test_late_missions_count_for_nothing_and_those_that_only_waited_do(
    service: Service, mapped: RobotCaller, core: Core
) -> None:
    for key in ("2", "3"):
        core.planned[key] = rejected(f"c{key}")
    mapped.upload("5", shifted(5))
    assert mapped.upload("3", shifted(3)).json()["outcome"] == "superseded"
    assert total(service) == {"missions": 1}
    service.worker.paused = True
    for number in (9, 7, 8):  # the order in which a robot reached the network again
        mapped.upload(str(number), shifted(number), wait=None)
    service.worker.resume()
    assert total(service) == {"missions": 4}
    assert mapped.upload("2", shifted(2)).json()["outcome"] == "superseded"
    assert total(service) == {"missions": 4}
    assert service.operator.get("/api/v1/fleet/causes").json()["missions"] == 0


def test_what_is_restored_stays_counted_and_one_error_is_one_escape(service: Service, mapped: RobotCaller) -> None:
    def restore(number: int) -> None:
        answer = service.operator.request("POST", f"{mapped.path()}/versions/{number}/restore")
        assert answer.status_code == 201, answer.text

    for key in (1, 2, 3):
        mapped.upload(str(key), shifted(key))
    restore(2)
    assert total(service) == {"missions": 3, "escapes": 1}
    restore(4)  # it was right after all: no mission is undone by that
    restore(2)
    assert total(service) == {"missions": 3, "escapes": 1}
    mapped.upload("4", shifted(4))
    restore(1)  # the first of those that it takes back, which is another one
    assert total(service) == {"missions": 4, "escapes": 2}
    mapped.upload("5", shifted(5))
    assert total(service) == {"missions": 5, "escapes": 2}


def test_what_was_deleted_stays_counted_and_what_is_brought_back_is_not_counted_twice(
    service: Service, mapped: RobotCaller, core: Core
) -> None:
    core.planned["2"] = rejected("c2")
    for key in (1, 2, 3):
        mapped.upload(str(key), shifted(key))
    assert service.operator.request("POST", f"{mapped.path()}/versions/2/restore").status_code == 201
    before = told(service)
    assert [(row["missions"], row["needs_review"], row["escapes"]) for row in before.values()] == [(3, 1, 1)]
    archive = service.operator.get(f"/api/v1/robots/{mapped.id}/archive").content
    service.worker.settle()
    core.planned["4"] = rejected("c4")
    mapped.upload("4", shifted(4))  # nobody has counted it when all of it goes
    gone = service.operator.request("DELETE", f"/api/v1/robots/{mapped.id}/maps?confirm={mapped.id}")
    assert gone.status_code == 200, gone.text
    assert recount.recount(service.database) == []
    after = told(service)
    assert [(row["missions"], row["needs_review"], row["escapes"]) for row in after.values()] == [(4, 2, 1)]
    back = service.operator.request(
        "POST", f"/api/v1/robots/{mapped.id}/archive", {"Content-Type": "application/zip"}, content=archive
    )
    assert back.status_code == 201, back.text
    assert told(service) == after
    assert mapped.upload("5", shifted(5)).json()["outcome"] == "updated"
    assert [row["missions"] for row in told(service).values()] == [5]


def told(service: Service) -> dict[str, dict[str, float]]:
    answer = service.operator.get(f"/api/v1/fleet/failure-rates?{YEARS}&group_by=day")
    return {row["key"]: recount.told(row) for row in answer.json()["items"]}


@pytest.fixture
def set_clock(monkeypatch: pytest.MonkeyPatch) -> Callable[[datetime], None]:
    """What the service takes for the time; the leases of lanes have a clock of their own."""

    lock, to_process = maps.lock, missions.to_process

    def set_to(moment: datetime) -> None:
        monkeypatch.setattr(clock, "now", lambda _tx: moment)
        monkeypatch.setattr(maps, "lock", lambda *what: (*lock(*what)[:2], moment))
        monkeypatch.setattr(missions, "to_process", lambda *what: replace(to_process(*what), now=moment))

    return set_to


def test_robots_clocks_say_nothing_and_a_step_of_the_servers_own_loses_and_doubles_nothing(
    service: Service, mapped: RobotCaller, core: Core, set_clock: Callable[[datetime], None]
) -> None:
    core.planned["2"], core.planned["4"] = rejected("c2"), rejected("c4")
    noon = datetime(2026, 3, 10, 12, tzinfo=UTC)
    for key, at, said in (
        (1, noon, "2099-12-31T23:59:59+14:00"),
        (2, noon + timedelta(hours=12), "1970-01-01T00:00:00Z"),  # midnight is the next day's
        (3, noon + timedelta(hours=11, minutes=59), "2026-03-10T12:00:00Z"),  # the clock was put back a minute
        (4, noon - timedelta(days=40), "2026-03-10T12:00:00Z"),  # and by far
    ):
        set_clock(at)
        base = mapped.get(mapped.path()).json()["version"]
        answer = mapped.upload(str(key), shifted(key), started_at=said, ended_at=said, base_version=base)
        assert answer.status_code == 201, answer.text
    found = figures(service)
    assert {day: row["missions"] for day, row in found.items()} == {
        "2026-01-29": 1,
        "2026-03-10": 2,
        "2026-03-11": 1,
    }
    assert figures(service, "week").keys() == {"2026-01-26", "2026-03-09"}
    (cause,) = service.operator.get(f"/api/v1/fleet/causes?{YEARS}").json()["items"]
    seen = [datetime.fromisoformat(cause[name]) for name in ("first_seen", "last_seen")]
    assert seen == [noon - timedelta(days=40), noon + timedelta(hours=12)]
    # a correction that seems to come before what it corrects holds against it all the same
    with service.database.read() as tx:
        head = tx.execute(sa.select(sa.func.max(version.c.number))).scalar_one()
    set_clock(noon - timedelta(hours=1))
    assert service.operator.request("POST", f"{mapped.path()}/versions/{head - 1}/restore").status_code == 201
    assert total(service)["escapes"] == 1
    with service.database.read() as tx:
        assert tx.execute(sa.select(sa.func.count()).select_from(mission)).scalar_one() == 5
