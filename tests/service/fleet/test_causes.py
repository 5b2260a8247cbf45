"""Causes: groups of missions that failed alike, and whether somebody has to look at them."""

from datetime import UTC, datetime, timedelta

import pytest

from stillroom.errors import NotFound
from stillroom.service.fleet import causes
from stillroom.service.fleet.selecting import Asked
from stillroom.store.database import Database
from stillroom.store.fleet_figures import CauseRow
from tests.fleets import START, Done, Fleet

ALL = Asked("2026-11-01", "2026-12-30")
NOW = datetime(2026, 11, 22, tzinfo=UTC)


def row(first: int, last: int = 0, returned: int | None = None) -> CauseRow:
    """Days ago."""
    ago = (NOW - timedelta(days=days) if days is not None else None for days in (first, last, returned))
    first_seen, last_seen, returned_at = ago
    assert first_seen is not None
    assert last_seen is not None
    return CauseRow(
        1, "k", "shape", "unknown", "transfer", "1", first_seen, last_seen, returned_at, None, None, None, None
    )


def test_a_cause_is_new_for_a_week_and_so_long_has_one_come_back() -> None:
    assert causes.state_of(row(3), NOW) == "new"
    assert causes.state_of(row(8), NOW) == "ongoing"
    assert causes.state_of(row(100, returned=2), NOW) == "regressed"
    assert causes.state_of(row(100, returned=9), NOW) == "ongoing"


@pytest.fixture
def homes(database: Database) -> Fleet:
    return Fleet(database)


def test_missions_that_fail_alike_are_one_cause(homes: Fleet) -> None:
    shut = {"met": ("connectivity", "door_closed"), "outcome": "needs_review", "failed": 3}
    homes.add(
        Done("RB-1", 0, **shut),  # type: ignore[arg-type]
        Done("RB-1", 1, **shut, firmware="5.2"),  # type: ignore[arg-type]
        Done("RB-2", 1, **shut, firmware="5.2"),  # type: ignore[arg-type]
        Done("RB-3", 1, "needs_review", 2, met=("connectivity", "door_closed")),  # broke a rule at another stage
        Done("RB-3", 1, "needs_review", 3, met=("connectivity", "door_closed"), algorithm="1.1"),
        Done("RB-4", 2, "resolved", 1, met=("room_recall", "wall_gap")),
        Done("RB-5", 2, "parked", None, met=("wrong_map", "unknown")),
        Done("RB-6", 2, "reverted", None, traceback="Traceback\n  ...\nstillroom.errors.InvalidGrid: secret of a home"),
        Done("RB-7", 2, "needs_review", 0, met=("shape", "unknown")),
        Done("RB-8", 2),
    )
    found = causes.causes(homes.database, ALL, None, 100)
    assert found.missions == 9
    seen = {(c.kind, c.cause, c.stage, c.algorithm): (c.missions, c.robots, c.settled) for c in found.items}
    assert seen == {
        ("connectivity", "door_closed", "meta_dividers", "1.0"): (3, 2, 0),
        ("connectivity", "door_closed", "meta_occupancy", "1.0"): (1, 1, 0),
        ("connectivity", "door_closed", "meta_dividers", "1.1"): (1, 1, 0),
        ("room_recall", "wall_gap", "transfer", "1.0"): (1, 1, 1),
        ("wrong_map", "unknown", "registration", "1.0"): (1, 1, 0),
        ("error", "stillroom.errors.InvalidGrid", "processing", "1.0"): (1, 1, 0),
        ("shape", "unknown", "verification", "1.0"): (1, 1, 0),
    }
    first = found.items[0]
    assert (first.first_seen, first.last_seen) == (START, START + timedelta(days=1))
    assert [point.missions for point in first.trend] == [1, 2]
    one = causes.cause(homes.database, ALL, first.id)
    assert (one.firmware, one.size) == ({"5.1": 1, "5.2": 2}, {"4-6": 3})
    some = Asked("2026-11-01", "2026-12-30", firmware=("5.2",), algorithm=("1.0",))
    assert [(c.missions, c.robots) for c in causes.causes(homes.database, some, None, 100).items] == [(2, 2)]
    with pytest.raises(NotFound):
        causes.cause(homes.database, ALL, "0" * 16)


def test_a_cause_that_was_gone_for_two_weeks_has_come_back(homes: Fleet) -> None:
    failing = {"outcome": "needs_review", "failed": 3, "met": ("shape", "unknown")}
    homes.add(Done(day=0, **failing), Done(day=10, **failing))  # type: ignore[arg-type]
    (cause,) = causes.causes(homes.database, ALL, None, 100).items
    assert cause.returned_at is None
    homes.add(Done(day=25, **failing))  # type: ignore[arg-type]
    (cause,) = causes.causes(homes.database, ALL, None, 100).items
    assert cause.returned_at == START + timedelta(days=25)


def test_the_missions_of_a_cause_come_in_pages(homes: Fleet) -> None:
    homes.add(
        *[Done(outcome="needs_review", failed=3, met=("shape", "unknown"))] * 5, Done(outcome="resolved", failed=1)
    )
    key = causes.causes(homes.database, ALL, None, 1).items[0].id
    seen, cursor = [], None
    while True:
        page = causes.missions(homes.database, ALL, key, False, cursor, 2)
        seen += [item.mission for item in page.items]
        if page.next is None:
            break
        cursor = int(page.next)
    assert seen == ["5", "4", "3", "2", "1"]
    assert len(causes.missions(homes.database, ALL, None, False, None, 100).items) == 6
