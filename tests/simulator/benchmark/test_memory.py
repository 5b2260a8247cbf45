"""The service in memory: it must come to what the real one comes to."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from stillroom.simulator.benchmark.memory import MemoryService
from stillroom.simulator.building import draw_home
from stillroom.simulator.client import Refused
from stillroom.simulator.effects import Effects, Streams
from stillroom.simulator.fleet import SimulatedRobot, Sortie
from tests.conftest import RobotCaller, Service

EFFECTS = replace(Effects.DEMO, drift_m=0.1, drift_deg=2.0)
STREAMS = Streams(6)


@pytest.fixture(scope="module")
def robot_at_home() -> SimulatedRobot:
    return SimulatedRobot(draw_home(STREAMS.of("home"), 6), STREAMS, EFFECTS)


@pytest.fixture(scope="module")
def sorties(robot_at_home: SimulatedRobot) -> list[Sortie]:
    return [robot_at_home.sortie(number) for number in range(4)]


def upload(service: MemoryService, robot: SimulatedRobot, sortie: Sortie, base: Any = None) -> Any:
    return service.process(sortie.number, sortie.sensed.grid, robot.meta(sortie, base or service.document()))


def rename(document: Any) -> list[dict[str, Any]]:
    return [{"op": "rename_room", "id": document["features"][0]["id"], "name": "Den"}]


def named(document: Any) -> list[Any]:
    rooms = [f for f in document["features"] if f["properties"]["semantic"] == "room"]
    return [(room["id"], room["properties"]["name"], room["geometry"]) for room in rooms]


def test_it_comes_to_what_the_real_service_comes_to(
    service: Service, robot: RobotCaller, robot_at_home: SimulatedRobot, sorties: list[Sortie]
) -> None:
    memory, real = MemoryService(), None
    bases = [None]
    for sortie in sorties:
        # mission 2 set out with the map that mission 1 set out with
        base = bases[-2] if sortie.number == 2 else real
        answer = upload(memory, robot_at_home, sortie, base)
        done = robot.upload(str(sortie.number), sortie.png(), **robot_at_home.meta(sortie, base)).json()
        assert (answer.verdict, answer.reason) == (done["outcome"], done["reason"])
        if sortie.number == 1:
            memory.edit(rename)
            version = robot.get(robot.path()).json()["version"]
            assert service.operator.edit(robot.path(), version, *rename(memory.document())).status_code == 200
        real = robot.get(robot.path()).json()
        bases.append(real)
        document = memory.document()
        assert document is not None
        assert (document["version"], document["mission"]) == (real["version"], real["mission"])
        assert named(document) == named(real)


def test_a_late_mission_changes_nothing(robot_at_home: SimulatedRobot, sorties: list[Sortie]) -> None:
    memory = MemoryService()
    for number in (0, 2):
        upload(memory, robot_at_home, sorties[number])
    before = memory.document()
    late = upload(memory, robot_at_home, sorties[1])
    assert (late.verdict, late.taken) == ("superseded", False)
    assert memory.document() == before


def test_before_the_first_mission_there_is_no_map(robot_at_home: SimulatedRobot, sorties: list[Sortie]) -> None:
    memory = MemoryService()
    assert memory.document() is None
    assert memory.edit(rename) is None
    first = upload(memory, robot_at_home, sorties[0])
    assert (first.verdict, first.taken, len(memory.versions)) == ("created", True, 1)


def test_an_edit_makes_a_version_in_the_same_frame_and_a_bad_one_is_refused(
    robot_at_home: SimulatedRobot, sorties: list[Sortie]
) -> None:
    memory = MemoryService()
    upload(memory, robot_at_home, sorties[0])
    edited = memory.edit(rename)
    assert edited is not None
    assert edited["version"] == 2
    assert "Den" in [name for _, name, _ in named(edited)]
    assert memory.in_force.motion is None
    with pytest.raises(Refused):
        memory.edit(lambda _document: [{"op": "remove_divider", "id": "d999"}])
    with pytest.raises(Refused):
        memory.edit(lambda _document: [{"op": "paint_it_black"}])
    assert len(memory.versions) == 2


def test_a_mission_that_breaks_the_core_is_not_taken(
    robot_at_home: SimulatedRobot, sorties: list[Sortie], monkeypatch: pytest.MonkeyPatch
) -> None:
    memory = MemoryService()
    upload(memory, robot_at_home, sorties[0])

    def broken(*_: object) -> None:
        raise RuntimeError("out of luck")

    monkeypatch.setattr("stillroom.simulator.benchmark.memory.update_map", broken)
    answer = upload(memory, robot_at_home, sorties[1])
    assert (answer.verdict, answer.taken, answer.reason) == ("reverted", False, "RuntimeError: out of luck")
    assert not answer.ablation.meta_dividers


def test_no_mission_alters_a_grid(robot_at_home: SimulatedRobot, sorties: list[Sortie]) -> None:
    memory = MemoryService()
    copies = [sortie.sensed.grid.cells.copy() for sortie in sorties]
    for sortie in sorties:
        upload(memory, robot_at_home, sortie)
    for sortie, copy in zip(sorties, copies, strict=True):
        assert np.array_equal(sortie.sensed.grid.cells, copy)
