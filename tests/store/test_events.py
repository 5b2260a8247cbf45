"""Who follows events by their ids misses none, however many transactions add them at once."""

import threading
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime

import pytest

from stillroom.store import events, maps, robots
from stillroom.store.database import Database, Transaction
from stillroom.store.rows import MapRow, RobotRow

NOW = datetime(2026, 11, 22, tzinfo=UTC)


@pytest.fixture
def homes(database: Database) -> list[MapRow]:
    """A map each of three robots: two of one owner, and one of another."""
    owners = {"RB-1": "ann@example.org", "RB-2": "ann@example.org", "RB-3": "bob@example.org"}
    with database.write() as tx:
        for robot_id, owner in owners.items():
            robots.add(tx, RobotRow(robot_id, robot_id, owner, NOW), robot_id, "")
        return [maps.get_or_add(tx, robot_id, "ground") for robot_id in owners]


def seen(tx: Transaction, owner: str, last: int = 0) -> list[int]:
    return [row.id for row in events.after(tx, last, robots.owned_by(owner), None, 1000)]


def test_events_that_the_same_people_see_are_committed_in_the_order_of_their_ids(
    database: Database, homes: list[MapRow]
) -> None:
    each, writers = 25, 4
    found: list[int] = []
    written = threading.Event()

    def write(of: MapRow) -> None:
        for _ in range(each):
            with database.write() as tx:
                events.add(tx, of, [("settings", {})], NOW)

    def read() -> None:
        while True:
            all_written = written.is_set()
            with database.read() as tx:
                new = seen(tx, "ann@example.org", found[-1] if found else 0)
            found.extend(new)
            if all_written and not new:
                return

    with ThreadPoolExecutor(writers + 1) as pool:
        reader = pool.submit(read)
        for writer in [pool.submit(write, homes[n % 2]) for n in range(writers)]:
            writer.result()
        written.set()
        reader.result()
    assert len(found) == each * writers
    with database.read() as tx:
        assert found == seen(tx, "ann@example.org")


@pytest.mark.parametrize("engine", ["postgresql"])
def test_events_that_others_see_wait_for_nothing(database: Database, homes: list[MapRow]) -> None:
    anns, _, bobs = homes
    with database.write() as slow:
        events.add(slow, anns, [("settings", {})], NOW)
        with database.write() as tx:
            events.add(tx, bobs, [("settings", {})], NOW)
        with database.read() as tx:
            newest = events.newest(tx, robots.owned_by("bob@example.org"))
            assert seen(tx, "bob@example.org") == [newest]
            # Who begins to follow now must not begin after the one that is not committed yet.
            begin = events.newest(tx, robots.owned_by("ann@example.org"))
            assert begin < newest
    with database.read() as tx:
        assert len(seen(tx, "ann@example.org", begin)) == 1
