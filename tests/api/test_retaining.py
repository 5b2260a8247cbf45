"""What robots sensed is kept as long as its home says, and what still needs it keeps it."""

from datetime import timedelta
from typing import Any

import pytest
import sqlalchemy as sa

from stillroom.service.retaining import sweep
from stillroom.service.verifying import verify
from stillroom.store import retaining
from stillroom.store.tables import mission
from tests.api.test_access import signed_in
from tests.conflicts import expect
from tests.conftest import Service
from tests.homes import home

ANN = "ann@example.org"
RETENTION = "/api/v1/home/retention"


def test_what_was_sensed_goes_when_its_time_is_over_and_the_history_stays(
    service: Service, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(retaining, "NEWEST", 2)
    robot, bobs = service.add_robot("RB-1", ANN), service.add_robot("RB-2", "bob@example.org")
    still: dict[str, Any] = {"tracking": {"transform": [0.0, 0.0, 0.0]}}
    for number in range(6):
        expect(robot.upload(str(number), home(shift=(number % 2, number)), base_version=number, **still), 201)
    expect(bobs.upload("0", home(shift=(7, 0))), 201)
    ann, path = signed_in(service, ANN), robot.path()
    expect(ann.request("PATCH", f"{path}/versions/2", json={"name": "The good one"}))
    assert expect(ann.get(RETENTION))["days"] is None
    with service.database.write() as tx:
        for row in tx.execute(sa.select(mission.c.id, mission.c.received_at)).all():
            values = {"received_at": row.received_at - timedelta(days=40)}
            tx.execute(sa.update(mission).where(mission.c.id == row.id).values(**values))
    sweep(service.database, service.grids)
    assert len(list(service.grids.list())) == 7, "nobody has said that anything goes"
    assert ann.request("PUT", RETENTION, json={"days": 6}).status_code == 422
    would = expect(ann.request("PUT", f"{RETENTION}?dry_run=true", json={"days": 30}))
    assert (would["missions"], would["newest"]) == (3, 2)
    assert "30 days" in would["effect"]
    assert expect(ann.get(RETENTION))["days"] is None
    before = [expect(ann.get(f"{path}/versions/{number}"))["features"] for number in range(1, 7)]
    expect(ann.request("PUT", RETENTION, json={"days": 30}))
    sweep(service.database, service.grids)
    assert len(list(service.grids.list())) == 4
    assert [expect(ann.get(f"{path}/versions/{number}"))["features"] for number in range(1, 7)] == before
    for number, status in {1: 404, 2: 200, 3: 404, 4: 404, 5: 200, 6: 200}.items():
        assert ann.get(f"{path}/versions/{number}/grid.png").status_code == status, number
    assert ann.get(f"{path}/missions/0/grid.png").status_code == 404
    assert expect(ann.get(f"{path}/missions/0"))["outcome"] == "created"
    assert ann.request("POST", f"{path}/versions/1/restore").status_code == 409
    assert ann.request("POST", f"{path}/versions/2/restore").status_code == 201
    assert expect(robot.upload("0", home(), base_version=0, **still))["version"] == 1, "the same mission as it was"
    report = verify(service.database, service.grids)
    assert report.holds, report.examples
    assert expect(ann.request("PUT", RETENTION, json={"days": None}))["days"] is None
