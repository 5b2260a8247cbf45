"""The grid store or the database is away for a while: callers are told to come back, and nothing is half-done."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
import sqlalchemy as sa
from httpx2 import Response

from stillroom.errors import Unavailable
from stillroom.service.processing import process_next
from stillroom.store.grids import GridStore
from stillroom.store.tables import lane, mission
from tests.conftest import RobotCaller, Service
from tests.homes import home


@contextmanager
def away(service: Service) -> Iterator[GridStore]:
    """The grid store does not answer within the block: nobody listens there, or its folder is not there."""
    parts, url = service.http.app.state.parts, service.settings.grid_store_url  # type: ignore[attr-defined]
    there = parts.grids
    folder = Path(url)
    if "://" in url:
        gone = GridStore("s3://stillroom/gone?endpoint=http://127.0.0.1:1")
        parts.__dict__["grids"] = gone
        yield gone
    else:
        folder.rename(folder.with_suffix(".away"))
        folder.write_text("not a folder")
        yield there
        folder.unlink()
        folder.with_suffix(".away").rename(folder)
    parts.__dict__["grids"] = there


def is_told_to_come_back(answer: Response) -> bool:
    problem = answer.json()
    return (answer.status_code, problem["retryable"]) == (503, True) and int(answer.headers["Retry-After"]) > 0


def test_without_a_grid_store_uploads_are_put_off_and_leave_nothing_behind(
    service: Service, mapped: RobotCaller
) -> None:
    with away(service):
        assert is_told_to_come_back(mapped.upload("1", home(shift=(1, 0)), wait=None))
        assert is_told_to_come_back(mapped.get(f"{mapped.path()}/missions/0/grid.png"))
        assert is_told_to_come_back(service.stranger.get("/readyz"))
        assert mapped.get(mapped.path()).json()["version"] == 1
    with service.database.read() as tx:
        assert tx.execute(sa.select(mission.c.key)).scalars().all() == ["0"]
    assert mapped.upload("1", home(shift=(1, 0))).status_code == 201


def test_a_mission_waits_for_the_grid_store_however_often_it_was_begun(service: Service, mapped: RobotCaller) -> None:
    service.worker.paused = True
    mapped.upload("1", home(shift=(1, 0)), wait=None)
    with away(service) as gone:
        for _ in range(5):
            with pytest.raises(Unavailable):
                process_next(service.database, gone)
            with service.database.write() as tx:
                assert tx.execute(sa.select(mission.c.status, mission.c.attempts)).all()[-1] == ("queued", 0)
                tx.execute(sa.update(lane).where(lane.c.ready_at.is_not(None)).values(ready_at=0.0))
    service.worker.resume()
    found = mapped.get(f"{mapped.path()}/missions/1").json()
    assert (found["outcome"], found["version"]) == ("updated", 2)


def test_a_grid_that_is_lost_is_told_apart_from_a_store_that_is_away(service: Service) -> None:
    lost = "0" * 64
    with pytest.raises(FileNotFoundError):
        service.grids.get(lost)
    with away(service) as gone, pytest.raises(Unavailable):
        gone.get(lost)
    if "://" not in service.settings.grid_store_url:
        shutil.rmtree(service.settings.grid_store_url)
        with pytest.raises(Unavailable):
            service.grids.get(lost)
