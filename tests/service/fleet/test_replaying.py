"""Replays: stored missions run again; no map is touched, and a replay that was stopped goes on."""

from collections.abc import Iterator
from concurrent.futures import Executor, ThreadPoolExecutor
from datetime import UTC, datetime, timedelta
from typing import Any

import pytest
from distributed import LocalCluster

from stillroom.__main__ import main
from stillroom.errors import AlreadyExists, InvalidInput, NotFound
from stillroom.service import gathering
from stillroom.service.fleet import replaying
from stillroom.service.fleet.replaying import Replay
from stillroom.service.fleet.variants import parameters
from tests.conftest import RobotCaller, Service
from tests.homes import changed, home

FLEET = "/api/v1/fleet"


@pytest.fixture
def executor() -> Iterator[Executor]:
    with ThreadPoolExecutor(2) as pool:
        yield pool


@pytest.fixture
def lived(mapped: RobotCaller) -> RobotCaller:
    """A robot whose wall had a gap one day: the meta layer closed it."""
    tracking = {"transform": [0.0, 0.0, 0.0]}
    for key, image, outcome in (
        ("1", home(shift=(1, 0)), "updated"),
        ("2", changed("open plan"), "resolved"),
        ("3", home(), "updated"),
    ):
        base = mapped.get(mapped.path()).json()["version"]
        assert mapped.upload(key, image, base_version=base, tracking=tracking).json()["outcome"] == outcome
    return mapped


def replay(service: Service, executor: Executor, what: Replay, resume: bool = False) -> Any:
    row, maps = replaying.start(service.database, what, resume)
    replaying.run(service.database, service.settings.grid_store_url, row, maps, executor, 2, lambda _done, _of: None)
    return results(service, what.name)


def results(service: Service, name: str) -> Any:
    answer = service.operator.get(f"{FLEET}/replays/{name}")
    assert answer.status_code == 200, answer.text
    return answer.json()


def cells(found: Any, measure: str) -> list[int]:
    (table,) = (one for one in found["tables"] if one["measure"] == measure)
    return [table[cell] for cell in ("both", "only_old", "only_new", "neither")]


def test_the_same_code_comes_to_the_same_and_touches_no_map(
    service: Service, lived: RobotCaller, executor: Executor
) -> None:
    before = lived.get(lived.path()).json(), lived.get(f"{lived.path()}/missions").json()
    found = replay(service, executor, Replay("same"))
    assert (found["missions"], found["done"]) == (3, 3)
    assert found["finished_at"] is not None
    assert [cells(found, measure) for measure in ("transfer", "meta_dividers", "taken")] == [
        [2, 0, 0, 1],
        [3, 0, 0, 0],
        [3, 0, 0, 0],
    ]
    assert (lived.get(lived.path()).json(), lived.get(f"{lived.path()}/missions").json()) == before


def test_what_another_algorithm_changes_is_told_mission_by_mission(
    service: Service, lived: RobotCaller, executor: Executor
) -> None:
    found = replay(service, executor, Replay("bare", resolvers=()))
    assert cells(found, "taken") == [2, 1, 0, 0]
    assert found["tables"][3]["p"] == 1.0
    (lost,) = service.operator.get(f"{FLEET}/replays/bare/missions?cell=only_old").json()["items"]
    assert (lost["mission"], lost["outcome_then"], lost["robot"]) == ("2", "resolved", lived.id)
    assert lost["outcome_now"] in ("needs_review", "reverted")
    assert service.operator.get(lost["url"]).status_code == 200
    same = service.operator.get(f"{FLEET}/replays/bare/missions?cell=both&limit=1").json()
    assert len(same["items"]) == 1
    assert same["next"] is not None
    listed = service.operator.get(f"{FLEET}/replays").json()["items"]
    assert [(one["name"], one["resolvers"]) for one in listed] == [("bare", [])]


def test_a_replay_that_was_stopped_goes_on_where_it_was(
    service: Service, lived: RobotCaller, executor: Executor, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(replaying, "CHUNK", 1)

    def stop(_done: int, _of: int) -> None:
        raise KeyboardInterrupt

    row, maps = replaying.start(service.database, Replay("long"), resume=False)
    with pytest.raises(KeyboardInterrupt):
        replaying.run(service.database, service.settings.grid_store_url, row, maps, executor, 1, stop)
    assert (results(service, "long")["done"], results(service, "long")["finished_at"]) == (1, None)
    lived.upload("9", home())  # came later: no part of it
    with pytest.raises(AlreadyExists):
        replaying.start(service.database, Replay("long"), resume=False)
    found = replay(service, executor, Replay("long"), resume=True)
    assert (found["missions"], found["done"]) == (3, 3)
    with pytest.raises(NotFound):
        replaying.start(service.database, Replay("never"), resume=True)


def test_a_mission_that_the_new_code_can_not_process_is_not_taken(
    service: Service, lived: RobotCaller, executor: Executor, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*_asked: Any, **_more: Any) -> Any:
        raise RuntimeError("worse than before")

    monkeypatch.setattr(gathering, "update_map", broken)
    assert cells(replay(service, executor, Replay("broken", robots=(lived.id,))), "taken") == [0, 3, 0, 0]
    lost = service.operator.get(f"{FLEET}/replays/broken/missions").json()["items"]
    assert all("worse than before" in one["error"] for one in lost)


def test_maps_that_wait_for_their_owners_do_not_count_as_taken_or_not(
    service: Service, lived: RobotCaller, executor: Executor
) -> None:
    service.operator.request("PATCH", lived.path(), json={"review": "ask_first"})
    found = replay(service, executor, Replay("asked"))
    assert (cells(found, "taken"), cells(found, "meta_dividers")) == ([0, 0, 0, 0], [3, 0, 0, 0])


def test_one_that_is_begun_on_the_dashboard_is_run_by_workers_when_nothing_else_waits(
    service: Service, lived: RobotCaller
) -> None:
    def begin(status: int, **what: Any) -> Any:
        answer = service.operator.request("POST", f"{FLEET}/replays", json=what)
        assert answer.status_code == status, answer.text
        return answer.json()

    before = lived.get(lived.path()).json()
    assert begin(201, name="bare", resolvers=[])["done"] == 0
    begin(409, name="bare")
    begin(422, name="odd", params={"walls": 1})
    begin(422, name="odd", since="yesterday")
    lived.upload("9", home())  # came later: no part of it
    with ThreadPoolExecutor(2) as workers:
        for _ in range(3):
            list(workers.map(lambda _: replaying.run_next(service.database, service.grids), range(2)))
    found = results(service, "bare")
    assert (found["missions"], found["done"], cells(found, "taken")) == (3, 3, [2, 1, 0, 0])
    assert found["finished_at"] is not None
    assert not replaying.run_next(service.database, service.grids)
    assert lived.get(lived.path()).json()["version"] == before["version"] + 1


@pytest.mark.usefixtures("lived")
def test_what_other_code_has_begun_ends_where_it_came_to(service: Service, monkeypatch: pytest.MonkeyPatch) -> None:
    answer = service.operator.request("POST", f"{FLEET}/replays", json={"name": "old"})
    assert answer.status_code == 201
    monkeypatch.setattr(replaying, "__version__", "9.9")
    assert replaying.run_next(service.database, service.grids)
    found = results(service, "old")
    assert (found["done"], found["finished_at"] is not None) == (0, True)


def test_only_what_was_asked_for_is_run(service: Service, lived: RobotCaller, executor: Executor) -> None:
    tomorrow = datetime.now(UTC) + timedelta(days=1)
    assert replay(service, executor, Replay("none", robots=("RB-99",)))["missions"] == 0
    assert replay(service, executor, Replay("later", since=tomorrow))["missions"] == 0
    assert replay(service, executor, Replay("sooner", until=tomorrow))["missions"] == 3
    assert lived.get(f"{FLEET}/replays/later").status_code == 403


@pytest.mark.parametrize("engine", ["sqlite"])
def test_a_cluster_comes_to_the_same_as_one_machine(service: Service, lived: RobotCaller) -> None:
    local = LocalCluster(n_workers=1, threads_per_worker=2, processes=False, dashboard_address=None)
    with local, replaying.cluster(local.scheduler_address) as (executor, at_once):
        assert at_once == 2
        assert cells(replay(service, executor, Replay("spread", resolvers=())), "taken") == [2, 1, 0, 0]
    assert lived.get(lived.path()).status_code == 200


def test_parameters_are_checked() -> None:
    assert parameters({"room_overlap": 1, "hallway_doors": 4, "divider_length_m": [0.2, 3.0]}).room_overlap == 1.0
    for wrong in (
        {"room_overlap": "much"},
        {"rooms": 3},
        {"hallway_doors": 1.5},
        {"room_overlap": True},
        {"divider_length_m": 3},
    ):
        with pytest.raises(InvalidInput):
            parameters(wrong)


@pytest.mark.parametrize("engine", ["sqlite"])
def test_the_command_prints_the_paired_table(
    service: Service, lived: RobotCaller, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("STILLROOM_DATABASE_URL", service.settings.database_url)
    monkeypatch.setenv("STILLROOM_GRID_STORE_URL", service.settings.grid_store_url)
    assert main(["replay", "strict", "--set", "room_overlap=0.999", "--processes", "1", "--robot", lived.id]) == 0
    lines = {line.split()[0]: line.split()[1:] for line in capsys.readouterr().out.splitlines()[1:]}
    assert set(lines) == {"transfer", "meta_occupancy", "meta_dividers", "taken"}
    assert sum(map(int, lines["taken"][:4])) == 3
    assert results(service, "strict")["params"] == {"room_overlap": 0.999}
    assert main(["replay", "strict"]) == 1
    assert main(["replay", "other", "--set", "room_overlap"]) == 1
    assert main(["replay", "other", "--set", "walls=1"]) == 1
    assert "no such parameter" in capsys.readouterr().err
