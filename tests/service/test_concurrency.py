"""Robots, people and workers at once: nobody waits for ever, nothing is lost."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

from httpx2 import Response

from tests.conftest import RobotCaller, Service
from tests.homes import home

MISSIONS = 4
FLOORS = ("ground", "upstairs", "cellar")


def test_uploads_edits_restores_and_renames_of_one_robots_maps_at_once_neither_block_nor_get_lost(
    service: Service, mapped: RobotCaller
) -> None:
    def upload(floor: str, mission: int) -> Response:
        return mapped.upload(str(mission), home(shift=(mission % 2, 0)), map_name=floor)

    def rename(room: str, name: str) -> Response:
        while True:
            version = mapped.get(mapped.path()).json()["version"]
            answer = service.operator.edit(mapped.path(), version, {"op": "rename_room", "id": room, "name": name})
            if answer.status_code != 412:
                return answer

    def restore() -> Response:
        return service.operator.request("POST", f"{mapped.path()}/versions/1/restore")

    def settings(name: str) -> Response:
        return service.operator.request("PATCH", mapped.path(), json={"name": name})

    with ThreadPoolExecutor(8) as pool:
        asked: list[Callable[[], Response]] = [restore]
        for n in range(1, MISSIONS + 1):
            asked += [lambda f=floor, n=n: upload(f, n) for floor in FLOORS]  # type: ignore[misc]
            asked += [lambda n=n: rename("r1", f"Room {n}"), lambda n=n: settings(f"Floor {n}")]  # type: ignore[misc]
        answers = [answer.result() for answer in [pool.submit(ask) for ask in asked]]
    assert {answer.status_code for answer in answers} <= {200, 201}, [answer.text for answer in answers]
    for floor in FLOORS:
        missions = mapped.get(f"{mapped.path(floor)}/missions").json()["items"]
        assert [mission["status"] for mission in missions] == ["done"] * (MISSIONS + (floor == "ground"))
        versions = [v["version"] for v in mapped.get(f"{mapped.path(floor)}/versions").json()["items"]]
        assert versions == list(range(len(versions), 0, -1))
    causes = [version["cause"] for version in mapped.get(f"{mapped.path()}/versions").json()["items"]]
    assert (causes.count("edit"), causes.count("restore")) == (MISSIONS, 1)
