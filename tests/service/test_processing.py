"""Missions, edits and restores of one map meet; none is ever lost."""

import threading
from typing import Any

import numpy as np
import pytest

from stillroom.maps.geometry import Pose
from stillroom.maps.mission import Mission
from stillroom.maps.semantics import SemanticMap
from stillroom.pipeline.update import RESOLVERS, MapUpdate, update_map
from stillroom.service import gathering, processing
from stillroom.service.steps import frame_step
from stillroom.store import lanes, maps, missions
from stillroom.store.database import Database
from tests.conftest import RobotCaller, Service, features
from tests.homes import home


@pytest.fixture
def seen(monkeypatch: pytest.MonkeyPatch) -> list[tuple[SemanticMap, Mission]]:
    """What the core was asked, call by call."""
    calls: list[tuple[SemanticMap, Mission]] = []

    def remember(previous: SemanticMap, mission: Mission, **rest: Any) -> MapUpdate:
        calls.append((previous, mission))
        return update_map(previous, mission, **rest)

    monkeypatch.setattr(gathering, "update_map", remember)
    return calls


def tracked(document: dict[str, Any], dx: float, dy: float) -> dict[str, Any]:
    return {
        "rooms": {
            f["id"]: [[x + dx, y + dy] for x, y in f["geometry"]["coordinates"][0]] for f in features(document, "room")
        }
    }


def test_an_edit_made_while_a_mission_is_processed_is_kept_and_carried_over(
    service: Service, mapped: RobotCaller, monkeypatch: pytest.MonkeyPatch
) -> None:
    edits: list[int] = []

    def slow_update(previous: SemanticMap, mission: Mission, **rest: Any) -> MapUpdate:
        result = update_map(previous, mission, **rest)
        if not edits:
            rename = {"op": "rename_room", "id": "r1", "name": "Kitchen"}
            edits.append(service.operator.edit(mapped.path(), 1, rename).status_code)
        return result

    monkeypatch.setattr(gathering, "update_map", slow_update)
    mission = mapped.upload("1", home(shift=(1, 0)), base_version=1).json()
    assert edits == [200]
    assert (mission["outcome"], mission["base_version"], mission["version"]) == ("updated", 2, 3)
    document = mapped.get(mapped.path()).json()
    assert next(f for f in features(document, "room") if f["id"] == "r1")["properties"]["name"] == "Kitchen"
    causes = [version["cause"] for version in mapped.get(f"{mapped.path()}/versions").json()["items"]]
    assert causes == ["mission", "edit", "created"]


def test_a_restore_made_while_a_mission_is_processed_is_kept_and_carried_over(
    service: Service, mapped: RobotCaller, monkeypatch: pytest.MonkeyPatch
) -> None:
    restores: list[int] = []

    def slow_update(previous: SemanticMap, mission: Mission, **rest: Any) -> MapUpdate:
        result = update_map(previous, mission, **rest)
        if not restores:
            answer = service.operator.request("POST", f"{mapped.path()}/versions/1/restore")
            restores.append(answer.status_code)
        return result

    monkeypatch.setattr(gathering, "update_map", slow_update)
    mission = mapped.upload("1", home(shift=(1, 0))).json()
    assert restores == [201]
    assert (mission["base_version"], mission["version"]) == (2, 3)


def test_a_worker_whose_claim_was_taken_over_changes_nothing(
    service: Service, mapped: RobotCaller, monkeypatch: pytest.MonkeyPatch
) -> None:
    service.worker.paused = True
    mapped.upload("1", home(shift=(1, 0)), wait=None)

    def overtaken(previous: SemanticMap, mission: Mission, **rest: Any) -> MapUpdate:
        monkeypatch.setattr(gathering, "update_map", update_map)
        with service.database.write() as tx:
            lanes.expire(tx, 1)
        assert processing.process_next(service.database, service.grids) == 1
        return update_map(previous, mission, **rest)

    monkeypatch.setattr(gathering, "update_map", overtaken)
    assert processing.process_next(service.database, service.grids) == 1
    assert [v["version"] for v in mapped.get(f"{mapped.path()}/versions").json()["items"]] == [2, 1]
    assert mapped.get(f"{mapped.path()}/missions/1").json()["version"] == 2


def test_a_mission_that_ends_its_worker_again_and_again_is_put_aside(service: Service, mapped: RobotCaller) -> None:
    service.worker.paused = True
    mapped.upload("1", home(shift=(1, 0)), wait=None)
    for _ in range(processing.MAX_ATTEMPTS):
        assert lanes.claim(service.database) is not None
        with service.database.write() as tx:
            lanes.expire(tx, 1)
    service.worker.resume()
    mission = mapped.get(f"{mapped.path()}/missions/1").json()
    assert (mission["outcome"], mission["version"]) == ("reverted", 1)
    assert mapped.upload("2", home(shift=(1, 0))).json()["outcome"] == "updated"


def test_a_worker_s_resolvers_reach_the_core(
    service: Service, mapped: RobotCaller, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[object] = []

    def remember(previous: SemanticMap, mission: Mission, **rest: Any) -> MapUpdate:
        asked.append(rest["resolvers"])
        return update_map(previous, mission, **rest)

    monkeypatch.setattr(gathering, "update_map", remember)
    service.worker.paused = True
    mapped.upload("1", wait=None)
    processing.process_next(service.database, service.grids, ("meta_occupancy",))
    service.worker.resume()
    assert mapped.upload("2").json()["status"] == "done"
    assert asked == [("meta_occupancy",), RESOLVERS]


def test_missions_of_different_maps_are_claimed_side_by_side_and_of_one_map_never(
    service: Service, robot: RobotCaller
) -> None:
    service.worker.paused = True
    for map_name in ("ground", "upstairs"):
        for mission in ("0", "1"):
            robot.upload(mission, map_name=map_name, wait=None)
    claims = [lanes.claim(service.database) for _ in range(3)]
    assert [claim and claim.map_id for claim in claims] == [1, 2, None]
    for map_id in (1, 2):
        with service.database.write() as tx:
            lanes.expire(tx, map_id)
    service.worker.resume()


def test_tracking_from_the_version_in_force_goes_to_the_core_as_it_is(
    mapped: RobotCaller, seen: list[tuple[SemanticMap, Mission]]
) -> None:
    document = mapped.get(mapped.path()).json()
    mapped.upload("1", home(shift=(1, -1)), base_version=1, tracking=tracked(document, 0.05, -0.05))
    previous, mission = seen[-1]
    assert mission.motion is not None
    corners = np.asarray(previous.rooms[0].polygon.exterior.coords)
    assert np.allclose(mission.motion.apply(corners), corners + np.array([0.05, -0.05]))


def test_tracking_from_an_older_version_goes_through_the_frames_between(
    mapped: RobotCaller, seen: list[tuple[SemanticMap, Mission]]
) -> None:
    base = mapped.get(mapped.path()).json()
    moved: dict[str, Any] = {"base_version": 1, "tracking": {"transform": [0.5, 0.0, 0.0]}}
    assert mapped.upload("1", home(shift=(10, 0)), **moved).json()["outcome"] == "updated"
    again = mapped.upload("2", home(shift=(4, 2)), base_version=1, tracking=tracked(base, 0.2, 0.1)).json()
    assert (again["outcome"], again["base_version"]) == ("updated", 2)
    previous, mission = seen[-1]
    assert mission.motion is not None
    corners = np.asarray(previous.rooms[0].polygon.exterior.coords)
    # The version in force lies 0.5 m from the base; the mission 0.2, 0.1 m from it.
    assert np.allclose(mission.motion.apply(corners), corners + np.array([-0.3, 0.1]), atol=0.02)


def test_tracking_goes_through_edits_and_restores_unchanged(
    service: Service, mapped: RobotCaller, seen: list[tuple[SemanticMap, Mission]]
) -> None:
    mapped.upload("1", home(shift=(10, 0)), base_version=1, tracking={"transform": [0.5, 0.0, 0.0]})
    service.operator.edit(mapped.path(), 2, {"op": "rename_room", "id": "r1", "name": "Kitchen"})
    service.operator.request("POST", f"{mapped.path()}/versions/1/restore")
    # Version 4 lies where version 1 did: 0.5 m from version 3, which the robot started from.
    mapped.upload("2", home(shift=(10, 0)), base_version=3, tracking={"transform": [0.0, 0.0, 0.0]})
    assert seen[-1][1].motion is not None
    start = np.array([[1.0, 1.0]])
    assert np.allclose(seen[-1][1].motion.apply(start), start + np.array([0.5, 0.0]), atol=0.02)


def test_an_unknown_base_gives_the_core_no_motion(mapped: RobotCaller, seen: list[tuple[SemanticMap, Mission]]) -> None:
    mission = mapped.upload("1", base_version=7, tracking={"transform": [0.0, 0.0, 0.0]}).json()
    assert seen[-1][1].motion is None
    assert "base_version 7" in mission["warnings"][0]


def test_tracking_without_a_base_is_ignored_with_a_warning(
    mapped: RobotCaller, seen: list[tuple[SemanticMap, Mission]]
) -> None:
    mission = mapped.upload("1", tracking={"transform": [0.0, 0.0, 0.0]}).json()
    assert seen[-1][1].motion is None
    assert "base_version" in mission["warnings"][0]


def test_the_frame_of_every_version_is_stored(service: Service, mapped: RobotCaller) -> None:
    mapped.upload("1", home(shift=(10, 0)), base_version=1, tracking={"transform": [0.5, 0.0, 0.0]})
    with service.database.read() as tx:
        step = frame_step(tx, 1, 2)
        assert maps.version_head(tx, 1, 1) is not None
        assert missions.get(tx, 2).status == "done"
    assert step is not None
    older, motion = step
    assert older == 1
    assert motion is not None
    start = np.array([[1.0, 1.0]])
    assert np.allclose(motion.apply(start), Pose(0.5, 0.0).apply(start), atol=0.02)


def test_a_long_mission_keeps_its_claim(service: Service, mapped: RobotCaller, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lanes, "LEASE_S", 1.5)
    renewed = threading.Event()
    others: list[lanes.Claim | None] = []

    def renew_and_tell(database: Database, held: lanes.Claim) -> None:
        renew(database, held)
        renewed.set()

    def long_update(previous: SemanticMap, mission: Mission, **rest: Any) -> MapUpdate:
        for _ in range(4):  # longer than the lease
            renewed.clear()
            assert renewed.wait(30)
            others.append(lanes.claim(service.database))
        return update_map(previous, mission, **rest)

    renew = lanes.renew
    monkeypatch.setattr(lanes, "renew", renew_and_tell)
    monkeypatch.setattr(gathering, "update_map", long_update)
    assert mapped.upload("1", home(shift=(1, 0))).json()["outcome"] == "updated"
    assert others == [None] * 4
