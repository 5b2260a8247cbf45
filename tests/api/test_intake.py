"""More comes than can be processed: robots are asked to come again, before their uploads are read."""

import pytest
import sqlalchemy as sa

from stillroom.service import intake
from stillroom.settings import QueueLimits
from stillroom.store.tables import lane
from tests.conftest import RobotCaller, Service
from tests.homes import home


@pytest.fixture
def limited(service: Service, monkeypatch: pytest.MonkeyPatch) -> intake.Intake:
    """That looks at the queue for each upload, and takes two missions."""
    monkeypatch.setattr(intake, "LOOK_S", 0.0)
    found: intake.Intake = service.http.app.state.parts.intake  # type: ignore[attr-defined]
    found.limits = QueueLimits(missions=1, age_s=100.0)
    return found


@pytest.mark.usefixtures("limited")
def test_a_queue_that_is_too_long_takes_nothing_until_it_was_worked_off(service: Service, mapped: RobotCaller) -> None:
    service.worker.paused = True
    for number in ("1", "2"):
        assert mapped.upload(number, home(shift=(1, 0)), wait=None).status_code == 202
    refused = mapped.upload("3", b"not even read", wait=None)
    assert (refused.status_code, refused.json()["retryable"]) == (503, True)
    assert int(refused.headers["Retry-After"]) > 0
    assert mapped.get(f"{mapped.path()}/missions").status_code == 200
    service.worker.resume()
    assert mapped.upload("3", home(shift=(1, 0))).status_code == 201


@pytest.mark.usefixtures("limited")
def test_a_queue_that_nobody_works_on_takes_nothing(service: Service, mapped: RobotCaller) -> None:
    service.worker.paused = True
    assert mapped.upload("1", home(shift=(1, 0)), wait=None).status_code == 202
    with service.database.write() as tx:
        tx.execute(sa.update(lane).values(ready_at=lane.c.ready_at - 101))
    assert mapped.upload("2", home(shift=(1, 0)), wait=None).status_code == 503


@pytest.mark.parametrize("engine", ["sqlite"])
def test_who_would_wait_and_can_not_is_answered_at_once(
    service: Service, mapped: RobotCaller, monkeypatch: pytest.MonkeyPatch
) -> None:
    service.worker.paused = True
    monkeypatch.setattr(intake, "MOST_WAITERS", 0)
    answer = mapped.upload("1", home(shift=(1, 0)), wait=30)
    assert (answer.status_code, "Preference-Applied" in answer.headers) == (202, False)


@pytest.mark.parametrize("engine", ["sqlite"])
def test_more_uploads_than_a_process_can_hold_are_put_off(mapped: RobotCaller, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(intake, "MOST_BEFORE", 0)
    answer = mapped.upload("1", home(shift=(1, 0)))
    assert (answer.status_code, "Retry-After" in answer.headers) == (503, True)
