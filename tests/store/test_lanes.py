"""Claims of lanes."""

from datetime import UTC, datetime

import pytest

from stillroom.store import lanes, maps, missions, robots
from stillroom.store.database import Database
from stillroom.store.rows import RobotRow

NOW = datetime(2026, 11, 22, tzinfo=UTC)


@pytest.fixture
def map_id(database: Database) -> int:
    with database.write() as tx:
        robots.add(tx, RobotRow("RB-1", "Hall", None, NOW), "hash", "")
        made = maps.get_or_add(tx, "RB-1", "ground").id
        lanes.wake(tx, made)
    return made


def test_a_lane_that_was_woken_for_nothing_rests_again(database: Database, map_id: int) -> None:
    assert lanes.claim_or_rest(database) is None
    with database.write() as tx:
        assert lanes.seconds_to_next(tx) is None
        assert lanes.lock(tx, map_id) is None


def test_who_finds_nothing_to_claim_is_told_when_the_next_lease_ends(database: Database, map_id: int) -> None:
    with database.write() as tx:
        added = missions.add(tx, missions.NewMission(map_id, "1", 0, 1, "0" * 64, {}, "1" * 64), NOW)
    claimed = lanes.claim_or_rest(database)
    assert isinstance(claimed, lanes.Claim)
    assert (claimed.map_id, claimed.mission_id, claimed.attempts) == (map_id, added, 1)
    ready_in = lanes.claim_or_rest(database)
    assert isinstance(ready_in, float)
    assert 0 < ready_in <= lanes.LEASE_S
