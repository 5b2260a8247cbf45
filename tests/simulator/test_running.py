"""`stillroom simulate` against the real application in this process."""

import json
import stat
from collections.abc import Callable
from pathlib import Path
from typing import Any

import httpx2
import pytest

from stillroom.__main__ import main
from stillroom.simulator.running import MAP, ROOM_COUNTS
from tests.conftest import ADMIN_TOKEN, Json, Service

Simulate = Callable[..., int]


@pytest.fixture
def answers(service: Service, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> list[int | Exception]:
    """Robots speak to the service in this process; statuses and errors put into the list come first."""
    planned: list[int | Exception] = []

    class Client(httpx2.Client):
        def __init__(self, **options: Any) -> None:
            super().__init__(base_url=options["base_url"], transport=httpx2.MockTransport(answer))

    def answer(request: httpx2.Request) -> httpx2.Response:
        if planned and request.method == "PUT":
            first = planned.pop(0)
            if isinstance(first, Exception):
                raise first
            return httpx2.Response(first)
        headers = {name: value for name, value in request.headers.items() if name != "host"}
        real = service.http.request(request.method, request.url.path, headers=headers, content=request.read())
        return httpx2.Response(real.status_code, headers=dict(real.headers), content=real.content)

    monkeypatch.setattr(httpx2, "Client", Client)
    monkeypatch.setattr("stillroom.uploading.time.sleep", lambda _seconds: None)
    monkeypatch.setenv("STILLROOM_DATA_DIR", str(tmp_path / "robots"))
    monkeypatch.delenv("STILLROOM_ADMIN_TOKEN", raising=False)
    return planned


@pytest.fixture
def simulate(answers: list[int | Exception]) -> Simulate:
    assert answers == []

    def run(*arguments: object) -> int:
        given = ["simulate", "--url", "http://stillroom.test", "--token", ADMIN_TOKEN, "--every", "0.01", *arguments]
        return main([str(argument) for argument in given])

    return run


def map_of(service: Service, robot: str) -> Json:
    found = service.operator.get(f"/api/v1/robots/{robot}/maps/{MAP}")
    assert found.status_code == 200, found.text
    document: Json = found.json()
    return document


def missions_of(service: Service, robot: str) -> list[Json]:
    items: list[Json] = service.operator.get(f"/api/v1/robots/{robot}/maps/{MAP}/missions").json()["items"]
    return items


def test_homes_get_maps_whose_rooms_have_their_true_names(
    simulate: Simulate, service: Service, capsys: pytest.CaptureFixture[str]
) -> None:
    assert simulate("--homes", 2, "--missions", 2, "--score") == 0
    for robot, rooms in zip(("demo-1", "demo-2"), ROOM_COUNTS, strict=False):
        features = [f["properties"] for f in map_of(service, robot)["features"]]
        names = [p["name"] for p in features if p["semantic"] == "room"]
        assert {"Kitchen", "Living room", "Hall", "Bathroom", "Bedroom"} <= set(names)
        assert len(names) == rooms
        assert [m["outcome"] for m in missions_of(service, robot)] == ["updated", "created"]
    told = capsys.readouterr().out.splitlines()
    last = [line for line in told if "mission 1:" in line]
    assert len(last) == 2
    assert all(float(line.split("mean IoU ")[1].split()[0]) > 0.9 for line in last)


def test_robots_go_on_where_they_stopped(simulate: Simulate, service: Service, tmp_path: Path) -> None:
    for _ in range(2):
        assert simulate("--homes", 1, "--missions", 1, "--quiet") == 0
    assert [m["id"] for m in missions_of(service, "demo-1")] == ["1", "0"]
    state = tmp_path / "robots" / "simulator.json"
    assert stat.S_IMODE(state.stat().st_mode) == 0o600, "it holds tokens"
    assert [kept["next"] for kept in json.loads(state.read_text()).values()] == [2]


def test_a_robot_whose_token_is_lost_is_registered_anew(simulate: Simulate, service: Service, tmp_path: Path) -> None:
    simulate("--homes", 1, "--missions", 1, "--quiet")
    (tmp_path / "robots" / "simulator.json").unlink()
    assert simulate("--homes", 1, "--missions", 1, "--quiet") == 0
    robots = [robot["id"] for robot in service.operator.get("/api/v1/robots").json()["items"]]
    assert len(robots) == 2
    assert all(robot.startswith("demo-1") for robot in robots)


def test_a_robot_that_the_service_does_not_know_any_more_is_registered_anew(
    simulate: Simulate, service: Service, tmp_path: Path
) -> None:
    state = tmp_path / "robots" / "simulator.json"
    state.parent.mkdir()
    key = "http://stillroom.test seed 1 home 1"
    state.write_text(json.dumps({key: {"id": "demo-1", "token": "srm_of-another-database", "next": 9}}))
    assert simulate("--homes", 1, "--missions", 1, "--quiet") == 0
    assert [m["id"] for m in missions_of(service, "demo-1")] == ["0"]


def test_uploads_are_sent_again_where_the_service_is_busy_or_away(
    simulate: Simulate, service: Service, answers: list[int | Exception], capsys: pytest.CaptureFixture[str]
) -> None:
    answers += [503, httpx2.ConnectError("Connection refused"), 429]
    assert simulate("--homes", 1, "--missions", 1, "--quiet") == 0
    assert answers == []
    assert len(missions_of(service, "demo-1")) == 1
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("trying again") == 3


def test_a_mission_that_was_sent_before_with_another_base_is_left_behind(
    simulate: Simulate, service: Service, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    simulate("--homes", 1, "--missions", 1, "--quiet")
    state = tmp_path / "robots" / "simulator.json"
    state.write_text(state.read_text().replace('"next": 1', '"next": 0'))
    assert simulate("--homes", 1, "--missions", 2) == 0
    assert "mission 0: refused" in capsys.readouterr().out
    assert [m["id"] for m in missions_of(service, "demo-1")] == ["1", "0"]


def test_a_token_that_is_no_operators_is_told(simulate: Simulate, capsys: pytest.CaptureFixture[str]) -> None:
    assert simulate("--token", "nobody", "--homes", 1, "--missions", 1) == 1
    assert "401" in capsys.readouterr().err


def test_simulate_needs_a_token(answers: list[int | Exception], capsys: pytest.CaptureFixture[str]) -> None:
    assert answers == []
    assert main(["simulate"]) == 1
    assert "STILLROOM_ADMIN_TOKEN" in capsys.readouterr().err


@pytest.mark.parametrize("arguments", [("--every", "0"), ("--every", "inf"), ("--homes", "-1"), ("--resolution", "x")])
def test_numbers_that_make_no_sense_are_refused(arguments: tuple[str, str]) -> None:
    with pytest.raises(SystemExit):
        main(["simulate", *arguments])
