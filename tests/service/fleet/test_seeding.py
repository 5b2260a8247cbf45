"""The fleet that is made up has figures like any other: those that a plain recomputation comes to."""

from datetime import date
from pathlib import Path

import pytest
import sqlalchemy as sa

from stillroom.errors import AlreadyExists, NotFound
from stillroom.pipeline.update import RESOLVERS
from stillroom.service.access import OPERATOR
from stillroom.service.fleet import causes, inspector, rates
from stillroom.service.fleet.counting import catch_up
from stillroom.service.fleet.seeding import Seed, seed_fleet
from stillroom.service.fleet.selecting import Asked
from stillroom.service.planning import Means
from stillroom.store.database import Database
from stillroom.store.grids import GridStore
from stillroom.store.tables import mission

UNTIL = date(2026, 11, 22)


def test_a_fleet_that_is_made_up_is_counted_like_any_other(database: Database, tmp_path: Path) -> None:
    told: list[str] = []
    grids = GridStore(str(tmp_path / "grids"))
    seed_fleet(database, Seed(missions=600, robots=40, days=40, seed=3, until=UNTIL), told.append)
    assert told[-1] == "600 of 600 missions"
    assert catch_up(database) == 0
    whole = rates.rates(database, Asked("2026-10-01", "2026-11-22"), None).total
    with database.read() as tx:
        done = tx.execute(sa.select(mission)).all()
    judged = [row for row in done if row.outcome != "parked"]
    assert len(done) == 600
    assert (whole.missions, whole.parked) == (len(judged), 600 - len(judged))
    assert whole.failed.model_dump() == {
        row: sum(not getattr(one, f"ablation_{row}") for one in judged)
        for row in ("transfer", "meta_occupancy", "meta_dividers")
    }
    assert 0 < whole.failed.meta_dividers < whole.failed.meta_occupancy < whole.failed.transfer
    asked = Asked("2026-10-01", "2026-11-22")
    missions = causes.missions(database, asked, None, False, None, 1000).items
    assert len(missions) == causes.causes(database, asked, None, 1000).missions
    one, somebody = missions[0], OPERATOR
    assert inspector.numbers(database, somebody, one.robot, one.map, one.mission).outcome == one.outcome
    with pytest.raises(NotFound, match="no grid"):
        inspector.figure(Means(database, grids, RESOLVERS), somebody, one.robot, one.map, one.mission)
    with pytest.raises(AlreadyExists):
        seed_fleet(database, Seed(1, 1, 1, 1, UNTIL), told.append)
