"""`stillroom verify` finds nothing after ordinary work, and everything that can be wrong."""

import json
import sqlite3
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from hashlib import sha256
from pathlib import Path

import pytest
import sqlalchemy as sa

from stillroom.__main__ import main
from stillroom.service.fleet.counting import catch_up
from stillroom.service.verifying import Report, verify
from stillroom.store import erasing
from stillroom.store.database import Database, Transaction
from stillroom.store.fleet_tables import counted, fleet_day
from stillroom.store.tables import event, lane, map_, mission, version
from tests.conftest import RobotCaller, Service
from tests.homes import home

PATH = "/api/v1/robots/RB-1/maps/ground/missions"


@pytest.fixture
def worked(service: Service, mapped: RobotCaller) -> Service:
    """Missions in order, one sent twice, one late, one of another floor, an edit and a restore."""
    for number in ("1", "3", "3", "2", "4"):
        mapped.upload(number, home(shift=(int(number), 0)))
    mapped.upload("0", map_name="upstairs")
    service.operator.edit(
        mapped.path(), mapped.get(mapped.path()).json()["version"], {"op": "rename_room", "id": "r1", "name": "Hall"}
    )
    service.operator.request("POST", f"{mapped.path()}/versions/1/restore")
    mapped.upload("5", home(shift=(2, 0)))
    service.worker.paused = True
    catch_up(service.database, 5)
    return service


def checked(service: Service, *acknowledged: str) -> Report:
    return verify(service.database, service.grids, acknowledged, grace=timedelta(0))


def test_ordinary_work_passes(worked: Service) -> None:
    report = checked(worked, *(f"{PATH}/{number}" for number in range(6)))
    assert report.examples == []
    assert report.holds
    assert (report.counts["missions"], report.counts["versions"], report.counts["counted"]) == (7, 8, 4)


@pytest.mark.parametrize("engine", ["sqlite"])
def test_a_mission_that_waits_passes_and_one_that_nobody_will_look_for_does_not(
    worked: Service, mapped: RobotCaller
) -> None:
    mapped.upload("6", home(shift=(1, 0)), wait=None)
    assert checked(worked).holds
    with worked.database.write() as tx:
        tx.execute(sa.update(lane).values(ready_at=None))
    assert checked(worked).faults == {"nothing_forgotten": 1}


def of(key: str) -> sa.ColumnElement[bool]:
    return sa.and_(mission.c.map_id == 1, mission.c.key == key)


DAMAGE: dict[str, tuple[str, Callable[[Transaction], object]]] = {
    "a version is lost": ("one_chain", lambda tx: tx.execute(sa.delete(version).where(version.c.number == 2))),
    "an older version is in force": ("one_chain", lambda tx: tx.execute(sa.update(map_).values(head=1))),
    "a mission made two versions": (
        "processed_once",
        lambda tx: tx.execute(sa.update(version).where(version.c.number == 3).values(mission="1")),
    ),
    "a mission was told of twice": (
        "processed_once",
        lambda tx: tx.execute(
            sa.insert(event).from_select(
                ["robot_id", "map_id", "kind", "data", "created_at"],
                sa.select(event.c.robot_id, event.c.map_id, event.c.kind, event.c.data, event.c.created_at).where(
                    event.c.kind == "mission"
                ),
            )
        ),
    ),
    "a late mission was taken": (
        "in_order",
        lambda tx: tx.execute(sa.update(mission).where(of("3")).values(sequence=0)),
    ),
    "the map knows an older mission": ("in_order", lambda tx: tx.execute(sa.update(map_).values(sequence=1))),
    "a mission that is done came to nothing": (
        "nothing_forgotten",
        lambda tx: tx.execute(sa.update(mission).where(of("2")).values(outcome=None)),
    ),
    "a mission is not counted": (
        "figures",
        lambda tx: tx.execute(sa.delete(counted).where(counted.c.mission_id == 2)),
    ),
    "a tally has one too many": (
        "figures",
        lambda tx: tx.execute(sa.update(fleet_day).values(missions=fleet_day.c.missions.concat("0001"))),
    ),
    "a grid is lost": ("grids", lambda tx: tx.execute(sa.update(mission).where(of("2")).values(grid="0" * 64))),
}


@pytest.mark.parametrize("engine", ["sqlite"])
def test_damage_is_found(worked: Service, tmp_path: Path) -> None:
    for number, (damage, (check, do)) in enumerate(DAMAGE.items()):
        copied = tmp_path / f"{number}.sqlite"
        with sqlite3.connect(worked.database.url.database or "") as whole, sqlite3.connect(copied) as copy:
            whole.backup(copy)
        whole.close()
        copy.close()
        database = Database(f"sqlite:///{copied}")
        with database.write() as tx:
            do(tx)
        report = verify(database, worked.grids, grace=timedelta(0))
        database.dispose()
        assert check in report.faults, f"{damage}: {report.as_json()}"
        assert not report.holds
    assert checked(worked, f"{PATH}/7").faults == {"acknowledged": 1}
    worked.grids.put(b"of an upload that never was")
    assert checked(worked).faults == {"orphans": 1}
    assert verify(worked.database, worked.grids).holds  # it may be on its way
    with worked.database.write() as tx:
        erasing.discard(tx, [sha256(b"of an upload that never was").hexdigest()], datetime.now(UTC))
    assert checked(worked).holds  # it is deleted soon


@pytest.mark.parametrize("engine", ["sqlite"])
def test_the_command_says_it_in_json_and_by_its_exit_code(
    worked: Service, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("STILLROOM_DATABASE_URL", worked.settings.database_url)
    monkeypatch.setenv("STILLROOM_GRID_STORE_URL", worked.settings.grid_store_url)
    assert main(["verify"]) == 0
    assert json.loads(capsys.readouterr().out)["counts"]["missions"] == 7
    acknowledged = worked.settings.data_dir / "acknowledged"
    acknowledged.write_text(f"{PATH}/1\n{PATH}/9\n")
    assert main(["verify", "--quick", "--acknowledged", str(acknowledged)]) == 1
    assert json.loads(capsys.readouterr().out)["faults"] == {"acknowledged": 1}
